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

/// Change of the sensor and of the robot's tilt between memorising and localising.
struct PlaceCondition {
  std::string name;
  simulation::SensorOptions sensor;
  double tilt_rad = 0.0;  ///< tilt of each query view, in a random direction
  bool levelled = false;  ///< correct the tilt, as measured by an inertial sensor
};

/// Returns four conditions: as memorised; 30 % less light and 30 % more light, both with a tenth of
/// the columns hidden; 5 degrees of tilt.
[[nodiscard]] std::vector<PlaceCondition> place_conditions();

/// Localisation results under one condition.
struct PlaceResult {
  std::string condition;
  Proportion nearest;               ///< the best match is the nearest reference
  Proportion nearest_or_neighbour;  ///< the best match is that one or a grid neighbour of it
  Proportion known;                 ///< recognised as a place of the memory
  double heading_median_rad = 0.0;  ///< absolute error by the best match, over all queries
  double heading_p95_rad = 0.0;
  double position_median_m = 0.0;  ///< error of interpolated positions, known places only
  Proportion inside;               ///< of these positions, share within the stated 95 % radius
};

/// Memorises the references of the place and localises the queries in all conditions. Throws as
/// `Renderer`.
[[nodiscard]] std::vector<PlaceResult> run_place_experiment(
    const simulation::PlaceRecording& place, const std::vector<PlaceCondition>& conditions,
    Executor& executor);

/// An answer to a query whose place is in the memory, and whether its statement is right.
struct StatedPlace {
  bool known = false;        ///< recognised as a place of the memory
  double probability = 0.0;  ///< stated, of the place that was chosen
  bool right = false;        ///< the best match is the nearest reference or a grid neighbour of it
  /// The best match of a place named as another possibility is the nearest reference or a grid
  /// neighbour of it.
  bool right_is_named = false;
};

/// Memorises the references of the place and localises the queries in all conditions, as
/// `run_place_experiment`.
[[nodiscard]] std::vector<StatedPlace> collect_stated_places(
    const simulation::PlaceRecording& place, const std::vector<PlaceCondition>& conditions,
    Executor& executor);

/// Results of localisation in one memory of a building with several floors.
struct BuildingResult {
  std::size_t queries = 0;
  std::size_t known = 0;          ///< recognised as a place of the memory
  std::size_t right_floor = 0;    ///< of these, the answer is on the query's floor
  std::size_t stated = 0;         ///< positions with a stated 95 % radius
  std::size_t inside = 0;         ///< of these, on the right floor and within the radius
  double learnt_spacing_m = 0.0;  ///< of the references, as learnt from the memory
};

/// Memorises each place as a floor of one building, all in the same coordinates, and localises the
/// queries of all of them.
[[nodiscard]] BuildingResult run_building_experiment(
    std::span<const simulation::PlaceRecording* const> floors, Executor& executor);

/// Share of the queries taken in one place that the memory of another (or the same) place
/// recognises.
struct RecognitionRate {
  std::string memory;
  std::string queries;
  Proportion known;
};

/// Localises the queries of all places in the memory of each place. Rates of a place in its own
/// memory come first.
[[nodiscard]] std::vector<RecognitionRate> measure_recognition_rates(
    std::span<const simulation::PlaceRecording* const> places, Executor& executor);

}  // namespace panonav::lab
