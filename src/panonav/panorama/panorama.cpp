#include "panonav/panorama/panorama.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

std::size_t validated_size(int rows, int columns) {
  require(rows >= 1, "panorama rows", rows, ">= 1");
  require(columns >= 4, "panorama columns", columns, ">= 4");
  return static_cast<std::size_t>(rows) * columns;
}

}  // namespace

Panorama::Panorama(int rows, int columns, std::optional<ElevationBand> elevations)
    : Panorama(rows, columns, elevations, std::vector<float>(validated_size(rows, columns))) {}

Panorama::Panorama(int rows, int columns, std::optional<ElevationBand> elevations,
                   std::vector<float> values)
    : rows_(rows), columns_(columns), elevations_(elevations), values_(std::move(values)) {
  const std::size_t size = validated_size(rows, columns);
  require(values_.size() == size, "number of panorama values", static_cast<double>(values_.size()),
          to_text(static_cast<double>(size)));
  if (elevations_) {
    constexpr double zenith = std::numbers::pi / 2.0 + 1e-9;
    require(elevations_->bottom_rad >= -zenith && elevations_->bottom_rad < elevations_->top_rad,
            "elevations bottom_rad", elevations_->bottom_rad, "-pi/2 .. below top_rad");
    require(elevations_->top_rad <= zenith, "elevations top_rad", elevations_->top_rad,
            "above bottom_rad .. pi/2");
  }
  // 0 times a finite value is 0, and an infinite or NaN value makes the sum NaN: one vectorised
  // loop instead of a test per value.
  constexpr std::size_t lanes = 8;
  std::array<float, lanes> sums{};
  std::size_t i = 0;
  for (; i + lanes <= size; i += lanes) {
    for (std::size_t lane = 0; lane < lanes; ++lane) sums[lane] += values_[i + lane] * 0.0F;
  }
  for (; i < size; ++i) sums[0] += values_[i] * 0.0F;
  const float sum = std::accumulate(sums.begin(), sums.end(), 0.0F);
  require(sum == 0.0F, "panorama value", static_cast<double>(sum), "finite");
}

double Panorama::elevation_rad(int row) const noexcept {
  if (!elevations_) return 0.0;
  const double band = elevations_->top_rad - elevations_->bottom_rad;
  return elevations_->top_rad - band * (row + 0.5) / rows_;
}

std::optional<int> Panorama::horizon_row() const noexcept {
  if (!elevations_ || elevations_->bottom_rad > 0.0 || elevations_->top_rad < 0.0) return {};
  const double band = elevations_->top_rad - elevations_->bottom_rad;
  const int row = static_cast<int>(std::floor(elevations_->top_rad / band * rows_));
  return std::clamp(row, 0, rows_ - 1);
}

double Panorama::azimuth_rad(int column) const noexcept {
  return wrap_angle(2.0 * std::numbers::pi * column / columns_);
}

Panorama mirror(const Panorama& panorama) {
  Panorama image = panorama;
  for (int y = 0; y < panorama.rows(); ++y) {
    for (int x = 1; x < panorama.columns(); ++x) {
      image.at(y, x) = panorama.at(y, panorama.columns() - x);
    }
  }
  return image;
}

Panorama rotate_columns(const Panorama& panorama, int columns_turned) {
  const int columns = panorama.columns();
  const int shift = (columns_turned % columns + columns) % columns;
  Panorama turned = panorama;
  const auto values = turned.values();
  for (int y = 0; y < panorama.rows(); ++y) {
    const auto row = values.subspan(static_cast<std::size_t>(y) * columns, columns);
    std::rotate(row.begin(), row.begin() + shift, row.end());
  }
  return turned;
}

Image to_picture(const Panorama& panorama) {
  const int columns = panorama.columns();
  Image picture(columns, panorama.rows());
  for (int y = 0; y < panorama.rows(); ++y) {
    const std::span<const float> row = panorama.row(y);
    std::uint8_t* const to = &picture.at(0, y);
    const auto fill = [&](int begin, int end, int first_column) {
      for (int u = begin; u < end; ++u) {
        const float value = std::clamp(row[first_column - (u - begin)], 0.0F, 1.0F) * 255.0F;
        to[u] = static_cast<std::uint8_t>(static_cast<int>(static_cast<double>(value) + 0.5));
      }
    };
    const int turned = columns / 2 + 1;  // columns from the forward direction to column 0
    fill(0, std::min(turned, columns), columns / 2);
    fill(turned, columns, columns - 1);
  }
  return picture;
}

double picture_forward_column(int columns) noexcept {
  return (columns / 2 + 0.5) / columns;
}

}  // namespace panonav
