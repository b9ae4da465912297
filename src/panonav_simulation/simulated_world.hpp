#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/motion/trajectory.hpp"
#include "panonav_simulation/free_space.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::simulation {

/// Variation of the scene, and the seed of all random draws.
struct SceneOptions {
  int seed = 1;                ///< of poses, noise, tilt and odometry
  int scene_seed = 1;          ///< of textures and furniture of built-in scenes
  double moved_objects = 0.0;  ///< share of the movable objects that are moved, 0 .. 1
  int moved_seed = 1;          ///< of the choice and motion of moved objects
  double light = 1.0;          ///< factor of all lamps and the sky, > 0
};
void visit_options(SceneOptions& options, OptionVisitor& visitor);

/// The simulated camera and the variation of the scene.
struct SimulationOptions {
  int kind = 0;       ///< 0: mirror, 1: panorama, 2: dual-fisheye, 3: equirectangular
  int rows = 80;      ///< of panoramas, 1 .. 4096
  int columns = 512;  ///< of panoramas and equirectangular images (even), 4 .. 16384
  double elevation_low_deg = -30.0;  ///< lower edge of panoramas
  double elevation_high_deg = 40.0;  ///< upper edge of panoramas
  int lens_seed = 1;                 ///< see `make_simulated_dual_fisheye`
  double lens_distance_m = 0.0;      ///< between the lenses, 0 .. 1; causes parallax of near things
  SceneOptions scene;                ///< variation of the scene
};
void visit_options(SimulationOptions& options, OptionVisitor& visitor);

/// All options of a simulated run.
struct SimulatedWorldOptions {
  SimulationOptions simulation;  ///< camera and scene
  RecordingOptions recording;    ///< poses of the images
  FrameOptions frame;            ///< camera height by the scene, unless set by the user
  FreeSpaceOptions free_space;   ///< robot size by the scene, unless set by the user
  SensorOptions sensor;          ///< noise and faults of the camera
  OdometryNoise odometry;        ///< errors of the wheels
  std::optional<Camera> mirror;  ///< of mirror images; nullopt: `make_simulated_mirror_camera`
};

/// Called with each warning of a scene, before anything else can fail.
using SceneWarning = std::function<void(const std::string&)>;

/// Returns the name under which the user set an option; nullopt if the user did not set it.
/// `section` is "simulation", "frame" or "free_space".
using FindSetOption =
    std::function<std::optional<std::string>(const std::string& section, const std::string& name)>;

/// Returns the heading that is used for a path if the user chose none.
[[nodiscard]] RecordingHeading default_heading(RecordingPath path) noexcept;

/// A scene with renderer, the robot's free space and the options of a run.
class SimulatedWorld {
 public:
  /// `scene` is the name of a built-in scene, or a Gazebo world or mesh file, which is first read
  /// in a separate process because damaged files may crash the reader. The floor of a file is found
  /// by `find_free_space`, unless the user set its height, and becomes z = 0 of the scene; robots
  /// follow a ground that is not level, with an upright camera. Throws
  /// OptionError on a name that is neither, and if the user set options for a file that vary only
  /// built-in scenes (scene_seed, moved_objects, moved_seed); FileError; else as `FreeSpace` and
  /// `Renderer`.
  SimulatedWorld(const std::string& scene, SimulatedWorldOptions options,
                 const FindSetOption& find_set_option, Executor& executor,
                 const SceneWarning& on_warning = {});

  /// Returns the same world with other recording options and another seed of poses, noise and
  /// odometry.
  [[nodiscard]] SimulatedWorld with(const RecordingOptions& recording, int seed) const;

  /// Returns the scene with its light and moved objects; its floor is at z = 0.
  [[nodiscard]] const Scene& scene() const noexcept { return scene_; }
  /// Returns the free space of the robot.
  [[nodiscard]] const FreeSpace& free_space() const noexcept { return *free_space_; }
  /// Returns the renderer of the images.
  [[nodiscard]] const Renderer& renderer() const noexcept { return *renderer_; }
  /// Returns the shared free space.
  [[nodiscard]] std::shared_ptr<const FreeSpace> shared_free_space() const { return free_space_; }
  /// Returns the shared renderer.
  [[nodiscard]] std::shared_ptr<const Renderer> shared_renderer() const { return renderer_; }
  /// Returns the options, in which the scene's values replace those that the user did not set.
  [[nodiscard]] const SimulatedWorldOptions& options() const noexcept { return options_; }
  /// Returns the camera of the images, chosen by the options.
  [[nodiscard]] RecordingCamera camera() const;
  /// Returns the kind and layout of the images, as for a data set.
  [[nodiscard]] PictureSource source() const;

  /// Plans the poses of the recording options. Throws as `plan_recording`.
  [[nodiscard]] std::vector<RecordedPose> plan(std::span<const Point2> way_points = {}) const;
  /// Returns recorded poses along a trajectory, without checking that they are free. Throws
  /// OptionError.
  [[nodiscard]] std::vector<RecordedPose> plan_along(std::span<const StampedPose> trajectory) const;
  /// Returns a warning that counts the poses at which the robot cannot be: outside of the floor,
  /// in or too near to an obstacle, or above no floor. Empty if there are none.
  [[nodiscard]] std::string describe_impossible_poses(std::span<const RecordedPose> poses) const;
  /// Takes the image at a pose; use a different seed for each image. Throws as the renderer.
  [[nodiscard]] Image capture_image(const Pose2& pose, std::uint64_t seed,
                                    Executor& executor) const;

 private:
  SimulatedWorldOptions options_;
  Scene scene_;
  std::shared_ptr<const FreeSpace> free_space_;
  std::shared_ptr<const Renderer> renderer_;
};

/// Writes a data set into a new or empty folder, which gets its final name when everything is
/// written. Images are PNG files; equirectangular ones are JPEG files with Photo Sphere data. With
/// `with_path` the poses are a path, and time stamps and odometry are written, too. `on_image` is
/// called after each image, before its file has its final path. Throws FileError and removes what
/// was written; files left by a killed process are removed by the next run.
Dataset record_dataset(const SimulatedWorld& world, const std::filesystem::path& folder,
                       std::span<const RecordedPose> poses, bool with_path, Executor& executor,
                       const std::function<void(const DatasetEntry&, const Image&)>& on_image = {});

}  // namespace panonav::simulation
