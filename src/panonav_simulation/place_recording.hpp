#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav_simulation/floor_camera.hpp"
#include "panonav_simulation/free_space.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/scene.hpp"
#include "panonav_simulation/sensor.hpp"

namespace panonav::simulation {

/// A scene with its renderer and free space, shared by any number of runs on any number of threads.
struct SimulatedPlace {
  Scene scene;
  std::shared_ptr<const FreeSpace> free_space;  ///< positions of the scene's robot
  std::shared_ptr<const Renderer> renderer;
  /// Camera of the robots that see obstacles with it (`add_floor_camera`); null: they do not.
  std::shared_ptr<const FloorCamera> floor_camera = nullptr;
};

/// Lets the robots of a place see the floor.
void add_floor_camera(SimulatedPlace& place, const SensorOptions& sensor = {});

/// Computes free space and light of a scene. If the free space has several components, the one that
/// contains `inside` is used; without `inside` the largest. Throws ContractError as `FreeSpace` and
/// `Renderer`.
[[nodiscard]] SimulatedPlace make_place(Scene scene, Executor& executor,
                                        std::optional<Point2> inside = std::nullopt);

struct PlacedView {
  Pose2 pose;
  Panorama panorama;
};

/// A simulated place with reference views on a grid, queries at random poses, and the camera
/// settings for further views (`capture_view`).
struct PlaceRecording : SimulatedPlace {
  std::uint64_t seed = 1;
  PanoramaRendering rendering;
  double spacing_m = 0.25;
  std::vector<PlacedView> references;
  std::vector<PlacedView> queries;

  /// Returns the index of the reference view nearest to `position`.
  [[nodiscard]] std::size_t nearest_reference(Point2 position) const;
};

struct PlaceRecordingOptions {
  std::string scene = "office";
  std::uint64_t seed = 1;   ///< of textures, furniture and noise
  double spacing_m = 0.25;  ///< of the reference grid
  int queries = 60;
  int rows = 80;
  int columns = 512;
  bool mirror = false;  ///< unwarp the views from mirror images; false: render them directly
};

/// Records references with heading 0 and queries with random headings, both with sensor noise.
[[nodiscard]] PlaceRecording record_place(const PlaceRecordingOptions& options, Executor& executor);
/// Records in a given scene; `options.scene` is ignored. Throws ContractError if no grid position
/// is free at this spacing.
[[nodiscard]] PlaceRecording record_place(Scene scene, const PlaceRecordingOptions& options,
                                          Executor& executor);

/// Takes one more view in the place, at its camera height. The same pose, seed and sensor give the
/// same bits; may be called from several threads.
[[nodiscard]] Panorama capture_view(const PlaceRecording& place, const Pose2& pose,
                                    std::uint64_t seed, const SensorOptions& sensor = {});
/// Takes a view with the rows, columns and elevations of `rendering`.
[[nodiscard]] Panorama capture_view(const PlaceRecording& place, const PanoramaRendering& rendering,
                                    const Pose2& pose, std::uint64_t seed,
                                    const SensorOptions& sensor = {});

/// Takes a view at each pose; view i uses the seed `first_seed` + i.
[[nodiscard]] std::vector<PlacedView> capture_views(const PlaceRecording& place,
                                                    const PanoramaRendering& rendering,
                                                    const std::vector<Pose2>& poses,
                                                    std::uint64_t first_seed,
                                                    const SensorOptions& sensor,
                                                    Executor& executor);

/// Takes all queries again with other sensor options.
[[nodiscard]] std::vector<PlacedView> recapture_queries(const PlaceRecording& place,
                                                        const SensorOptions& sensor,
                                                        std::uint64_t first_seed,
                                                        Executor& executor);

}  // namespace panonav::simulation
