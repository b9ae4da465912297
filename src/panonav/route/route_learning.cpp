// Learning from the lines of a route.

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/route_tracker.hpp"

namespace panonav {

namespace {

/// Share of the errors within the stated covariance's ellipse.
constexpr double coverage = 0.95;
/// Squared standard deviations that contain this share of a Gaussian in one and two dimensions.
constexpr double square_of_coordinate = 3.841;
constexpr double square_of_position = 5.991;
/// Smallest number of fits from which anything is learnt.
constexpr std::size_t min_fits = 3;
/// Lines of which one is kept where errors by interpolation are learnt. Two blended lines show an
/// edge twice, which moves a fit along the path. Midway between the lines both sides cancel out; a
/// third of the way the error is about its root mean square over all positions between the lines.
constexpr std::size_t lines_per_kept_line = 3;

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

}  // namespace

/// Error of a fit, with the covariance by the noise of the lines.
struct RouteTracker::FitError {
  Point2 position;
  double heading_rad = 0.0;
  std::array<double, 9> covariance{};

  /// Returns the variance of x and of y that puts the error on the circle of 95 %.
  [[nodiscard]] double square_variance_m2() const {
    return (position.x_m * position.x_m + position.y_m * position.y_m) / square_of_position;
  }
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
    double high = square_variance_m2();
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

struct RouteTracker::TestRoute {
  /// Keeps one of every `kept_every` lines, and tests up to 40 of the lines after them.
  TestRoute(const RoutePanorama& route, std::size_t kept_every, const RouteFitOptions& options)
      : lines(thin_out(route, kept_every), options) {
    constexpr std::size_t samples = 40;
    for (std::size_t s = 0; s < samples; ++s) {
      // Spread over the route, at each distance from a kept line in turn.
      const std::size_t kept = s * route.size() / samples / kept_every * kept_every;
      const std::size_t i = kept + 1 + s % (kept_every - 1);
      if (i >= route.size()) break;
      if (std::ranges::find(poses, route.poses()[i]) != poses.end()) continue;
      poses.push_back(route.poses()[i]);
      values.push_back(line_values(route, i));
    }
  }
  static RoutePanorama thin_out(const RoutePanorama& route, std::size_t kept_every) {
    RoutePanorama kept(route.columns());
    for (std::size_t i = 0; i < route.size(); i += kept_every)
      kept.append(route.poses()[i], route.line(i));
    return kept;
  }

  RouteLines lines;
  std::vector<Pose2> poses;                // of the tested lines
  std::vector<std::vector<float>> values;  // of these
};

void RouteTracker::learn(const RoutePanorama& route, const RouteFitOptions& fit) {
  // Errors if nothing can be learnt: even between two lines.
  const double spacing_m = route.length_m() / static_cast<double>(route.size() - 1);
  limits_.model_variance_m2 = spacing_m * spacing_m / 12.0;
  constexpr std::size_t min_lines = 6;
  // Threshold if nothing can be learnt: half of the variance is explained.
  constexpr double default_correlation = 0.7071;
  const bool is_set = options_.min_correlation != 0.0;
  limits_.min_correlation = is_set ? options_.min_correlation : default_correlation;
  if (route.size() < min_lines) return;
  const TestRoute halved(route, 2, fit);
  if (!is_set) learn_acceptance(halved);
  learn_model_errors(halved, TestRoute(route, lines_per_kept_line, fit));
}

void RouteTracker::learn_acceptance(const TestRoute& test) {
  std::vector<RouteFix> right;
  std::vector<RouteFix> wrong;
  const auto add_wrong = [&](std::span<const float> line) {
    auto fixes = find_on_route(line);
    if (!fixes.empty()) wrong.push_back(std::move(fixes.front()));
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
  limits_.min_correlation = low + std::max(0.0, high - low) / 3.0;
  // Details that the route itself does not show twice, such as noise, tell no places apart: the
  // finest scale at which most of its lines exceed the limit counts, the coarsest if there is none.
  for (std::size_t scale = 0; scale < RouteFix::detail_scales_deg.size(); ++scale) {
    const auto detail = [&](const RouteFix& fix) { return fix.detail_correlations[scale]; };
    limits_.detail_scale = scale;
    limits_.min_detail_correlation = compute_upper_limit(collect(wrong, detail));
    if (order_statistic(collect(right, detail), 0.5) > limits_.min_detail_correlation) break;
  }
}

std::vector<RouteTracker::FitError> RouteTracker::measure_errors(const TestRoute& test) const {
  std::vector<FitError> errors;
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
    errors.push_back(error);
  }
  return errors;
}

void RouteTracker::learn_model_errors(const TestRoute& halved, const TestRoute& thinned) {
  const auto compute_coverage_limit = [](const std::vector<FitError>& errors, auto variance) {
    std::vector<double> values;
    for (const FitError& error : errors) values.push_back((error.*variance)());
    return order_statistic(std::move(values), coverage);
  };
  const std::vector<FitError> errors = measure_errors(halved);
  if (errors.size() < min_fits) return;
  limits_.model_variance_m2 = compute_coverage_limit(errors, &FitError::missing_variance_m2);
  limits_.model_variance_rad2 = compute_coverage_limit(errors, &FitError::missing_variance_rad2);
  const std::vector<FitError> thinned_errors = measure_errors(thinned);
  if (thinned_errors.size() < min_fits) return;
  // Errors of poses or by tilt are in both; those by interpolation grow with the spacing or faster.
  constexpr auto spacings = static_cast<double>(lines_per_kept_line);
  limits_.model_variance_m2 +=
      std::max(0.0, compute_coverage_limit(thinned_errors, &FitError::square_variance_m2) -
                        compute_coverage_limit(errors, &FitError::square_variance_m2)) /
      (spacings * spacings);
}

}  // namespace panonav
