#pragma once

#include <span>
#include <string>
#include <vector>

#include "lab/statistics.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

/// Differences between memorising and localising.
struct PlaceCondition {
  std::string name;
  simulation::SensorOptions sensor;
  double tilt_rad = 0.0;  ///< the robot is tilted by this much, in another direction at each place
  bool levelled = false;  ///< an inertial sensor measures it, and views are turned upright
};

/// Returns four conditions: as memorised; light 30 % less and 30 % more, with a tenth of the
/// columns hidden; 5 degrees of tilt.
[[nodiscard]] std::vector<PlaceCondition> place_conditions();

/// Results of one condition.
struct PlaceResult {
  std::string condition;
  Proportion nearest;               ///< the best match is the nearest grid place
  Proportion nearest_or_next;       ///< or one of its eight neighbours on the grid
  Proportion known;                 ///< taken for a place of the memory
  double heading_median_rad = 0.0;  ///< absolute error by the best match, over all queries
  double heading_p95_rad = 0.0;
  double position_median_m = 0.0;  ///< error of the interpolated position, where the place is known
  Proportion inside;               ///< of those, within the stated 95 % radius
};

/// Memorises the references of the place and localises the queries in all conditions. Throws as
/// `Renderer`.
[[nodiscard]] std::vector<PlaceResult> run_place_experiment(
    const simulation::PlaceRecording& place, const std::vector<PlaceCondition>& conditions,
    Executor& executor);

/// Share of the queries of one place that the memory of a place knows.
struct RecognitionRate {
  std::string memory;
  std::string queries;
  Proportion known;
};

/// Localises the queries of all places in the memory of each place. Rates of the same place come
/// first.
[[nodiscard]] std::vector<RecognitionRate> recognition_rates(
    std::span<const simulation::PlaceRecording* const> places, Executor& executor);

}  // namespace panonav::lab
