#pragma once

#include <array>
#include <optional>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// One fisheye lens with its sensor. A direction at the angle theta from the optical axis is imaged
/// at the distance r = f (theta + k3 theta^3 + k5 theta^5) from the centre (Kannala, Brandt 2006,
/// with two odd terms). Valid if r grows with theta from 0 to `max_angle_rad`.
struct FisheyeLens {
  /// Rotation of a lens, by its azimuth, elevation and roll. The lens frame has x along the optical
  /// axis, y towards the left of its picture and z towards the top.
  class Rotation {
   public:
    /// Computes the rotation once, for many directions.
    explicit Rotation(const FisheyeLens& lens);
    /// Rotates a direction of the lens frame into the robot frame.
    [[nodiscard]] Direction3 robot_from_lens(const Direction3& d) const;
    /// Rotates a direction of the robot frame into the lens frame.
    [[nodiscard]] Direction3 lens_from_robot(const Direction3& d) const;

   private:
    std::array<Direction3, 3> axes_;  ///< of the lens, in the robot frame
  };

  /// Projection of a direction into one lens.
  struct Point {
    double right_px = 0.0;  ///< from the lens's centre
    double up_px = 0.0;     ///< from the lens's centre, against v
    /// Angle to the border of the lens's field of view, > 0 within; 0 on it.
    double margin_rad = 0.0;
  };

  double centre_u_px = 0.0;        ///< of the optical axis, from the picture's left edge
  double centre_v_px = 0.0;        ///< of the optical axis, from the picture's upper edge
  double focal_length_px = 150.0;  ///< above 0, pixels for each radian at the centre
  double k3 = 0.0;                 ///< radial distortion of third order, without unit
  double k5 = 0.0;                 ///< radial distortion of fifth order, without unit
  /// Half of the field of view, in (0, pi].
  double max_angle_rad = 1.6580627893946132;
  /// Azimuth of the optical axis in the robot frame.
  double azimuth_rad = 0.0;
  double elevation_rad = 0.0;  ///< of the optical axis, above the horizon
  /// Right-handed rotation of lens and sensor about the viewing direction: the world's up direction
  /// appears in the picture rotated counter-clockwise from its top by this angle.
  double roll_rad = 0.0;
  /// Relative brightness of the lens's picture, > 0; only the ratio between the two lenses matters.
  double gain = 1.0;
  friend bool operator==(const FisheyeLens&, const FisheyeLens&) = default;
};

/// Two fisheye lenses back to back, imaged side by side in one picture, as in the live video of 360
/// degree cameras: lens 0 in the left half, lens 1 in the right one. They cover the whole sphere if
/// each has a field of view above 180 degrees.
struct DualFisheyeModel {
  std::array<FisheyeLens, 2> lenses;  ///< in the order of their halves of the picture
  /// Distance between the viewpoints of the lenses; each viewpoint is half of it from the camera's
  /// centre, along the lens's axis. Only simulated images use it; projection assumes distant
  /// points.
  double baseline_m = 0.0;
  friend bool operator==(const DualFisheyeModel&, const DualFisheyeModel&) = default;
};

/// Throws ContractError that names the lens, the field, its value and its range.
void validate(const DualFisheyeModel& model);

/// Returns the distance from the lens's centre, in px, of directions at `angle_rad` from its axis.
[[nodiscard]] double radius_at(const FisheyeLens& lens, double angle_rad);
/// Inverts `radius_at`, for a radius within 0 .. radius_at(lens, max_angle_rad), by Newton steps.
[[nodiscard]] double angle_at(const FisheyeLens& lens, double radius_px);

/// Projects a direction of the lens frame, of any length but 0; nullopt beyond the field of view.
[[nodiscard]] std::optional<FisheyeLens::Point> project(const FisheyeLens& lens,
                                                        const Direction3& in_lens);
/// Returns the unit direction in the lens frame; nullopt beyond the field of view.
[[nodiscard]] std::optional<Direction3> unproject(const FisheyeLens& lens, double right_px,
                                                  double up_px);

/// Returns the weight of the first lens when blending a direction that both lenses see, from the
/// angles to the borders of both fields of view: 1/2 on the seam, where the angles are equal, and 1
/// or 0 in the outer quarters of the overlap. Continuous; the second lens has the complementary
/// weight.
[[nodiscard]] double blend_share(double margin_rad, double other_margin_rad);

}  // namespace panonav
