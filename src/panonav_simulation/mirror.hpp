#pragma once

#include <cstdint>

#include "panonav/camera/camera.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// Origin of the light in a pixel of a mirror camera.
enum class MirrorTarget {
  world,        ///< the world, along the reflected ray
  camera_body,  ///< the camera, reflected in the mirror's middle
  housing       ///< the surroundings of the mirror, beyond its rim
};

/// The path of light from a pixel through the lens to the mirror and out, in the robot frame (x
/// forward, y left, z up) with its origin at the mirror's inner focus, which is the viewpoint.
struct MirrorRay {
  MirrorTarget target = MirrorTarget::housing;  ///< origin of the pixel's light
  Vector3 origin;                               ///< on the mirror; meaningless for the housing
  Direction3 direction;                         ///< of unit length; meaningless for the housing
  double body_radius = 0.0;  ///< camera body: distance from its axis / its radius
};

/// A hyperboloidal mirror above a pinhole, simulated physically: the ray is reflected about the
/// surface normal at its hit point, without assuming a single viewpoint. [Y03 eq. 1, figure 1]
class HyperboloidalMirror {
 public:
  /// Throws ContractError unless the camera is valid and its model hyperboloidal.
  explicit HyperboloidalMirror(const Camera& camera);

  /// Traces the light of an image point back to its origin. Points beyond the mirror's rim show the
  /// housing.
  [[nodiscard]] MirrorRay trace(PixelPoint pixel) const;
  /// Returns the radius of the mirror's rim.
  [[nodiscard]] double rim_radius_m() const noexcept { return rim_radius_mm_ * 1e-3; }
  /// Returns the radius of the camera body that hides the middle of the mirror; 0 if nothing is
  /// hidden.
  [[nodiscard]] double body_radius_m() const noexcept { return body_radius_mm_ * 1e-3; }

 private:
  struct Point {
    double radius_mm, height_mm;      // hit point; height above the middle between the foci
    double direction_r, direction_z;  // of the reflected ray, unit length
  };
  // Reflects a ray at the mirror; returns false if it misses the mirror's sheet.
  bool reflect(double radius_px, Point& point) const;

  Camera camera_;
  HyperboloidalModel model_;
  double focus_mm_;  // c: height of the inner focus +c, of the lens -c
  double rim_radius_mm_ = 0.0;
  double body_radius_mm_ = 0.0;
};

/// Returns the mirror camera of the simulated robot: 640 x 480 pixels, with the mirror of [Y03]
/// scaled to a third (5 cm across, to suit the smallest scene), and a view from 58 degrees below to
/// 21 degrees above the horizon.
[[nodiscard]] Camera make_simulated_mirror_camera();

/// Returns a 360 degree camera of two fisheye lenses, 1280 x 640 pixels, 190 degrees per lens, the
/// left one forward. With `lens_seed` 0 the lenses are ideal; with any other seed they have
/// manufacturing errors: centres up to 5 px off, axes and rolls up to 2 degrees, focal lengths up
/// to 2.5 %, distortions k3 and k5 up to 0.01 and 0.002, and one lens up to a fifth darker.
[[nodiscard]] Camera make_simulated_dual_fisheye(std::uint64_t lens_seed, double baseline_m = 0.0);

}  // namespace panonav::simulation
