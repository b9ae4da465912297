#pragma once

#include <array>
#include <optional>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// One fisheye lens with its sensor. A direction at the angle theta from the optical axis is seen
/// r = f (theta + k3 theta^3 + k5 theta^5) from the centre (Kannala, Brandt 2006, two odd terms).
/// Valid where r grows with theta, from 0 to `max_angle_rad`.
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

  /// A direction as one lens sees it.
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
  /// Half of the field of view: nothing is seen beyond. In (0, pi].
  double max_angle_rad = 1.6580627893946132;
  /// Azimuth of the optical axis in the robot frame.
  double azimuth_rad = 0.0;
  double elevation_rad = 0.0;  ///< of the optical axis, above the horizon
  /// The turn of lens and sensor about the viewing direction, right-handed: the picture shows what
  /// is above turned by this angle counter-clockwise.
  double roll_rad = 0.0;
  /// Brightness of its picture, > 0; only the ratio of the two lenses counts.
  double gain = 1.0;
  friend bool operator==(const FisheyeLens&, const FisheyeLens&) = default;
};

/// Two fisheye lenses back to back whose circles are side by side in one image, as 360 degree
/// cameras deliver it live: lens 0 in the left half, lens 1 in the right one. Together they see all
/// directions if each sees more than half of them.
struct DualFisheyeModel {
  std::array<FisheyeLens, 2> lenses;  ///< in the order of their halves of the picture
  /// Distance between the viewpoints of both lenses; each is half of it in front of the middle of
  /// the camera, along its own axis. Simulated images have this parallax; projection takes
  /// everything as far away.
  double baseline_m = 0.0;
  friend bool operator==(const DualFisheyeModel&, const DualFisheyeModel&) = default;
};

/// Throws ContractError that names the lens, the field, its value and its range.
void validate(const DualFisheyeModel& model);

/// Distance from the lens's centre at which `angle_rad` from its axis is seen.
[[nodiscard]] double radius_at(const FisheyeLens& lens, double angle_rad);
/// Inverts `radius_at`, for a radius within 0 .. radius_at(lens, max_angle_rad), by Newton steps.
[[nodiscard]] double angle_at(const FisheyeLens& lens, double radius_px);

/// Projects a direction of the lens frame, of any length but 0; nullopt beyond the field of view.
[[nodiscard]] std::optional<FisheyeLens::Point> project(const FisheyeLens& lens,
                                                        const Direction3& in_lens);
/// Returns the unit direction in the lens frame; nullopt beyond the field of view.
[[nodiscard]] std::optional<Direction3> unproject(const FisheyeLens& lens, double right_px,
                                                  double up_px);

/// Returns the share of the first lens in the blended image of a direction that both see, by its
/// distance from the borders of both fields of view: 1/2 on the seam, where both are equal, 1 and 0
/// from a quarter of the overlap before its borders on. Continuous; the share of the second lens is
/// 1 less it.
[[nodiscard]] double blend_share(double margin_rad, double other_margin_rad);

}  // namespace panonav
