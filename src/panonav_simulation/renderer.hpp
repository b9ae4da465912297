#pragma once

#include <memory>
#include <string>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// Pose of the camera in the scene. Its axis is vertical unless the robot is tilted.
struct Viewpoint {
  Pose2 pose;              ///< of the robot on the floor, in the scene's x and y
  double height_m = 0.6;   ///< of the single viewpoint above the floor
  double roll_rad = 0.0;   ///< about the robot's x axis, then
  double pitch_rad = 0.0;  ///< about its y axis; positive lowers the front
};

/// Options of rendering a scene.
struct RendererOptions {
  /// Embree's instruction set, for example "sse4.2" for pictures that must be the same on every
  /// machine. Empty: the widest that the processor has.
  std::string instructions{};
  /// Lamps cast shadows and corners are darker. Off: every surface is lit as if it stood alone.
  bool shadows = true;
  /// 1: grey. 3: images in colour, for people; panoramas are grey all the same.
  int channels = 1;
};

/// Size and rays of a rendered panoramic cylinder.
struct PanoramaRendering {
  int rows = 80;                                                      ///< values of a column, >= 1
  int columns = 512;                                                  ///< values of a row, >= 4
  ElevationBand elevations{-0.5235987755982988, 0.6981317007977318};  ///< -30 .. 40 degrees
  /// Rays per pixel and axis, n x n within the pixel. No two share a line along either axis, so
  /// that an edge is placed to 1 / n^2 of a pixel.
  int rays_per_axis = 2;
};

/// Light at the pixels of a camera before exposure and noise: linear, 1 is white in light 1,
/// not clamped. Rows from the top, channels interleaved (1 grey by the weights of ITU-R BT.601, 3
/// RGB).
struct Radiance {
  int width = 0;              ///< pixels of a row
  int height = 0;             ///< rows
  int channels = 1;           ///< 1 grey, 3 RGB
  std::vector<float> values;  ///< width * height * channels numbers
};

/// Ray tracing of a scene with Embree. Light and shadows are computed once, when it is built, at
/// points a 25th of the floor's diagonal apart (some tenths of a second for a room); a ray then
/// costs a fraction of a microsecond. Same scene, viewpoint and instruction set: same bits on any
/// number of threads. All members may be called from several threads at once.
class Renderer {
 public:
  /// Copies the parts of the scene that it needs. Throws ContractError on a scene that is not valid
  /// and on a number of channels that is neither 1 nor 3. `executor` helps to compute the light.
  Renderer(const Scene& scene, const RendererOptions& options, Executor& executor);
  /// Builds it with the light computed in the calling thread alone.
  explicit Renderer(const Scene& scene, const RendererOptions& options = {});
  ~Renderer();
  /// A moved-from renderer may only be destroyed or assigned to.
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// Returns the brightness in 0 .. 1 that a noiseless grey camera sees along a ray from any point,
  /// in scene coordinates. Textures are smoothed over `spread_rad`, the angle between neighbouring
  /// rays.
  [[nodiscard]] float radiance_along(const Vector3& origin, const Direction3& direction,
                                     double spread_rad) const;

  /// Renders the panoramic cylinder directly: no mirror, no sensor. Throws ContractError unless
  /// rows >= 1, columns >= 4, rays_per_axis 1 .. 8.
  [[nodiscard]] Panorama render_panorama(const Viewpoint& viewpoint,
                                         const PanoramaRendering& rendering,
                                         Executor& executor) const;

  /// Renders the image of a camera. A hyperboloidal mirror is traced as a physical mirror, with the
  /// camera's body in the middle and dark housing beyond the rim (see HyperboloidalMirror); every
  /// other camera by `unproject`, 0 where it sees nothing; the lenses of a dual fisheye camera from
  /// their own viewpoints, times their gain. Throws ContractError unless the camera is valid and
  /// rays_per_axis is 1 .. 8.
  [[nodiscard]] Radiance render_image(const Viewpoint& viewpoint, const Camera& camera,
                                      int rays_per_axis, Executor& executor) const;

  /// Returns the metres to the nearest surface along the ray; infinity where there is none.
  [[nodiscard]] double distance_along(const Vector3& origin, const Direction3& direction) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Converts to 8-bit pixels: 1 becomes 255, rounded and clamped, without noise.
[[nodiscard]] Image to_image(const Radiance& radiance);

/// Returns the direction `in_robot` in scene coordinates, for a robot with this heading and tilt.
[[nodiscard]] Direction3 scene_from_robot(const Viewpoint& viewpoint, const Direction3& in_robot);

}  // namespace panonav::simulation
