#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/homing/homing_survey.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/homing_guide.hpp"

namespace panonav {

/// The views of a recording, in its order.
struct RecordedViews {
  std::vector<std::string> files;  ///< of the pictures, as the data set names them
  /// As the data set has them, before the robot was turned; empty: unknown.
  std::vector<std::optional<ReferencePose>> poses;
  std::vector<double> turned_rad;  ///< by which the robot was turned before the view was taken
  std::vector<HomingView> views;   ///< of the pictures as the robot, turned, sees them
};

/// Receives, on the caller's thread, the name of the current work, the number of its steps since
/// the last call (0 at first), and the number of all its steps.
using WorkProgress =
    std::function<void(const std::string& work, std::size_t steps, std::size_t total)>;

/// Reads all pictures on all threads. With a seed the robot turns by a random number of whole
/// columns before each. Throws FileError, also when the pictures differ in rows.
[[nodiscard]] RecordedViews read_views(const Dataset& recording, const HomingViewOptions& options,
                                       const std::optional<std::uint64_t>& turn_seed,
                                       Executor& executor, const WorkProgress& progress = {});

/// Options of a survey of two recordings.
struct CatchmentSettings {
  FourierHomingOptions homing;  ///< of all home vectors
  /// Highest frequency of each stage of a run, which continues with the next stage where one stops
  /// [S06 section 5]; empty: one stage, as `homing` says. Averages are always those of `homing`.
  std::vector<int> stages;
  HomingSurveyOptions run;              ///< steps and obstacles; what was not given is learnt
  bool typical_distance_given = false;  ///< else learnt from the pairs
  bool longest_step_given = false;      ///< else twice the spacing, as [S06 section 4.4]
  bool obstacle_given = false;          ///< else 0.8 of the spacing
  std::optional<double> bin_m;          ///< else the spacing
  std::optional<double> up_to_m;        ///< pairs farther apart do not count in averages
};

/// Results of all home vectors between two recordings.
struct CatchmentResult {
  /// Pairs of a range of distances.
  struct Bin {
    HomingSurvey::Bin homeward;  ///< pairs of these distances and their mean cosine
    /// Circular standard deviation of the error of the heading; NaN without pairs.
    double orientation_error_rad = 0.0;
  };

  double spacing_m = 0.0;           ///< of the places
  double typical_distance_m = 0.0;  ///< metres that a home vector of length 1 is worth
  HomingSurveyOptions run;          ///< as the runs were made, with what was learnt
  HomingSurvey survey;              ///< of `homing` alone, without stages
  std::size_t pairs = 0;            ///< at different places, up to the distance asked for
  /// Mean cosine between home vector and true direction over these pairs [S06 eq. 48]; NaN without
  /// pairs.
  double component = 0.0;
  /// Circular standard deviation of the error of the heading over these pairs.
  double orientation_error_rad = 0.0;
  std::vector<Bin> bins;           ///< of all distances
  std::vector<float> final_m;      ///< where runs end: goal after goal, one per place
  std::vector<double> accepted_m;  ///< distances of `areas`: 0 to 5 spacings
  std::vector<double> areas;       ///< mean number of places from which runs end so near
};

/// All pairs: views of `goals` as homes, views of `places` as current ones, which the recording
/// `name` holds. Throws ContractError as `survey_homing` and where a view has no position or no
/// heading, FileError where fewer than two places differ. Cost: goals x places home vectors for
/// each stage, and 20 bytes for each.
[[nodiscard]] CatchmentResult survey_catchment(const RecordedViews& goals,
                                               const RecordedViews& places,
                                               const CatchmentSettings& settings,
                                               const std::string& name, Executor& executor,
                                               const WorkProgress& progress = {});

/// Number of places from which runs to this goal end within `accepted_m`.
[[nodiscard]] std::size_t catchment_of(const CatchmentResult& result, std::size_t goal,
                                       double accepted_m);

}  // namespace panonav
