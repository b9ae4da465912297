#include "lab/y03/route_contours.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/horizon_scanline.hpp"

namespace panonav::lab {

namespace {

std::vector<float> compute_slopes(std::span<const float> line) {
  std::vector<float> result(line.size());
  for (std::size_t c = 0; c < line.size(); ++c) {
    const float left = line[(c + line.size() - 1) % line.size()];
    const float right = line[(c + 1) % line.size()];
    result[c] = 0.5F * (right - left);
  }
  return result;
}

// Returns the columns of local maxima of the absolute slope above its mean; at most the `max_count`
// strongest.
std::vector<int> find_edge_columns(std::span<const float> edges, int max_count) {
  double mean = 0.0;
  for (const float edge : edges)
    mean += static_cast<double>(std::abs(edge)) / static_cast<double>(edges.size());
  std::vector<int> columns;
  const std::size_t size = edges.size();
  for (std::size_t c = 0; c < size; ++c) {
    const float here = std::abs(edges[c]);
    if (static_cast<double>(here) <= mean) continue;
    if (here < std::abs(edges[(c + size - 1) % size]) || here < std::abs(edges[(c + 1) % size]))
      continue;
    columns.push_back(static_cast<int>(c));
  }
  std::ranges::stable_sort(columns, std::greater<>{},
                           [&](int c) { return std::abs(edges[static_cast<std::size_t>(c)]); });
  if (columns.size() > static_cast<std::size_t>(max_count))
    columns.resize(static_cast<std::size_t>(max_count));
  std::ranges::sort(columns);
  return columns;
}

// Energies of the dual active contour models [Y03 eq. 6-11]. The paper states no weights; these
// were chosen on lab scenes of seeds 701 to 704. Units: lines along the path,
// columns of azimuth, intensities 0 to 1.
constexpr double tension = 0.002;        // w_alpha, eq. 7
constexpr double rigidity = 0.002;       // w_beta, eq. 7
constexpr double image_weight = 1.0;     // w_diff, eq. 8
constexpr double contour_pull = 0.002;   // w_pull, eq. 10
constexpr double stretch_weight = 0.5;   // w_const, of the squared eq. 11
constexpr double smoothing_deg = 1.0;    // of the lines, before the slopes
constexpr int max_control_points = 120;  // at the strongest edges of the line
constexpr int max_contour_moves = 200;   // iterations of both contours

// Smallest number of control points that determines a pose.
constexpr std::size_t min_points = 8;
// Relative damping of the pose fit, so that a direction that no control point determines does not
// change.
constexpr double pose_damping = 1e-6;

using Vector = Eigen::Vector3d;

double wrap_columns(double columns, double size) {
  return columns - size * std::floor(columns / size + 0.5);
}

}  // namespace

RouteContours::RouteContours(const RoutePanorama& route, double margin_m)
    : columns_(route.columns()),
      margin_m_(margin_m),
      poses_(route.poses().begin(), route.poses().end()),
      directions_(equal_directions(static_cast<std::size_t>(route.columns()))) {
  require(margin_m > 0.0, "margin_m", margin_m, "> 0");
  if (route.size() < 2) {
    throw ContractError("lines of the route", static_cast<double>(route.size()), "2 or more");
  }
  spacing_m_ = route.length_m() / static_cast<double>(route.size() - 1);
  for (std::size_t i = 0; i < route.size(); ++i) {
    const auto line =
        compute_slopes(smooth_line(world_line(route, i), smoothing_deg * columns_ / 360.0));
    edges_.insert(edges_.end(), line.begin(), line.end());
  }
}

float RouteContours::edge(double along, double azimuth) const noexcept {
  const auto size = static_cast<long long>(columns_);
  const double at = std::clamp(along, 0.0, static_cast<double>(poses_.size() - 1));
  const auto row = std::min(static_cast<std::size_t>(at), poses_.size() - 2);
  const auto fy = static_cast<float>(at - static_cast<double>(row));
  const double whole = std::floor(azimuth);
  const auto fx = static_cast<float>(azimuth - whole);
  const auto c0 = static_cast<std::size_t>(((static_cast<long long>(whole) % size) + size) % size);
  const std::size_t c1 = (c0 + 1) % static_cast<std::size_t>(size);
  const float* const a = edges_.data() + row * static_cast<std::size_t>(columns_);
  const float* const b = a + columns_;
  return (1.0F - fy) * ((1.0F - fx) * a[c0] + fx * a[c1]) + fy * ((1.0F - fx) * b[c0] + fx * b[c1]);
}

std::vector<RouteCrossing> RouteContours::predict_curve(Point2 viewpoint) const {
  std::vector<RouteCrossing> crossings(static_cast<std::size_t>(columns_));
  find_crossings(poses_, 0, viewpoint, directions_, crossings);
  return crossings;
}

// Returns the energy of two neighbouring control points [Y03 eq. 7 and 11], which are `interval`
// columns apart in the line. Energies are integrated over azimuth, so that dense control points do
// not weigh more. `next_slope` is the slope to the following control point, NaN if the two are not
// joined.
double RouteContours::pair_energy(const ContourPoint& before, const ContourPoint& at,
                                  double interval, bool joined, double next_slope) const {
  const double slope = (at.along - before.along) / interval;
  const double stretch = wrap_columns(at.azimuth - before.azimuth, columns_) - interval;
  double energy = stretch_weight * stretch * stretch;
  if (joined) energy += 0.5 * tension * slope * slope * interval;
  if (std::isfinite(next_slope)) {
    const double bend = next_slope - slope;
    energy += 0.5 * rigidity * bend * bend * interval;
  }
  return energy;
}

// Moves the contour by dynamic programming: each control point stays or moves to one of its eight
// neighbours; eq. 7 and 11 couple neighbouring control points. The second derivative uses the next
// but one point's position of the last iteration.
void RouteContours::move(std::vector<ContourPoint>& contour, const std::vector<ContourPoint>& other,
                         const std::vector<int>& columns, std::span<const float> edges,
                         const std::vector<bool>& joined, double step) const {
  constexpr std::size_t choices = 9;
  const std::size_t n = contour.size();
  const auto choice = [&](std::size_t i, std::size_t k) {
    const double da = (static_cast<double>(k % 3) - 1.0) * step;
    const double dt = (static_cast<double>(k / 3) - 1.0) * step;
    return ContourPoint{contour[i].azimuth + da, contour[i].along + dt};
  };
  std::vector<std::array<double, choices>> cost(n);
  std::vector<std::array<std::size_t, choices>> from(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto target = edges[static_cast<std::size_t>(columns[i])];
    for (std::size_t k = 0; k < choices; ++k) {
      const ContourPoint at = choice(i, k);
      const double off_azimuth = wrap_columns(other[i].azimuth - at.azimuth, columns_);
      const double off_along = other[i].along - at.along;
      cost[i][k] =
          image_weight * static_cast<double>(std::abs(edge(at.along, at.azimuth) - target));
      cost[i][k] += 0.5 * contour_pull * (off_azimuth * off_azimuth + off_along * off_along);
      if (i == 0) continue;
      const double next_slope =
          joined[i] && i + 1 < n && joined[i + 1]
              ? (contour[i + 1].along - at.along) / static_cast<double>(columns[i + 1] - columns[i])
              : std::numeric_limits<double>::quiet_NaN();
      const auto interval = static_cast<double>(columns[i] - columns[i - 1]);
      double best = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < choices; ++j) {
        const double total =
            cost[i - 1][j] + pair_energy(choice(i - 1, j), at, interval, joined[i], next_slope);
        if (total < best) {
          best = total;
          from[i][k] = j;
        }
      }
      cost[i][k] += best;
    }
  }
  std::size_t k =
      static_cast<std::size_t>(std::ranges::min_element(cost[n - 1]) - cost[n - 1].begin());
  std::vector<ContourPoint> moved(n);
  for (std::size_t i = n; i-- > 0;) {
    moved[i] = choice(i, k);
    if (i > 0) k = from[i][k];
  }
  for (ContourPoint& point : moved) {
    point.along = std::clamp(point.along, 0.0, static_cast<double>(poses_.size() - 1));
  }
  contour = std::move(moved);
}

// One equation of the least squares fit of eq. 5: its difference, weight and gradient.
struct RouteContours::Term {
  double difference, weight;
  Vector slope;
  double deviations = 0.0;  // absolute difference in standard deviations
};

// Returns the equations of the contours' positions along the path [Y03 eq. 5], weighted by the
// accuracy with which an azimuth determines the position.
std::vector<RouteContours::Term> RouteContours::make_path_terms(const RouteContourFix& fix) const {
  const auto size = static_cast<long long>(columns_);
  const double columns_per_rad = columns_ / (2.0 * std::numbers::pi);
  const auto crossings = predict_curve(fix.pose.position());
  std::vector<Term> terms;
  for (std::size_t i = 0; i < fix.columns.size(); ++i) {
    const double azimuth = fix.columns[i] + fix.pose.heading_rad * columns_per_rad;
    const double whole = std::floor(azimuth);
    const double f = azimuth - whole;
    const auto c0 =
        static_cast<std::size_t>(((static_cast<long long>(whole) % size) + size) % size);
    const RouteCrossing& a = crossings[c0];
    const RouteCrossing& b = crossings[(c0 + 1) % static_cast<std::size_t>(size)];
    if (a.along < 0.0F || b.along < 0.0F) continue;
    const auto turn = static_cast<double>(b.along - a.along);  // lines per column
    // Skip jumps from one part of the path to another, and azimuths next to a pole.
    if (std::abs(turn) * spacing_m_ > 1.0) continue;
    const double along = static_cast<double>(a.along) + f * turn;
    const double middle = 0.5 * (fix.first[i].along + fix.second[i].along);
    // Standard deviations: half a line along the path, half a column of azimuth.
    const double variance = 0.25 + 0.25 * turn * turn;
    terms.push_back({middle - along, 1.0 / variance,
                     Vector(static_cast<double>(a.along_by_x), static_cast<double>(a.along_by_y),
                            turn * columns_per_rad),
                     std::abs(middle - along) / std::sqrt(variance)});
  }
  return terms;
}

// Adds the equations of the contours' azimuths for the heading, with a deviation of one column.
// They determine the heading on the path itself, where all lines of sight start at one position and
// eq. 5 does not depend on it.
void RouteContours::add_heading_terms(const RouteContourFix& fix, std::vector<Term>& terms) const {
  const double columns_per_rad = columns_ / (2.0 * std::numbers::pi);
  for (std::size_t i = 0; i < fix.columns.size(); ++i) {
    const double azimuth = fix.columns[i] + fix.pose.heading_rad * columns_per_rad;
    const double middle =
        fix.first[i].azimuth +
        0.5 * wrap_columns(fix.second[i].azimuth - fix.first[i].azimuth, columns_);
    terms.push_back(
        {wrap_columns(middle - azimuth, columns_), 1.0, Vector(0.0, 0.0, columns_per_rad)});
  }
}

// Fills the equations with Cauchy weights and sets residual and covariance of the fix; returns
// false if the terms do not determine a pose.
bool RouteContours::fill_weighted_equations(const std::vector<Term>& terms, std::size_t along_terms,
                                            RouteContourFix& fix,
                                            DenseEquations<3>& equations) const {
  std::vector<double> sizes;
  for (const Term& term : std::span(terms).first(along_terms)) sizes.push_back(term.deviations);
  const double noise = std::max(0.1, 1.4826 * upper_median_in_place(std::span(sizes)));
  equations.set_zero();
  double left = 0.0;
  double weights = 0.0;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Term& term = terms[i];
    const double ratio = term.difference * std::sqrt(term.weight) / (2.0 * noise);
    const double weight = term.weight / (1.0 + ratio * ratio);
    equations.matrix += weight * term.slope * term.slope.transpose();
    equations.right += weight * term.difference * term.slope;
    if (i >= along_terms) continue;
    left += weight * term.difference * term.difference;
    weights += weight;
  }
  fix.residual_m = std::sqrt(left / weights) * spacing_m_;
  Eigen::Matrix3d damped = equations.matrix;
  damped.diagonal() *= 1.0 + pose_damping;
  const Eigen::Matrix3d inverse = damped.ldlt().solve(Eigen::Matrix3d::Identity());
  if (!inverse.allFinite()) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      fix.covariance[3 * i + j] =
          noise * noise * inverse(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return true;
}

bool RouteContours::fit_pose(RouteContourFix& fix) const {
  constexpr int max_moves = 20;
  struct PoseProblem {
    const RouteContours& contours;
    RouteContourFix& fix;
    int moves = 0;

    bool linearise(DenseEquations<3>& equations) const {
      std::vector<Term> terms = contours.make_path_terms(fix);
      const std::size_t along_terms = terms.size();
      if (along_terms < min_points) return false;
      contours.add_heading_terms(fix, terms);
      return contours.fill_weighted_equations(terms, along_terms, fix, equations);
    }
    bool move(const Vector& change) {
      const double length_m = std::hypot(change[0], change[1]);
      if (moves++ == max_moves || (length_m < 1e-5 && std::abs(change[2]) < 1e-6)) return true;
      const double scale = std::min(1.0, 0.1 / std::max(1e-12, length_m));
      fix.pose.x_m += scale * change[0];
      fix.pose.y_m += scale * change[1];
      fix.pose.heading_rad = wrap_angle(fix.pose.heading_rad + scale * change[2]);
      return false;
    }
  } problem{*this, fix};
  DenseEquations<3> equations;
  return minimise(problem, equations, {.max_steps = max_moves + 1, .damping = pose_damping})
      .solvable;
}

std::optional<RouteContourFix> RouteContours::fit(std::span<const float> line,
                                                  const Pose2& predicted) const {
  if (line.size() != static_cast<std::size_t>(columns_)) {
    throw ContractError("values of the line", static_cast<double>(line.size()),
                        std::to_string(columns_));
  }
  const auto edges = compute_slopes(smooth_line(line, smoothing_deg * columns_ / 360.0));
  std::vector<bool> joined;
  RouteContourFix fix = initialise_contours(edges, predicted, joined);
  if (fix.columns.size() < min_points) return std::nullopt;
  converge(fix, edges, joined);
  std::size_t met = 0;
  for (std::size_t i = 0; i < fix.first.size(); ++i) {
    met += std::abs(fix.first[i].along - fix.second[i].along) <= 1.0 ? 1 : 0;
  }
  fix.converged = 5 * met >= 4 * fix.first.size();
  if (!fit_pose(fix)) return std::nullopt;
  return fix;
}

// Places the control points of both contours, `margin_m` ahead of and behind the predicted curve.
// `joined` states for each control point whether it is on the same side of the path as the previous
// one.
RouteContourFix RouteContours::initialise_contours(std::span<const float> edges,
                                                   const Pose2& predicted,
                                                   std::vector<bool>& joined) const {
  const auto crossings = predict_curve(predicted.position());
  const double turn = predicted.heading_rad * columns_ / (2.0 * std::numbers::pi);
  const auto size = static_cast<long long>(columns_);
  RouteContourFix fix;
  fix.pose = predicted;
  const double margin = margin_m_ / spacing_m_;
  bool left = false;
  for (const int column : find_edge_columns(edges, max_control_points)) {
    const double azimuth = column + turn;
    const auto c = static_cast<std::size_t>(((std::llround(azimuth) % size) + size) % size);
    const RouteCrossing& crossing = crossings[c];
    if (crossing.along < 0.0F) continue;
    // Sine of the angle between the line of sight and the path.
    const double sine_to_path =
        1.0 / (spacing_m_ * std::hypot(static_cast<double>(crossing.along_by_x),
                                       static_cast<double>(crossing.along_by_y)));
    if (sine_to_path < std::sin(radians(10.0))) continue;
    const auto along = static_cast<double>(crossing.along);
    const Direction2& direction = directions_[c];
    const bool to_the_left = direction.y * static_cast<double>(crossing.along_by_x) >
                             direction.x * static_cast<double>(crossing.along_by_y);
    joined.push_back(!joined.empty() && to_the_left == left);
    left = to_the_left;
    fix.columns.push_back(column);
    fix.first.push_back({azimuth, along + margin});
    fix.second.push_back({azimuth, along - margin});
  }
  return fix;
}

void RouteContours::converge(RouteContourFix& fix, std::span<const float> edges,
                             const std::vector<bool>& joined) const {
  // Move by one line and column at first, then halve the step whenever nothing moves.
  double step = 1.0;
  for (; fix.iterations < max_contour_moves; ++fix.iterations) {
    const auto first = fix.first;
    const auto second = fix.second;
    move(fix.first, fix.second, fix.columns, edges, joined, step);
    move(fix.second, fix.first, fix.columns, edges, joined, step);
    bool is_unchanged = true;
    for (std::size_t i = 0; i < first.size(); ++i) {
      is_unchanged = is_unchanged && first[i].along == fix.first[i].along &&
                     first[i].azimuth == fix.first[i].azimuth &&
                     second[i].along == fix.second[i].along &&
                     second[i].azimuth == fix.second[i].azimuth;
    }
    if (!is_unchanged) continue;
    if (step < 0.3) break;
    step *= 0.5;
  }
}

}  // namespace panonav::lab
