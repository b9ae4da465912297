#include "panonav/geometry/alignment.hpp"

#include <Eigen/Dense>
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

Rotation3 Rotation3::from_matrix(const std::array<double, 9>& rows) {
  const Eigen::Matrix3d matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>(rows.data());
  const Eigen::Quaterniond q = Eigen::Quaterniond(matrix).normalized();
  return {q.w(), q.x(), q.y(), q.z()};
}

Point3 Alignment3::apply(Point3 p_in_from) const {
  if (reflected) p_in_from.y_m = -p_in_from.y_m;
  const Point3 p = rotation * p_in_from;
  return {scale * p.x_m + translation.x_m, scale * p.y_m + translation.y_m,
          scale * p.z_m + translation.z_m};
}

Pose3 Alignment3::apply(const Pose3& pose_in_from) const {
  Rotation3 q = pose_in_from.rotation;
  if (reflected) q = {q.w, -q.x, q.y, -q.z};
  return {apply(pose_in_from.position), rotation * q};
}

namespace {

Eigen::Matrix3Xd to_columns(std::span<const Point3> points) {
  Eigen::Matrix3Xd columns(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    columns.col(static_cast<Eigen::Index>(i)) << points[i].x_m, points[i].y_m, points[i].z_m;
  }
  return columns;
}

void set_translation(Alignment3& alignment, const Eigen::Vector3d& from_centre,
                     const Eigen::Vector3d& to_centre) {
  alignment.translation = {};
  const Point3 moved = alignment.apply(Point3{from_centre.x(), from_centre.y(), from_centre.z()});
  alignment.translation = {to_centre.x() - moved.x_m, to_centre.y() - moved.y_m,
                           to_centre.z() - moved.z_m};
}

void require_pairs(std::size_t from, std::size_t to) {
  require(from > 0 && from == to, "number of points to align", static_cast<double>(from),
          "the size of the other set, >= 1");
}

}  // namespace

Alignment3 align_in_space(std::span<const Point3> from, std::span<const Point3> to,
                          const Alignment::Options& options) {
  require_pairs(from.size(), to.size());
  // The second singular value relative to the first, below which it is rounding: points on a line.
  constexpr double rank_tolerance = 1e-14;
  Eigen::Matrix3Xd x = to_columns(from);
  Eigen::Matrix3Xd y = to_columns(to);
  const Eigen::Vector3d x_centre = x.rowwise().mean();
  const Eigen::Vector3d y_centre = y.rowwise().mean();
  x.colwise() -= x_centre;
  y.colwise() -= y_centre;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(y * x.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d d = svd.singularValues();
  Eigen::Matrix3d r = svd.matrixU() * svd.matrixV().transpose();
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  Alignment3 result;
  result.is_unique = d[1] > rank_tolerance * d[0];
  if (r.determinant() < 0.0) {
    result.reflected = options.allow_reflection && result.is_unique && d[2] > rank_tolerance * d[0];
    if (result.reflected) {
      r.col(1) *= -1.0;  // r times the reflection of y is the improper matrix
    } else {
      signs[2] = -1.0;
      r = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    }
  }
  Eigen::Quaterniond q(r);
  if (!result.is_unique) {
    q = d[0] > 0.0 ? Eigen::Quaterniond::FromTwoVectors(svd.matrixV().col(0), svd.matrixU().col(0))
                   : Eigen::Quaterniond::Identity();
  }
  q.normalize();
  result.rotation = {q.w(), q.x(), q.y(), q.z()};
  const double x_norm2 = x.squaredNorm();
  if (options.allow_scale && x_norm2 > 0.0) result.scale = d.dot(signs) / x_norm2;
  set_translation(result, x_centre, y_centre);
  return result;
}

Alignment3 align_in_plane(std::span<const Point3> from, std::span<const Point3> to,
                          const Alignment::Options& options) {
  require_pairs(from.size(), to.size());
  const auto project = [](std::span<const Point3> points) {
    std::vector<Point2> projected;
    for (const Point3& point : points) projected.push_back({point.x_m, point.y_m});
    return projected;
  };
  const Alignment planar = align(project(from), project(to), options);
  Alignment3 result;
  result.scale = planar.scale;
  result.rotation = Rotation3::from_yaw(planar.rotation_rad);
  result.reflected = planar.reflected;
  set_translation(result, to_columns(from).rowwise().mean(), to_columns(to).rowwise().mean());
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
