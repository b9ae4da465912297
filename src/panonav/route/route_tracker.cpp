#include "panonav/route/route_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/route_position.hpp"

namespace panonav {

void visit_options(RouteTrackerOptions& options, OptionVisitor& visitor) {
  using T = RouteTrackerOptions;
  constexpr OptionTable table{
      option<&T::search_step_m>("distance between the tested positions along the route", 0.01, 100),
      option<&T::search_lateral_m>("distance between the tested positions beside the route", 0.01,
                                   100),
      option<&T::search_sides>("number of tested positions on each side of the route", 0, 100),
      option<&T::max_candidates>("number of positions that a search refines", 1, 1000),
      option<&T::recovery_m>("assumed largest error of a predicted position", 0, 100),
      option<&T::surprise_m>(
          "distance from the predicted position above which the next line must confirm the result",
          0, 100),
      option<&T::min_correlation>(
          "smallest correlation of an accepted result; 0: learnt from the route", 0, 1),
  };
  table.visit(options, visitor);
}

RouteTracker::RouteTracker(const RoutePanorama& route, const RouteTrackerOptions& options,
                           const RouteFitOptions& fit)
    : options_(options), lines_(route, fit) {
  validate(options);
  min_correlation_ = options.min_correlation;
  if (min_correlation_ == 0.0) min_correlation_ = learn_min_correlation(route, fit);
}

double RouteTracker::learn_min_correlation(const RoutePanorama& route,
                                           const RouteFitOptions& options) const {
  // Threshold if nothing can be learnt: half of the variance is explained.
  constexpr double default_correlation = 0.7071;
  constexpr std::size_t samples = 40;
  if (route.size() < 6) return default_correlation;
  RoutePanorama half(route.columns());
  for (std::size_t i = 0; i < route.size(); i += 2) half.append(route.poses()[i], route.line(i));
  const RouteLines others(half, options);
  std::vector<double> right;
  std::vector<double> wrong;
  for (std::size_t s = 0; s < samples; ++s) {
    // Lines of odd numbers, spread over the route.
    const std::size_t i = (s * route.size() / samples) | 1U;
    if (i >= route.size()) break;
    auto line = line_values(route, i);
    if (const auto fix = others.fit(line, route.poses()[i])) right.push_back(fix->correlation);
    std::ranges::reverse(line);
    if (const auto fix = find_best_on_route(line)) wrong.push_back(fix->correlation);
  }
  if (right.size() < 3 || wrong.size() < 3) return default_correlation;
  const double low = std::max(0.0, order_statistic(std::move(wrong), 0.95));
  const double high = order_statistic(std::move(right), 0.05);
  // Puts the limit nearer to the wrong fits, as a line taken off the path or in a changed scene
  // fits worse than one from the path.
  return low + std::max(0.0, high - low) / 3.0;
}

RouteFix RouteTracker::add_route_position(RouteFix fix, RouteFix::Origin origin) const {
  const RoutePosition position = project_onto_route(lines_.poses(), fix.pose.position());
  fix.origin = origin;
  fix.along_m = position.along_m;
  fix.lateral_m = position.lateral_m;
  return fix;
}

std::optional<RouteFix> RouteTracker::recover(std::span<const float> line,
                                              const Pose2& predicted) const {
  const auto coarse = lines_.to_coarse_line(line);
  std::optional<RouteLines::Candidate> start;
  constexpr int rings = 2;
  constexpr int directions = 8;
  for (int ring = 0; ring <= rings; ++ring) {
    for (int k = 0; k < (ring == 0 ? 1 : directions); ++k) {
      const double off = options_.recovery_m * ring / rings;
      const double angle = 2.0 * std::numbers::pi * k / directions;
      const auto found = lines_.find_candidate(
          coarse, {predicted.x_m + off * std::cos(angle), predicted.y_m + off * std::sin(angle)});
      if (found && (!start || found->correlation > start->correlation)) start = found;
    }
  }
  if (!start) return std::nullopt;
  return lines_.fit(line, start->pose);
}

std::optional<RouteFix> RouteTracker::find_best_on_route(std::span<const float> line) const {
  const auto coarse = lines_.to_coarse_line(line);
  std::vector<RouteLines::Candidate> found;
  const auto path = lines_.poses();
  double since = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i > 0) since += distance(path[i - 1].position(), path[i].position());
    if (since < options_.search_step_m) continue;
    since = 0.0;
    const Pose2& before = path[i == 0 ? 0 : i - 1];
    const Pose2& after = path[std::min(i + 1, path.size() - 1)];
    const double length = std::max(1e-9, distance(before.position(), after.position()));
    const double nx = -(after.y_m - before.y_m) / length;
    const double ny = (after.x_m - before.x_m) / length;
    for (int side = -options_.search_sides; side <= options_.search_sides; ++side) {
      const double off = side * options_.search_lateral_m;
      const auto candidate =
          lines_.find_candidate(coarse, {path[i].x_m + off * nx, path[i].y_m + off * ny});
      if (candidate) found.push_back(*candidate);
    }
  }
  std::ranges::stable_sort(found, std::greater<>{}, &RouteLines::Candidate::correlation);
  std::optional<RouteFix> best;
  std::vector<Point2> tried;
  for (const auto& candidate : found) {
    if (tried.size() >= static_cast<std::size_t>(options_.max_candidates)) break;
    // Skips positions near a tested one, from which a fit would converge to the same pose.
    const bool near = std::ranges::any_of(tried, [&](Point2 other) {
      return distance(other, candidate.pose.position()) < 1.5 * options_.search_lateral_m;
    });
    if (near) continue;
    tried.push_back(candidate.pose.position());
    auto fix = lines_.fit(line, candidate.pose);
    if (fix && (!best || fix->correlation > best->correlation)) best = std::move(fix);
  }
  return best;
}

std::optional<RouteFix> RouteTracker::search(std::span<const float> line) const {
  auto best = find_best_on_route(line);
  if (!best || best->correlation < min_correlation_) return std::nullopt;
  return add_route_position(*std::move(best), RouteFix::Origin::search);
}

std::optional<RouteFix> RouteTracker::track(std::span<const float> line, const Pose2& step) {
  const auto agrees = [&](const RouteFix& fix, double within_m) {
    return unconfirmed_ &&
           distance((*unconfirmed_ * step).position(), fix.pose.position()) <= within_m;
  };
  std::optional<RouteFix> found;
  if (pose_) {
    const Pose2 predicted = *pose_ * step;
    pose_ = predicted;
    const auto off_m = [&](const RouteFix& fix) {
      return distance(fix.pose.position(), predicted.position());
    };
    const auto is_acceptable = [&](const std::optional<RouteFix>& fix) {
      return fix && fix->correlation >= min_correlation_ &&
             off_m(*fix) <= 1.5 * options_.recovery_m;
    };
    auto fix = lines_.fit(line, predicted);
    if (is_acceptable(fix)) {
      found = add_route_position(*std::move(fix), RouteFix::Origin::prediction);
    } else {
      fix = recover(line, predicted);
      if (is_acceptable(fix))
        found = add_route_position(*std::move(fix), RouteFix::Origin::recovery);
    }
    // Odometry errs by centimetres from one line to the next.
    if (found && is_followed_ && off_m(*found) > options_.surprise_m &&
        !agrees(*found, options_.surprise_m)) {
      unconfirmed_ = found->pose;
      return std::nullopt;
    }
  }
  if (!found) {
    auto anywhere = search(line);
    // A followed robot is seldom kidnapped; a wrong match of one line is more likely.
    if (anywhere && (!pose_ || agrees(*anywhere, options_.recovery_m))) {
      found = std::move(anywhere);
    } else {
      unconfirmed_ = anywhere ? std::optional(anywhere->pose) : std::nullopt;
    }
  }
  if (found) {
    pose_ = found->pose;
    unconfirmed_.reset();
    is_followed_ = true;
  }
  return found;
}

}  // namespace panonav
