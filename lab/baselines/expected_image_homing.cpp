#include "lab/baselines/expected_image_homing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "lab/baselines/rotation_products.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::lab {

namespace {

// Number of expected views compared at once, few enough that they and their products stay in the L1
// cache.
constexpr std::size_t positions_per_block = 8;

// Largest distance of the positions from (0, 0), in units of R.
constexpr double max_position_distance = 2.0 / 3.0;

struct LatticePoint {
  int x = 0;
  int y = 0;
  [[nodiscard]] int squared_norm() const noexcept { return x * x + y * y; }
};

// Returns more than `min_count` points of the square lattice, sorted by their distance from (0, 0).
std::vector<LatticePoint> make_lattice(int min_count) {
  const int side = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(min_count)))) + 1;
  std::vector<LatticePoint> points;
  for (int y = -side; y <= side; ++y) {
    for (int x = -side; x <= side; ++x) {
      if (x * x + y * y <= side * side) points.push_back({x, y});
    }
  }
  std::ranges::stable_sort(points, {}, [](const LatticePoint& p) { return p.squared_norm(); });
  return points;
}

double compute_mean(std::span<const float> values) {
  double sum = 0.0;
  for (const float value : values) sum += static_cast<double>(value);
  return sum / static_cast<double>(values.size());
}

}  // namespace

ExpectedImageHoming::ExpectedImageHoming(int columns, int max_positions)
    : columns_(columns), spacing_(0.0) {
  require(columns >= 4 && columns <= 65536, "columns", columns, "4 .. 65536");
  require(max_positions >= 5 && max_positions <= 10000, "positions", max_positions, "5 .. 10000");
  const auto points = make_lattice(max_positions);
  // Keep only complete rings of points at equal distance, as many as `max_positions` allows.
  std::size_t count = 0;
  while (true) {
    std::size_t next = count;
    while (points[next].squared_norm() == points[count].squared_norm()) ++next;
    if (next > static_cast<std::size_t>(max_positions)) break;
    count = next;
  }
  spacing_ = max_position_distance / std::sqrt(static_cast<double>(points[count].squared_norm()));
  const double pixels_per_radian = columns / (2.0 * std::numbers::pi);
  table_.reserve(count * static_cast<std::size_t>(columns));
  for (std::size_t p = 0; p < count; ++p) {
    const double xi = spacing_ * points[p].x;
    const double eta = spacing_ * points[p].y;
    positions_.push_back({static_cast<float>(xi), static_cast<float>(eta)});
    for (int i = 0; i < columns; ++i) {
      const double azimuth = i / pixels_per_radian;
      const double pixel_position =
          i + pixels_per_radian * (eta * std::cos(azimuth) - xi * std::sin(azimuth));
      const int pixel = static_cast<int>(std::nearbyint(pixel_position)) % columns;
      table_.push_back(static_cast<std::uint16_t>(pixel < 0 ? pixel + columns : pixel));
    }
  }
}

namespace {

// A row with its mean subtracted, and its energy (sum of squares).
struct ZeroMeanRow {
  std::vector<float> values;
  double energy = 0.0;

  explicit ZeroMeanRow(std::span<const float> row) {
    const double mean = compute_mean(row);
    for (const float value : row) {
      values.push_back(static_cast<float>(static_cast<double>(value) - mean));
      energy += static_cast<double>(values.back()) * static_cast<double>(values.back());
    }
  }
};

// Writes the view expected from a position to `row`; returns its energy after subtracting its mean.
float compute_expected_row(std::span<const float> current, const std::uint16_t* pixel_indices,
                           float* row) {
  const std::size_t columns = current.size();
  // Four independent partial sums, so that no addition waits for another.
  std::array<float, 4> sums{};
  std::array<float, 4> squares{};
  std::size_t i = 0;
  for (; i + 4 <= columns; i += 4) {
    for (std::size_t j = 0; j < 4; ++j) {
      const float value = current[pixel_indices[i + j]];
      row[i + j] = value;
      sums[j] += value;
      squares[j] += value * value;
    }
  }
  for (; i < columns; ++i) {
    row[i] = current[pixel_indices[i]];
    sums[0] += row[i];
    squares[0] += row[i] * row[i];
  }
  const float sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  return (squares[0] + squares[1]) + (squares[2] + squares[3]) -
         sum * sum / static_cast<float>(columns);
}

// The position and rotation whose expected view is most similar to the home view.
struct BestExpectedView {
  double difference = 0.0;  // without the energy of the home view, which is the same for all
  std::size_t position = std::numeric_limits<std::size_t>::max();
  std::size_t turn = 0;
};

}  // namespace

void ExpectedImageHoming::require_row(std::span<const float> row) const {
  require(row.size() == static_cast<std::size_t>(columns_), "pixels of a row",
          static_cast<double>(row.size()), to_text(columns_));
  for (const float value : row) {
    require(std::isfinite(value), "pixel", static_cast<double>(value), "a finite number");
  }
}

HomeVector ExpectedImageHoming::home_vector(std::span<const float> home,
                                            std::span<const float> current) const {
  require_row(home);
  require_row(current);
  const auto columns = static_cast<std::size_t>(columns_);
  const std::size_t stride = rotation_products_stride(columns);
  ZeroMeanRow periodic(home);
  for (std::size_t i = 0; i < stride; ++i) periodic.values.push_back(periodic.values[i]);
  const ZeroMeanRow zero_mean_current(current);
  // Pixel values are of the order of 1, so energies this small are rounding errors.
  if (!(periodic.energy * zero_mean_current.energy > 1e-20)) return {};
  std::vector<float> expected(positions_per_block * columns);
  std::vector<float> products(positions_per_block * stride);
  HomeVector vector;
  BestExpectedView best;
  for (std::size_t first = 0; first < positions_.size(); first += positions_per_block) {
    const std::size_t count = std::min(positions_per_block, positions_.size() - first);
    std::array<float, positions_per_block> energies{};
    std::array<float, positions_per_block> largest{};
    for (std::size_t p = 0; p < count; ++p) {
      energies[p] =
          compute_expected_row(zero_mean_current.values, expected_pixel_indices(first + p).data(),
                               expected.data() + p * columns);
    }
    compute_rotation_products(std::span(expected).first(count * columns), columns, periodic.values,
                              std::span(products).first(count * stride),
                              std::span(largest).first(count));
    if (first == 0) {
      vector.correlation = std::clamp(
          static_cast<double>(largest[0]) / std::sqrt(periodic.energy * zero_mean_current.energy),
          -1.0, 1.0);
    }
    for (std::size_t p = 0; p < count; ++p) {
      const auto difference =
          static_cast<double>(energies[p]) - 2.0 * static_cast<double>(largest[p]);
      if (best.position < positions_.size() && difference >= best.difference) continue;
      const float* const row = products.data() + p * stride;
      best = {difference, first + p,
              static_cast<std::size_t>(std::find(row, row + columns, largest[p]) - row)};
      const double energy = periodic.energy + static_cast<double>(energies[p]);
      vector.residual = std::clamp((periodic.energy + difference) / energy, 0.0, 1.0);
    }
  }
  // The rotated home view shows value i + turn at i, [S06 eq. 8] value i - s; hence s = -turn.
  const std::size_t shift = (columns - best.turn) % columns;
  vector.xi = static_cast<double>(positions_[best.position].xi);
  vector.eta = static_cast<double>(positions_[best.position].eta);
  vector.heading_rad = wrap_angle(2.0 * std::numbers::pi * static_cast<double>(shift) / columns_);
  // Position and turn are uniform in their cells: variances are widths^2 / 12.
  const double column_rad = 2.0 * std::numbers::pi / columns_;
  vector.covariance[0] = vector.covariance[4] = spacing_ * spacing_ / 12.0;
  vector.covariance[8] = column_rad * column_rad / 12.0;
  vector.frequencies = columns_ / 2.0;
  return vector;
}

}  // namespace panonav::lab
