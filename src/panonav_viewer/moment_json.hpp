#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "panonav_recordings/run_recorder.hpp"

/// Writes the moments of a run as JSON for the page, live and in reports. Metres to 0.1 mm, radians
/// to 1e-4.
namespace panonav::viewer {

/// Returns a moment as JSON, without the members that stay. `number` counts moments from 0.
[[nodiscard]] std::string moment_json(const recordings::RunMoment& moment, std::size_t number);

/// "references": [x, y, ...]; "names" and "headings" of these; "regions": [[area, x, y, ...], ...];
/// "walls": [[x, y, ...], ...]; "edges": [x, y, x, y, kind, ...]; "plan" and "directions": [x, y,
/// heading, ...]; "goal": [x, y, heading]: those of these that the moment replaces. Empty: none.
[[nodiscard]] std::string retained_json(const recordings::RunMoment& moment);

/// The newest of each part of a run that stays until it is replaced, and how often it was replaced.
struct RetainedParts {
  recordings::RunMoment moment;
  std::size_t times = 0;

  void take(const recordings::RunMoment& from);
};

/// Part of a moment that the page keeps, for path and timeline.
struct PastMoment {
  double stamp_s = 0.0;
  std::optional<Pose2> pose;
  std::optional<Point2> truth;
  std::optional<double> probability;
  bool sure = false;
  std::string state;
};
/// Returns [[stamp, x, y, heading, probability, sure, state, true x, true y], ...], null for
/// unknown values.
[[nodiscard]] std::string past_json(const std::vector<PastMoment>& past);

}  // namespace panonav::viewer
