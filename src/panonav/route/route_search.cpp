// Headings and places of lines of which nothing is known.

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

// Smoothing by 8 degrees leaves nothing that 48 columns do not show.
constexpr std::size_t coarse_columns = 48;

struct Correlation {
  double value = -1.0;
  double turn = 0.0;  // columns by which the line must be turned
};

// Over the columns where `shown` is finite, at the turn where it is highest.
Correlation best_turn(std::span<const float> shown, std::span<const float> seen) {
  const std::size_t size = shown.size();
  std::vector<double> values(size, -1.0);
  for (std::size_t turn = 0; turn < size; ++turn) {
    double n = 0.0;
    double x = 0.0;
    double y = 0.0;
    double xx = 0.0;
    double yy = 0.0;
    double xy = 0.0;
    for (std::size_t c = 0; c < size; ++c) {
      if (!std::isfinite(shown[c])) continue;
      const auto a = static_cast<double>(shown[c]);
      const auto b = static_cast<double>(seen[(c + size - turn) % size]);
      n += 1.0;
      x += a;
      y += b;
      xx += a * a;
      yy += b * b;
      xy += a * b;
    }
    const double vx = xx - x * x / n;
    const double vy = yy - y * y / n;
    if (vx > 1e-9 && vy > 1e-9) values[turn] = (xy - x * y / n) / std::sqrt(vx * vy);
  }
  const auto at = static_cast<std::size_t>(std::ranges::max_element(values) - values.begin());
  // The top of the parabola through the maximum and its neighbours.
  const double left = values[(at + size - 1) % size];
  const double right = values[(at + 1) % size];
  const double bend = left - 2.0 * values[at] + right;
  const double shift = bend < -1e-12 ? std::clamp(0.5 * (left - right) / bend, -0.5, 0.5) : 0.0;
  return {values[at], static_cast<double>(at) + shift};
}

}  // namespace

std::vector<float> RouteLines::coarse(std::span<const float> line) const {
  if (line.size() != static_cast<std::size_t>(columns_)) {
    throw ContractError("values of the line", static_cast<double>(line.size()),
                        std::to_string(columns_));
  }
  const auto smooth = smooth_line(line, levels_.front().sigma);
  std::vector<float> result(coarse_columns);
  for (std::size_t c = 0; c < coarse_columns; ++c) {
    result[c] = sample_line(smooth, static_cast<double>(c) * columns_ / coarse_columns).value;
  }
  return result;
}

std::optional<RouteLines::Candidate> RouteLines::candidate(std::span<const float> coarse_line,
                                                           Point2 position) const {
  if (coarse_line.size() != coarse_columns) {
    throw ContractError("values of the coarse line", static_cast<double>(coarse_line.size()),
                        std::to_string(coarse_columns));
  }
  const auto near = window(position);
  if (!near) return std::nullopt;
  static const std::vector<Direction2> directions = equal_directions(coarse_columns);
  std::vector<RouteCrossing> crossings(coarse_columns);
  find_crossings(std::span(poses_).subspan(near->begin, near->end - near->begin), near->begin,
                 position, directions, crossings);
  std::vector<float> shown_there(coarse_columns, std::numeric_limits<float>::quiet_NaN());
  std::size_t count = 0;
  const auto size = static_cast<std::size_t>(columns_);
  for (std::size_t c = 0; c < coarse_columns; ++c) {
    if (crossings[c].along < 0.0F) continue;
    const std::size_t column = (c * size + coarse_columns / 2) / coarse_columns % size;
    shown_there[c] = shown(levels_.front(), crossings[c].along, column);
    ++count;
  }
  if (2 * count < coarse_columns) return std::nullopt;
  const Correlation best = best_turn(shown_there, coarse_line);
  if (!(best.value > -1.0)) return std::nullopt;
  return Candidate{
      {position.x_m, position.y_m, wrap_angle(best.turn * 2.0 * std::numbers::pi / coarse_columns)},
      best.value};
}

}  // namespace panonav
