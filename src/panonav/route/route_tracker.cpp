#include "panonav/route/route_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
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
          "smallest correlation of an accepted result; 0: learnt from the route, with that of the "
          "details of the image",
          0, 1),
  };
  table.visit(options, visitor);
}

RouteTracker::RouteTracker(const RoutePanorama& route, const RouteTrackerOptions& options,
                           const RouteFitOptions& fit, const std::optional<RouteLimits>& learnt)
    : options_(options), metre_(fit.metre), lines_(route, fit) {
  validate(options);
  list_search_views();
  if (learnt) {
    if (!is_valid(*learnt)) throw ContractError("limits", "out of range", "those of a tracker");
    limits_ = *learnt;
  } else {
    learn(route, fit);
  }
}

void RouteTracker::list_search_views() {
  const double step_m = options_.search_step_m * metre_;
  const double side_m = options_.search_lateral_m * metre_;
  const auto path = lines_.poses();
  double since = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i > 0) since += distance(path[i - 1].position(), path[i].position());
    if (since < step_m) continue;
    since = 0.0;
    const Pose2& before = path[i == 0 ? 0 : i - 1];
    const Pose2& after = path[std::min(i + 1, path.size() - 1)];
    const double length = std::max(1e-9, distance(before.position(), after.position()));
    const double nx = -(after.y_m - before.y_m) / length;
    const double ny = (after.x_m - before.x_m) / length;
    for (int side = -options_.search_sides; side <= options_.search_sides; ++side) {
      auto view = lines_.make_coarse_view(
          {path[i].x_m + side * side_m * nx, path[i].y_m + side * side_m * ny});
      if (view) search_views_.push_back(*std::move(view));
    }
  }
}

bool is_valid(const RouteLimits& limits) {
  const auto is_within = [](double value, double low, double high) {
    return value >= low && value <= high;
  };
  constexpr double max_variance = std::numeric_limits<double>::max();
  return is_within(limits.min_correlation, 0.0, 1.0) &&
         is_within(limits.min_detail_correlation, -1.0, 1.0) &&
         limits.detail_scale < RouteFix::detail_scales_deg.size() &&
         is_within(limits.model_variance_m2, 0.0, max_variance) &&
         is_within(limits.model_variance_rad2, 0.0, max_variance);
}

bool RouteTracker::has_enough_columns(const RouteFix& fix) const {
  return 2 * fix.columns >= lines_.columns();
}

bool RouteTracker::is_match(const RouteFix& fix) const {
  return has_enough_columns(fix) && fix.correlation >= limits_.min_correlation &&
         fix.detail_correlations[limits_.detail_scale] >= limits_.min_detail_correlation;
}

RouteFix RouteTracker::add_route_position(RouteFix fix, RouteFix::Origin origin) const {
  RoutePosition position = project_onto_route(lines_.poses(), fix.pose.position());
  if (along_m_ && origin != RouteFix::Origin::search) {
    // Where the route crosses itself or returns beside itself, the robot stays on its pass.
    const double reach_m = std::abs(position.lateral_m) + options_.recovery_m * metre_;
    for (const RoutePosition& pass : find_passes(lines_.poses(), fix.pose.position(), reach_m)) {
      if (std::abs(pass.along_m - *along_m_) < std::abs(position.along_m - *along_m_))
        position = pass;
    }
  }
  fix.origin = origin;
  fix.covariance[0] += limits_.model_variance_m2;
  fix.covariance[4] += limits_.model_variance_m2;
  fix.covariance[8] += limits_.model_variance_rad2;
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
      const double off = options_.recovery_m * metre_ * ring / rings;
      const double angle = 2.0 * std::numbers::pi * k / directions;
      const auto view = lines_.make_coarse_view(
          {predicted.x_m + off * std::cos(angle), predicted.y_m + off * std::sin(angle)});
      const auto found = view ? RouteLines::find_candidate(coarse, *view) : std::nullopt;
      if (found && (!start || found->correlation > start->correlation)) start = found;
    }
  }
  if (!start) return std::nullopt;
  return lines_.fit(line, start->pose);
}

std::optional<RouteFix> RouteTracker::find_best_on_route(std::span<const float> line) const {
  const auto coarse = lines_.to_coarse_line(line);
  std::vector<RouteLines::Candidate> found;
  for (const RouteLines::CoarseView& view : search_views_) {
    if (const auto candidate = RouteLines::find_candidate(coarse, view))
      found.push_back(*candidate);
  }
  std::ranges::stable_sort(found, std::greater<>{}, &RouteLines::Candidate::correlation);
  std::optional<RouteFix> best;
  std::vector<Point2> tried;
  for (const auto& candidate : found) {
    if (tried.size() >= static_cast<std::size_t>(options_.max_candidates)) break;
    // Skips positions near a tested one, from which a fit would converge to the same pose.
    const bool near = std::ranges::any_of(tried, [&](Point2 other) {
      return distance(other, candidate.pose.position()) < 1.5 * options_.search_lateral_m * metre_;
    });
    if (near) continue;
    tried.push_back(candidate.pose.position());
    auto fix = lines_.fit(line, candidate.pose);
    if (!fix || !has_enough_columns(*fix)) continue;
    if (!best || fix->correlation > best->correlation) best = std::move(fix);
  }
  return best;
}

std::optional<RouteFix> RouteTracker::search(std::span<const float> line) const {
  auto best = find_best_on_route(line);
  if (!best || !is_match(*best)) return std::nullopt;
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
      return fix && is_match(*fix) && off_m(*fix) <= 1.5 * options_.recovery_m * metre_;
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
    if (found && is_followed_ && off_m(*found) > options_.surprise_m * metre_ &&
        !agrees(*found, options_.surprise_m * metre_)) {
      unconfirmed_ = found->pose;
      return std::nullopt;
    }
  }
  if (!found) {
    auto anywhere = search(line);
    // A followed robot is seldom kidnapped; a wrong match of one line is more likely.
    if (anywhere && (!pose_ || agrees(*anywhere, options_.recovery_m * metre_))) {
      found = std::move(anywhere);
    } else {
      unconfirmed_ = anywhere ? std::optional(anywhere->pose) : std::nullopt;
    }
  }
  if (found) {
    pose_ = found->pose;
    along_m_ = found->along_m;
    unconfirmed_.reset();
    is_followed_ = true;
  }
  return found;
}

}  // namespace panonav
