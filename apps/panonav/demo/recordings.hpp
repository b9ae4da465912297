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
  std::uint64_t seed = 1;  ///< of the office, the noise and the questions
  bool quick = false;

  [[nodiscard]] double spacing_m() const noexcept { return quick ? 0.5 : 0.25; }
  [[nodiscard]] int query_count() const noexcept { return quick ? 8 : 40; }
  [[nodiscard]] int homing_run_count() const noexcept { return quick ? 3 : 12; }
  /// Images of the robot that is tracked, half of them before it is kidnapped.
  [[nodiscard]] int walk_image_count() const noexcept { return 60; }
  [[nodiscard]] int mission_count() const noexcept { return quick ? 3 : 12; }
  [[nodiscard]] double route_m() const noexcept { return quick ? 3.0 : 10.0; }
};

/// The data of the demonstration: images of a simulated mirror camera with sensor noise, stored as
/// recordings, and the calibrated camera.
struct DemoRecordings {
  Dataset memory_run;               ///< the office on a grid
  Dataset query_run;                ///< the same office at random places
  Dataset elsewhere_run;            ///< another room
  Dataset corridor_run;             ///< a corridor of identical doors and junctions
  Dataset walk_run;                 ///< a drive through it, with odometry
  std::size_t kidnapped_after = 0;  ///< the image of the walk; odometry does not know
  MirrorCircle mirror;              ///< what calibration found
  int calibrated_on = 0;            ///< pictures
  Camera true_camera;
  simulation::Scene office_scene;
  std::shared_ptr<const simulation::SimulatedWorld>
      office_world;  ///< in grey, as the robot sees it
  simulation::Scene corridor_scene;
  /// Renders the camera's image at an entry of the office in colour.
  std::function<Image(const DatasetEntry&, Executor&)> colour_picture;
};

/// Returns the options of the demonstration's camera and office. Each `stream` has noise of its
/// own.
[[nodiscard]] simulation::SimulatedWorldOptions demo_world_options(const DemoOptions& options,
                                                                   int stream);

/// Makes the folder, or removes the files of an earlier demonstration from it. Throws FileError if
/// it holds anything else or cannot be written.
void prepare_demo_folder(const std::filesystem::path& out);

/// Renders all pictures, calibrates, and writes the three data sets. Empty when calibration finds
/// no mirror.
[[nodiscard]] std::optional<DemoRecordings> record_demo(const DemoOptions& options,
                                                        Session& session);

}  // namespace panonav::command
