#include "panonav/route/route_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/route_position.hpp"

namespace panonav {

namespace {

/// Number of candidates of a search that are fitted at the coarsest level; twice as many find no
/// more poses in `corridor`.
constexpr std::size_t max_coarse_candidates = 32;
/// Two coarse fits that end nearer to each other have found one pose.
constexpr double converged_m = 0.1;
/// Headings nearer than this are one maximum of the correlation of lines smoothed by 8 degrees.
constexpr double same_heading_rad = 0.35;
/// Standard deviations by which a pose must explain a line better than any pose elsewhere: 95 % in
/// a two-sided test, as the better pose is chosen by the same line.
constexpr double min_lead = 1.96;

bool is_same_heading(const Pose2& a, const Pose2& b) {
  return std::abs(angle_difference(a.heading_rad, b.heading_rad)) < same_heading_rad;
}

/// Returns the items of the highest correlations, of which no two are near each other. `candidate`:
/// projection of an item to its candidate.
template <class Item, class Projection>
std::vector<Item> choose_candidates(std::vector<Item> items, double near_m, std::size_t count,
                                    Projection candidate) {
  const auto correlation = [&](const Item& item) {
    return std::invoke(candidate, item).correlation;
  };
  std::ranges::stable_sort(items, std::greater<>{}, correlation);
  std::vector<Item> chosen;
  for (const Item& item : items) {
    if (chosen.size() >= count) break;
    const Pose2& pose = std::invoke(candidate, item).pose;
    const bool is_near = std::ranges::any_of(chosen, [&](const Item& other) {
      const Pose2& there = std::invoke(candidate, other).pose;
      return distance(there.position(), pose.position()) < near_m && is_same_heading(there, pose);
    });
    if (!is_near) chosen.push_back(item);
  }
  return chosen;
}

/// Adds the spread of the fix and of another position of the same line to the covariance.
/// `p_other`: probability of the other one.
void add_other_position(RouteFix& fix, Point2 other, double p_other) {
  const double x_m = other.x_m - fix.pose.x_m;
  const double y_m = other.y_m - fix.pose.y_m;
  fix.covariance[0] += p_other * x_m * x_m;
  fix.covariance[1] += p_other * x_m * y_m;
  fix.covariance[3] += p_other * x_m * y_m;
  fix.covariance[4] += p_other * y_m * y_m;
}

}  // namespace

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
    if (since < step_m && i + 1 < path.size()) continue;
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
      if (!view) continue;
      for (const auto& found : RouteLines::find_candidates(coarse, *view)) {
        if (!start || found.correlation > start->correlation) start = found;
      }
    }
  }
  if (!start) return std::nullopt;
  return lines_.fit(line, start->pose);
}

std::vector<RouteFix> RouteTracker::find_on_route(std::span<const float> line) const {
  const auto coarse = lines_.to_coarse_line(line);
  std::vector<RouteLines::Candidate> all;
  for (const RouteLines::CoarseView& view : search_views_) {
    const auto found = RouteLines::find_candidates(coarse, view);
    all.insert(all.end(), found.begin(), found.end());
  }
  struct Start {
    Pose2 pose;                    // before the coarse fit, which may end at a wrong pose
    RouteLines::Candidate coarse;  // by this
  };
  std::vector<Start> starts;
  const double near_m = 1.5 * options_.search_lateral_m * metre_;
  for (const auto& candidate :
       choose_candidates(std::move(all), near_m, max_coarse_candidates, std::identity{})) {
    if (const auto better = lines_.fit_coarsely(line, candidate.pose))
      starts.push_back({candidate.pose, *better});
  }
  std::vector<RouteFix> fixes;
  for (const Start& start :
       choose_candidates(std::move(starts), converged_m * metre_,
                         static_cast<std::size_t>(options_.max_candidates), &Start::coarse)) {
    auto fix = lines_.fit(line, start.pose);
    if (fix && has_enough_columns(*fix)) fixes.push_back(*std::move(fix));
  }
  std::ranges::stable_sort(fixes, std::greater<>{}, &RouteFix::correlation);
  return fixes;
}

std::optional<RouteFix> RouteTracker::search(std::span<const float> line) const {
  auto fixes = find_on_route(line);
  if (fixes.empty() || !is_match(fixes.front())) return std::nullopt;
  RouteFix best = add_route_position(std::move(fixes.front()), RouteFix::Origin::search);
  // Returns false if the other position is elsewhere and explains the line about as well.
  const auto add_other = [&](Point2 other, double lead, double same_m) {
    if (distance(best.pose.position(), other) > same_m * metre_) return lead >= min_lead;
    add_other_position(best, other, 0.5 * std::erfc(lead / std::numbers::sqrt2));
    return true;
  };
  for (const RouteFix& other : std::span(fixes).subspan(1)) {
    if (is_round_end(best.pose, other.pose)) continue;
    const double same_m = is_same_heading(best.pose, other.pose) ? options_.recovery_m : -1.0;
    const double lead = lines_.compare_poses(line, best.pose, other.pose);
    if (!add_other(other.pose.position(), lead, same_m)) return std::nullopt;
  }
  const RouteLines::PastEnd past_end = lines_.find_past_end(line, best.pose);
  if (!add_other(past_end.position, past_end.lead, options_.surprise_m)) return std::nullopt;
  return best;
}

bool RouteTracker::is_round_end(const Pose2& pose, const Pose2& other) const {
  const auto path = lines_.poses();
  const auto is_near = [&](const Pose2& a, const Pose2& b) {
    return distance(a.position(), b.position()) <= options_.recovery_m * metre_;
  };
  return is_same_heading(pose, other) &&
         ((is_near(pose, path.front()) && is_near(other, path.back())) ||
          (is_near(pose, path.back()) && is_near(other, path.front())));
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
