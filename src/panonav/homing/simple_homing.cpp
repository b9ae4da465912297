#include "panonav/homing/simple_homing.hpp"

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav {

AverageLandmarkVector average_landmark_vector(std::span<const float> row) {
  const std::size_t columns = row.size();
  require(columns >= 4, "pixels of a row", static_cast<double>(columns), ">= 4");
  double x = 0.0;
  double y = 0.0;
  double all = 0.0;
  for (std::size_t c = 0; c < columns; ++c) {
    const auto value = static_cast<double>(row[c]);
    require(std::isfinite(value), "pixel", value, "a finite number");
    const auto left = static_cast<double>(row[(c + 1) % columns]);
    const auto right = static_cast<double>(row[(c + columns - 1) % columns]);
    const double contrast = std::abs(left - right);
    const double azimuth =
        2.0 * std::numbers::pi * static_cast<double>(c) / static_cast<double>(columns);
    x += contrast * std::cos(azimuth);
    y += contrast * std::sin(azimuth);
    all += contrast;
  }
  if (!(all > 0.0)) return {};
  return {x / all, y / all};
}

HomeVector landmark_home_vector(const AverageLandmarkVector& home,
                                const AverageLandmarkVector& current, double heading_rad) {
  // What is seen from home at azimuth alpha is at alpha + heading in the current frame.
  const double cosine = std::cos(heading_rad);
  const double sine = std::sin(heading_rad);
  HomeVector vector;
  vector.xi = 2.0 * (current.x - (cosine * home.x - sine * home.y));
  vector.eta = 2.0 * (current.y - (sine * home.x + cosine * home.y));
  vector.heading_rad = wrap_angle(heading_rad);
  vector.confidence = vector.length() > 0.0 ? 1.0 : 0.0;
  return vector;
}

std::optional<double> descent_direction_rad(double difference_here,
                                            std::span<const NearbyDifference> nearby) {
  require(std::isfinite(difference_here), "difference", difference_here, "a finite number");
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  double xd = 0.0;
  double yd = 0.0;
  for (const NearbyDifference& there : nearby) {
    const double x = there.offset.x_m;
    const double y = there.offset.y_m;
    const double rise = there.difference - difference_here;
    require(std::isfinite(x) && std::isfinite(y), "offset", x, "finite numbers");
    require(std::isfinite(rise), "difference", there.difference, "a finite number");
    xx += x * x;
    xy += x * y;
    yy += y * y;
    xd += x * rise;
    yd += y * rise;
  }
  const double determinant = xx * yy - xy * xy;
  constexpr double collinear = 1e-9;
  if (!(determinant > collinear * xx * yy)) return std::nullopt;
  const double slope_x = (yy * xd - xy * yd) / determinant;
  const double slope_y = (xx * yd - xy * xd) / determinant;
  if (slope_x == 0.0 && slope_y == 0.0) return std::nullopt;
  return std::atan2(-slope_y, -slope_x);
}

}  // namespace panonav
