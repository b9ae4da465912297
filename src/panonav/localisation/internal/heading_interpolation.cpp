#include "panonav/localisation/internal/heading_interpolation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "panonav/geometry/angles.hpp"

namespace panonav {

std::optional<double> interpolate_heading(const VisualMemory& memory,
                                          std::span<const PlaceMatch> matches,
                                          const std::optional<PositionEstimate>& position) {
  constexpr double agreement_rad = radians(15.0);  // three times the compass's typical error
  constexpr double min_difference = 1e-2;          // below it all weights are equal
  // Variance of the compass's random error over that of its change from the estimate to a typical
  // reference: 0.3 against 1 degree in `gantry_plants`. Keeps the plane flat where the references
  // do not differ in position, or where one is far more similar than all others.
  constexpr double slope_prior = 0.1;
  std::optional<double> centre_rad;
  // Weighted sums of the products of (1, x, y), and of these with the offset of the heading.
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squared_distances = 0.0;
  double count = 0.0;
  for (const PlaceMatch& match : matches.first(std::min(nearest_reference_count, matches.size()))) {
    const auto& pose = memory.info(match.view).pose;
    if (!pose || !pose->heading_rad || !match.heading_rad) continue;
    if (floor_of(match.name) != floor_of(matches.front().name)) continue;
    const double heading_rad = *pose->heading_rad + *match.heading_rad;
    if (!centre_rad) centre_rad = heading_rad;
    const double offset_rad = angle_difference(heading_rad, *centre_rad);
    if (std::abs(offset_rad) > agreement_rad) continue;
    const double weight = std::pow(std::max(min_difference, match.column_difference), -4.0);
    const Eigen::Vector3d row(1.0, position ? pose->x_m - position->x_m : 0.0,
                              position ? pose->y_m - position->y_m : 0.0);
    squared_distances += row[1] * row[1] + row[2] * row[2];
    count += 1.0;
    matrix += weight * row * row.transpose();
    right += weight * offset_rad * row;
  }
  if (!centre_rad) return std::nullopt;
  const double prior = slope_prior * matrix(0, 0) * squared_distances / count;
  if (!(prior > 0.0)) return wrap_angle(*centre_rad + right[0] / matrix(0, 0));
  matrix(1, 1) += prior;
  matrix(2, 2) += prior;
  return wrap_angle(*centre_rad + matrix.ldlt().solve(right)[0]);
}

}  // namespace panonav
