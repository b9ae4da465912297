#include "panonav/panorama/tilt.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/levelling.hpp"

namespace panonav {

namespace {

/// Spacing of the nodes at which positions are computed exactly; in between they are interpolated
/// linearly, with errors below 0.01 degrees. Rows within 30 degrees of a pole of either panorama
/// are computed exactly everywhere.
constexpr double node_spacing_rad = 5.0 * std::numbers::pi / 180.0;
constexpr double polar_elevation_rad = std::numbers::pi / 3.0;

/// Positions in the tilted panorama of directions of the level one: rows, and differences of the
/// columns, which vary slowly from direction to direction.
struct Shifts {
  std::vector<float> rows, columns;
};

/// Cosines and sines of equally spaced azimuths.
struct Azimuths {
  std::vector<double> cosines, sines;
};

/// Computes the azimuths of every `step`-th column, with one beyond the last column.
Azimuths make_azimuths(int columns, int step) {
  Azimuths azimuths;
  for (int c = 0; c < columns + step; c += step) {
    const double azimuth_rad = 2.0 * std::numbers::pi * c / columns;
    azimuths.cosines.push_back(std::cos(azimuth_rad));
    azimuths.sines.push_back(std::sin(azimuth_rad));
  }
  return azimuths;
}

kernels::TiltedDirections make_directions(const Panorama& seen, const Tilt& tilt) {
  const auto& [bottom_rad, top_rad] = *seen.elevations();
  return {.cos_roll = std::cos(tilt.roll_rad),
          .sin_roll = std::sin(tilt.roll_rad),
          .cos_pitch = std::cos(tilt.pitch_rad),
          .sin_pitch = std::sin(tilt.pitch_rad),
          .flat = 1.0,
          .z = 0.0,
          .top_rad = top_rad,
          .rows_per_rad = seen.rows() / (top_rad - bottom_rad),
          .columns_per_rad = seen.columns() / (2.0 * std::numbers::pi)};
}

/// Computes the positions of the directions of one elevation.
void compute_shifts(kernels::TiltedDirections directions, double elevation_rad,
                    const Azimuths& azimuths, Shifts& shifts) {
  directions.flat = std::cos(elevation_rad);
  directions.z = std::sin(elevation_rad);
  shifts.rows.resize(azimuths.cosines.size());
  shifts.columns.resize(azimuths.cosines.size());
  kernels::tilted_positions(directions, azimuths.cosines, azimuths.sines, shifts.rows,
                            shifts.columns, kernels::chosen_instructions());
}

/// Interpolates between the positions in two rows.
void interpolate_rows(const Shifts& upper, const Shifts& lower, float share, Shifts& shifts) {
  const auto interpolate = [share](const std::vector<float>& a, const std::vector<float>& b,
                                   std::vector<float>& between) {
    between.resize(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) between[i] = a[i] + share * (b[i] - a[i]);
  };
  interpolate(upper.rows, lower.rows, shifts.rows);
  interpolate(upper.columns, lower.columns, shifts.columns);
}

/// Interpolates between nodes, which are `step` columns apart, to all columns.
void interpolate_columns(const Shifts& nodes, int step, std::size_t columns, Shifts& shifts) {
  const auto interpolate = [&](const std::vector<float>& at_nodes, std::vector<float>& all) {
    all.resize(columns);
    std::size_t node = 0;
    for (std::size_t first = 0; first < columns; first += static_cast<std::size_t>(step), ++node) {
      const float a = at_nodes[node];
      const float difference = at_nodes[node + 1] - a;
      const std::size_t count = std::min(static_cast<std::size_t>(step), columns - first);
      for (std::size_t i = 0; i < count; ++i)
        all[first + i] = a + static_cast<float>(i) / static_cast<float>(step) * difference;
    }
  };
  interpolate(nodes.rows, shifts.rows);
  interpolate(nodes.columns, shifts.columns);
}

/// Samples one row of the level panorama at the positions of its columns.
void sample_row(const Panorama& seen, const Shifts& shifts, std::span<float> values) {
  kernels::sample_tilted_row(seen.values(), std::span(shifts.rows).first(values.size()),
                             std::span(shifts.columns).first(values.size()), values,
                             kernels::chosen_instructions());
}

Direction3 rotate_about_x(const Direction3& d, double angle_rad) noexcept {
  const double cosine = std::cos(angle_rad);
  const double sine = std::sin(angle_rad);
  return {d.x, cosine * d.y - sine * d.z, sine * d.y + cosine * d.z};
}
Direction3 rotate_about_y(const Direction3& d, double angle_rad) noexcept {
  const double cosine = std::cos(angle_rad);
  const double sine = std::sin(angle_rad);
  return {cosine * d.x + sine * d.z, d.y, -sine * d.x + cosine * d.z};
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

Direction3 level_direction(const Direction3& seen, const Tilt& tilt) noexcept {
  return rotate_about_y(rotate_about_x(seen, tilt.roll_rad), tilt.pitch_rad);
}

Direction3 tilt_direction(const Direction3& level, const Tilt& tilt) noexcept {
  return rotate_about_x(rotate_about_y(level, -tilt.pitch_rad), -tilt.roll_rad);
}

Panorama level_panorama(const Panorama& seen, const Tilt& tilt, int rows,
                        const ElevationBand& band) {
  validate(tilt, seen.elevations());
  require(seen.elevations().has_value(), "elevations of a tilted panorama", 0.0, "known ones");
  if (tilt == Tilt{} && rows == seen.rows() && band == *seen.elevations()) return seen;
  Panorama level(rows, seen.columns(), band);
  const int columns = level.columns();
  const auto width = static_cast<std::size_t>(columns);
  const kernels::TiltedDirections directions = make_directions(seen, tilt);
  const double row_rad = (band.top_rad - band.bottom_rad) / rows;
  const double column_rad = 2.0 * std::numbers::pi / columns;
  const int column_step = std::max(1, static_cast<int>(node_spacing_rad / column_rad));
  const int row_step = std::max(1, static_cast<int>(node_spacing_rad / row_rad));
  const double tilt_rad = std::hypot(tilt.roll_rad, tilt.pitch_rad);
  const Azimuths azimuths = make_azimuths(columns, column_step);
  std::optional<Azimuths> all_azimuths;
  Shifts shifts;
  Shifts nodes;
  Shifts upper;
  Shifts lower;
  int lower_row = -1;
  for (int y = 0; y < rows; ++y) {
    const auto values = level.values().subspan(width * static_cast<std::size_t>(y), width);
    if (std::abs(level.elevation_rad(y)) + tilt_rad > polar_elevation_rad) {
      if (!all_azimuths) all_azimuths = make_azimuths(columns, 1);
      compute_shifts(directions, level.elevation_rad(y), *all_azimuths, shifts);
      sample_row(seen, shifts, values);
      continue;
    }
    const int upper_row = y / row_step * row_step;
    if (lower_row != upper_row + row_step) {
      if (lower_row == upper_row) {
        std::swap(upper, lower);
      } else {
        compute_shifts(directions, level.elevation_rad(upper_row), azimuths, upper);
      }
      lower_row = upper_row + row_step;
      compute_shifts(directions, level.elevation_rad(lower_row), azimuths, lower);
    }
    interpolate_rows(upper, lower, static_cast<float>(y - upper_row) / static_cast<float>(row_step),
                     nodes);
    if (column_step > 1) interpolate_columns(nodes, column_step, width, shifts);
    sample_row(seen, column_step > 1 ? shifts : nodes, values);
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
