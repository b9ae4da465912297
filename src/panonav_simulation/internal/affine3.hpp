#pragma once

#include <array>

#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// An affine transform, p_in_a = matrix * p_in_b + translation, for poses, scales and mirror
/// images of scene parts. The matrix is row-major.
struct Affine3 {
  std::array<double, 9> matrix{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  Vector3 translation;

  [[nodiscard]] static Affine3 scaling(double x, double y, double z) {
    return {{x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z}, {}};
  }
  [[nodiscard]] Vector3 operator*(const Vector3& p) const {
    const auto& m = matrix;
    return {m[0] * p.x_m + m[1] * p.y_m + m[2] * p.z_m + translation.x_m,
            m[3] * p.x_m + m[4] * p.y_m + m[5] * p.z_m + translation.y_m,
            m[6] * p.x_m + m[7] * p.y_m + m[8] * p.z_m + translation.z_m};
  }
};

/// Returns the determinant of the matrix; below 0 if the transform mirrors.
[[nodiscard]] inline double determinant(const Affine3& transform) {
  const auto& m = transform.matrix;
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
         m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/// Returns a_from_c = a_from_b * b_from_c.
[[nodiscard]] inline Affine3 operator*(const Affine3& a_from_b, const Affine3& b_from_c) {
  Affine3 result;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      double sum = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        sum += a_from_b.matrix[3 * row + k] * b_from_c.matrix[3 * k + column];
      }
      result.matrix[3 * row + column] = sum;
    }
  }
  result.translation = a_from_b * b_from_c.translation;
  return result;
}

}  // namespace panonav::simulation
