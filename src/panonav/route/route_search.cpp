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

struct Correlation {
  double value = -1.0;
  double rotation = 0.0;  // of the line, in columns
};

// Returns the highest correlation over all rotations of the line, over columns where `expected` is
// finite.
Correlation find_best_rotation(std::span<const float> expected, std::span<const float> line) {
  const std::size_t size = expected.size();
  std::vector<double> values(size, -1.0);
  for (std::size_t rotation = 0; rotation < size; ++rotation) {
    double n = 0.0;
    double x = 0.0;
    double y = 0.0;
    double xx = 0.0;
    double yy = 0.0;
    double xy = 0.0;
    for (std::size_t c = 0; c < size; ++c) {
      if (!std::isfinite(expected[c])) continue;
      const auto a = static_cast<double>(expected[c]);
      const auto b = static_cast<double>(line[(c + size - rotation) % size]);
      n += 1.0;
      x += a;
      y += b;
      xx += a * a;
      yy += b * b;
      xy += a * b;
    }
    const double vx = xx - x * x / n;
    const double vy = yy - y * y / n;
    if (vx > 1e-9 && vy > 1e-9) values[rotation] = (xy - x * y / n) / std::sqrt(vx * vy);
  }
  const auto at = static_cast<std::size_t>(std::ranges::max_element(values) - values.begin());
  // Interpolates the maximum by a parabola through the highest value and its neighbours.
  const double left = values[(at + size - 1) % size];
  const double right = values[(at + 1) % size];
  const double bend = left - 2.0 * values[at] + right;
  const double shift = bend < -1e-12 ? std::clamp(0.5 * (left - right) / bend, -0.5, 0.5) : 0.0;
  return {values[at], static_cast<double>(at) + shift};
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

std::optional<RouteLines::Candidate> RouteLines::find_candidate(std::span<const float> coarse_line,
                                                                Point2 position) const {
  if (coarse_line.size() != coarse_columns) {
    throw ContractError("values of the coarse line", static_cast<double>(coarse_line.size()),
                        std::to_string(coarse_columns));
  }
  const auto window = find_window(position);
  if (!window) return std::nullopt;
  static const std::vector<Direction2> directions = equal_directions(coarse_columns);
  const auto crossings = find_crossings_in(*window, position, directions);
  std::vector<float> expected(coarse_columns, std::numeric_limits<float>::quiet_NaN());
  std::size_t count = 0;
  const auto size = static_cast<std::size_t>(columns_);
  for (std::size_t c = 0; c < coarse_columns; ++c) {
    if (crossings[c].along < 0.0F) continue;
    const std::size_t column = (c * size + coarse_columns / 2) / coarse_columns % size;
    expected[c] = expected_value(levels_.front(), crossings[c].along, column);
    ++count;
  }
  if (2 * count < coarse_columns) return std::nullopt;
  const Correlation best = find_best_rotation(expected, coarse_line);
  if (!(best.value > -1.0)) return std::nullopt;
  return Candidate{{position.x_m, position.y_m,
                    wrap_angle(best.rotation * 2.0 * std::numbers::pi / coarse_columns)},
                   best.value};
}

}  // namespace panonav
