#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

/// Returns the home vector to view `goal` of one set from view `place` of another. Called from
/// several threads at once.
using HomingRule = std::function<HomeVector(std::size_t goal, std::size_t place)>;

/// Simulated runs over the places of a recording [S06 section 4.4].
struct HomingSurveyOptions {
  double typical_distance_m = 0.5;  ///< R^typ: metres for a home vector of length 1, > 0
  double max_step_m = 0.05;         ///< l^max, > 0
  double obstacle_m = 0.02;         ///< a step that ends farther from all places stops the run, > 0
  int max_steps = 30;               ///< of one stage of a run, >= 1
};
void visit_options(HomingSurveyOptions& options, OptionVisitor& visitor);

/// The result of a rule at every place for every goal.
struct HomingSurvey {
  /// The average homeward component in a range of distances [S06 eq. 48].
  struct Bin {
    double distance_m = 0.0;  ///< middle of the bin
    std::size_t pairs = 0;    ///< pairs of a place and a goal in the bin
    double component = 0.0;   ///< mean cosine, -1 .. 1; NaN without pairs
  };

  std::vector<Pose2> goals;   ///< where the home views were taken
  std::vector<Pose2> places;  ///< where the current views were taken, and where runs may be
  /// For each goal and place, the number of the place to which the step leads; the place itself
  /// where the run stops.
  std::vector<std::uint32_t> next;
  /// For each goal and place, the cosine between home vector and true direction of the goal; 0 for
  /// a vector of length 0, NaN where place and goal are the same.
  std::vector<float> homeward;

  /// The part of `next` for one goal: a number for each place.
  [[nodiscard]] std::span<const std::uint32_t> next_of(std::size_t goal) const {
    return std::span(next).subspan(goal * places.size(), places.size());
  }
  /// The part of `homeward` for one goal: a cosine for each place.
  [[nodiscard]] std::span<const float> homeward_of(std::size_t goal) const {
    return std::span(homeward).subspan(goal * places.size(), places.size());
  }
};

/// Receives the progress, 0 .. 1. Called from several threads, but never from two at the same time.
using SurveyProgress = std::function<void(double fraction)>;

/// Applies the rule to all pairs. Same bits on any number of threads. Throws OptionError;
/// ContractError when there is no goal, no place, or a coordinate is not finite; what `rule`
/// throws. Cost: goals x places home vectors, and 8 bytes for each.
[[nodiscard]] HomingSurvey survey_homing(std::span<const Pose2> goals,
                                         std::span<const Pose2> places, const HomingRule& rule,
                                         const HomingSurveyOptions& options, Executor& executor,
                                         const SurveyProgress& progress = {});

/// Averages the homeward component by distance [S06 eq. 48]. Bin i contains the distances from (i -
/// 0.5) bin_m to (i + 0.5) bin_m, so that the distances on a grid of this spacing are in the
/// middle of bins. Throws ContractError unless bin_m > 0 and there are at most 100,000 bins.
[[nodiscard]] std::vector<HomingSurvey::Bin> homeward_by_distance(const HomingSurvey& survey,
                                                                  double bin_m = 0.025);

/// Averages the homeward component over all pairs whose distance is above 0 and at most `max_m`;
/// NaN if there is none.
[[nodiscard]] double mean_homeward_component(const HomingSurvey& survey, double max_m);

/// Returns for each place the place where a run to the goal that starts there ends. Each stage
/// continues where the previous one has stopped [S06 section 5]; stages are surveys of the same
/// goals and places. Throws ContractError without stages, on different sizes and on a goal out of
/// range.
[[nodiscard]] std::vector<std::uint32_t> final_places(std::span<const HomingSurvey* const> stages,
                                                      std::size_t goal,
                                                      const HomingSurveyOptions& options = {});

/// Returns the distance in metres between the goal and the end of the run from each place: all
/// places of the first goal, then of the next.
[[nodiscard]] std::vector<float> final_distances(std::span<const HomingSurvey* const> stages,
                                                 const HomingSurveyOptions& options,
                                                 Executor& executor);

/// Returns the mean number of places from which runs end within each of the accepted distances [S06
/// section 4.4]; `distances` as from `final_distances`, for `goals` goals.
[[nodiscard]] std::vector<double> mean_catchment_areas(std::span<const float> distances,
                                                       std::size_t goals,
                                                       std::span<const double> accepted_m);

}  // namespace panonav
