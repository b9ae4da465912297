#include "panonav/route/route_fit.hpp"

#include <Eigen/Cholesky>
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
#include "panonav/motion/path.hpp"
#include "panonav/route/horizon_scanline.hpp"
#include "panonav/route/internal/line_sampling.hpp"

namespace panonav {

namespace {

// Unknowns: x, y, heading, gain, offset.
using Matrix = Eigen::Matrix<double, 5, 5>;
using Vector = Eigen::Matrix<double, 5, 1>;

// Things are a few metres away; smoothing by an angle is smoothing by this over it along the path.
constexpr double usual_distance_m = 2.0;

// With fewer directions three numbers are not worth asking for.
constexpr std::size_t min_directions = 16;

// A grey level: lines are bytes.
constexpr double min_noise = 1.0 / 255.0;

// Standard deviations of a Gaussian for the median of its absolute values.
constexpr double deviations_per_median = 1.4826;

}  // namespace

// One direction: what the route shows there, what the line shows, and how both change.
struct RouteLines::Term {
  float shown = 0.0F;
  float shown_x = 0.0F;  // per metre
  float shown_y = 0.0F;
  float seen = 0.0F;
  float seen_turn = 0.0F;  // per radian of heading, with the sign of the residual
  std::uint32_t direction = 0;
};

// The normal equations of all directions: differences are what the route shows less gain times what
// is seen less offset.
struct RouteLines::Linearised {
  Matrix matrix = Matrix::Zero();
  Vector right = Vector::Zero();
  double gain = 1.0;
  double offset = 0.0;
  double noise = 0.0;      // deviation of a difference, by the median
  double variance = 0.0;   // of a difference, robust
  double deviation = 0.0;  // of what the route shows
  double correlation = 0.0;

  // Returns the equations at these terms; empty where a line has no structure.
  static std::optional<Linearised> at(const std::vector<Term>& terms, bool robust,
                                      std::vector<float>& scratch);

 private:
  double mean_seen_ = 0.0;
  double mean_shown_ = 0.0;

  [[nodiscard]] bool set_light(const std::vector<Term>& terms);
  void set_noise(const std::vector<Term>& terms, std::vector<float>& scratch);
  void set_equations(const std::vector<Term>& terms, bool robust);
  [[nodiscard]] double difference(const Term& term) const {
    return static_cast<double>(term.shown) - gain * static_cast<double>(term.seen) - offset;
  }
};

// What a fit writes over and over.
struct RouteLines::Workspace {
  std::vector<float> seen;
  std::vector<RouteCrossing> crossings;
  std::vector<Term> terms;
  std::vector<float> scratch;
};

void visit_options(RouteFitOptions& options, OptionVisitor& visitor) {
  using T = RouteFitOptions;
  constexpr OptionTable table{
      option<&T::coarse_deg>("smoothing of the lines where a fit starts", 0, 45),
      option<&T::levels>("number of levels from coarse to fine", 1, 8),
      option<&T::max_steps>("steps at each level", 1, 100),
      option<&T::reach_m>("distance from the prediction beyond which lines are not compared", 0.1,
                          1000),
      option<&T::robust>("give changed parts of the scene less weight"),
  };
  table.visit(options, visitor);
}

RouteLines::RouteLines(const RoutePanorama& route, const RouteFitOptions& options)
    : columns_(route.columns()),
      options_(options),
      poses_(route.poses().begin(), route.poses().end()) {
  validate(options);
  if (route.size() < 2) {
    throw ContractError("lines of the route", static_cast<double>(route.size()), "2 or more");
  }
  const double spacing_m = route.length_m() / static_cast<double>(route.size() - 1);
  for (int i = 0; i < options.levels; ++i) {
    Level level;
    // Each a third as smooth as the one before, the last not at all.
    if (i + 1 < options.levels) {
      level.sigma = options.coarse_deg * columns_ / 360.0 / std::pow(3.0, i);
    }
    const double sigma_rad = level.sigma * 2.0 * std::numbers::pi / columns_;
    level.half_slope =
        static_cast<std::size_t>(std::lround(usual_distance_m * sigma_rad / (2.0 * spacing_m)));
    // Two a standard deviation show all that is left of a line.
    while (2.0 * static_cast<double>(2 * level.stride) <= level.sigma &&
           static_cast<std::size_t>(columns_) % (2 * level.stride) == 0) {
      level.stride *= 2;
    }
    level.directions = equal_directions(static_cast<std::size_t>(columns_) / level.stride);
    levels_.push_back(std::move(level));
  }
  for (std::size_t i = 0; i < route.size(); ++i) {
    const auto turned = world_line(route, i);
    for (Level& level : levels_) {
      const auto smooth = smooth_line(turned, level.sigma);
      level.values.insert(level.values.end(), smooth.begin(), smooth.end());
    }
  }
}

std::optional<RouteLines::Window> RouteLines::window(Point2 position) const {
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const double off = distance(poses_[i].position(), position);
    if (off < least) {
      least = off;
      nearest = i;
    }
  }
  if (!(least < options_.reach_m)) return std::nullopt;
  const auto in_reach = [&](std::size_t i) {
    return distance(poses_[i].position(), position) < options_.reach_m;
  };
  Window found{nearest, nearest + 1};
  while (found.begin > 0 && in_reach(found.begin - 1)) --found.begin;
  while (found.end < poses_.size() && in_reach(found.end)) ++found.end;
  if (found.end - found.begin < 2) return std::nullopt;
  return found;
}

float RouteLines::shown(const Level& level, float along, std::size_t column) const noexcept {
  const auto before = std::min(static_cast<std::size_t>(along), poses_.size() - 2);
  const float share = along - static_cast<float>(before);
  const float* const at =
      level.values.data() + before * static_cast<std::size_t>(columns_) + column;
  return at[0] + share * (at[columns_] - at[0]);
}

bool RouteLines::collect(const Level& level, std::span<const float> seen, const Pose2& pose,
                         const Window& window, std::vector<RouteCrossing>& crossings,
                         std::vector<Term>& terms) const {
  crossings.resize(level.directions.size());
  find_crossings(std::span(poses_).subspan(window.begin, window.end - window.begin), window.begin,
                 pose.position(), level.directions, crossings);
  const double columns_per_rad = columns_ / (2.0 * std::numbers::pi);
  const double turn = pose.heading_rad * columns_per_rad;
  const auto row = [&](std::size_t line) {
    return level.values.data() + line * static_cast<std::size_t>(columns_);
  };
  terms.clear();
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    const RouteCrossing& crossing = crossings[k];
    if (crossing.along < 0.0F) continue;
    const std::size_t c = k * level.stride;
    const auto before = std::min(static_cast<std::size_t>(crossing.along), poses_.size() - 2);
    const std::size_t low = before >= level.half_slope ? before - level.half_slope : 0;
    const std::size_t high = std::min(before + 1 + level.half_slope, poses_.size() - 1);
    const float along = (row(high)[c] - row(low)[c]) / static_cast<float>(high - low);
    const LineSample at = sample_line(seen, static_cast<double>(c) - turn);
    terms.push_back(
        {shown(level, crossing.along, c), along * crossing.along_by_x, along * crossing.along_by_y,
         at.value, at.slope * static_cast<float>(columns_per_rad), static_cast<std::uint32_t>(c)});
  }
  return terms.size() >= min_directions;
}

bool RouteLines::Linearised::set_light(const std::vector<Term>& terms) {
  const auto n = static_cast<double>(terms.size());
  double seen = 0.0;
  double shown = 0.0;
  for (const Term& term : terms) {
    seen += static_cast<double>(term.seen) / n;
    shown += static_cast<double>(term.shown) / n;
  }
  double seen_square = 0.0;
  double shown_square = 0.0;
  double product = 0.0;
  for (const Term& term : terms) {
    const double x = static_cast<double>(term.seen) - seen;
    const double y = static_cast<double>(term.shown) - shown;
    seen_square += x * x / n;
    shown_square += y * y / n;
    product += x * y / n;
  }
  constexpr double min_variance = 1e-8;
  if (seen_square < min_variance || shown_square < min_variance) return false;
  // Another light is a factor of a few at most, and never turns black into white.
  gain = std::clamp(product / seen_square, 0.2, 5.0);
  offset = shown - gain * seen;
  deviation = std::sqrt(shown_square);
  mean_seen_ = seen;
  mean_shown_ = shown;
  return true;
}

void RouteLines::Linearised::set_noise(const std::vector<Term>& terms,
                                       std::vector<float>& scratch) {
  scratch.clear();
  for (const Term& term : terms) scratch.push_back(std::abs(static_cast<float>(difference(term))));
  noise = std::max(min_noise, deviations_per_median *
                                  static_cast<double>(upper_median_in_place(std::span(scratch))));
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
    const double off = difference(term);
    // Cauchy's weight; three deviations are usual, more are likely a change of the scene.
    const double ratio = off / (3.0 * noise);
    const double weight = robust ? 1.0 / (1.0 + ratio * ratio) : 1.0;
    const std::array<double, 5> slope{
        static_cast<double>(term.shown_x), static_cast<double>(term.shown_y),
        gain * static_cast<double>(term.seen_turn), -static_cast<double>(term.seen), -1.0};
    for (std::size_t i = 0; i < slope.size(); ++i) {
      const double weighted = weight * slope[i];
      sums[i] -= off * weighted;
      for (std::size_t j = 0; j <= i; ++j) lower[5 * i + j] += weighted * slope[j];
    }
    left += weight * off * off;
    weights += weight;
    const double a = static_cast<double>(term.seen) - mean_seen_;
    const double b = static_cast<double>(term.shown) - mean_shown_;
    x += weight * a;
    y += weight * b;
    xx += weight * a * a;
    yy += weight * b * b;
    xy += weight * a * b;
  }
  const double within = (xx - x * x / weights) * (yy - y * y / weights);
  correlation = within > 0.0 ? (xy - x * y / weights) / std::sqrt(within) : 0.0;
  for (Eigen::Index i = 0; i < 5; ++i) {
    right[i] = sums[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j <= i; ++j) {
      matrix(i, j) = matrix(j, i) = lower[static_cast<std::size_t>(5 * i + j)];
    }
  }
  constexpr double rounding_variance = min_noise * min_noise / 12.0;  // of bytes
  variance = std::max(left / weights, rounding_variance);
}

std::optional<RouteLines::Linearised> RouteLines::Linearised::at(const std::vector<Term>& terms,
                                                                 bool robust,
                                                                 std::vector<float>& scratch) {
  Linearised result;
  if (!result.set_light(terms)) return std::nullopt;
  result.set_noise(terms, scratch);
  result.set_equations(terms, robust);
  return result;
}

// By direction in the world: how far what is seen lies outside of all that is shown within `shift`
// columns, or what is shown outside of all that is seen there, whichever is less; NaN where the
// path is not crossed.
std::vector<float> RouteLines::shift_tolerant_residuals(const std::vector<Term>& terms,
                                                        std::size_t columns, double gain,
                                                        double offset, int shift) {
  const float nothing = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> shown(columns, nothing);
  std::vector<float> seen(columns, nothing);
  for (const Term& term : terms) {
    shown[term.direction] = term.shown;
    seen[term.direction] = static_cast<float>(gain * static_cast<double>(term.seen) + offset);
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
  std::vector<float> left(columns, nothing);
  for (const Term& term : terms) {
    const std::size_t c = term.direction;
    left[c] = std::min(outside(seen, shown, c), outside(shown, seen, c));
  }
  return left;
}

// Gauss-Newton from level to level.
bool RouteLines::descend(std::span<const Level> levels, std::span<const float> line,
                         const Window& near, Workspace& work, Pose2& pose) const {
  for (const Level& level : levels) {
    work.seen = smooth_line(line, level.sigma);
    const bool last = &level == &levels_.back();
    const double near_enough_m =
        last ? 3e-4 : 0.05 * usual_distance_m * level.sigma * 2.0 * std::numbers::pi / columns_;
    for (int step = 0; step < options_.max_steps; ++step) {
      if (!collect(level, work.seen, pose, near, work.crossings, work.terms)) return false;
      const auto normal = Linearised::at(work.terms, options_.robust, work.scratch);
      if (!normal) return false;
      // A little damping: directions in which nothing changes stay where they are.
      Matrix damped = normal->matrix;
      damped.diagonal() *= 1.0 + 1e-3;
      const Vector change = damped.ldlt().solve(normal->right);
      if (!change.allFinite()) return false;
      // No step is longer than what smoothing lets it see.
      const double length_m = std::hypot(change[0], change[1]);
      const double scale = std::min(
          {1.0, 0.25 / std::max(1e-12, length_m), 0.2 / std::max(1e-12, std::abs(change[2]))});
      pose.x_m += scale * change[0];
      pose.y_m += scale * change[1];
      pose.heading_rad = wrap_angle(pose.heading_rad + scale * change[2]);
      if (length_m < near_enough_m && std::abs(change[2]) < near_enough_m) break;
    }
  }
  return true;
}

std::optional<RouteFix> RouteLines::fit(std::span<const float> line, const Pose2& predicted) const {
  if (line.size() != static_cast<std::size_t>(columns_)) {
    throw ContractError("values of the line", static_cast<double>(line.size()),
                        std::to_string(columns_));
  }
  const auto near = window(predicted.position());
  if (!near) return std::nullopt;
  Workspace work;
  work.terms.reserve(line.size());
  work.scratch.reserve(line.size());
  std::optional<Linearised> normal;
  Pose2 pose;
  const auto try_from = [&](std::span<const Level> levels, Pose2 start) {
    if (!descend(levels, line, *near, work, start)) return;
    // `descend` leaves the line as its last level sees it.
    if (!collect(levels_.back(), work.seen, start, *near, work.crossings, work.terms)) return;
    const auto there = Linearised::at(work.terms, options_.robust, work.scratch);
    if (!there || (normal && there->correlation <= normal->correlation)) return;
    normal = there;
    pose = start;
  };
  // Smoothed lines lead from afar, but may lead away: near things and far ones behind them blend.
  // From a good prediction the lines themselves find their way. What explains more is believed.
  const std::span<const Level> levels(levels_);
  try_from(levels.last(1), predicted);
  Pose2 coarse = predicted;
  if (levels.size() > 1 && descend(levels.first(levels.size() - 1), line, *near, work, coarse)) {
    // So near to each other both end at the same place.
    constexpr double same_m = 0.01;
    constexpr double same_rad = 0.01;
    const bool same = normal && distance(coarse.position(), pose.position()) < same_m &&
                      std::abs(angle_difference(coarse.heading_rad, pose.heading_rad)) < same_rad;
    if (!same) try_from(levels.last(1), coarse);
  }
  if (!normal) return std::nullopt;
  return described(line, pose, *normal, *near, work);
}

std::optional<RouteFix> RouteLines::described(std::span<const float> line, const Pose2& pose,
                                              const Linearised& normal, const Window& near,
                                              Workspace& work) const {
  const Matrix inverse = normal.matrix.ldlt().solve(Matrix::Identity());
  if (!inverse.allFinite()) return std::nullopt;
  work.seen = smooth_line(line, levels_.back().sigma);
  static_cast<void>(collect(levels_.back(), work.seen, pose, near, work.crossings, work.terms));
  RouteFix fix;
  fix.pose = pose;
  fix.columns = static_cast<int>(work.terms.size());
  fix.correlation = normal.correlation;
  fix.residual = std::sqrt(normal.variance) / normal.deviation;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      fix.covariance[3 * i + j] =
          normal.variance * inverse(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  fix.noise = normal.noise;
  const int shift = std::max(1, columns_ / 360);
  const double turn = fix.pose.heading_rad * columns_ / (2.0 * std::numbers::pi);
  const auto left =
      shift_tolerant_residuals(work.terms, line.size(), normal.gain, normal.offset, shift);
  fix.unexplained.resize(line.size());
  for (std::size_t c = 0; c < left.size(); ++c) {
    const auto size = static_cast<long long>(line.size());
    const long long at = (std::llround(static_cast<double>(c) - turn) % size + size) % size;
    fix.unexplained[static_cast<std::size_t>(at)] = left[c];
  }
  return fix;
}

std::vector<float> RouteLines::synthesise(const Pose2& pose) const {
  const float nothing = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> line(static_cast<std::size_t>(columns_), nothing);
  const auto near = window(pose.position());
  if (!near) return line;
  std::vector<RouteCrossing> crossings(line.size());
  find_crossings(std::span(poses_).subspan(near->begin, near->end - near->begin), near->begin,
                 pose.position(), levels_.back().directions, crossings);
  std::vector<float> world(line.size(), nothing);
  for (std::size_t c = 0; c < line.size(); ++c) {
    if (crossings[c].along >= 0.0F) world[c] = shown(levels_.back(), crossings[c].along, c);
  }
  const double turn = pose.heading_rad * columns_ / (2.0 * std::numbers::pi);
  for (std::size_t c = 0; c < line.size(); ++c) {
    line[c] = sample_line(world, static_cast<double>(c) + turn).value;
  }
  return line;
}

}  // namespace panonav
