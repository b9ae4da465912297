#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "panonav_recordings/run_recorder.hpp"

/// JSON of the moments of a run for the page, live and in reports. Metres are rounded to 0.1 mm,
/// radians to 1e-4.
namespace panonav::viewer {

/// Returns a moment as JSON, without its retained parts (see `retained_to_json`). `number` is the
/// index of the moment.
[[nodiscard]] std::string moment_to_json(const recordings::RunMoment& moment, std::size_t number);

/// "references": [x, y, ...]; "names" and "headings" of these; "regions": [[area, x, y, ...], ...];
/// "walls": [[x, y, ...], ...]; "edges": [x, y, x, y, kind, ...]; "plan" and "directions": [x, y,
/// heading, ...]; "goal": [x, y, heading]; "unit": of lengths that are not in metres: only the
/// members that the moment replaces. Returns an empty text if there are none.
[[nodiscard]] std::string retained_to_json(const recordings::RunMoment& moment);

/// The newest version of each retained part of a run (shown until it is replaced), and the
/// number of replacements.
struct RetainedParts {
  recordings::RunMoment moment;
  std::size_t replacement_count = 0;

  void update_from(const recordings::RunMoment& from);
};

/// Values of a past moment that the page keeps for the path and the timeline.
struct PastMoment {
  double stamp_s = 0.0;
  std::optional<Pose2> pose;
  std::optional<Point2> truth;
  std::optional<double> probability;
  bool sure = false;
  std::string state;
};
/// Returns [[stamp, x, y, heading, probability, sure, state, true x, true y], ...]; unknown values
/// are null.
[[nodiscard]] std::string moments_to_json(const std::vector<PastMoment>& past);

}  // namespace panonav::viewer
