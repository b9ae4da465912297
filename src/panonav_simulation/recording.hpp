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
  grid,    ///< every free place of a grid, row by row
  zigzag,  ///< the same, every second row backwards
  tour,    ///< along the scene's round trip, or way points of the caller
  walk,    ///< a random walk
  random,  ///< independent random poses
};

/// The robot's heading at each place.
enum class RecordingHeading {
  fixed,   ///< the same heading everywhere
  path,    ///< the way it goes
  random,  ///< any
};

/// Poses and times of the images of a robot.
struct RecordingOptions {
  RecordingPath path = RecordingPath::grid;            ///< from place to place
  RecordingHeading heading = RecordingHeading::fixed;  ///< at each place
  double heading_rad = 0.0;                            ///< of fixed headings
  double spacing_m = 0.5;                              ///< of the grid, or along the path
  int poses = 200;                                     ///< number of a walk or of random poses
  double speed_m_s = 0.3;                              ///< gives the stamps
};
void visit_options(RecordingOptions& options, OptionVisitor& visitor);

/// True pose and odometry of one image of a recording.
struct RecordedPose {
  double stamp_s = 0.0;  ///< seconds, by way and speed; of a trajectory its own
  Pose2 pose;            ///< where it truly is
  Pose2 odometry;        ///< where its odometry says that it is, in the odometry frame
  friend bool operator==(const RecordedPose&, const RecordedPose&) = default;
};

/// Plans the poses of a recording, all of them free. `way_points` replace the scene's tour.
/// Straight lines that are not free are replaced by the shortest free paths. The same seed gives
/// the same poses. Throws OptionError; ContractError when no place is free at this spacing, a way
/// point is not free, or a tour is requested where there is none.
[[nodiscard]] std::vector<RecordedPose> plan_recording(const Scene& scene, const FreeSpace& space,
                                                       const RecordingOptions& options,
                                                       const OdometryNoise& odometry,
                                                       std::uint64_t seed,
                                                       std::span<const Point2> way_points = {});

/// Turns each pose towards the next one, -pi .. pi; the last keeps the heading of the one before.
void face_path(std::vector<Pose2>& poses);

/// Camera of the rendered image: an image through a camera, or the panoramic cylinder directly.
using RecordingCamera = std::variant<PanoramaRendering, Camera>;

/// Viewpoint and rays of each image of a recording.
struct FrameOptions {
  double camera_height_m = 0.6;  ///< of the viewpoint above the floor, > 0
  /// Tilt of the robot, in another random direction at each place.
  double tilt_rad = 0.0;
  int rays_per_axis = 2;  ///< for pictures through a camera
};
void visit_options(FrameOptions& options, OptionVisitor& visitor);

/// Draws the tilt of the robot in the image of this seed.
[[nodiscard]] Tilt sample_tilt(const FrameOptions& options, std::uint64_t seed);

/// Takes the image of the robot: a panorama for people (see `to_picture`), or the camera's
/// image. The same options and seed give the same picture; give each frame its own seed.
/// Throws OptionError, and ContractError as the renderer does.
[[nodiscard]] Image take_picture(const Renderer& renderer, const Pose2& pose,
                                 const RecordingCamera& camera, const FrameOptions& options,
                                 const SensorOptions& sensor, std::uint64_t seed,
                                 Executor& executor);

/// Takes the image as a panorama.
[[nodiscard]] Panorama take_panorama(const Renderer& renderer, const Pose2& pose,
                                     const PanoramaRendering& rendering,
                                     const FrameOptions& options, const SensorOptions& sensor,
                                     std::uint64_t seed, Executor& executor);

/// One image of a recording, valid during the call.
struct RecordedFrame {
  std::size_t number = 0;    ///< counted from 0
  const RecordedPose& pose;  ///< belongs to the poses that `record` was given
  Tilt tilt;                 ///< as it truly is
  const Image& picture;      ///< as `take_picture` gives it; gone after the call
};

/// Takes all pictures in order and hands each to `frame`, so that only one is in memory. Frame i
/// has the random stream (seed, i).
void record(const Renderer& renderer, std::span<const RecordedPose> poses,
            const RecordingCamera& camera, const FrameOptions& options, const SensorOptions& sensor,
            std::uint64_t seed, Executor& executor,
            const std::function<void(const RecordedFrame&)>& frame);

}  // namespace panonav::simulation
