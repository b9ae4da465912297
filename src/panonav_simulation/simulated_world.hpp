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

/// Variation of the scene and seeds of random draws.
struct SceneOptions {
  int seed = 1;                ///< poses, noise, tilt, odometry
  int scene_seed = 1;          ///< textures and furniture of built-in scenes
  double moved_objects = 0.0;  ///< share of the movable objects that stand elsewhere, 0 .. 1
  int moved_seed = 1;          ///< which objects moved, and where to
  double light = 1.0;          ///< factor on all lamps and the sky, > 0
};
void visit_options(SceneOptions& options, OptionVisitor& visitor);

/// The simulated camera and the scene.
struct SimulationOptions {
  int kind = 0;                      ///< mirror, panorama, dual-fisheye
  int rows = 80;                     ///< of panoramas, 1 .. 4096
  int columns = 512;                 ///< of panoramas, 4 .. 16384
  double elevation_low_deg = -30.0;  ///< lower edge of panoramas
  double elevation_high_deg = 40.0;  ///< upper edge of panoramas
  int lens_seed = 1;                 ///< see `make_simulated_dual_fisheye`
  double lens_distance_m = 0.0;      ///< of the two lenses, 0 .. 1; gives near things a parallax
  SceneOptions scene;                ///< how it differs from the plain one
};
void visit_options(SimulationOptions& options, OptionVisitor& visitor);

/// Everything that can be chosen of a simulated run.
struct SimulatedWorldOptions {
  SimulationOptions simulation;  ///< camera and scene
  RecordingOptions recording;    ///< where pictures are taken
  FrameOptions frame;  ///< camera_height_m is the scene's own unless the user gives another
  FreeSpaceOptions free_space;   ///< likewise: of the robot that the scene is made for
  SensorOptions sensor;          ///< noise and faults of the camera
  OdometryNoise odometry;        ///< errors of the wheels
  std::optional<Camera> mirror;  ///< of mirror pictures; empty: `make_simulated_mirror_camera`
};

/// Returns the name under which the user set an option; nullopt if he did not. `section`:
/// "simulation", "frame" or "free_space".
using FindSetOption =
    std::function<std::optional<std::string>(const std::string& section, const std::string& name)>;

/// Returns the default heading of a path.
[[nodiscard]] RecordingHeading default_heading(RecordingPath path) noexcept;

/// A scene with a robot in it.
class SimulatedWorld {
 public:
  /// `scene`: name of a built-in scene, or a Gazebo world or mesh file, which is read in a process
  /// of its own first. Throws OptionError on a name that is neither, and when the user chose what
  /// only varies built-in scenes (scene_seed, moved_objects, moved_seed) for a file; FileError;
  /// else as `FreeSpace` and `Renderer`.
  SimulatedWorld(const std::string& scene, SimulatedWorldOptions options,
                 const FindSetOption& find_set_option, Executor& executor);

  /// Returns the same world for another recording: its poses, noise and odometry.
  [[nodiscard]] SimulatedWorld with(const RecordingOptions& recording, int seed) const;

  /// Returns the scene with its light and its moved objects.
  [[nodiscard]] const Scene& scene() const noexcept { return scene_; }
  /// Returns the free space of the robot.
  [[nodiscard]] const FreeSpace& free_space() const noexcept { return *free_space_; }
  /// Returns the renderer of the images.
  [[nodiscard]] const Renderer& renderer() const noexcept { return *renderer_; }
  /// Returns the shared free space.
  [[nodiscard]] std::shared_ptr<const FreeSpace> shared_free_space() const { return free_space_; }
  /// Returns the shared renderer.
  [[nodiscard]] std::shared_ptr<const Renderer> shared_renderer() const { return renderer_; }
  /// Returns the options, completed by those of the scene.
  [[nodiscard]] const SimulatedWorldOptions& options() const noexcept { return options_; }
  /// Returns the camera of its images: a panorama or a camera, by the options.
  [[nodiscard]] RecordingCamera camera() const;
  /// Returns the format of the robot's images.
  [[nodiscard]] PictureSource source() const;

  /// Plans the poses of its recording, by its seed. Throws as `plan_recording`.
  [[nodiscard]] std::vector<RecordedPose> plan(std::span<const Point2> way_points = {}) const;
  /// Plans poses along a trajectory, free or not. Throws OptionError.
  [[nodiscard]] std::vector<RecordedPose> plan_along(std::span<const StampedPose> trajectory) const;
  /// Takes the image at a pose; each image needs its own seed. Throws as the renderer.
  [[nodiscard]] Image take_picture(const Pose2& pose, std::uint64_t seed, Executor& executor) const;

 private:
  SimulatedWorldOptions options_;
  Scene scene_;
  std::shared_ptr<const FreeSpace> free_space_;
  std::shared_ptr<const Renderer> renderer_;
};

/// Writes a data set into a new or empty folder, which gets its name when all is written.
/// `with_path`: the poses are a path, so stamps and odometry mean something. `on_image` is called
/// after each picture, whose file does not have its path yet. Throws FileError; what was written is
/// then removed again, and what a killed process left by the next one.
Dataset record_dataset(const SimulatedWorld& world, const std::filesystem::path& folder,
                       std::span<const RecordedPose> poses, bool with_path, Executor& executor,
                       const std::function<void(const DatasetEntry&, const Image&)>& on_image = {});

}  // namespace panonav::simulation
