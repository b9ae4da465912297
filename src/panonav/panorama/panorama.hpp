#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"

namespace panonav {

/// A panoramic cylinder [M04 section 2.1]: one channel, float32, row-major. Row 0 is the highest
/// elevation, rows are equally spaced in angle between the edges of the elevation band. Column c is
/// centred on azimuth 2 pi c / columns in the robot frame (counter-clockwise, forward at column 0).
/// Values are in [0, 1] as read from a camera; preprocessing may leave that range.
/// Invariant: rows >= 1, columns >= 4, all values finite.
class Panorama {
 public:
  /// All values 0. Throws ContractError.
  Panorama(int rows, int columns, std::optional<ElevationBand> elevations);
  /// Throws ContractError on a wrong size or a value that is not finite.
  Panorama(int rows, int columns, std::optional<ElevationBand> elevations,
           std::vector<float> values);

  /// Number of rows: values of a column, from the highest elevation to the lowest.
  [[nodiscard]] int rows() const noexcept { return rows_; }
  /// Number of columns: values of a row, which cover a full turn in azimuth.
  [[nodiscard]] int columns() const noexcept { return columns_; }
  /// Elevations of the lower and upper edge; nullopt if unknown: every row is then treated as if it
  /// were on the horizon.
  [[nodiscard]] const std::optional<ElevationBand>& elevations() const noexcept {
    return elevations_;
  }
  /// Elevation of the middle of row y; 0 where elevations are unknown.
  [[nodiscard]] double elevation_rad(int row) const noexcept;
  /// The row whose middle is nearest to elevation 0; empty when unknown or outside the band.
  [[nodiscard]] std::optional<int> horizon_row() const noexcept;
  [[nodiscard]] double azimuth_rad(int column) const noexcept;  ///< in [-pi, pi)

  /// All rows * columns values, row after row.
  [[nodiscard]] std::span<const float> values() const& noexcept { return values_; }
  /// Returns the values for writing; the caller keeps them finite.
  [[nodiscard]] std::span<float> values() & noexcept { return values_; }
  std::span<const float> values() const&& = delete;  // would dangle
  /// Row y, all azimuths. The caller guarantees 0 <= y < rows.
  [[nodiscard]] std::span<const float> row(int y) const& noexcept {
    return std::span(values_).subspan(static_cast<std::size_t>(y) * columns_, columns_);
  }
  std::span<const float> row(int y) const&& = delete;  // would dangle
  /// One value. The caller guarantees that row and column are within the panorama.
  [[nodiscard]] float at(int y, int column) const noexcept {
    return values_[static_cast<std::size_t>(y) * columns_ + column];
  }
  /// Returns a value for writing.
  [[nodiscard]] float& at(int y, int column) noexcept {
    return values_[static_cast<std::size_t>(y) * columns_ + column];
  }
  friend bool operator==(const Panorama&, const Panorama&) = default;

 private:
  int rows_, columns_;
  std::optional<ElevationBand> elevations_;
  std::vector<float> values_;
};

/// Returns the view after the robot has rotated counter-clockwise by `columns_turned` columns:
/// I'(phi) = I(phi + delta), so column c of the result is column c + columns_turned.
[[nodiscard]] Panorama rotate_columns(const Panorama& panorama, int columns_turned);
/// Mirrors the view, left to right: column c goes to -c.
[[nodiscard]] Panorama mirror(const Panorama& panorama);

/// Converts to an image for display: columns run clockwise, forward is in the middle, and 0..1
/// becomes 0..255 (clamped). Columns are reordered without interpolation: column 0 becomes column
/// columns / 2 of the image, so reading the image with `picture_forward_column` restores the
/// panorama up to rounding to 8 bit.
[[nodiscard]] Image to_picture(const Panorama& panorama);

/// Returns the position of the forward direction in the image of `to_picture`, as a fraction of its
/// width from the left edge.
[[nodiscard]] double picture_forward_column(int columns) noexcept;

}  // namespace panonav
