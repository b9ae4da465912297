#include "panonav/route/route_tracker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/route_position.hpp"

namespace panonav {

namespace {

/// Share of the errors within the stated covariance's ellipse.
constexpr double coverage = 0.95;
/// Squared standard deviations that contain this share of a Gaussian in one and two dimensions.
constexpr double square_of_coordinate = 3.841;
constexpr double square_of_position = 5.991;
/// Smallest number of fits from which anything is learnt.
constexpr std::size_t min_fits = 3;

/// Returns the correlation that 1 % of correlations of the same distribution exceed, by the normal
/// distribution of Fisher's z and Student's distribution of its estimated spread. Needs two
/// correlations or more.
double compute_upper_limit(const std::vector<double>& correlations) {
  constexpr double max_correlation = 0.999;  // of which z is finite
  std::vector<double> z;
  for (const double value : correlations) {
    z.push_back(std::atanh(std::clamp(value, -max_correlation, max_correlation)));
  }
  const double middle = mean(z);
  double squares = 0.0;
  for (const double value : z) squares += (value - middle) * (value - middle);
  const auto n = static_cast<double>(z.size());
  // Quantile of 99 % of Student's distribution, by its expansion in the degrees of freedom.
  constexpr double quantile_99 = 2.326;
  constexpr double cubed = quantile_99 * quantile_99 * quantile_99;
  const double freedom = n - 1.0;
  const double student_99 =
      quantile_99 + (cubed + quantile_99) / (4.0 * freedom) +
      (5.0 * cubed * quantile_99 * quantile_99 + 16.0 * cubed + 3.0 * quantile_99) /
          (96.0 * freedom * freedom);
  return std::tanh(middle + student_99 * std::sqrt(squares / freedom * (1.0 + 1.0 / n)));
}

/// Returns a line with the structures of `line` that shows no place: its eighths, mirrored and in
/// another order.
std::vector<float> shuffle_line(std::span<const float> line) {
  constexpr std::array<std::size_t, 8> order{0, 3, 6, 1, 4, 7, 2, 5};
  std::vector<float> shuffled;
  shuffled.reserve(line.size());
  for (const std::size_t eighth : order) {
    const std::size_t begin = eighth * line.size() / order.size();
    const std::size_t end = (eighth + 1) * line.size() / order.size();
    for (std::size_t c = end; c > begin; --c) shuffled.push_back(line[c - 1]);
  }
  return shuffled;
}

/// Error of a fit, with the covariance by the noise of the lines.
struct FitError {
  Point2 position;
  double heading_rad = 0.0;
  std::array<double, 9> covariance{};

  /// Returns the variance of x and of y that must be added so that the error lies on the ellipse of
  /// 95 %; 0 if it lies within it.
  [[nodiscard]] double missing_variance_m2() const {
    const auto is_within = [&](double added_m2) {
      const double xx = covariance[0] + added_m2;
      const double xy = covariance[1];
      const double yy = covariance[4] + added_m2;
      return yy * position.x_m * position.x_m - 2.0 * xy * position.x_m * position.y_m +
                 xx * position.y_m * position.y_m <=
             square_of_position * (xx * yy - xy * xy);
    };
    if (is_within(0.0)) return 0.0;
    double low = 0.0;
    double high = (position.x_m * position.x_m + position.y_m * position.y_m) / square_of_position;
    constexpr int halvings = 40;
    for (int i = 0; i < halvings; ++i) {
      const double middle = 0.5 * (low + high);
      (is_within(middle) ? high : low) = middle;
    }
    return high;
  }
  [[nodiscard]] double missing_variance_rad2() const {
    return std::max(0.0, heading_rad * heading_rad / square_of_coordinate - covariance[8]);
  }
};

}  // namespace

struct RouteTracker::TestRoute {
  TestRoute(const RoutePanorama& route, const RouteFitOptions& options)
      : lines(make_half(route), options) {
    constexpr std::size_t samples = 40;
    for (std::size_t s = 0; s < samples; ++s) {
      // Lines of odd numbers, spread over the route.
      const std::size_t i = (s * route.size() / samples) | 1U;
      if (i >= route.size()) break;
      if (!poses.empty() && poses.back() == route.poses()[i]) continue;
      poses.push_back(route.poses()[i]);
      values.push_back(line_values(route, i));
    }
  }
  static RoutePanorama make_half(const RoutePanorama& route) {
    RoutePanorama half(route.columns());
    for (std::size_t i = 0; i < route.size(); i += 2) half.append(route.poses()[i], route.line(i));
    return half;
  }

  RouteLines lines;
  std::vector<Pose2> poses;                // of the other lines
  std::vector<std::vector<float>> values;  // of these
};

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
                           const RouteFitOptions& fit)
    : options_(options), metre_(fit.metre), lines_(route, fit) {
  validate(options);
  // Errors if nothing can be learnt: even between two lines.
  const double spacing_m = route.length_m() / static_cast<double>(route.size() - 1);
  model_variance_m2_ = spacing_m * spacing_m / 12.0;
  constexpr std::size_t min_lines = 6;
  // Threshold if nothing can be learnt: half of the variance is explained.
  constexpr double default_correlation = 0.7071;
  min_correlation_ = options.min_correlation == 0.0 ? default_correlation : options.min_correlation;
  if (route.size() < min_lines) return;
  const TestRoute test(route, fit);
  if (options.min_correlation == 0.0) learn_limits(test);
  learn_model_errors(test);
}

bool RouteTracker::has_enough_columns(const RouteFix& fix) const {
  return 2 * fix.columns >= lines_.columns();
}

bool RouteTracker::is_match(const RouteFix& fix) const {
  return has_enough_columns(fix) && fix.correlation >= min_correlation_ &&
         fix.detail_correlations[detail_scale_] >= min_detail_;
}

void RouteTracker::learn_limits(const TestRoute& test) {
  std::vector<RouteFix> right;
  std::vector<RouteFix> wrong;
  const auto add_wrong = [&](std::span<const float> line) {
    if (auto fix = find_best_on_route(line)) wrong.push_back(*std::move(fix));
  };
  for (std::size_t i = 0; i < test.poses.size(); ++i) {
    const auto& line = test.values[i];
    if (auto fix = test.lines.fit(line, test.poses[i])) right.push_back(*std::move(fix));
    // As detailed as the lines of the route, but of no place. Unlike the mirror image of a line,
    // its negative and its shuffled parts are no view in a symmetric corridor either. A negative
    // has dark spots for bright ones, which correlate with the route less than other places do.
    std::vector<float> negative(line);
    for (float& value : negative) value = 1.0F - value;
    add_wrong(negative);
    add_wrong(shuffle_line(line));
  }
  if (right.size() < min_fits || wrong.size() < min_fits) return;
  const auto collect = [](const std::vector<RouteFix>& fixes, const auto& correlation) {
    std::vector<double> values;
    for (const RouteFix& fix : fixes) values.push_back(correlation(fix));
    return values;
  };
  const auto whole = [](const RouteFix& fix) { return fix.correlation; };
  const double low = std::max(0.0, order_statistic(collect(wrong, whole), 0.95));
  const double high = order_statistic(collect(right, whole), 0.05);
  // Nearer to the wrong fits, as a line taken off the path or in a changed scene fits worse than
  // one from the path.
  min_correlation_ = low + std::max(0.0, high - low) / 3.0;
  // Details that the route itself does not show twice, such as noise, tell no places apart: the
  // finest scale at which most of its lines exceed the limit counts, the coarsest if there is none.
  for (std::size_t scale = 0; scale < RouteFix::detail_scales_deg.size(); ++scale) {
    const auto detail = [&](const RouteFix& fix) { return fix.detail_correlations[scale]; };
    detail_scale_ = scale;
    min_detail_ = compute_upper_limit(collect(wrong, detail));
    if (order_statistic(collect(right, detail), 0.5) > min_detail_) break;
  }
}

void RouteTracker::learn_model_errors(const TestRoute& test) {
  std::vector<double> variances_m2;
  std::vector<double> variances_rad2;
  for (std::size_t i = 0; i < test.poses.size(); ++i) {
    const Pose2& truth = test.poses[i];
    // To the left and right in turn.
    const double lateral_m = (i % 2 == 0 ? 1.0 : -1.0) * options_.surprise_m * metre_;
    const auto fix = test.lines.fit(test.values[i], truth * Pose2{0.0, lateral_m, 0.0});
    if (!fix || !has_enough_columns(*fix)) continue;
    const FitError error{{fix->pose.x_m - truth.x_m, fix->pose.y_m - truth.y_m},
                         angle_difference(fix->pose.heading_rad, truth.heading_rad),
                         fix->covariance};
    // A fit that moves away from the truth has found another minimum, which the limits refuse.
    if (std::hypot(error.position.x_m, error.position.y_m) > std::abs(lateral_m)) continue;
    variances_m2.push_back(error.missing_variance_m2());
    variances_rad2.push_back(error.missing_variance_rad2());
  }
  if (variances_m2.size() < min_fits) return;
  model_variance_m2_ = order_statistic(std::move(variances_m2), coverage);
  model_variance_rad2_ = order_statistic(std::move(variances_rad2), coverage);
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
  fix.covariance[0] += model_variance_m2_;
  fix.covariance[4] += model_variance_m2_;
  fix.covariance[8] += model_variance_rad2_;
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
    if (since < options_.search_step_m * metre_) continue;
    since = 0.0;
    const Pose2& before = path[i == 0 ? 0 : i - 1];
    const Pose2& after = path[std::min(i + 1, path.size() - 1)];
    const double length = std::max(1e-9, distance(before.position(), after.position()));
    const double nx = -(after.y_m - before.y_m) / length;
    const double ny = (after.x_m - before.x_m) / length;
    for (int side = -options_.search_sides; side <= options_.search_sides; ++side) {
      const double off = side * options_.search_lateral_m * metre_;
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
