#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/s06/arena.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/homing/homing_survey.hpp"

namespace panonav::lab {

/// Largest accepted distances of the end of a run from the goal.
inline constexpr std::array<double, 3> s06_accepted_m{0.025, 0.05, 0.1};
/// Iterations of the published rule in homing runs: N_it + 1 = 3 [S06 figure 11].
inline constexpr int s06_iterations = 2;

/// A view is similar to home if their image difference, computed with the highest frequency K = 10
/// [S06], is below this value.
inline constexpr double s06_max_similar_difference = 0.1;

/// A homing strategy: a sequence of rules; whenever homing stops, the next rule continues.
struct HomingStrategy {
  enum class Rule { published, own, library, expected_images };
  std::string label;
  Rule rule = Rule::published;
  std::vector<int> highest;  ///< K of each stage; only for the published rule
};
[[nodiscard]] HomingStrategy make_published_strategy(std::vector<int> highest);
/// Returns the chain of stages, which exists only in this experiment: home vectors with default
/// options and K = 10; then, where runs stop at a place that is not similar to home, three rounds
/// of coarse to fine without displacement search; finally the default options again. A place is
/// similar to home below an image difference of `s06_max_similar_difference`. Chosen on arenas of
/// seeds 1 to 4.
[[nodiscard]] HomingStrategy make_own_strategy();
/// Returns the strategy of the library as a user calls it: `HomingPursuit` with default options.
[[nodiscard]] HomingStrategy make_library_strategy();
[[nodiscard]] HomingStrategy make_expected_image_strategy();

/// The surveys of one arena, computed on first use and cached.
class ArenaSurveys {
 public:
  /// Refers to the arena and the executor, which must outlive this object.
  ArenaSurveys(const Arena& arena, std::size_t goal_stride, Executor& executor);

  [[nodiscard]] const Arena& arena() const noexcept { return arena_; }
  [[nodiscard]] std::size_t goal_stride() const noexcept { return goal_stride_; }
  [[nodiscard]] const HomingSurvey& survey_published(int highest, int iterations = s06_iterations);
  /// Surveys home vectors with default options and K = `highest`.
  [[nodiscard]] const HomingSurvey& survey_own(int highest);
  /// Surveys home vectors without displacement search, with K = `highest`; K = 10 where the view is
  /// similar to home.
  [[nodiscard]] const HomingSurvey& survey_own_without_search(int highest);
  [[nodiscard]] const HomingSurvey& survey_expected_images();
  /// Returns the surveys of all stages. A run of the library's strategy ends before the first stage
  /// that begins where the views differ by at most `HomingPursuitOptions::arrived_difference`.
  [[nodiscard]] std::vector<const HomingSurvey*> survey_stages(const HomingStrategy& strategy);
  /// Returns the distances from the goal at which all runs end, goal by goal.
  [[nodiscard]] std::vector<float> compute_final_distances(const HomingStrategy& strategy);
  [[nodiscard]] std::vector<float> compute_final_distances(
      std::span<const HomingSurvey* const> stages);
  [[nodiscard]] std::vector<double> compute_areas(const HomingStrategy& strategy,
                                                  std::span<const double> accepted_m);

 private:
  [[nodiscard]] std::vector<float> compute_library_distances();
  template <typename Rule>
  [[nodiscard]] const HomingSurvey& survey(const std::string& key, const Rule& rule);

  const Arena& arena_;
  std::size_t goal_stride_;
  Executor& executor_;
  ExpectedImageHoming expected_image_homing_;
  std::map<std::string, HomingSurvey> surveys_;
};

/// Reproduces [S06] figures 3, 6, 7 and 8.
void reproduce_view_figures(const Arena& arena, const Experiments& context);
/// Adds the heading error between two views taken at the same place, with the pose noise of the
/// tracker.
void reproduce_heading_with_pose_noise(const Arena& arena, Reproduction& result);
/// Reproduces [S06] figures 10 to 13.
void reproduce_homing_figures(ArenaSurveys& surveys, const Experiments& context);
/// Reproduces [S06] figures 9, 14, 15 and 16.
void reproduce_goal_figures(ArenaSurveys& surveys, Reproduction& result);
/// Compares three snapshots of K = 3 with one image of the same size in bytes [S06 section 4.4].
void reproduce_snapshot_bytes(ArenaSurveys& surveys, Reproduction& result);

/// Mean catchment areas of one arena at `s06_accepted_m`, by the strategy's label.
using CatchmentAreas = std::map<std::string, std::array<double, s06_accepted_m.size()>>;
[[nodiscard]] CatchmentAreas measure_catchment_areas(ArenaSurveys& surveys);
/// Adds rows that compare the catchment areas of the homing rules over several arenas.
void compare_catchment_areas(std::span<const CatchmentAreas> arenas, const Experiments& context);
/// Adds rows for a variant of the first arena: with the tracker's pose noise, or with a fixed
/// heading.
void report_variant(const std::string& id, const std::string& what, const CatchmentAreas& areas,
                    Reproduction& result);

/// Measures the run time of one home vector from coefficients, and of one by expected images, N =
/// 360.
void measure_homing_times(const Arena& arena, Reproduction& result);

}  // namespace panonav::lab
