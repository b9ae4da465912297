#pragma once

#include <cstdint>
#include <memory>

#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/navigation/floor_scanner.hpp"
#include "panonav_simulation/people.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/sensor.hpp"

namespace panonav::simulation {

/// The mirror camera of a simulated robot (`make_simulated_mirror_camera`), of whose pictures only
/// the floor is rendered. Immutable; the robots of a place share it.
class FloorCamera {
 public:
  /// `renderer` renders the scene of a robot of this size. Cost: some 100 ms. Throws ContractError
  /// as `FloorScanner`.
  FloorCamera(std::shared_ptr<const Renderer> renderer, const FloorScannerOptions& robot,
              const SensorOptions& sensor = {});

  /// Returns the size of the robot, and the range of its scans.
  [[nodiscard]] const FloorScannerOptions& robot() const noexcept { return robot_; }
  /// Takes a picture of the floor, for a `FloorScanner`. `people` may be null. The same pose, seed
  /// and people give the same bits. Cost: some milliseconds.
  [[nodiscard]] Panorama capture(const Pose2& pose, std::uint64_t seed, const People* people) const;

 private:
  std::shared_ptr<const Renderer> renderer_;
  FloorScannerOptions robot_;
  SensorOptions sensor_;
  PanoramaRendering rendering_;
};

/// Throws ContractError if a robot sees the floor without a camera.
void require_floor_camera(const FloorCamera* camera);

/// The camera of one robot as its sensor of obstacles: takes pictures of the floor while the robot
/// drives, and scans it. Knows nothing but pictures and odometry.
class FloorSensor {
 public:
  /// `camera` must outlive the sensor; `people` too, and may be null.
  FloorSensor(const FloorCamera& camera, const People* people, std::uint64_t seed)
      : camera_(&camera), people_(people), scanner_(camera.robot()), noise_(seed, 6) {}

  /// Moves the robot by its odometry, robot_old_from_robot_new, to the true pose `robot`. Takes a
  /// picture every 5 cm.
  void move(const Pose2& step, const Pose2& robot);
  /// Takes a picture at the true pose `robot`, and scans the floor.
  [[nodiscard]] FloorScan scan(const Pose2& robot);

 private:
  void add_picture(const Pose2& robot);

  const FloorCamera* camera_;
  const People* people_;
  FloorScanner scanner_;
  Random noise_;
  Pose2 moved_;  // by odometry, since the last picture
};

}  // namespace panonav::simulation
