#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav {
class Unwarper;
}  // namespace panonav

namespace panonav::simulation {

/// Pose of the camera in the scene. Its axis is vertical if the robot is not tilted.
struct Viewpoint {
  Pose2 pose;              ///< of the robot on the floor, in the scene's x and y
  double height_m = 0.6;   ///< of the single viewpoint above the ground
  double roll_rad = 0.0;   ///< about the robot's x axis, applied before the pitch
  double pitch_rad = 0.0;  ///< about the robot's y axis; positive lowers the front
};

/// Options for rendering a scene.
struct RendererOptions {
  /// Embree's instruction set, for example "sse4.2" for pictures that are the same on every
  /// machine. Empty selects the widest set that the processor has.
  std::string instructions{};
  /// True: lamps cast shadows, and corners are darker. False: each surface is lit as if no other
  /// surface existed.
  bool shadows = true;
  /// 1 for grey, 3 for colour images; panoramas are always grey.
  int channels = 1;
};

/// The rays of some pixels of a camera, computed once for many pictures: most of the time of a
/// picture through a mirror is spent on following its rays to the mirror and back. Holds 28 bytes a
/// ray.
class PixelRays {
 public:
  /// Follows rays_per_axis^2 rays per pixel, the same as `Renderer::render_image`. `pixels`:
  /// offsets v * width + u, ascending. Throws ContractError unless the camera is valid,
  /// rays_per_axis is 1 .. 8 and all pixels are in its image.
  PixelRays(const Camera& camera, std::span<const std::uint32_t> pixels, int rays_per_axis);

  [[nodiscard]] const std::vector<std::uint32_t>& pixels() const noexcept { return pixels_; }
  [[nodiscard]] ImageSize image_size() const noexcept { return image_size_; }

 private:
  friend class Renderer;
  /// A ray in the robot's frame, with its origin measured from the viewpoint of the camera.
  struct PixelRay {
    std::array<float, 3> origin{};
    std::array<float, 3> direction{};
    std::uint32_t pixel = 0;  ///< index of `pixels_`
  };
  ImageSize image_size_;
  std::vector<std::uint32_t> pixels_;
  std::vector<float> gains_;    // light through the lens over rays, by pixel
  std::vector<PixelRay> rays_;  // into the scene, in the order of the pixels
  std::vector<float> bodies_;   // light of each pixel from parts of the camera
  float spread_rad_ = 0.0F;
};

/// Size, ray density and optics of a rendered panorama.
struct PanoramaRendering {
  int rows = 80;                                                      ///< number of rows, >= 1
  int columns = 512;                                                  ///< number of columns, >= 4
  ElevationBand elevations{-0.5235987755982988, 0.6981317007977318};  ///< -30 .. 40 degrees
  /// Rays per pixel and axis: n x n rays within the pixel, all with different u and v, so that an
  /// edge is resolved to 1 / n^2 of a pixel.
  int rays_per_axis = 2;
  /// If set, `capture_panorama` takes an image with this unwarper's camera, with rays_per_axis^2
  /// rays per pixel of the image, and unwarps it; the panorama then has the unwarper's size and
  /// elevations. If empty, the panorama is rendered directly.
  std::shared_ptr<const Unwarper> unwarper = nullptr;
  /// If set, only these pixels of the image are rendered, by these rays instead of `rays_per_axis`
  /// for each; they must be all pixels that the unwarper reads. Much faster than without.
  std::shared_ptr<const PixelRays> rays = nullptr;
};

/// Light at the pixels of a camera before exposure and noise: linear, not clamped; a white surface
/// in light 1 has the value 1. Rows from the top, channels interleaved (1: grey with the weights of
/// ITU-R BT.601, 3: RGB).
struct Radiance {
  int width = 0;              ///< pixels per row
  int height = 0;             ///< number of rows
  int channels = 1;           ///< 1 grey, 3 RGB
  std::vector<float> values;  ///< width * height * channels numbers
};

/// Ray tracer for a scene, based on Embree. Light and shadows are computed once, in the
/// constructor, at points a 25th of the floor's diagonal apart (some tenths of a second for a
/// room), at most 1 m or a 200th of it; after that a ray costs a fraction of a microsecond. The
/// same scene, viewpoint and instruction set give the same bits on any number of threads. All
/// members may be called from several threads at once.
class Renderer {
 public:
  /// Copies what it needs of the scene and computes the light on the threads of `executor`. Throws
  /// ContractError on an invalid scene, and unless the number of channels is 1 or 3.
  Renderer(const Scene& scene, const RendererOptions& options, Executor& executor);
  /// Builds the renderer in the calling thread alone.
  explicit Renderer(const Scene& scene, const RendererOptions& options = {});
  ~Renderer();
  /// A moved-from renderer may only be destroyed or assigned to.
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// Returns the brightness, 0 .. 1, that a noiseless grey camera measures along a ray from any
  /// point, in scene coordinates. Textures are averaged over `spread_rad`, the angle between
  /// neighbouring rays.
  [[nodiscard]] float radiance_along(const Vector3& origin, const Direction3& direction,
                                     double spread_rad) const;

  /// Renders a panorama directly, without mirror and sensor. Throws ContractError unless rows >= 1,
  /// columns >= 4, rays_per_axis is 1 .. 8 and the rendering has no unwarper.
  [[nodiscard]] Panorama render_panorama(const Viewpoint& viewpoint,
                                         const PanoramaRendering& rendering,
                                         Executor& executor) const;

  /// Renders the image of a camera. A hyperboloidal mirror is traced as a physical mirror, with the
  /// camera's body in the middle and dark housing beyond the rim (see HyperboloidalMirror); all
  /// other cameras use `unproject`, with 0 where a pixel sees nothing. The lenses of a dual fisheye
  /// camera have their own viewpoints and gains. Throws ContractError unless the camera is valid
  /// and rays_per_axis is 1 .. 8.
  [[nodiscard]] Radiance render_image(const Viewpoint& viewpoint, const Camera& camera,
                                      int rays_per_axis, Executor& executor) const;
  /// Renders some pixels of the image of a camera; the others are 0. The same light as in the whole
  /// image, up to rounding to single precision.
  [[nodiscard]] Radiance render_image(const Viewpoint& viewpoint, const PixelRays& pixel_rays,
                                      Executor& executor) const;

  /// Returns the distance in metres to the nearest surface along the ray; infinity if there is
  /// none.
  [[nodiscard]] double distance_along(const Vector3& origin, const Direction3& direction) const;

  /// Returns the height of the scene's ground at a position; 0 if the scene has none.
  [[nodiscard]] double ground_height_m(Point2 position) const noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Converts linear light to 8-bit pixels without noise: 1 becomes 255, rounded and clamped.
[[nodiscard]] Image to_image(const Radiance& radiance);

/// Rotates the direction `in_robot` to scene coordinates, for a robot with the heading and tilt of
/// `viewpoint`.
[[nodiscard]] Direction3 scene_from_robot(const Viewpoint& viewpoint, const Direction3& in_robot);

}  // namespace panonav::simulation
