#pragma once

#include <optional>
#include <span>

#include "panonav/geometry/pose2.hpp"
#include "panonav/homing/fourier_homing.hpp"

namespace panonav {

/// The mean of the unit vectors to all landmarks, in the robot frame (Lambrinos et al. 2000): the
/// two numbers that the most parsimonious way of homing stores of a place. Length 0 .. 1.
struct AverageLandmarkVector {
  double x = 0.0;
  double y = 0.0;
  friend bool operator==(const AverageLandmarkVector&, const AverageLandmarkVector&) = default;
};

/// Of one row of pixels, column c at azimuth 2 pi c / columns. Every column is a landmark as far as
/// it is an edge: it counts by the difference of its neighbours. (0, 0) for a row without edges.
/// Throws ContractError unless there are 4 values or more, all finite.
[[nodiscard]] AverageLandmarkVector average_landmark_vector(std::span<const float> row);

/// Towards home: the current vector less that of home, which a compass has turned into the current
/// frame (`heading_rad` = heading of the home view minus heading of the current view). Edges that
/// the robot nears pull ahead of the mean and those that it leaves fall behind; among equally far
/// edges all around, a displacement d changes the mean by half of -d, so the difference is doubled.
/// `heading_rad` is handed through; there is no residual and no confidence but 1 for any vector.
[[nodiscard]] HomeVector landmark_home_vector(const AverageLandmarkVector& home,
                                              const AverageLandmarkVector& current,
                                              double heading_rad);

/// The image difference to home somewhere near the robot.
struct NearbyDifference {
  Point2 offset;  ///< from the current position, in any frame
  double difference = 0.0;
};

/// The way down the image difference surface (Zeil et al. 2003), for a robot that has looked around
/// itself: the direction, in the frame of the offsets, in which the plane that fits the differences
/// best falls. Empty when it does not fall or the offsets lie on a line through the robot. Throws
/// ContractError on a value that is not finite.
[[nodiscard]] std::optional<double> descent_direction_rad(double difference_here,
                                                          std::span<const NearbyDifference> nearby);

}  // namespace panonav
