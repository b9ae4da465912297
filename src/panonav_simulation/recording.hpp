#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <variant>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/image.hpp"
#include "panonav/core/options.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/panorama/tilt.hpp"
#include "panonav_simulation/free_space.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/sensor.hpp"

namespace panonav::simulation {

/// Poses at which a simulated robot takes its images.
enum class RecordingPath {
  grid,    ///< every free grid position, row by row
  zigzag,  ///< as grid, every second row backwards
  tour,    ///< along the scene's round trip or given way points
  walk,    ///< a random walk
  random,  ///< independent random poses
};

/// The robot's heading at each pose.
enum class RecordingHeading {
  fixed,   ///< the same heading everywhere
  path,    ///< along the path
  random,  ///< uniform
};

/// Path, headings and speed of the robot that records images.
struct RecordingOptions {
  RecordingPath path = RecordingPath::grid;            ///< positions of the images
  RecordingHeading heading = RecordingHeading::fixed;  ///< headings of the images
  double heading_rad = 0.0;                            ///< of fixed headings
  double spacing_m = 0.5;                              ///< of the grid, or along the path
  int poses = 200;                                     ///< number of poses of walk and random
  double speed_m_s = 0.3;                              ///< determines the time stamps
};
void visit_options(RecordingOptions& options, OptionVisitor& visitor);

/// True pose and odometry of one image of a recording.
struct RecordedPose {
  double stamp_s = 0.0;  ///< s; from distance and speed, or the trajectory's own
  Pose2 pose;            ///< true pose
  Pose2 odometry;        ///< pose by odometry, in the odometry frame
  friend bool operator==(const RecordedPose&, const RecordedPose&) = default;
};

/// Plans the poses of a recording, all of them free. `way_points` replace the scene's tour. Where
/// the straight line between way points is not free, the shortest free path replaces it. The same
/// seed gives the same poses. Throws OptionError, and ContractError if no grid position is free at
/// this spacing, a way point is not free, or a tour is requested in a scene without one.
[[nodiscard]] std::vector<RecordedPose> plan_recording(const Scene& scene, const FreeSpace& space,
                                                       const RecordingOptions& options,
                                                       const OdometryNoise& odometry,
                                                       std::uint64_t seed,
                                                       std::span<const Point2> way_points = {});

/// Turns each pose towards the next one, -pi .. pi; the last pose gets the heading of the one
/// before it.
void face_path(std::vector<Pose2>& poses);

/// Returns the rendering of panoramas that are unwarped from images of
/// `make_simulated_mirror_camera`, one ray per pixel of the image. Without `elevations`: all that
/// the mirror shows at every azimuth. `pixel_size`: pixels of that camera along each side of a
/// pixel of the image, 1 for its full size. Only the pixels that the unwarper reads are rendered.
/// Cost: some 100 ms. Throws OptionError on an invalid size, ContractError unless `pixel_size` is
/// 1 .. 8.
[[nodiscard]] PanoramaRendering make_mirror_rendering(
    int rows, int columns, std::optional<ElevationBand> elevations = std::nullopt,
    int pixel_size = 1);

/// Camera of a recording: a camera model, or a panorama that is rendered directly.
using RecordingCamera = std::variant<PanoramaRendering, Camera>;

/// Viewpoint and ray density of each image of a recording.
struct FrameOptions {
  double camera_height_m = 0.6;  ///< of the viewpoint above the floor, > 0
  /// Tilt of the robot in rad, in a new random direction for each image.
  double tilt_rad = 0.0;
  int rays_per_axis = 2;  ///< for images of a camera model
};
void visit_options(FrameOptions& options, OptionVisitor& visitor);

/// Draws the tilt of the robot in the image with this seed.
[[nodiscard]] Tilt sample_tilt(const FrameOptions& options, std::uint64_t seed);

/// Takes the robot's image: by a camera model, or a panorama as an image (see `to_picture`). The
/// same options and seed give the same image; use a different seed for each image. Throws
/// OptionError, and ContractError as the renderer does.
[[nodiscard]] Image capture_image(const Renderer& renderer, const Pose2& pose,
                                  const RecordingCamera& camera, const FrameOptions& options,
                                  const SensorOptions& sensor, std::uint64_t seed,
                                  Executor& executor);

/// Takes the robot's view as a panorama: rendered directly, or unwarped from an image if the
/// rendering has an unwarper. Otherwise as `capture_image`.
[[nodiscard]] Panorama capture_panorama(const Renderer& renderer, const Pose2& pose,
                                        const PanoramaRendering& rendering,
                                        const FrameOptions& options, const SensorOptions& sensor,
                                        std::uint64_t seed, Executor& executor);

/// One image of a recording, valid during the callback.
struct RecordedFrame {
  std::size_t number = 0;    ///< index from 0
  const RecordedPose& pose;  ///< element of the poses passed to `record`
  Tilt tilt;                 ///< true tilt of the robot
  const Image& picture;      ///< as returned by `capture_image`
};

/// Takes all images in order and passes each to `frame`, so that only one is in memory. Frame i
/// uses the random stream (seed, i).
void record(const Renderer& renderer, std::span<const RecordedPose> poses,
            const RecordingCamera& camera, const FrameOptions& options, const SensorOptions& sensor,
            std::uint64_t seed, Executor& executor,
            const std::function<void(const RecordedFrame&)>& frame);

}  // namespace panonav::simulation
