#include "panonav/geometry/alignment.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

Point2 centroid(std::span<const Point2> points) {
  Point2 sum;
  for (const auto& p : points) {
    sum.x_m += p.x_m;
    sum.y_m += p.y_m;
  }
  const auto n = static_cast<double>(points.size());
  return {sum.x_m / n, sum.y_m / n};
}

// In the plane two complex correlations replace the 2 x 2 singular value decomposition: with
// points as complex numbers, |sum conj(a) b| = s_1 + s_2 of a proper rotation, |sum a b| that of a
// reflection.
struct Correlations {
  double proper_real = 0.0, proper_imaginary = 0.0;
  double mirrored_real = 0.0, mirrored_imaginary = 0.0;
  double from_norm2 = 0.0, to_norm2 = 0.0;
};

Correlations correlate(std::span<const Point2> from, Point2 from_centre, std::span<const Point2> to,
                       Point2 to_centre) {
  Correlations c;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double ax = from[i].x_m - from_centre.x_m;
    const double ay = from[i].y_m - from_centre.y_m;
    const double bx = to[i].x_m - to_centre.x_m;
    const double by = to[i].y_m - to_centre.y_m;
    c.proper_real += ax * bx + ay * by;
    c.proper_imaginary += ax * by - ay * bx;
    c.mirrored_real += ax * bx - ay * by;
    c.mirrored_imaginary += ax * by + ay * bx;
    c.from_norm2 += ax * ax + ay * ay;
    c.to_norm2 += bx * bx + by * by;
  }
  return c;
}

}  // namespace

Point2 Alignment::apply(Point2 p_in_from) const {
  const double y = reflected ? -p_in_from.y_m : p_in_from.y_m;
  const double c = scale * std::cos(rotation_rad);
  const double s = scale * std::sin(rotation_rad);
  return {c * p_in_from.x_m - s * y + translation.x_m, s * p_in_from.x_m + c * y + translation.y_m};
}

Alignment align(std::span<const Point2> from, std::span<const Point2> to,
                const Alignment::Options& options) {
  require(!from.empty() && from.size() == to.size(), "number of points to align",
          static_cast<double>(from.size()), "the size of the other set, >= 1");
  const Point2 from_centre = centroid(from);
  const Point2 to_centre = centroid(to);
  const Correlations c = correlate(from, from_centre, to, to_centre);
  const double proper = std::hypot(c.proper_real, c.proper_imaginary);
  const double mirrored = std::hypot(c.mirrored_real, c.mirrored_imaginary);

  Alignment result;
  result.reflected = options.allow_reflection && mirrored > proper;
  result.rotation_rad = result.reflected ? std::atan2(c.mirrored_imaginary, c.mirrored_real)
                                         : std::atan2(c.proper_imaginary, c.proper_real);
  if (options.allow_scale && c.from_norm2 > 0.0) {
    result.scale = (result.reflected ? mirrored : proper) / c.from_norm2;
  }
  const Point2 rotated = result.apply(from_centre);
  result.translation = {to_centre.x_m - rotated.x_m, to_centre.y_m - rotated.y_m};
  double sum = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double d = distance(result.apply(from[i]), to[i]);
    sum += d * d;
  }
  result.rms_m = std::sqrt(sum / static_cast<double>(from.size()));
  return result;
}

ShapeDifference shape_difference(std::span<const Point2> a, std::span<const Point2> b) {
  require(a.size() >= 2 && a.size() == b.size(), "number of points of a shape",
          static_cast<double>(a.size()), "the size of the other shape, >= 2");
  const Correlations c = correlate(a, centroid(a), b, centroid(b));
  require(c.from_norm2 > 0.0 && c.to_norm2 > 0.0, "extent of a shape",
          std::min(c.from_norm2, c.to_norm2), "> 0");
  const double norm2 = c.from_norm2 * c.to_norm2;
  const auto mu = [norm2](double real, double imaginary) {
    return std::clamp(1.0 - (real * real + imaginary * imaginary) / norm2, 0.0, 1.0);
  };
  ShapeDifference result;
  result.value = mu(c.proper_real, c.proper_imaginary);
  result.with_reflection = std::min(result.value, mu(c.mirrored_real, c.mirrored_imaginary));
  return result;
}

}  // namespace panonav
