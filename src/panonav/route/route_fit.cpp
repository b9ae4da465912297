#include "panonav/route/route_fit.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/least_squares.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/route/horizon_scanline.hpp"
#include "panonav/route/internal/autocorrelation.hpp"
#include "panonav/route/internal/line_sampling.hpp"

namespace panonav {

namespace {

/// Unknowns: x, y, heading, gain, offset.
using Equations = DenseEquations<5>;

/// Typical distance of things: smoothing by an angle corresponds to smoothing along the path by the
/// angle times this distance.
constexpr double typical_distance_m = 2.0;
/// Fewest directions from which a pose, gain and offset are fitted.
constexpr std::size_t min_directions = 16;
/// Damping of the steps, so that unknowns that do not affect the line do not change.
constexpr double fit_damping = 1e-3;
/// Longest step, beyond which smoothed lines are no longer linear.
constexpr double max_step_m = 0.25;
constexpr double max_step_rad = 0.2;
/// Length of the extrapolated section at either end, over the distance of the last two lines.
constexpr double extension = 0.5;

/// Returns the path with a pose before its first and one after its last.
std::vector<Pose2> extend_path(std::span<const Pose2> poses) {
  if (poses.size() < 2) return {};
  const auto extrapolate = [](const Pose2& end, const Pose2& inner) {
    return Pose2{end.x_m + extension * (end.x_m - inner.x_m),
                 end.y_m + extension * (end.y_m - inner.y_m), end.heading_rad};
  };
  std::vector<Pose2> extended{extrapolate(poses[0], poses[1])};
  extended.insert(extended.end(), poses.begin(), poses.end());
  extended.push_back(extrapolate(poses.back(), poses[poses.size() - 2]));
  return extended;
}

/// Returns the line of the pose at `index` in the extended path, in the world's frame.
std::vector<float> make_extended_line(const RoutePanorama& route, std::size_t index) {
  const std::size_t end = std::clamp<std::size_t>(index, 1, route.size()) - 1;
  auto line = world_line(route, end);
  if (index == end + 1) return line;
  const auto inner = world_line(route, index == 0 ? 1 : end - 1);
  for (std::size_t c = 0; c < line.size(); ++c)
    line[c] += static_cast<float>(extension) * (line[c] - inner[c]);
  return line;
}

}  // namespace

/// One direction: the values of the route and of the line, and their derivatives.
struct RouteLines::Term {
  float expected = 0.0F;
  float expected_by_x = 0.0F;  // per metre
  float expected_by_y = 0.0F;
  float measured = 0.0F;
  float measured_by_heading = 0.0F;  // per radian, with the sign of the residual
  std::uint32_t direction = 0;
};

/// The normal equations of all directions. Residuals: expected - gain * measured - offset.
struct RouteLines::Linearised {
  Equations equations;
  double gain = 1.0;
  double offset = 0.0;
  double noise = 0.0;      // standard deviation of a residual, by the median
  double variance = 0.0;   // of a residual, robust
  double deviation = 0.0;  // of the expected values
  double correlation = 0.0;

  /// Returns the `autocorrelation_factor` of the residuals: lines differ in whole surfaces.
  [[nodiscard]] double correlation_factor(const std::vector<Term>& terms,
                                          std::size_t columns) const;
  /// Returns the equations of these terms; nullopt where a line has no structure.
  static std::optional<Linearised> make(const std::vector<Term>& terms, bool robust);

 private:
  double mean_measured_ = 0.0;
  double mean_expected_ = 0.0;

  [[nodiscard]] bool fit_gain_and_offset(const std::vector<Term>& terms);
  void estimate_noise(const std::vector<Term>& terms);
  void set_equations(const std::vector<Term>& terms, bool robust);
  [[nodiscard]] double residual(const Term& term) const {
    return static_cast<double>(term.expected) - gain * static_cast<double>(term.measured) - offset;
  }
};

/// The fit at one level as a problem for `minimise`.
class RouteLines::FitProblem {
 public:
  FitProblem(const RouteLines& route, const Level& level, std::span<const float> line,
             const LineWindow& window, Pose2& pose)
      : route_(route),
        level_(level),
        line_(smooth_line(line, level.sigma)),
        window_(window),
        pose_(pose),
        settled_tolerance_(&level == &route.levels_.back()
                               ? 3e-4
                               : 0.05 * typical_distance_m * route_.options_.metre * level.sigma *
                                     2.0 * std::numbers::pi / route.columns_) {}

  /// Returns the equations at the present pose.
  [[nodiscard]] std::optional<Linearised> compute_equations() {
    if (!route_.collect_terms(level_, line_, pose_, window_, terms_)) return std::nullopt;
    return Linearised::make(terms_, route_.options_.robust);
  }
  bool linearise(Equations& equations) {
    const auto made = compute_equations();
    if (made) equations = made->equations;
    return made.has_value();
  }
  bool move(const Equations::Vector& change) {
    const double length_m = std::hypot(change[0], change[1]);
    const double scale =
        std::min({1.0, max_step_m * route_.options_.metre / std::max(1e-12, length_m),
                  max_step_rad / std::max(1e-12, std::abs(change[2]))});
    pose_.x_m += scale * change[0];
    pose_.y_m += scale * change[1];
    pose_.heading_rad = wrap_angle(pose_.heading_rad + scale * change[2]);
    return length_m < settled_tolerance_ && std::abs(change[2]) < settled_tolerance_;
  }

 private:
  const RouteLines& route_;
  const Level& level_;
  std::vector<float> line_;
  const LineWindow& window_;
  Pose2& pose_;
  double settled_tolerance_;  // in metres and radians
  std::vector<Term> terms_;
};

void visit_options(RouteFitOptions& options, OptionVisitor& visitor) {
  using T = RouteFitOptions;
  constexpr OptionTable table{
      option<&T::coarse_deg>("width of the filter that smooths the lines at the first level", 0,
                             45),
      option<&T::levels>("number of levels from coarse to fine", 1, 8),
      option<&T::max_steps>("largest number of steps at each level", 1, 100),
      option<&T::reach_m>(
          "largest distance from the predicted position at which lines are compared", 0.1, 1000),
      option<&T::robust>("reduce the weight of changed parts of the scene"),
      no_option<&T::metre>("set by the unit of the route"),
  };
  table.visit(options, visitor);
}

RouteLines::RouteLines(const RoutePanorama& route, const RouteFitOptions& options)
    : columns_(route.columns()),
      options_(options),
      poses_(route.poses().begin(), route.poses().end()),
      path_(extend_path(poses_)) {
  validate(options);
  if (route.size() < 2) {
    throw ContractError("lines of the route", static_cast<double>(route.size()), "2 or more");
  }
  const double spacing_m = route.length_m() / static_cast<double>(route.size() - 1);
  for (int i = 0; i < options.levels; ++i) {
    Level level;
    // Each level is smoothed a third as much as the previous one, the last not at all.
    if (i + 1 < options.levels) {
      level.sigma = options.coarse_deg * columns_ / 360.0 / std::pow(3.0, i);
    }
    const double sigma_rad = level.sigma * 2.0 * std::numbers::pi / columns_;
    level.half_slope = static_cast<std::size_t>(
        std::lround(typical_distance_m * options_.metre * sigma_rad / (2.0 * spacing_m)));
    // Two columns per standard deviation of the smoothing preserve all remaining structure.
    while (2.0 * static_cast<double>(2 * level.stride) <= level.sigma &&
           static_cast<std::size_t>(columns_) % (2 * level.stride) == 0) {
      level.stride *= 2;
    }
    level.directions = equal_directions(static_cast<std::size_t>(columns_) / level.stride);
    levels_.push_back(std::move(level));
  }
  for (std::size_t i = 0; i < route.size() + 2; ++i) {
    const auto line = make_extended_line(route, i);
    for (Level& level : levels_) {
      const auto smooth = smooth_line(line, level.sigma);
      level.values.insert(level.values.end(), smooth.begin(), smooth.end());
    }
  }
}

bool RouteLines::collect_terms(const Level& level, std::span<const float> line, const Pose2& pose,
                               const LineWindow& window, std::vector<Term>& terms) const {
  const auto crossings = find_crossings_in(window, pose.position(), level.directions);
  const double columns_per_rad = columns_ / (2.0 * std::numbers::pi);
  const double rotation = pose.heading_rad * columns_per_rad;
  const auto row = [&](std::size_t i) {
    return level.values.data() + i * static_cast<std::size_t>(columns_);
  };
  terms.clear();
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    const RouteCrossing& crossing = crossings[k];
    if (crossing.along < 0.0F) continue;
    const std::size_t c = k * level.stride;
    const auto before = std::min(static_cast<std::size_t>(crossing.along), poses_.size());
    const std::size_t low = before >= level.half_slope ? before - level.half_slope : 0;
    const std::size_t high = std::min(before + 1 + level.half_slope, poses_.size() + 1);
    const float slope = (row(high)[c] - row(low)[c]) / static_cast<float>(high - low);
    const LineSample at = sample_line(line, static_cast<double>(c) - rotation);
    terms.push_back({expected_value(level, crossing.along, c), slope * crossing.along_by_x,
                     slope * crossing.along_by_y, at.value,
                     at.slope * static_cast<float>(columns_per_rad),
                     static_cast<std::uint32_t>(c)});
  }
  return terms.size() >= min_directions;
}

bool RouteLines::Linearised::fit_gain_and_offset(const std::vector<Term>& terms) {
  const auto n = static_cast<double>(terms.size());
  double measured = 0.0;
  double expected = 0.0;
  for (const Term& term : terms) {
    measured += static_cast<double>(term.measured) / n;
    expected += static_cast<double>(term.expected) / n;
  }
  double measured_square = 0.0;
  double expected_square = 0.0;
  double product = 0.0;
  for (const Term& term : terms) {
    const double x = static_cast<double>(term.measured) - measured;
    const double y = static_cast<double>(term.expected) - expected;
    measured_square += x * x / n;
    expected_square += y * y / n;
    product += x * y / n;
  }
  constexpr double min_variance = 1e-8;
  if (measured_square < min_variance || expected_square < min_variance) return false;
  // The gain of the light changes by a small factor at most, and is never negative.
  gain = std::clamp(product / measured_square, 0.2, 5.0);
  offset = expected - gain * measured;
  deviation = std::sqrt(expected_square);
  mean_measured_ = measured;
  mean_expected_ = expected;
  return true;
}

void RouteLines::Linearised::estimate_noise(const std::vector<Term>& terms) {
  std::vector<float> absolute_residuals;
  absolute_residuals.reserve(terms.size());
  for (const Term& term : terms)
    absolute_residuals.push_back(std::abs(static_cast<float>(residual(term))));
  noise = std::max(
      min_noise,
      sigma_over_mad * static_cast<double>(upper_median_in_place(std::span(absolute_residuals))));
}

void RouteLines::Linearised::set_equations(const std::vector<Term>& terms, bool robust) {
  std::array<double, 25> lower{};  // half of the matrix, row by row
  std::array<double, 5> sums{};
  double left = 0.0;
  double weights = 0.0;
  double x = 0.0;
  double y = 0.0;
  double xx = 0.0;
  double yy = 0.0;
  double xy = 0.0;
  for (const Term& term : terms) {
    const double off = residual(term);
    // Cauchy's weight: more than three standard deviations are likely a change of the scene.
    const double ratio = off / (3.0 * noise);
    const double weight = robust ? 1.0 / (1.0 + ratio * ratio) : 1.0;
    const std::array<double, 5> slope{static_cast<double>(term.expected_by_x),
                                      static_cast<double>(term.expected_by_y),
                                      gain * static_cast<double>(term.measured_by_heading),
                                      -static_cast<double>(term.measured), -1.0};
    for (std::size_t i = 0; i < slope.size(); ++i) {
      const double weighted = weight * slope[i];
      sums[i] -= off * weighted;
      for (std::size_t j = 0; j <= i; ++j) lower[5 * i + j] += weighted * slope[j];
    }
    left += weight * off * off;
    weights += weight;
    const double a = static_cast<double>(term.measured) - mean_measured_;
    const double b = static_cast<double>(term.expected) - mean_expected_;
    x += weight * a;
    y += weight * b;
    xx += weight * a * a;
    yy += weight * b * b;
    xy += weight * a * b;
  }
  const double within = (xx - x * x / weights) * (yy - y * y / weights);
  correlation = within > 0.0 ? (xy - x * y / weights) / std::sqrt(within) : 0.0;
  for (Eigen::Index i = 0; i < 5; ++i) {
    equations.right[i] = sums[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j <= i; ++j) {
      equations.matrix(i, j) = equations.matrix(j, i) = lower[static_cast<std::size_t>(5 * i + j)];
    }
  }
  constexpr double rounding_variance = min_noise * min_noise / 12.0;  // of bytes
  variance = std::max(left / weights, rounding_variance);
}

double RouteLines::Linearised::correlation_factor(const std::vector<Term>& terms,
                                                  std::size_t columns) const {
  std::vector<double> bounded(columns, 0.0);  // residuals by column; 0 where there is none
  for (const Term& term : terms) {
    const double off = residual(term);  // bounded as by the weights of the equations
    bounded[term.direction] = off / (1.0 + std::pow(off / (3.0 * noise), 2.0));
  }
  return autocorrelation_factor(bounded, correlated_share);
}

std::optional<RouteLines::Linearised> RouteLines::Linearised::make(const std::vector<Term>& terms,
                                                                   bool robust) {
  Linearised result;
  if (!result.fit_gain_and_offset(terms)) return std::nullopt;
  result.estimate_noise(terms);
  result.set_equations(terms, robust);
  return result;
}

// Returns for each direction in the world the distance of the measured value from the range of
// expected values within `shift` columns, or of the expected value from the range of measured ones,
// whichever is less; NaN where the path is not crossed.
std::vector<float> RouteLines::shift_tolerant_residuals(const std::vector<Term>& terms,
                                                        std::size_t columns, double gain,
                                                        double offset, int shift) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> expected(columns, none);
  std::vector<float> measured(columns, none);
  for (const Term& term : terms) {
    expected[term.direction] = term.expected;
    measured[term.direction] =
        static_cast<float>(gain * static_cast<double>(term.measured) + offset);
  }
  const auto outside = [&](const std::vector<float>& values, const std::vector<float>& others,
                           std::size_t c) {
    float low = others[c];
    float high = others[c];
    for (int k = -shift; k <= shift; ++k) {
      const auto size = static_cast<long long>(columns);
      const auto i = static_cast<std::size_t>((static_cast<long long>(c) + k + size) % size);
      if (!std::isfinite(others[i])) continue;
      low = std::min(low, others[i]);
      high = std::max(high, others[i]);
    }
    return std::max({0.0F, low - values[c], values[c] - high});
  };
  std::vector<float> left(columns, none);
  for (const Term& term : terms) {
    const std::size_t c = term.direction;
    left[c] = std::min(outside(measured, expected, c), outside(expected, measured, c));
  }
  return left;
}

std::array<double, RouteFix::detail_scales_deg.size()> RouteLines::correlate_details(
    const std::vector<Term>& terms, std::size_t columns) {
  std::vector<float> expected(columns, 0.0F);
  std::vector<float> measured(columns, 0.0F);
  std::vector<std::size_t> compared;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Term& left = terms[i];
    const Term& right = terms[(i + 1) % terms.size()];
    if ((left.direction + 1) % columns != right.direction) continue;
    expected[left.direction] = right.expected - left.expected;
    measured[left.direction] = right.measured - left.measured;
    compared.push_back(left.direction);
  }
  std::array<double, RouteFix::detail_scales_deg.size()> correlations{};
  for (std::size_t scale = 0; scale < correlations.size(); ++scale) {
    const double sigma = RouteFix::detail_scales_deg[scale] * static_cast<double>(columns) / 360.0;
    const auto xs = smooth_line(expected, sigma);
    const auto ys = smooth_line(measured, sigma);
    double xx = 0.0;
    double yy = 0.0;
    double xy = 0.0;
    for (const std::size_t c : compared) {
      const auto x = static_cast<double>(xs[c]);
      const auto y = static_cast<double>(ys[c]);
      xx += x * x;
      yy += y * y;
      xy += x * y;
    }
    if (xx > 0.0 && yy > 0.0) correlations[scale] = xy / std::sqrt(xx * yy);
  }
  return correlations;
}

void RouteLines::check_line(std::span<const float> line) const {
  if (line.size() == static_cast<std::size_t>(columns_)) return;
  throw ContractError("values of the line", static_cast<double>(line.size()),
                      std::to_string(columns_));
}

std::optional<RouteFix> RouteLines::fit(std::span<const float> line, const Pose2& predicted) const {
  check_line(line);
  const auto window = find_window(predicted.position());
  if (!window) return std::nullopt;
  const auto minimise_at = [&](const Level& level, Pose2& pose) {
    FitProblem problem(*this, level, line, *window, pose);
    Equations equations;
    return minimise(problem, equations, {.max_steps = options_.max_steps, .damping = fit_damping})
        .solvable;
  };
  std::optional<Linearised> best;
  Pose2 pose;
  const auto fit_last_level = [&](Pose2 start) {
    const Level& level = levels_.back();
    if (!minimise_at(level, start)) return;
    const auto fitted = FitProblem(*this, level, line, *window, start).compute_equations();
    if (!fitted || (best && fitted->correlation <= best->correlation)) return;
    best = fitted;
    pose = start;
  };
  // Smoothed lines converge from far away, but may end at a wrong pose, as near things blend with
  // far ones behind them. Lines that are not smoothed converge from a good prediction. Both are
  // tried, and the fit with the better correlation is used.
  fit_last_level(predicted);
  Pose2 coarse = predicted;
  const auto coarse_levels = std::span(levels_).first(levels_.size() - 1);
  if (!coarse_levels.empty() &&
      std::ranges::all_of(coarse_levels, [&](const Level& l) { return minimise_at(l, coarse); })) {
    // Below these differences both fits would end at the same pose.
    const double same_m = 0.01 * options_.metre;
    constexpr double same_rad = 0.01;
    const bool is_same =
        best && distance(coarse.position(), pose.position()) < same_m &&
        std::abs(angle_difference(coarse.heading_rad, pose.heading_rad)) < same_rad;
    if (!is_same) fit_last_level(coarse);
  }
  if (!best) return std::nullopt;
  return make_fix(line, pose, *best, *window);
}

std::optional<RouteLines::Candidate> RouteLines::fit_coarsely(std::span<const float> line,
                                                              const Pose2& predicted) const {
  check_line(line);
  const auto window = find_window(predicted.position());
  if (!window) return std::nullopt;
  Pose2 pose = predicted;
  FitProblem problem(*this, levels_.front(), line, *window, pose);
  Equations equations;
  const LeastSquaresOptions search{.max_steps = options_.max_steps, .damping = fit_damping};
  if (!minimise(problem, equations, search).solvable) return std::nullopt;
  const auto fitted = problem.compute_equations();
  if (!fitted) return std::nullopt;
  return Candidate{pose, fitted->correlation};
}

std::optional<RouteFix> RouteLines::make_fix(std::span<const float> line, const Pose2& pose,
                                             const Linearised& fitted,
                                             const LineWindow& window) const {
  const Equations::Matrix inverse =
      fitted.equations.matrix.ldlt().solve(Equations::Matrix::Identity());
  if (!inverse.allFinite()) return std::nullopt;
  std::vector<Term> terms;
  static_cast<void>(
      collect_terms(levels_.back(), smooth_line(line, levels_.back().sigma), pose, window, terms));
  RouteFix fix;
  fix.pose = pose;
  fix.columns = static_cast<int>(terms.size());
  fix.correlation = fitted.correlation;
  fix.detail_correlations = correlate_details(terms, line.size());
  fix.residual = std::sqrt(fitted.variance) / fitted.deviation;
  const double variance = fitted.variance * fitted.correlation_factor(terms, line.size());
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      fix.covariance[3 * i + j] =
          variance * inverse(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  fix.noise = fitted.noise;
  const int shift = std::max(1, columns_ / 360);
  const double rotation = fix.pose.heading_rad * columns_ / (2.0 * std::numbers::pi);
  const auto residuals =
      shift_tolerant_residuals(terms, line.size(), fitted.gain, fitted.offset, shift);
  fix.unexplained.resize(line.size());
  for (std::size_t c = 0; c < residuals.size(); ++c) {
    const auto size = static_cast<long long>(line.size());
    const long long at = (std::llround(static_cast<double>(c) - rotation) % size + size) % size;
    fix.unexplained[static_cast<std::size_t>(at)] = residuals[c];
  }
  return fix;
}

}  // namespace panonav
