#include "panonav_simulation/floor_camera.hpp"

#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav_simulation/mirror.hpp"

namespace panonav::simulation {

namespace {

// Elevations above the lowest one that are not used: pixels there show a part of the camera.
constexpr double border_rad = 0.02;

}  // namespace

FloorCamera::FloorCamera(std::shared_ptr<const Renderer> renderer, const FloorScannerOptions& robot,
                         const SensorOptions& sensor)
    : renderer_(std::move(renderer)),
      robot_(robot),
      sensor_(sensor),
      rendering_(make_mirror_rendering(
          FloorScanner::rows, FloorScanner::columns,
          ElevationBand{visible_elevations(make_simulated_mirror_camera()).bottom_rad + border_rad,
                        FloorScanner::top_rad})) {}

Panorama FloorCamera::capture(const Pose2& pose, std::uint64_t seed, const People* people) const {
  Executor one_thread(1);
  Panorama view =
      capture_panorama(*renderer_, pose, rendering_, {.camera_height_m = robot_.camera_height_m},
                       sensor_, seed, one_thread);
  if (people != nullptr) people->paint(view, pose, robot_.camera_height_m);
  return view;
}

void require_floor_camera(const FloorCamera* camera) {
  if (camera == nullptr) {
    throw ContractError("obstacle sensor", "camera", "others, or a place with add_floor_camera");
  }
}

void FloorSensor::move(const Pose2& step, const Pose2& robot) {
  constexpr double spacing_m = 0.05;
  moved_ = moved_ * step;
  if (std::hypot(moved_.x_m, moved_.y_m) >= spacing_m) add_picture(robot);
}

FloorScan FloorSensor::scan(const Pose2& robot) {
  add_picture(robot);
  return scanner_.scan();
}

void FloorSensor::add_picture(const Pose2& robot) {
  scanner_.add(camera_->capture(robot, noise_.next(), people_), std::exchange(moved_, {}));
}

}  // namespace panonav::simulation
