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
  /// Poses in the data set, before the robot was rotated; empty: unknown.
  std::vector<std::optional<ReferencePose>> poses;
  std::vector<double> rotation_rad;  ///< rotation of the robot before each view
  std::vector<HomingView> views;     ///< of the pictures as the rotated robot sees them
};

/// Receives, on the caller's thread, the name of the current work, the number of its steps since
/// the last call (0 at first), and the number of all its steps.
using WorkProgress =
    std::function<void(const std::string& work, std::size_t steps, std::size_t total)>;

/// Reads all pictures on all threads. With a seed, the robot rotates by a random number of whole
/// columns before each. Throws FileError, also when the pictures differ in rows.
[[nodiscard]] RecordedViews read_views(const Dataset& recording, const HomingViewOptions& options,
                                       const std::optional<std::uint64_t>& rotation_seed,
                                       Executor& executor, const WorkProgress& progress = {});

/// Options of a survey of two recordings.
struct CatchmentSettings {
  FourierHomingOptions homing;  ///< of all home vectors
  /// Highest frequency of each stage of a run, which continues with the next stage where one stops
  /// [S06 section 5]; empty: one stage, as `homing` says. Averages are always those of `homing`.
  std::vector<int> stages;
  HomingSurveyOptions run;            ///< steps and obstacles; unset values are learnt
  bool has_typical_distance = false;  ///< else it is learnt from the pairs
  bool has_longest_step = false;      ///< else twice the spacing, as [S06 section 4.4]
  bool has_obstacle = false;          ///< else 0.8 of the spacing
  std::optional<double> bin_m;        ///< else the spacing
  std::optional<double> up_to_m;      ///< pairs farther apart do not count in averages
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
  double typical_distance_m = 0.0;  ///< metres of a home vector of length 1
  HomingSurveyOptions run;          ///< options of the runs, learnt values included
  HomingSurvey survey;              ///< of `homing` alone, without stages
  std::size_t pairs = 0;            ///< at different places, up to `up_to_m`
  /// Mean cosine between home vector and true direction over these pairs [S06 eq. 48]; NaN without
  /// pairs.
  double component = 0.0;
  /// Circular standard deviation of the error of the heading over these pairs.
  double orientation_error_rad = 0.0;
  std::vector<Bin> bins;  ///< of all distances
  std::vector<float>
      final_m;  ///< distance to the goal where runs end: goal after goal, one per place
  std::vector<double> accepted_m;  ///< distances of `areas`: 0 to 5 spacings
  std::vector<double> areas;       ///< mean number of places from which runs end so near
};

/// Computes the home vectors of all pairs: from the views of `places`, of the recording `name`, to
/// those of `goals`. Throws ContractError as `survey_homing` and where a view has no position or no
/// heading, FileError where fewer than two places differ. Cost: goals x places home vectors for
/// each stage, and 20 bytes for each.
[[nodiscard]] CatchmentResult survey_catchment(const RecordedViews& goals,
                                               const RecordedViews& places,
                                               const CatchmentSettings& settings,
                                               const std::string& name, Executor& executor,
                                               const WorkProgress& progress = {});

/// Counts the places from which runs to this goal end within `accepted_m`.
[[nodiscard]] std::size_t count_places_in_catchment(const CatchmentResult& result, std::size_t goal,
                                                    double accepted_m);

}  // namespace panonav
