#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
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
  std::vector<std::string> files;  ///< file names of the images, relative to the data set
  /// Poses in the data set, before the robot was rotated; empty: unknown.
  std::vector<std::optional<ReferencePose>> poses;
  std::vector<double> rotation_rad;  ///< rotation of the robot before each view
  std::vector<HomingView> views;     ///< homing views of the images as the rotated robot sees them
};

/// Callback on the caller's thread that receives the name of the current work, the number of steps
/// done since the last call (0 at first), and its total number of steps.
using WorkProgress =
    std::function<void(const std::string& work, std::size_t steps, std::size_t total)>;

/// Reads all images on all threads. With a seed, rotates the robot by a random whole number of
/// columns before each image. Calls `skip` with the error of an image that cannot be read, which
/// then has no view; without `skip`, throws it.
[[nodiscard]] RecordedViews read_views(
    const Dataset& recording, const HomingViewOptions& options,
    const std::optional<std::uint64_t>& rotation_seed, Executor& executor,
    const WorkProgress& progress = {},
    const std::function<void(const std::exception_ptr&)>& skip = {});

/// Options of a survey of two recordings.
struct CatchmentSettings {
  FourierHomingOptions homing;  ///< options of all home vectors
  /// Highest frequency of each stage of a run. Where a run stops in one stage, it continues with
  /// the next [S06 section 5]. Empty: a single stage with the options `homing`. Averages always use
  /// `homing`.
  std::vector<int> stages;
  HomingSurveyOptions run;            ///< steps and obstacles; parts are learnt, see below
  bool has_typical_distance = false;  ///< false: `run.typical_distance_m` is learnt from the pairs
  bool has_longest_step = false;      ///< false: the step is twice the spacing [S06 section 4.4]
  bool has_obstacle = false;          ///< false: the obstacle radius is 0.8 of the spacing
  std::optional<double> bin_m;        ///< width of the bins of distances; nullopt: the spacing
  std::optional<double> up_to_m;      ///< largest distance of pairs in averages; nullopt: any
};

/// Results of all home vectors between two recordings.
struct CatchmentResult {
  /// Pairs whose distance is in one range.
  struct Bin {
    HomingSurvey::Bin homeward;  ///< number of pairs at these distances and their mean cosine
    /// Circular standard deviation of the error of the heading; NaN without pairs.
    double orientation_error_rad = 0.0;
  };

  double spacing_m = 0.0;           ///< mean distance between neighbouring places
  double typical_distance_m = 0.0;  ///< metres of a home vector of length 1
  HomingSurveyOptions run;          ///< options of the runs, learnt values included
  HomingSurvey survey;              ///< survey with `CatchmentSettings::homing`, without stages
  std::size_t pairs = 0;            ///< number of pairs at different places, up to `up_to_m` apart
  /// Mean cosine of the angle between home vector and true direction over these pairs [S06 eq. 48];
  /// NaN without pairs.
  double component = 0.0;
  /// Circular standard deviation of the error of the heading over these pairs.
  double orientation_error_rad = 0.0;
  std::vector<Bin> bins;       ///< one for each range of distances
  std::vector<float> final_m;  ///< distance between the end of each run and its goal; all places of
                               ///< the first goal, then of the next
  std::vector<double> accepted_m;  ///< radii of `areas`: 0 to 5 spacings
  std::vector<double> areas;       ///< mean number of places from which runs end within each radius
};

/// Computes the home vectors of all pairs of a place and a goal. `name` names the recording of
/// `places` in messages. Throws ContractError as `survey_homing`, and if a view has no position or
/// heading; FileError if fewer than two places differ. Cost: goals x places home vectors for each
/// stage, and 20 bytes for each.
[[nodiscard]] CatchmentResult survey_catchment(const RecordedViews& goals,
                                               const RecordedViews& places,
                                               const CatchmentSettings& settings,
                                               const std::string& name, Executor& executor,
                                               const WorkProgress& progress = {});

/// Counts the places from which runs to this goal end within `accepted_m`.
[[nodiscard]] std::size_t count_places_in_catchment(const CatchmentResult& result, std::size_t goal,
                                                    double accepted_m);

}  // namespace panonav
