#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "lab/rows.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav_simulation/mapping_run.hpp"

namespace panonav::lab {

/// A shape difference of [F11] figure 6, with the numbers of components that it was reached with.
struct PublishedFigure {
  double shape_difference = 0.0;
  int k1 = 26;  ///< components of the distance
  int k2 = 20;  ///< components of the turn
};

/// The published rule [F11 eq. 2-5] as this library reads it, and what can be changed in it.
struct PublishedRuleVariant {
  /// Direction of travel of a step, by the headings at its ends [F11 eq. 3 and 4].
  enum class TravelDirection { first_heading, middle, last_heading };
  enum class UsedRows { all, above_horizon, below_horizon };

  bool unit_phases = false;      ///< all phases have the same weight
  bool unit_signatures = false;  ///< distance of signatures of norm 1
  UsedRows rows = UsedRows::all;
  int rows_per_band = 1;  ///< rows that are averaged to one, >= 1
  TravelDirection direction = TravelDirection::middle;
  double length_error = 1.0;  ///< share of the errors of the lengths that is left
  double turn_error = 1.0;    ///< share of the errors of the turns that is left
  bool reflection = false;    ///< the shape difference may mirror the map
  bool root = false;          ///< root of the shape difference
};

/// Errors of the published rule on one recording.
struct PublishedRuleErrors {
  double fixed = 1.0;     ///< shape difference with k1 and k2 as published
  double smallest = 1.0;  ///< smallest one over the grid of figure 6, as the paper chose k1 and k2
  /// Standard deviation of the errors of the headings along the path, with k2 as published.
  double heading_deg = 0.0;
};
/// Measures a variant. Throws ContractError unless the recording has at least 2 views of 64
/// components, and k1 and k2 are in the grid of figure 6.
[[nodiscard]] PublishedRuleErrors measure_published_rule(
    const simulation::MappingRecording& recording, const PublishedRuleVariant& variant,
    const PublishedFigure& published, Executor& executor);

/// Records images of the simulated mirror camera along `plan`. Each step leads to the next planned
/// pose and errs as those of `wheels`; a step that would leave the free space is made without
/// error. Throws as `simulation::capture_image`.
[[nodiscard]] simulation::MappingRecording record_by_mirror(const simulation::PlaceRecording& place,
                                                            std::span<const Pose2> plan,
                                                            int components,
                                                            const OdometryNoise& wheels,
                                                            std::uint64_t seed, Executor& executor);

/// Measures which step of the published rule, and which property of the place or the camera, its
/// shape difference depends on.
class PublishedRuleStudy {
 public:
  explicit PublishedRuleStudy(const PublishedFigure& published) : published_(published) {}

  /// Adds a recording of `place` in all variants, and one by a mirror camera in some of them.
  void add(const simulation::PlaceRecording& place, const simulation::MappingRecording& recording,
           const simulation::MappingRecording& by_mirror, Executor& executor);
  /// Adds every n-th view of a recording whose views are `spacing_m` apart, for n = 1, 2, 4, ... up
  /// to a spacing of 0.4 m.
  void add_spacings(const simulation::MappingRecording& recording, double spacing_m,
                    Executor& executor);
  /// Adds drives along the scene's tour, each at another distance from it; negative offsets lie
  /// outside of the tour. Offsets that lead through walls are left out.
  void add_offset_tours(const simulation::PlaceRecording& place, std::span<const double> offsets_m,
                        double spacing_m, std::size_t views, Executor& executor);
  /// Adds the rows of all that was added.
  void report(const std::string& id, const std::string& what, Reproduction& result) const;

 private:
  struct Entry {
    std::string text;
    std::vector<double> fixed, smallest, headings_deg, sidedness;
  };
  Entry& add_entry(const std::string& key, const std::string& text,
                   const PublishedRuleErrors& errors);

  PublishedFigure published_;
  std::vector<std::string> keys_;  // in the order of the rows
  std::map<std::string, Entry> entries_;
  std::vector<double> clearances_m_;  // median distance of things around
};

}  // namespace panonav::lab
