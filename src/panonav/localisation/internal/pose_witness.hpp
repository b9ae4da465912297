#pragma once

#include <optional>
#include <span>

#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Largest difference of two headings that agree: four times the error of the compass between
/// neighbouring views, far below the quarter rotation after which rooms look alike.
inline constexpr double agreeing_heading_rad = radians(20.0);

/// A certain answer to one image of a run, as evidence of the pose of another image.
struct PoseWitness {
  Pose2 odometry;            ///< at the answered image, in the odometry's frame
  Pose2 pose;                ///< of the answer, in the frame of the memory's positions
  double radius_m = 0.0;     ///< of the answer: holds its position in 95 % of the cases
  double travelled_m = 0.0;  ///< between it and the other image, >= 0
};

/// Returns where a robot certainly took an image, by the answers to other images of the run,
/// carried there by odometry. At least three witnesses, from images that lie two spacings apart,
/// must agree on a pose, and four fifths of all; the image's own answer only makes the pose more
/// precise. So a camera that was turned, a place that resembles another and a kidnapped robot show
/// nothing. nullopt where the witnesses are too few, too near to each other or disagree.
/// `odometry`: at the image; `own`: its own answer, where that was sure. `spacing_m`: of the
/// references. Cost: the square of the number of witnesses.
[[nodiscard]] std::optional<Pose2> find_witnessed_pose(const Pose2& odometry,
                                                       std::span<const PoseWitness> witnesses,
                                                       const std::optional<PoseWitness>& own,
                                                       double spacing_m);

}  // namespace panonav
