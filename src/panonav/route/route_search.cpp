// Views that a route predicts, and the search for lines by them.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/horizon_scanline.hpp"
#include "panonav/route/internal/autocorrelation.hpp"
#include "panonav/route/internal/line_sampling.hpp"
#include "panonav/route/route_fit.hpp"

namespace panonav {

namespace {

/// Columns of the coarsest level: smoothing by 8 degrees leaves no finer structure.
constexpr std::size_t coarse_columns = 48;

/// Returns the correlation of two lines of one length over the columns where `expected` is finite;
/// -1 if a line has no structure there.
double correlate(std::span<const float> expected, std::span<const float> line) {
  double n = 0.0;
  double x = 0.0;
  double y = 0.0;
  double xx = 0.0;
  double yy = 0.0;
  double xy = 0.0;
  for (std::size_t c = 0; c < expected.size(); ++c) {
    if (!std::isfinite(expected[c])) continue;
    const auto a = static_cast<double>(expected[c]);
    const auto b = static_cast<double>(line[c]);
    n += 1.0;
    x += a;
    y += b;
    xx += a * a;
    yy += b * b;
    xy += a * b;
  }
  const double vx = xx - x * x / n;
  const double vy = yy - y * y / n;
  return vx > 1e-9 && vy > 1e-9 ? (xy - x * y / n) / std::sqrt(vx * vy) : -1.0;
}

struct Correlation {
  double value = -1.0;
  double rotation = 0.0;  // of the line, in columns
};

/// Returns the maxima of the correlation over all rotations of the line, over columns where
/// `expected` is finite.
std::vector<Correlation> find_rotations(std::span<const float> expected,
                                        std::span<const float> line) {
  const std::size_t size = expected.size();
  // The line and its squares in reverse order of rotation, twice, so that no index wraps.
  std::vector<double> turned(2 * size);
  std::vector<double> squares(2 * size);
  for (std::size_t c = 0; c < turned.size(); ++c) {
    turned[c] = static_cast<double>(line[(2 * size - 1 - c) % size]);
    squares[c] = turned[c] * turned[c];
  }
  // Sums as in `correlate`, for all rotations at once.
  double n = 0.0;
  double x = 0.0;
  double xx = 0.0;
  std::vector<double> y(size, 0.0);
  std::vector<double> yy(size, 0.0);
  std::vector<double> xy(size, 0.0);
  for (std::size_t c = 0; c < size; ++c) {
    if (!std::isfinite(expected[c])) continue;
    const auto a = static_cast<double>(expected[c]);
    n += 1.0;
    x += a;
    xx += a * a;
    // Rotation r compares column c with column c - r of the line.
    const double* const values = turned.data() + (size - 1 - c);
    const double* const value_squares = squares.data() + (size - 1 - c);
    for (std::size_t r = 0; r < size; ++r) {
      y[r] += values[r];
      yy[r] += value_squares[r];
      xy[r] += a * values[r];
    }
  }
  std::vector<double> values(size, -1.0);
  const double vx = xx - x * x / n;
  for (std::size_t r = 0; r < size; ++r) {
    const double vy = yy[r] - y[r] * y[r] / n;
    if (vx > 1e-9 && vy > 1e-9) values[r] = (xy[r] - x * y[r] / n) / std::sqrt(vx * vy);
  }
  std::vector<Correlation> maxima;
  for (std::size_t at = 0; at < size; ++at) {
    const double left = values[(at + size - 1) % size];
    const double right = values[(at + 1) % size];
    if (values[at] <= left || values[at] < right) continue;
    // Interpolates the maximum by a parabola through the highest value and its neighbours.
    const double bend = left - 2.0 * values[at] + right;
    const double shift = bend < -1e-12 ? std::clamp(0.5 * (left - right) / bend, -0.5, 0.5) : 0.0;
    maxima.push_back({values[at], static_cast<double>(at) + shift});
  }
  return maxima;
}

/// Returns the highest of these maxima.
Correlation find_best_rotation(std::span<const float> expected, std::span<const float> line) {
  Correlation best;
  for (const Correlation& maximum : find_rotations(expected, line)) {
    if (maximum.value > best.value) best = maximum;
  }
  return best;
}

/// A view past an end of a route, relative to the view from the end.
struct StepOutward {
  double direction_rad = 0.0;  ///< of the step, in the world
  double length = 0.0;         ///< over the distance of things
  double heading_rad = 0.0;    ///< of the line
};
/// Longest step, up to which the moves of directions are linear in it: chosen.
constexpr double max_step_length = 0.4;
/// Shortest step that the search tells from none: half of its last change of the length.
constexpr double min_step_length = max_step_length / 128.0;

/// Least distance over which the change of the lines before an end shows how far away things are:
/// a tenth of a step at 2.5 m.
constexpr double min_known_step_m = 0.25;

/// Returns the line at the end after a step, in the world's frame.
std::vector<float> move_line(std::span<const float> end, const StepOutward& step,
                             std::size_t columns) {
  const double step_rad = 2.0 * std::numbers::pi / static_cast<double>(columns);
  std::vector<float> moved(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    // A thing in the direction b from the end is seen in b + length sin(b - direction).
    const double seen_rad = static_cast<double>(c) * step_rad;
    double before_rad = seen_rad;
    constexpr int iterations = 4;
    for (int i = 0; i < iterations; ++i) {
      before_rad = seen_rad - step.length * std::sin(before_rad - step.direction_rad);
    }
    const double turns = before_rad / (2.0 * std::numbers::pi);
    moved[c] =
        sample_line(end, (turns - std::floor(turns)) * static_cast<double>(end.size())).value;
  }
  return moved;
}

/// Returns the correlation of a line with the line at the end after a step.
double correlate_past_end(std::span<const float> end, std::span<const float> line,
                          const StepOutward& step, std::size_t columns) {
  const auto moved = move_line(end, step, columns);
  const double rotation = step.heading_rad / (2.0 * std::numbers::pi);
  std::vector<float> turned(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    const double turns = static_cast<double>(c) / static_cast<double>(columns) - rotation;
    turned[c] =
        sample_line(line, (turns - std::floor(turns)) * static_cast<double>(line.size())).value;
  }
  return correlate(moved, turned);
}

/// Returns the step from the end that explains the line best, at the coarsest level. `outward_rad`:
/// direction of the path out of the route.
StepOutward find_step(std::span<const float> end, std::span<const float> coarse_line,
                      double outward_rad) {
  StepOutward best;
  double best_correlation = -2.0;
  constexpr int lengths = 8;
  constexpr int sides = 3;  // to either side of straight outward, up to 45 degrees
  for (int i = 0; i <= lengths; ++i) {
    for (int k = i == 0 ? 0 : -sides; k <= (i == 0 ? 0 : sides); ++k) {
      StepOutward step{outward_rad + k * std::numbers::pi / 12.0, i * max_step_length / lengths,
                       0.0};
      const auto found = find_best_rotation(move_line(end, step, coarse_line.size()), coarse_line);
      if (found.value <= best_correlation) continue;
      best_correlation = found.value;
      step.heading_rad =
          found.rotation * 2.0 * std::numbers::pi / static_cast<double>(coarse_line.size());
      best = step;
    }
  }
  return best;
}

/// Moves the step to the highest correlation of the line with views near it, by pattern search.
void maximise_past_end(std::span<const float> end, std::span<const float> line, StepOutward& step,
                       std::size_t columns) {
  double best = correlate_past_end(end, line, step, columns);
  // Half of the steps of `find_step`, and of its columns.
  StepOutward change{std::numbers::pi / 24.0, max_step_length / 16.0,
                     std::numbers::pi / static_cast<double>(coarse_columns)};
  constexpr int halvings = 3;
  for (int halving = 0; halving < halvings; ++halving) {
    for (double StepOutward::*const unknown :
         {&StepOutward::heading_rad, &StepOutward::length, &StepOutward::direction_rad}) {
      for (const double sign : {-1.0, 1.0}) {
        StepOutward other = step;
        other.*unknown += sign * change.*unknown;
        other.length = std::clamp(other.length, 0.0, max_step_length);
        const double correlation = correlate_past_end(end, line, other, columns);
        if (correlation <= best) continue;
        best = correlation;
        step = other;
      }
      change.*unknown *= 0.5;
    }
  }
}

/// Returns the values of a line of the first level at the coarse columns.
std::vector<float> sample_coarse_columns(std::span<const float> smooth) {
  std::vector<float> result(coarse_columns);
  for (std::size_t c = 0; c < coarse_columns; ++c) {
    const auto column = static_cast<double>(c * smooth.size()) / coarse_columns;
    result[c] = sample_line(smooth, column).value;
  }
  return result;
}

/// A line at the first level and at the one at which views past the ends are compared.
struct SmoothedLine {
  std::span<const float> coarse;
  std::span<const float> fine;
};

/// Returns the step from the pose of a line after which another line is seen. `columns`: number of
/// compared columns.
StepOutward explain_by_step(const SmoothedLine& from, const SmoothedLine& seen, double outward_rad,
                            std::size_t columns) {
  StepOutward step = find_step(from.coarse, sample_coarse_columns(seen.coarse), outward_rad);
  maximise_past_end(from.fine, seen.fine, step, columns);
  return step;
}

/// Returns a line in the world's frame as seen with a heading.
std::vector<float> rotate_line(std::span<const float> world, double heading_rad) {
  const double rotation =
      heading_rad * static_cast<double>(world.size()) / (2.0 * std::numbers::pi);
  std::vector<float> line(world.size());
  for (std::size_t c = 0; c < line.size(); ++c)
    line[c] = sample_line(world, static_cast<double>(c) + rotation).value;
  return line;
}

/// The regression of a line on an expected one.
struct Regression {
  Regression(std::span<const float> line, std::span<const float> expected,
             std::span<const std::size_t> columns) {
    const auto n = static_cast<double>(columns.size());
    double x = 0.0;
    double y = 0.0;
    for (const std::size_t c : columns) {
      x += static_cast<double>(expected[c]) / n;
      y += static_cast<double>(line[c]) / n;
    }
    double xx = 0.0;
    double xy = 0.0;
    for (const std::size_t c : columns) {
      const double off = static_cast<double>(expected[c]) - x;
      xx += off * off;
      xy += off * (static_cast<double>(line[c]) - y);
    }
    const double slope = xx > 1e-9 ? xy / xx : 0.0;
    std::vector<double> absolute;
    for (const std::size_t c : columns) {
      residuals.push_back(static_cast<double>(line[c]) - y -
                          slope * (static_cast<double>(expected[c]) - x));
      absolute.push_back(std::abs(residuals.back()));
    }
    noise = std::max(min_noise, sigma_over_mad * order_statistic(std::move(absolute), 0.5));
  }

  std::vector<double> residuals;  // one for each column
  double noise = 0.0;             // robust standard deviation of these
};

/// Returns `RouteLines::compare_poses` by the lines that are expected at both; NaN: not predicted.
double compute_lead(std::span<const float> line, std::span<const float> expected,
                    std::span<const float> expected_by_other) {
  std::vector<std::size_t> columns;
  for (std::size_t c = 0; c < line.size(); ++c) {
    if (std::isfinite(expected[c]) && std::isfinite(expected_by_other[c])) columns.push_back(c);
  }
  if (columns.size() < 2) return 0.0;
  const Regression here(line, expected, columns);
  const Regression there(line, expected_by_other, columns);
  // Cauchy's loss, as of the fits.
  const double scale = 3.0 * std::min(here.noise, there.noise);
  const auto loss = [&](double residual) { return std::log1p(std::pow(residual / scale, 2.0)); };
  std::vector<double> gains(line.size(), 0.0);
  double sum = 0.0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    gains[columns[i]] = loss(there.residuals[i]) - loss(here.residuals[i]);
    sum += gains[columns[i]];
  }
  double squares = 0.0;
  for (const std::size_t c : columns) {
    gains[c] -= sum / static_cast<double>(columns.size());
    squares += gains[c] * gains[c];
  }
  const double variance = squares * autocorrelation_factor(gains, correlated_share);
  return variance > 0.0 ? sum / std::sqrt(variance) : 0.0;
}

}  // namespace

std::optional<LineWindow> RouteLines::find_window(Point2 position) const {
  return path_.find_window(position, options_.reach_m * options_.metre);
}

std::vector<RouteCrossing> RouteLines::find_crossings_in(
    const LineWindow& window, Point2 viewpoint, std::span<const Direction2> directions) const {
  std::vector<RouteCrossing> crossings(directions.size());
  path_.find_crossings(window, viewpoint, directions, crossings);
  return crossings;
}

float RouteLines::expected_value(const Level& level, float along,
                                 std::size_t column) const noexcept {
  const auto before = std::min(static_cast<std::size_t>(along), poses_.size());
  const float share = along - static_cast<float>(before);
  const float* const at =
      level.values.data() + before * static_cast<std::size_t>(columns_) + column;
  return at[0] + share * (at[columns_] - at[0]);
}

std::vector<float> RouteLines::to_coarse_line(std::span<const float> line) const {
  check_line(line);
  return sample_coarse_columns(smooth_line(line, levels_.front().sigma));
}

std::optional<RouteLines::CoarseView> RouteLines::make_coarse_view(Point2 position) const {
  const auto window = find_window(position);
  if (!window) return std::nullopt;
  static const std::vector<Direction2> directions = equal_directions(coarse_columns);
  const auto crossings = find_crossings_in(*window, position, directions);
  CoarseView view{position,
                  std::vector<float>(coarse_columns, std::numeric_limits<float>::quiet_NaN())};
  std::size_t count = 0;
  const auto size = static_cast<std::size_t>(columns_);
  for (std::size_t c = 0; c < coarse_columns; ++c) {
    if (crossings[c].along < 0.0F) continue;
    const std::size_t column = (c * size + coarse_columns / 2) / coarse_columns % size;
    view.expected[c] = expected_value(levels_.front(), crossings[c].along, column);
    ++count;
  }
  if (2 * count < coarse_columns) return std::nullopt;
  return view;
}

std::vector<RouteLines::Candidate> RouteLines::find_candidates(std::span<const float> coarse_line,
                                                               const CoarseView& view) {
  if (coarse_line.size() != coarse_columns) {
    throw ContractError("values of the coarse line", static_cast<double>(coarse_line.size()),
                        std::to_string(coarse_columns));
  }
  std::vector<Candidate> found;
  for (const Correlation& maximum : find_rotations(view.expected, coarse_line)) {
    found.push_back({{view.position.x_m, view.position.y_m,
                      wrap_angle(maximum.rotation * 2.0 * std::numbers::pi / coarse_columns)},
                     maximum.value});
  }
  return found;
}

std::vector<float> RouteLines::synthesise(const Pose2& pose) const {
  return synthesise(levels_.back(), pose);
}

std::vector<float> RouteLines::synthesise(const Level& level, const Pose2& pose) const {
  const std::size_t size = level.directions.size();
  std::vector<float> world(size, std::numeric_limits<float>::quiet_NaN());
  const auto window = find_window(pose.position());
  if (!window) return world;
  const auto crossings = find_crossings_in(*window, pose.position(), level.directions);
  for (std::size_t k = 0; k < size; ++k) {
    if (crossings[k].along >= 0.0F) {
      world[k] = expected_value(level, crossings[k].along, k * level.stride);
    }
  }
  return rotate_line(world, pose.heading_rad);
}

double RouteLines::compare_poses(std::span<const float> line, const Pose2& pose,
                                 const Pose2& other) const {
  check_line(line);
  return compute_lead(line, synthesise(pose), synthesise(other));
}

RouteLines::PastEnd RouteLines::find_past_end(std::span<const float> line,
                                              const Pose2& pose) const {
  check_line(line);
  // The last level shows depths, which a step among things at equal distances does not explain.
  const Level& level = levels_[levels_.size() > 1 ? levels_.size() - 2 : 0];
  const auto coarse = smooth_line(line, levels_.front().sigma);
  const auto fine = smooth_line(line, level.sigma);
  std::vector<float> measured;
  for (std::size_t c = 0; c < fine.size(); c += level.stride) measured.push_back(fine[c]);
  const auto expected = synthesise(level, pose);
  const auto smoothed_line_at = [&](std::size_t i) {
    const auto size = static_cast<std::size_t>(columns_);
    const std::size_t begin = (i + 1) * size;  // after the extrapolated one
    return SmoothedLine{std::span(levels_.front().values).subspan(begin, size),
                        std::span(level.values).subspan(begin, size)};
  };
  PastEnd found;
  for (const bool is_start : {true, false}) {
    const std::size_t end = is_start ? 0 : poses_.size() - 1;
    const auto find_step_from = [&](std::size_t from, std::size_t inner, const SmoothedLine& seen) {
      const double outward_rad =
          std::atan2(poses_[end].y_m - poses_[inner].y_m, poses_[end].x_m - poses_[inner].x_m);
      return explain_by_step(smoothed_line_at(from), seen, outward_rad, measured.size());
    };
    const auto step = find_step_from(end, is_start ? 1 : end - 1, {coarse, fine});
    const auto moved = move_line(smoothed_line_at(end).fine, step, measured.size());
    const double lead = compute_lead(measured, expected, rotate_line(moved, step.heading_rad));
    if (!is_start && lead >= found.lead) continue;
    // The step that leads to the end, of known length, shows how far away things are.
    std::size_t inner = end;
    const auto inner_m = [&] { return distance(poses_[inner].position(), poses_[end].position()); };
    do {
      inner = is_start ? inner + 1 : inner - 1;
    } while (inner_m() < min_known_step_m * options_.metre && inner > 0 &&
             inner + 1 < poses_.size());
    const StepOutward known = find_step_from(inner, inner, smoothed_line_at(end));
    const double unit_m = inner_m() / std::max(min_step_length, known.length);
    found = {{poses_[end].x_m + unit_m * step.length * std::cos(step.direction_rad),
              poses_[end].y_m + unit_m * step.length * std::sin(step.direction_rad)},
             lead};
  }
  return found;
}

}  // namespace panonav
