#pragma once

#include <cstdint>

#include "panonav/camera/camera.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// Target of the light of a pixel of a mirror camera.
enum class MirrorTarget {
  world,        ///< the world, along the reflected ray
  camera_body,  ///< the camera itself, reflected in the middle of the mirror
  housing       ///< what lies beyond the mirror's rim
};

/// The path of light from a pixel through the lens to the mirror and out, in the robot frame (x
/// forward, y left, z up) with its origin in the mirror's inner focus, the viewpoint.
struct MirrorRay {
  MirrorTarget target = MirrorTarget::housing;  ///< what the light of the pixel comes from
  Vector3 origin;                               ///< on the mirror; meaningless for the housing
  Direction3 direction;                         ///< of unit length; meaningless for the housing
  double body_radius = 0.0;  ///< camera body: distance from its axis in radii of the body, 0 .. 1
};

/// A hyperboloidal mirror above a pinhole, as a thing of glass: the ray is reflected by the
/// surface's normal where it meets the surface, and no use is made of the single viewpoint. [Y03
/// eq. 1, figure 1]
class HyperboloidalMirror {
 public:
  /// Throws ContractError unless the camera is valid and its model hyperboloidal.
  explicit HyperboloidalMirror(const Camera& camera);

  /// Traces the light of a point of the image. Points beyond the mirror's rim see the housing.
  [[nodiscard]] MirrorRay trace(PixelPoint pixel) const;
  /// Returns the radius of the mirror's rim.
  [[nodiscard]] double rim_radius_m() const noexcept { return rim_radius_mm_ * 1e-3; }
  /// Returns the radius of the camera body that hides the middle; 0: nothing is hidden.
  [[nodiscard]] double body_radius_m() const noexcept { return body_radius_mm_ * 1e-3; }

 private:
  struct Point {
    double radius_mm, height_mm;      // of the hit, about the middle between the foci
    double direction_r, direction_z;  // of the reflected ray, unit length
  };
  // Reflects a ray; false if it misses the mirror's sheet.
  bool reflect(double radius_px, Point& point) const;

  Camera camera_;
  HyperboloidalModel model_;
  double focus_mm_;  // c: the inner focus lies at height +c, the lens at -c
  double rim_radius_mm_ = 0.0;
  double body_radius_mm_ = 0.0;
};

/// Returns the mirror camera that the simulated robot carries: 640 x 480 pixels, the shape of
/// [Y03]'s mirror at a third of its size (5 cm across, so that it suits the smallest scene), from
/// 58 degrees below the horizon to 21 above.
[[nodiscard]] Camera make_simulated_mirror_camera();

/// Returns a 360 degree camera of two fisheye lenses, 1280 x 640 pixels, 190 degrees each, the left
/// one forward. `lens_seed` 0: lenses as drawn. Any other: as made, with centres up to 5 px off,
/// axes and rolls up to 2 degrees, focal lengths up to 2.5 %, a distortion of their own (k3 and k5
/// up to 0.01 and 0.002) and one of them up to a fifth darker.
[[nodiscard]] Camera make_simulated_dual_fisheye(std::uint64_t lens_seed, double baseline_m = 0.0);

}  // namespace panonav::simulation
