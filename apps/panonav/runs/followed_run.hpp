#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/session.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/pipeline/route_follower.hpp"
#include "panonav/route/route_changes.hpp"
#include "panonav/route/route_position.hpp"
#include "panonav/route/route_tracker.hpp"
#include "panonav_recordings/run_recorder.hpp"

namespace panonav::command {

/// One image of a run, matched to a route.
struct FollowedImage {
  std::size_t index = 0;  ///< in the data set, from 0
  std::string file;
  std::optional<double> stamp_s;
  std::vector<float> line;                          ///< scanline of the image
  std::optional<RouteFix> fix;                      ///< empty: not on this route
  std::vector<RouteChanges::AzimuthRange> changed;  ///< azimuths at which the scene has changed
  std::optional<Pose2> truth;                       ///< true pose in the route's frame, if known
  std::optional<RoutePosition> true_place;
  std::optional<recordings::RunMoment>
      moment;  ///< for the record of the run; nullopt: not recorded
};

/// Follows every N-th image of a run along a route. Lines are computed on all threads, the follower
/// runs in order; results do not depend on the number of threads. `truth` has the true poses of all
/// entries or is empty. `panorama_reader` unwraps images for the record; null: nothing is recorded.
/// `report` is called after each image, in order. An image that cannot be read is skipped
/// (`SkippedImages`).
void follow(RouteFollower& follower, const Dataset& run, const std::vector<Pose2>& truth,
            int every_nth, const PanoramaReader* panorama_reader, Session& session,
            const std::function<void(FollowedImage&&)>& report);

struct FollowSummary {
  std::size_t images = 0;
  std::size_t on_route = 0;
  std::size_t predicted = 0;
  std::size_t recovered = 0;
  std::size_t searched = 0;
  // Absolute errors of the images whose true pose is known.
  std::vector<double> position_m;
  std::vector<double> along_m;
  std::vector<double> lateral_m;
  std::vector<double> heading_rad;
};
[[nodiscard]] FollowSummary summarise_follow(const std::vector<FollowedImage>& images,
                                             bool headings_known);

/// Returns the stretches of the route on which the scene has changed: begin and end along the
/// route, in metres.
[[nodiscard]] std::vector<std::pair<double, double>> find_changed_sections(
    const std::vector<FollowedImage>& images);

/// Returns the name in JSON: "prediction", "recovery" or "search".
[[nodiscard]] std::string_view to_string(RouteFix::Origin origin);
/// Returns the word for people: "predicted", "recovered" or "found".
[[nodiscard]] std::string_view format_origin(RouteFix::Origin origin);
/// Explains the three words in one sentence.
inline constexpr std::string_view origin_explanation =
    "predicted: at the pose that the odometry predicts; recovered: by a search around that pose; "
    "found: by a search along the whole route";

}  // namespace panonav::command
