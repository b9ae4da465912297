#pragma once

#include <optional>
#include <span>

#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Largest difference of two headings that agree: four times the compass's error between
/// neighbouring views, far below the quarter rotation after which rooms look similar.
inline constexpr double heading_agreement_tolerance_rad = radians(20.0);

/// A sure localisation of one image of a run, used as evidence of the pose of another image.
struct PoseWitness {
  Pose2 odometry;  ///< at the witness's image, in the odometry's frame
  Pose2 pose;      ///< localised, in the frame of the memory's positions
  /// Contains the true position in 95 % of the cases; nullopt if it is not known.
  std::optional<double> radius_m;
  double travelled_m = 0.0;  ///< distance travelled between the two images, >= 0
};

/// Returns the certain pose at which an image was taken, predicted by odometry from sure
/// localisations of other images of the run (witnesses). At least three witnesses, from images two
/// spacings apart, and four fifths of all must agree on the pose; the image's own localisation can
/// only refine it. So the pose stays unknown if the camera was turned, a place resembles another or
/// the robot was kidnapped. nullopt if the witnesses are too few, too near to each other or
/// disagree. `odometry`: at the image; `own`: its own localisation if sure. `spacing_m`: of the
/// references. Cost: the square of the number of witnesses.
[[nodiscard]] std::optional<Pose2> find_witnessed_pose(const Pose2& odometry,
                                                       std::span<const PoseWitness> witnesses,
                                                       const std::optional<PoseWitness>& own,
                                                       double spacing_m);

}  // namespace panonav
