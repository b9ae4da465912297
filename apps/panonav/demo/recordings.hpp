#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "cli/session.hpp"
#include "panonav/camera/mirror_camera.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/scene.hpp"
#include "runs/simulated_recording.hpp"

namespace panonav::command {

struct DemoOptions {
  std::filesystem::path out = "demo";
  std::uint64_t seed = 1;  ///< seed of the office, the noise and the queries
  bool quick = false;

  [[nodiscard]] double spacing_m() const noexcept { return quick ? 0.5 : 0.25; }
  [[nodiscard]] int query_count() const noexcept { return quick ? 8 : 40; }
  [[nodiscard]] int homing_run_count() const noexcept { return quick ? 3 : 12; }
  /// Number of images of the tracked robot; half of them are taken before it is kidnapped.
  [[nodiscard]] int walk_image_count() const noexcept { return 60; }
  [[nodiscard]] int mission_count() const noexcept { return quick ? 3 : 12; }
  [[nodiscard]] double route_m() const noexcept { return quick ? 3.0 : 10.0; }
};

/// The data of the demonstration: images of a simulated mirror camera with sensor noise, stored as
/// recordings, and the calibrated camera.
struct DemoRecordings {
  Dataset memory_run;               ///< the office, on a grid of poses
  Dataset query_run;                ///< the same office, at random poses
  Dataset elsewhere_run;            ///< another room
  Dataset corridor_run;             ///< a corridor of identical doors and junctions
  Dataset walk_run;                 ///< a drive through the corridor, with odometry
  std::size_t kidnapped_after = 0;  ///< image of walk_run; the odometry does not show it
  MirrorCircle mirror;              ///< result of the calibration
  int calibration_image_count = 0;  ///< number of images that calibration used
  Camera true_camera;
  simulation::Scene office_scene;
  std::shared_ptr<const simulation::SimulatedWorld>
      office_world;  ///< renders grey images, which the robot uses
  simulation::Scene corridor_scene;
  /// Renders the camera's image at the pose of an entry in colour.
  std::function<Image(const DatasetEntry&, Executor&)> colour_picture;
};

/// Returns the options of the demonstration's camera and office. Each `stream` has different noise.
[[nodiscard]] simulation::SimulatedWorldOptions demo_world_options(const DemoOptions& options,
                                                                   int stream);

/// Creates the folder, or removes the files of an earlier demonstration from it. Throws FileError
/// if it contains other files only or cannot be written.
void prepare_demo_folder(const std::filesystem::path& out);

/// Renders all images, calibrates the camera and writes the data sets. Returns nullopt if the
/// calibration finds no mirror.
[[nodiscard]] std::optional<DemoRecordings> record_demo(const DemoOptions& options,
                                                        Session& session);

}  // namespace panonav::command
