#pragma once

#include <optional>

#include "panonav/camera/unified_model.hpp"

namespace panonav {

/// Fisheye lens with a vertical axis: a direction at the angle theta from the axis is imaged at the
/// distance r = f (theta + k1 theta^3 + k2 theta^5 + k3 theta^7 + k4 theta^9) from the centre
/// (Kannala, Brandt 2006; the model of OpenCV's cv::fisheye and Kalibr's pinhole-equi). Valid if r
/// grows with theta from 0 to `max_angle_rad`.
struct FisheyeModel {
  double focal_length_px = 300.0;             ///< above 0, pixels for each radian at the centre
  double k1 = 0.0;                            ///< radial distortion of third order, without unit
  double k2 = 0.0;                            ///< of fifth order
  double k3 = 0.0;                            ///< of seventh order
  double k4 = 0.0;                            ///< of ninth order
  double max_angle_rad = 1.6580627893946132;  ///< half of the field of view, in (0, pi]
  /// Direction that the middle of the picture shows.
  UnifiedModel::Axis axis = UnifiedModel::Axis::down;
  friend bool operator==(const FisheyeModel&, const FisheyeModel&) = default;
};

/// Throws ContractError that names the field, its value and its range.
void validate(const FisheyeModel& model);

/// Returns the distance from the centre at which directions at an angle from the axis are imaged.
[[nodiscard]] double radius_at_angle(const FisheyeModel& model, double angle_rad);
/// Returns the largest angle up to `limit_rad` to which the distance from the centre grows.
[[nodiscard]] double find_last_growing_angle(const FisheyeModel& model, double limit_rad);

/// Returns the elevation (up is positive) visible at distance `radius_px` from the image centre, by
/// Newton steps; nullopt outside the valid domain.
[[nodiscard]] std::optional<double> elevation_at(const FisheyeModel& model, double radius_px);

/// Returns the distance from the image centre at which an elevation is visible; nullopt outside the
/// valid domain.
[[nodiscard]] std::optional<double> radius_at(const FisheyeModel& model, double elevation_rad);

}  // namespace panonav
