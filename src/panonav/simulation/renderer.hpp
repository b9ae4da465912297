#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "panonav/camera/camera.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/simulation/scene.hpp"

namespace panonav {

/// Where the camera is in the scene. Its axis is vertical unless the robot is tilted.
struct Viewpoint {
  Pose2 pose;
  double height_m = 0.6;   ///< of the single viewpoint above the floor
  double roll_rad = 0.0;   ///< about the robot's x axis, then
  double pitch_rad = 0.0;  ///< about its y axis; positive lowers the front
};

struct RendererOptions {
  /// Embree's instruction set, for example "sse4.2" for pictures that must be the same on every
  /// machine. Empty: the widest that the processor has.
  std::string instructions;
};

/// How a panoramic cylinder is rendered.
struct PanoramaRendering {
  int rows = 80;
  int columns = 512;
  ElevationBand elevations{-0.5235987755982988, 0.6981317007977318};  ///< -30 .. 40 degrees
  /// Rays per pixel and axis: 1, 2 or more on a regular grid within the pixel.
  int rays_per_axis = 2;
};

/// Ray tracing of a scene with Embree. Building takes time in the order of the triangles, a ray
/// about a microsecond. Same scene, viewpoint and instruction set: same bits on any number of
/// threads. All members may be called from several threads at once.
class Renderer {
 public:
  /// Keeps what it needs of the scene. Throws ContractError on a scene that is not valid.
  explicit Renderer(const Scene& scene, const RendererOptions& options = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// The brightness in 0 .. 1 that a noiseless grey camera sees along `direction` (robot frame)
  /// from `viewpoint`. `spread_rad` is the angle between neighbouring rays; it chooses how much
  /// textures are smoothed.
  [[nodiscard]] float radiance(const Viewpoint& viewpoint, const Direction3& direction,
                               double spread_rad) const;

  /// Brightness along a ray from any point of the scene, in scene coordinates.
  [[nodiscard]] float radiance_along(const Vector3& origin, const Direction3& direction,
                                     double spread_rad) const;

  /// The panoramic cylinder, rendered directly: no mirror, no sensor. Throws ContractError unless
  /// rows >= 1, columns >= 4, rays_per_axis 1 .. 8.
  [[nodiscard]] Panorama render_panorama(const Viewpoint& viewpoint,
                                         const PanoramaRendering& rendering,
                                         Executor& executor) const;

  /// Metres to the nearest surface along the ray; infinity where there is none.
  [[nodiscard]] double distance_along(const Vector3& origin, const Direction3& direction) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// The direction `in_robot` in scene coordinates, for a robot with this heading and tilt.
[[nodiscard]] Direction3 scene_from_robot(const Viewpoint& viewpoint, const Direction3& in_robot);

}  // namespace panonav
