#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "panonav_recordings/run_recorder.hpp"

/// What the page reads of a run; live and in reports. Metres to 0.1 mm, radians to 1e-4.
namespace panonav::viewer {

/// One moment as JSON, without what stays. `number` counts moments from 0.
[[nodiscard]] std::string moment_json(const recordings::RunMoment& moment, std::size_t number);

/// "references": [x, y, ...]; "names" and "headings" of
/// these; "regions": [[area, x, y, ...], ...]; "walls":
/// [[x, y, ...], ...]; "edges": [x, y, x, y, kind, ...]; "plan" and "directions": [x, y, heading,
/// ...]; "goal": [x, y, heading]: what of these the moment gives anew. Empty: nothing.
[[nodiscard]] std::string staying_json(const recordings::RunMoment& moment);

/// What a run told once, the newest of each part, and how often it did.
struct StayingParts {
  recordings::RunMoment moment;
  std::size_t times = 0;

  void take(const recordings::RunMoment& from);
};

/// What of a moment stays in the page's memory: for path and timeline.
struct PastMoment {
  double stamp_s = 0.0;
  std::optional<Pose2> pose;
  std::optional<Point2> truth;
  std::optional<double> probability;
  bool sure = false;
  std::string state;
};
/// [[stamp, x, y, heading, probability, sure, state, true x, true y], ...], null for what is not
/// known.
[[nodiscard]] std::string past_json(const std::vector<PastMoment>& past);

}  // namespace panonav::viewer
