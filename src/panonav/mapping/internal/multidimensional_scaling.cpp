#include "panonav/mapping/internal/multidimensional_scaling.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "panonav/core/error.hpp"

namespace panonav {

std::vector<Point2> multidimensional_scaling(std::span<const std::size_t> landmarks,
                                             std::size_t count, std::span<const double> distances) {
  const auto known = static_cast<Eigen::Index>(landmarks.size());
  require(known >= 1 && landmarks.size() <= count, "number of landmarks",
          static_cast<double>(known), ">= 1 and at most the number of points");
  require(distances.size() == landmarks.size() * count, "number of distances",
          static_cast<double>(distances.size()), "one for each landmark and point");
  for (const std::size_t landmark : landmarks) {
    require(landmark < count, "landmark", static_cast<double>(landmark),
            "below the number of points");
  }
  for (const double value : distances) {
    require(std::isfinite(value) && value >= 0.0, "distance", value, "finite and >= 0");
  }
  const auto squared = [&](Eigen::Index row, std::size_t point) {
    const double d = distances[static_cast<std::size_t>(row) * count + point];
    return d * d;
  };

  Eigen::MatrixXd among(known, known);
  for (Eigen::Index i = 0; i < known; ++i) {
    for (Eigen::Index j = 0; j < known; ++j) {
      among(i, j) = 0.5 * (squared(i, landmarks[static_cast<std::size_t>(j)]) +
                           squared(j, landmarks[static_cast<std::size_t>(i)]));
    }
  }
  const Eigen::VectorXd mean = among.rowwise().mean();
  Eigen::MatrixXd inner = among.colwise() - mean;
  inner = -0.5 * ((inner.rowwise() - mean.transpose()).array() + mean.mean()).matrix();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(inner);

  std::vector<Point2> points(count);
  Eigen::VectorXd difference(known);
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Index column = known - 1 - axis;
    if (column < 0) break;
    const double value = solver.eigenvalues()(column);
    // Eigenvalues below the rounding error of the largest one are treated as 0.
    if (!(value > 1e-12 * std::max(solver.eigenvalues()(known - 1), 1e-300))) break;
    Eigen::VectorXd direction = solver.eigenvectors().col(column) / std::sqrt(value);
    Eigen::Index largest = 0;
    static_cast<void>(direction.cwiseAbs().maxCoeff(&largest));
    if (direction(largest) < 0.0) direction = -direction;
    for (std::size_t point = 0; point < count; ++point) {
      for (Eigen::Index i = 0; i < known; ++i) difference(i) = mean(i) - squared(i, point);
      const double coordinate = 0.5 * direction.dot(difference);
      (axis == 0 ? points[point].x_m : points[point].y_m) = coordinate;
    }
  }
  return points;
}

}  // namespace panonav
