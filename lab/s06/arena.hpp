#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lab/baselines/expected_image_homing.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/homing/homing_survey.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

inline constexpr double s06_spacing_m = 0.025;
/// Distance that places keep from the border of the floor; about 1250 places are free, the farthest
/// two 1.4 m apart as in [S06 figure 11].
inline constexpr double s06_margin_m = 0.15;
inline constexpr int s06_columns = 72;
/// Components of a view of 72 pixels: k = 0 .. 35.
inline constexpr int s06_components = s06_columns / 2;

/// Headings of the robot at the places of the grid.
enum class ArenaHeading {
  fixed,   ///< the same everywhere, as the published recordings were evaluated
  random,  ///< any: what a robot without a compass has
};

struct ArenaOptions {
  std::uint64_t seed = 1;
  ArenaHeading heading = ArenaHeading::random;
  /// Standard deviations of the tracking system [S06 figure 5] from the true pose.
  double position_noise_m = 0.0;
  double heading_noise_rad = 0.0;
  /// Light of the second recording, that of the first being 1.
  double light = 1.05;
  double spacing_m = s06_spacing_m;
};

/// A view and its true pose. Home vectors are judged by the heading; homing rules never see it.
struct ArenaView {
  Pose2 pose;
  HomingView view;
};

/// One recording: believed poses, rows of 72 pixels (mean over 10 degrees around the horizon) and
/// their Fourier coefficients.
struct ArenaRecording {
  std::vector<ArenaView> views;
  std::vector<std::vector<float>> rows;
};

/// Goals and places have the same numbers: those of the grid, row by row.
struct Arena : simulation::SimulatedPlace {
  ArenaOptions options;
  ArenaRecording homes;     ///< first recording
  ArenaRecording currents;  ///< second, at the same places
};

/// Records the toy house arena of [S06 section 4] twice. Throws ContractError when nothing is free
/// at the spacing.
[[nodiscard]] Arena record_arena(const ArenaOptions& options, Executor& executor);

/// Renders the row of one place of the scene through a camera with noise: 360 pixels of 1 degree
/// and 10 rows, averaged to 72.
[[nodiscard]] std::vector<float> render_arena_row(const simulation::Renderer& renderer,
                                                  const simulation::Scene& scene, const Pose2& pose,
                                                  std::uint64_t seed, Executor& executor);

/// Returns options of runs as in [S06 section 4.4], for the spacing of the arena.
[[nodiscard]] HomingSurveyOptions survey_options(const Arena& arena);

/// Surveys the home view of every `goal_stride`-th place of the first recording against all
/// places of the second. `rule` receives the indices of the places.
[[nodiscard]] HomingSurvey survey_arena(const Arena& arena, const HomingRule& rule,
                                        Executor& executor, std::size_t goal_stride = 1);
[[nodiscard]] HomingSurvey survey_arena(const Arena& arena, const FourierHomingOptions& homing,
                                        Executor& executor, std::size_t goal_stride = 1);
[[nodiscard]] HomingSurvey survey_arena(const Arena& arena, const ExpectedImageHoming& homing,
                                        Executor& executor, std::size_t goal_stride = 1);

}  // namespace panonav::lab
