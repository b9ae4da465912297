#include "panonav/panorama/tilt.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

/// Position in the tilted panorama of a direction of the level one: the row, and the difference of
/// the columns, which varies slowly from direction to direction.
struct Shift {
  float row = 0.0F;
  float columns = 0.0F;
};

/// An azimuth with its cosine and sine.
struct Azimuth {
  double azimuth_rad, cosine, sine;
};

class TiltedPositions {
 public:
  TiltedPositions(const Panorama& seen, const Tilt& tilt)
      : cos_roll_(std::cos(tilt.roll_rad)),
        sin_roll_(std::sin(tilt.roll_rad)),
        cos_pitch_(std::cos(tilt.pitch_rad)),
        sin_pitch_(std::sin(tilt.pitch_rad)),
        top_rad_(seen.elevations()->top_rad),
        rows_per_rad_(seen.rows() / (top_rad_ - seen.elevations()->bottom_rad)),
        columns_per_rad_(seen.columns() / (2.0 * std::numbers::pi)) {}

  /// Returns the position of a direction; `flat`, `z`: cosine and sine of its elevation.
  [[nodiscard]] Shift at(double flat, double z, const Azimuth& azimuth) const {
    const double x = flat * azimuth.cosine;
    const double y = flat * azimuth.sine;
    const double x_robot = cos_pitch_ * x - sin_pitch_ * z;
    const double z_rolled = sin_pitch_ * x + cos_pitch_ * z;
    const double y_robot = cos_roll_ * y + sin_roll_ * z_rolled;
    const double z_robot = cos_roll_ * z_rolled - sin_roll_ * y;
    const double elevation = std::atan2(z_robot, std::hypot(x_robot, y_robot));
    const double turned = wrap_angle(std::atan2(y_robot, x_robot) - azimuth.azimuth_rad);
    return {static_cast<float>((top_rad_ - elevation) * rows_per_rad_ - 0.5),
            static_cast<float>(turned * columns_per_rad_)};
  }

 private:
  double cos_roll_, sin_roll_, cos_pitch_, sin_pitch_;
  double top_rad_, rows_per_rad_, columns_per_rad_;
};

/// Spacing of the nodes at which positions are computed exactly; in between they are interpolated
/// linearly, with errors below 0.01 degrees. Rows within 30 degrees of a pole of either panorama
/// are computed exactly everywhere.
constexpr double node_spacing_rad = 5.0 * std::numbers::pi / 180.0;
constexpr double polar_elevation_rad = std::numbers::pi / 3.0;

/// Computes the nodes of one row, with one node beyond its last column. `azimuths`: of all nodes
/// of step 1.
void compute_row_nodes(const TiltedPositions& positions, double elevation_rad,
                       std::span<const Azimuth> azimuths, int columns, int step,
                       std::vector<Shift>& nodes) {
  const double flat = std::cos(elevation_rad);
  const double z = std::sin(elevation_rad);
  nodes.clear();
  for (int c = 0; c < columns + step; c += step)
    nodes.push_back(positions.at(flat, z, azimuths[static_cast<std::size_t>(c)]));
}

Shift interpolate_shift(const Shift& a, const Shift& b, float share) {
  return {a.row + share * (b.row - a.row), a.columns + share * (b.columns - a.columns)};
}

/// Computes one row of the level panorama by bilinear interpolation.
void interpolate_row(const Panorama& seen, const std::vector<Shift>& nodes, int step,
                     std::span<float> values) {
  const int columns = seen.columns();
  const auto last_row = static_cast<float>(seen.rows() - 1);
  const float* const from = seen.values().data();
  for (int c = 0; c < columns; ++c) {
    const int node = c / step;
    const Shift shift =
        interpolate_shift(nodes[node], nodes[static_cast<std::size_t>(node) + 1],
                          static_cast<float>(c - node * step) / static_cast<float>(step));
    const float row = std::clamp(shift.row, 0.0F, last_row);
    const int above = static_cast<int>(row);
    const int below = std::min(above + 1, seen.rows() - 1);
    const float down = row - static_cast<float>(above);
    const float column = static_cast<float>(c + columns) + shift.columns;  // above 0
    int left_column = static_cast<int>(column);
    const float right = column - static_cast<float>(left_column);
    while (left_column >= columns) left_column -= columns;
    const int right_column = left_column + 1 == columns ? 0 : left_column + 1;
    const float* const upper = from + static_cast<std::ptrdiff_t>(above) * columns;
    const float* const lower = from + static_cast<std::ptrdiff_t>(below) * columns;
    const float high = upper[left_column] + right * (upper[right_column] - upper[left_column]);
    const float low = lower[left_column] + right * (lower[right_column] - lower[left_column]);
    values[c] = high + down * (low - high);
  }
}

}  // namespace

bool is_whole_sphere(const ElevationBand& band) noexcept {
  constexpr double rounding_rad = 1e-6;
  return band.top_rad - band.bottom_rad > std::numbers::pi - rounding_rad;
}

void validate(const Tilt& tilt, const std::optional<ElevationBand>& seen) {
  const bool is_sphere = seen && is_whole_sphere(*seen);
  const double limit_rad = is_sphere ? std::numbers::pi : max_tilt_rad;
  for (const auto& [name, angle] :
       {std::pair("roll", tilt.roll_rad), std::pair("pitch", tilt.pitch_rad)}) {
    if (std::abs(angle) <= limit_rad) continue;
    throw ContractError(name, format_number(degrees(angle), "deg") + " degrees",
                        is_sphere ? "-180 to 180 degrees" : "-30 to 30 degrees");
  }
}

Panorama level_panorama(const Panorama& seen, const Tilt& tilt, int rows,
                        const ElevationBand& band) {
  validate(tilt, seen.elevations());
  require(seen.elevations().has_value(), "elevations of a tilted panorama", 0.0, "known ones");
  if (tilt == Tilt{} && rows == seen.rows() && band == *seen.elevations()) return seen;
  Panorama level(rows, seen.columns(), band);
  const int columns = level.columns();
  const auto width = static_cast<std::size_t>(columns);
  const TiltedPositions positions(seen, tilt);
  const double row_rad = (band.top_rad - band.bottom_rad) / rows;
  const double column_rad = 2.0 * std::numbers::pi / columns;
  const int column_step = std::max(1, static_cast<int>(node_spacing_rad / column_rad));
  const int row_step = std::max(1, static_cast<int>(node_spacing_rad / row_rad));
  const double tilt_rad = std::hypot(tilt.roll_rad, tilt.pitch_rad);
  std::vector<Azimuth> azimuths;
  for (int c = 0; c < columns + column_step; ++c) {
    const double azimuth_rad = 2.0 * std::numbers::pi * c / columns;
    azimuths.push_back({azimuth_rad, std::cos(azimuth_rad), std::sin(azimuth_rad)});
  }
  std::vector<Shift> nodes;
  std::vector<Shift> upper;
  std::vector<Shift> lower;
  int lower_row = -1;
  for (int y = 0; y < rows; ++y) {
    const bool is_polar = std::abs(level.elevation_rad(y)) + tilt_rad > polar_elevation_rad;
    const int step = is_polar ? 1 : column_step;
    if (is_polar) {
      compute_row_nodes(positions, level.elevation_rad(y), azimuths, columns, step, nodes);
    } else {
      const int upper_row = y / row_step * row_step;
      if (lower_row != upper_row + row_step) {
        if (lower_row == upper_row) {
          std::swap(upper, lower);
        } else {
          compute_row_nodes(positions, level.elevation_rad(upper_row), azimuths, columns, step,
                            upper);
        }
        lower_row = upper_row + row_step;
        compute_row_nodes(positions, level.elevation_rad(lower_row), azimuths, columns, step,
                          lower);
      }
      const auto share = static_cast<float>(y - upper_row) / static_cast<float>(row_step);
      nodes.resize(upper.size());
      for (std::size_t i = 0; i < nodes.size(); ++i)
        nodes[i] = interpolate_shift(upper[i], lower[i], share);
    }
    interpolate_row(seen, nodes, step,
                    level.values().subspan(width * static_cast<std::size_t>(y), width));
  }
  return level;
}

Panorama level_panorama(const Panorama& seen, const Tilt& tilt) {
  validate(tilt, seen.elevations());
  if (seen.elevations()) return level_panorama(seen, tilt, seen.rows(), *seen.elevations());
  constexpr double tolerated_tilt_rad = 0.5 * std::numbers::pi / 180.0;
  if (std::max(std::abs(tilt.roll_rad), std::abs(tilt.pitch_rad)) <= tolerated_tilt_rad)
    return seen;
  throw ContractError("tilt",
                      format_number(degrees(tilt.roll_rad)) + ", " +
                          format_number(degrees(tilt.pitch_rad)) + " degrees",
                      "up to 0.5 degrees in images whose elevations are not known");
}

}  // namespace panonav
