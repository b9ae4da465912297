#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "cli/arguments.hpp"
#include "experiments/runs/mission.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/simulation/free_space.hpp"
#include "panonav/simulation/recording.hpp"
#include "panonav/simulation/renderer.hpp"
#include "panonav/simulation/scenes.hpp"

namespace panonav::command {

/// How the scene differs from the plain one, and what is drawn at random.
struct SceneOptions {
  int seed = 1;  ///< poses, noise, tilt, odometry
  int scene_seed = 1;
  double moved_objects = 0.0;
  int moved_seed = 1;
  double light = 1.0;
};
void visit_options(SceneOptions& options, OptionVisitor& visitor);

/// The simulated camera and the scene.
struct SimulationOptions {
  int kind = 0;  ///< mirror, panorama, dual-fisheye
  int rows = 80;
  int columns = 512;
  double elevation_low_deg = -30.0;
  double elevation_high_deg = 40.0;
  int lens_seed = 1;  ///< see `simulated_dual_fisheye`
  double lens_distance_m = 0.0;
  SceneOptions scene;
};
void visit_options(SimulationOptions& options, OptionVisitor& visitor);

/// Everything that can be chosen of a simulated run.
struct SimulationArguments {
  SimulationOptions simulation;
  RecordingOptions recording;
  FrameOptions frame;  ///< camera_height_m is the scene's own unless the user gives another
  FreeSpaceOptions free_space;  ///< robot_height_m likewise is the camera's
  SensorOptions sensor;
  OdometryNoise odometry;
  std::optional<Camera> mirror;  ///< of mirror pictures; empty: `simulated_mirror_camera`
};
void declare_simulation(Arguments& arguments, SimulationArguments& wanted);
/// What the options of scene and sensor need of each other, for verbs that declare both.
void require_effects(Arguments& arguments, const SimulationArguments& wanted);

/// A scene with a robot in it.
class SimulatedWorld {
 public:
  /// `scene`: name of a built-in scene, or a Gazebo world or mesh file. `given`: says whether the
  /// user chose a member of a section. Throws UsageError on a name that is neither, and when the
  /// user chose what only varies built-in scenes (scene_seed, moved_objects, moved_seed) for a
  /// file.
  SimulatedWorld(const std::string& scene, SimulationArguments wanted,
                 const std::function<bool(const std::string&, const std::string&)>& given,
                 Executor& executor);

  /// The same world for another recording: its poses, noise and odometry.
  [[nodiscard]] SimulatedWorld with(const RecordingOptions& recording, int seed) const;

  [[nodiscard]] const Scene& scene() const noexcept { return scene_; }
  [[nodiscard]] const FreeSpace& free_space() const noexcept { return *free_space_; }
  [[nodiscard]] const Renderer& renderer() const noexcept { return *renderer_; }
  [[nodiscard]] const SimulationArguments& arguments() const noexcept { return wanted_; }
  [[nodiscard]] RecordingCamera camera() const;
  /// How the robot's pictures lie.
  [[nodiscard]] PictureSource source() const;
  /// The same for missions: a robot of the chosen size and sensor in it.
  [[nodiscard]] MissionPlace place() const;

 private:
  SimulationArguments wanted_;
  Scene scene_;
  std::shared_ptr<const FreeSpace> free_space_;
  std::shared_ptr<const Renderer> renderer_;
};

/// Writes a data set: pictures first, dataset.toml last. `with_path`: the poses are a path, so
/// stamps and odometry mean something. `taken` is called after each picture. Throws FileError; what
/// was written is then removed again.
Dataset record_dataset(const SimulatedWorld& world, const std::filesystem::path& folder,
                       std::span<const RecordedPose> poses, bool with_path, Executor& executor,
                       const std::function<void(const DatasetEntry&, const Image&)>& taken);

}  // namespace panonav::command
