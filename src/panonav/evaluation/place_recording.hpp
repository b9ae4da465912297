#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/simulation/free_space.hpp"
#include "panonav/simulation/scene.hpp"

namespace panonav {

struct PlacedView {
  Pose2 pose;
  Panorama panorama;
};

/// A simulated place as an experiment needs it: reference views on a grid, queries at random poses
/// in between, and a camera for further views. `take` is deterministic in (pose, seed) and may be
/// called from several threads.
struct PlaceRecording {
  Scene scene;
  std::shared_ptr<const FreeSpace> free_space;
  double spacing_m = 0.25;
  std::vector<PlacedView> references;
  std::vector<PlacedView> queries;
  std::function<Panorama(const Pose2&, std::uint64_t seed)> take;

  /// Index of the reference view that is nearest in space.
  [[nodiscard]] std::size_t nearest_reference(Point2 position) const;
};

struct PlaceRecordingOptions {
  std::string scene = "office";
  std::uint64_t seed = 1;   ///< varies textures and furniture, and the noise
  double spacing_m = 0.25;  ///< of the reference grid
  int queries = 60;
  int rows = 80;
  int columns = 512;
};

/// References with heading 0, queries at random headings, both with the sensor's noise.
[[nodiscard]] PlaceRecording record_place(const PlaceRecordingOptions& options, Executor& executor);

}  // namespace panonav
