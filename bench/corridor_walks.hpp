#pragma once

#include <memory>
#include <vector>

#include "lab/runs/tracking_run.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::bench {

/// Ranges in metres to what stands around, from the robot's heading once around counter-clockwise;
/// infinite where there is nothing.
using RangeScan = std::vector<float>;

/// A robot that drives through the `corridor` scene.
struct Walk {
  lab::TrackingRun run;
  std::vector<Pose2> odometry;  ///< robot_old_from_robot_new of each step as odometry tells it; the
                                ///< first one is unused
  std::vector<RangeScan> scans;  ///< what a laser would have measured beside each view
};

/// The `corridor` scene with its references on a 25 cm grid, 80 x 512 pixels a view.
struct Corridor {
  simulation::PlaceRecording place;
  std::shared_ptr<const lab::TrackingPlace> remembered;
  std::vector<Walk> clean;         ///< as memorised
  std::vector<Walk> hard;          ///< light, objects and sensor changed (`make_hard_condition`)
  std::vector<Pose2> mapped_from;  ///< where the scans for a rival's map were taken
  std::vector<RangeScan> map_scans;
};

/// About 950 references; renders for some seconds. 4 walks of 21 images, 25 cm apart, of each kind.
[[nodiscard]] Corridor make_corridor();

/// A memory of `count` references: those of the corridor that are nearest to the walks; when it has
/// fewer, those of as many corridors with other furniture and textures besides as it takes, 100 m
/// apart.
[[nodiscard]] std::shared_ptr<const lab::TrackingPlace> corridors_with(const Corridor& corridor,
                                                                       std::size_t count);

}  // namespace panonav::bench
