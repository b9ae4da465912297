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

/// Distances from the goal at which a run may end.
inline constexpr std::array<double, 3> s06_accepted_m{0.025, 0.05, 0.1};
/// Iterations of the published rule in the runs: N_it + 1 = 3 [S06 figure 11].
inline constexpr int s06_iterations = 2;

/// Image difference below which a place looks like home, K = 10.
inline constexpr double s06_alike = 0.1;

/// A homing strategy: rules that follow each other whenever homing stops.
struct HomingStrategy {
  enum class Rule { published, own, expected_images };
  std::string label;
  Rule rule = Rule::published;
  std::vector<int> highest;  ///< K of each stage; not for expected images and our rule
};
[[nodiscard]] HomingStrategy published_strategy(std::vector<int> highest);
/// Returns our strategy: home vectors with default options and K = 10; where runs stop at a place
/// that does not look like home, coarse to fine without the search of displacements, three times;
/// default options last. A place looks like home below `s06_alike`. All this was chosen on arenas
/// of seeds 1 to 4.
[[nodiscard]] HomingStrategy own_strategy();
[[nodiscard]] HomingStrategy expected_image_strategy();

/// The surveys of one arena, each computed on first use.
class ArenaSurveys {
 public:
  /// Keeps references.
  ArenaSurveys(const Arena& arena, std::size_t goals_every, Executor& executor);

  [[nodiscard]] const Arena& arena() const noexcept { return arena_; }
  [[nodiscard]] std::size_t goals_every() const noexcept { return every_; }
  [[nodiscard]] const HomingSurvey& survey_published(int highest, int iterations = s06_iterations);
  /// Surveys home vectors with default options.
  [[nodiscard]] const HomingSurvey& survey_own(int highest);
  /// Surveys without the search of displacements; K = 10 instead of `highest` where it looks like
  /// home.
  [[nodiscard]] const HomingSurvey& survey_own_without_search(int highest);
  [[nodiscard]] const HomingSurvey& survey_expected_images();
  [[nodiscard]] std::vector<const HomingSurvey*> survey_stages(const HomingStrategy& strategy);
  /// Returns the final distances of all runs, goal by goal.
  [[nodiscard]] std::vector<float> compute_final_distances(const HomingStrategy& strategy);
  [[nodiscard]] std::vector<float> compute_final_distances(
      std::span<const HomingSurvey* const> stages);
  [[nodiscard]] std::vector<double> compute_areas(const HomingStrategy& strategy,
                                                  std::span<const double> accepted_m);

 private:
  template <typename Rule>
  [[nodiscard]] const HomingSurvey& survey(const std::string& key, const Rule& rule);

  const Arena& arena_;
  std::size_t every_;
  Executor& executor_;
  ExpectedImageHoming expected_image_homing_;
  std::map<std::string, HomingSurvey> surveys_;
};

/// Reproduces [S06] figures 3, 6, 7 and 8.
void reproduce_view_figures(const Arena& arena, const Experiments& context);
/// Adds the heading error of two views from the same place, with the tracker's noise.
void reproduce_heading_with_pose_noise(const Arena& arena, Reproduction& result);
/// Reproduces [S06] figures 10 to 13.
void reproduce_homing_figures(ArenaSurveys& surveys, const Experiments& context);
/// Reproduces [S06] figures 9, 14, 15 and 16.
void reproduce_goal_figures(ArenaSurveys& surveys, Reproduction& result);
/// Compares three snapshots of K = 3 with one image of the same size [S06 section 4.4].
void reproduce_snapshot_bytes(ArenaSurveys& surveys, Reproduction& result);

/// Mean catchment areas of one arena at `s06_accepted_m`.
using CatchmentAreas = std::map<std::string, std::array<double, s06_accepted_m.size()>>;
[[nodiscard]] CatchmentAreas measure_catchment_areas(ArenaSurveys& surveys);
/// Adds rows that compare the rules over arenas.
void compare_catchment_areas(std::span<const CatchmentAreas> arenas, const Experiments& context);
/// Adds rows of the same two recordings with the tracker's noise, or all at one heading.
void report_variant(const std::string& id, const std::string& what, const CatchmentAreas& areas,
                    Reproduction& result);

/// Measures the time of one home vector and of its rival, N = 360.
void measure_homing_times(const Arena& arena, Reproduction& result);

}  // namespace panonav::lab
