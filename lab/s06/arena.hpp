#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lab/baselines/expected_image_homing.hpp"
#include "lab/reproduction.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/homing/homing_survey.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

inline constexpr double s06_spacing_m = 0.025;
/// Distance that places keep from the border of the floor. About 1250 places are free, the farthest
/// two 1.4 m apart as in [S06 figure 11].
inline constexpr double s06_margin_m = 0.15;
inline constexpr int s06_columns = 72;
/// Components of a view of 72 pixels: k = 0 .. 35.
inline constexpr int s06_components = s06_columns / 2;

/// Headings of the robot at the grid places.
enum class ArenaHeading {
  fixed,   ///< the same everywhere, as in the published evaluation
  random,  ///< random, as of a robot without a compass
};

/// Returns the rendering of 10 rows of 360 pixels, 5 degrees below to 5 above the horizon, that the
/// rows of an arena are averaged from.
[[nodiscard]] simulation::PanoramaRendering make_arena_rendering(Optics optics);

struct ArenaOptions {
  std::uint64_t seed = 1;
  ArenaHeading heading = ArenaHeading::random;
  /// Standard deviations of the recorded pose [S06 figure 5] from the true pose.
  double position_noise_m = 0.0;
  double heading_noise_rad = 0.0;
  /// Light of the second recording, relative to the first.
  double light = 1.05;
  double spacing_m = s06_spacing_m;
  /// 10 rows of 360 pixels around the horizon; with or without a mirror.
  simulation::PanoramaRendering rendering = make_arena_rendering(Optics::panorama);
};

/// A view and its pose. The heading serves to evaluate home vectors; homing rules do not use it.
struct ArenaView {
  Pose2 pose;
  HomingView view;
};

/// One recording: recorded poses, rows of 72 pixels (mean over 10 degrees of elevation around the
/// horizon) and their Fourier coefficients.
struct ArenaRecording {
  std::vector<ArenaView> views;
  std::vector<std::vector<float>> rows;
};

/// A recorded arena. Goal i and place i are at the same grid position; positions are numbered row
/// by row.
struct Arena : simulation::SimulatedPlace {
  ArenaOptions options;
  ArenaRecording homes;     ///< first recording
  ArenaRecording currents;  ///< second, at the same places
};

/// Records the toy house arena of [S06 section 4] twice. Throws ContractError if no grid position
/// is free.
[[nodiscard]] Arena record_arena(const ArenaOptions& options, Executor& executor);

/// Renders the row of pixels at `pose` through a noisy camera with the rendering of
/// `ArenaOptions`, averaged to 72 pixels.
[[nodiscard]] std::vector<float> render_arena_row(const simulation::Renderer& renderer,
                                                  const simulation::Scene& scene,
                                                  const simulation::PanoramaRendering& rendering,
                                                  const Pose2& pose, std::uint64_t seed,
                                                  Executor& executor);

/// Returns the options of homing runs in [S06 section 4.4], scaled to the grid spacing of the
/// arena.
[[nodiscard]] HomingSurveyOptions survey_options(const Arena& arena);

/// Surveys the home view of every `goal_stride`-th place of the first recording against all
/// places of the second. `rule` receives the indices of goal and place.
[[nodiscard]] HomingSurvey survey_arena(const Arena& arena, const HomingRule& rule,
                                        Executor& executor, std::size_t goal_stride = 1);
[[nodiscard]] HomingSurvey survey_arena(const Arena& arena, const FourierHomingOptions& homing,
                                        Executor& executor, std::size_t goal_stride = 1);
[[nodiscard]] HomingSurvey survey_arena(const Arena& arena, const ExpectedImageHoming& homing,
                                        Executor& executor, std::size_t goal_stride = 1);

}  // namespace panonav::lab
