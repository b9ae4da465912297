// Search for lines without a prediction.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/horizon_scanline.hpp"
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

// Returns the highest correlation over all rotations of the line, over columns where `expected` is
// finite.
Correlation find_best_rotation(std::span<const float> expected, std::span<const float> line) {
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
  const auto at = static_cast<std::size_t>(std::ranges::max_element(values) - values.begin());
  // Interpolates the maximum by a parabola through the highest value and its neighbours.
  const double left = values[(at + size - 1) % size];
  const double right = values[(at + 1) % size];
  const double bend = left - 2.0 * values[at] + right;
  const double shift = bend < -1e-12 ? std::clamp(0.5 * (left - right) / bend, -0.5, 0.5) : 0.0;
  return {values[at], static_cast<double>(at) + shift};
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

/// Moves the step to the highest correlation of the line with views near it, by pattern search;
/// returns that correlation.
double maximise_past_end(std::span<const float> end, std::span<const float> line, StepOutward& step,
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
  return best;
}

}  // namespace

std::vector<float> RouteLines::to_coarse_line(std::span<const float> line) const {
  check_line(line);
  const auto smooth = smooth_line(line, levels_.front().sigma);
  std::vector<float> result(coarse_columns);
  for (std::size_t c = 0; c < coarse_columns; ++c) {
    result[c] = sample_line(smooth, static_cast<double>(c) * columns_ / coarse_columns).value;
  }
  return result;
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

std::optional<RouteLines::Candidate> RouteLines::find_candidate(std::span<const float> coarse_line,
                                                                const CoarseView& view) {
  if (coarse_line.size() != coarse_columns) {
    throw ContractError("values of the coarse line", static_cast<double>(coarse_line.size()),
                        std::to_string(coarse_columns));
  }
  const Correlation best = find_best_rotation(view.expected, coarse_line);
  if (!(best.value > -1.0)) return std::nullopt;
  return Candidate{{view.position.x_m, view.position.y_m,
                    wrap_angle(best.rotation * 2.0 * std::numbers::pi / coarse_columns)},
                   best.value};
}

bool RouteLines::is_better_past_end(std::span<const float> line, const RouteFix& fix) const {
  const auto coarse = to_coarse_line(line);
  const auto window = find_window(fix.pose.position());
  if (!window) return false;
  // The last level shows depths, which a step among things at equal distances does not explain.
  const Level& level = levels_[levels_.size() > 1 ? levels_.size() - 2 : 0];
  const auto smooth = smooth_line(line, level.sigma);
  const auto crossings = find_crossings_in(*window, fix.pose.position(), level.directions);
  const double rotation = fix.pose.heading_rad * columns_ / (2.0 * std::numbers::pi);
  std::vector<float> expected;
  std::vector<float> measured;
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    if (crossings[k].along < 0.0F) continue;
    const std::size_t c = k * level.stride;
    expected.push_back(expected_value(level, crossings[k].along, c));
    measured.push_back(sample_line(smooth, static_cast<double>(c) - rotation).value);
  }
  const double explained = correlate(expected, measured);
  const auto size = static_cast<std::size_t>(columns_);
  const auto line_at = [&](const Level& at, std::size_t i) {
    return std::span(at.values).subspan(i * size, size);
  };
  const auto explain = [&](std::size_t end, std::size_t before) {
    const double outward_rad =
        std::atan2(poses_[end].y_m - poses_[before].y_m, poses_[end].x_m - poses_[before].x_m);
    auto step = find_step(line_at(levels_.front(), end), coarse, outward_rad);
    const double correlation =
        maximise_past_end(line_at(level, end), smooth, step, level.directions.size());
    return std::pair(correlation, step.length);
  };
  const auto [past_end, length] =
      std::max(explain(0, 1), explain(poses_.size() - 1, poses_.size() - 2));
  return length >= min_step_length && past_end > explained;
}

}  // namespace panonav
