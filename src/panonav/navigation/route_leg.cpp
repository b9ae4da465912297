#include "panonav/navigation/route_leg.hpp"

#include <algorithm>
#include <cmath>

namespace panonav {

void visit_options(RouteLegOptions& options, OptionVisitor& visitor) {
  visitor.visit({.name = "reach_m",
                 .help = "robot and goal lie no farther beside a route",
                 .low = 0,
                 .high = 100},
                options.reach_m);
  visitor.visit({.name = "shortest_m",
                 .help = "shortest way along a route that is worth following",
                 .low = 0,
                 .high = 1000,
                 .low_open = true},
                options.shortest_m);
}

namespace {

// Where the route is between two ways along it, low < high, both ends included.
std::vector<Point2> stretch(std::span<const Pose2> poses, double low_m, double high_m) {
  std::vector<Point2> places;
  double way_m = 0.0;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const Point2 from = poses[i].position();
    const Point2 to = poses[i + 1].position();
    const double length_m = distance(from, to);
    const double end_m = way_m + length_m;
    const auto place_at = [&](double along_m) {
      const double share = (along_m - way_m) / length_m;
      return Point2{from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m)};
    };
    if (low_m >= way_m && low_m < end_m) places.push_back(place_at(low_m));
    if (high_m > way_m && high_m <= end_m) places.push_back(place_at(high_m));
    if (end_m > low_m && end_m < high_m) places.push_back(to);
    way_m = end_m;
  }
  return places;
}

}  // namespace

std::optional<RouteLeg> route_leg(const RouteTracker& tracker, std::span<const float> here,
                                  std::span<const float> goal, const RouteLegOptions& options) {
  validate(options);
  const auto start = tracker.search(here);
  const auto end = tracker.search(goal);
  if (!start || !end) return std::nullopt;
  if (std::abs(start->lateral_m) > options.reach_m || std::abs(end->lateral_m) > options.reach_m) {
    return std::nullopt;
  }
  RouteLeg leg;
  leg.length_m = std::abs(end->along_m - start->along_m);
  if (leg.length_m < options.shortest_m) return std::nullopt;
  leg.back = end->along_m < start->along_m;
  leg.route_from_robot = start->fix.pose;
  leg.path = stretch(tracker.lines().poses(), std::min(start->along_m, end->along_m),
                     std::max(start->along_m, end->along_m));
  if (leg.back) std::ranges::reverse(leg.path);
  // The goal itself, beside the route.
  leg.path.push_back(end->fix.pose.position());
  return leg;
}

}  // namespace panonav
