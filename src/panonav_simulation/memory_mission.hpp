#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "panonav/pipeline/robot_navigator.hpp"
#include "panonav_simulation/mission.hpp"
#include "panonav_simulation/simulated_world.hpp"

namespace panonav::simulation {

/// Makes a place for missions from the world, with a robot of its size and sensor.
[[nodiscard]] MissionPlace make_mission_place(const SimulatedWorld& world);

/// Collects the data that a simulated run needs from the robot's memory: the graph and the true
/// poses of its views, without signatures.
[[nodiscard]] RememberedPlace make_remembered_place(const RobotNavigator& robot);

/// Called with each image that a simulated robot takes, and its panorama.
using ImageReport = std::function<void(const Image& image, const Panorama& panorama)>;

/// Makes a `MissionPlace::view_sensor` of a camera and an encoder: takes an image and computes its
/// signature as for the memory. With a null executor each calling thread renders alone, and any
/// number of threads may call; otherwise the executor must outlive the sensor and only one thread
/// may call.
[[nodiscard]] std::function<FourierSignature(const Pose2& pose, std::uint64_t seed)>
make_view_sensor(std::shared_ptr<const Renderer> renderer, const RecordingCamera& camera,
                 const FrameOptions& frame, const SensorOptions& sensor,
                 std::shared_ptr<const ViewEncoder> encoder, Executor* executor,
                 ImageReport report = {});

/// Makes a place in which the robot takes views like those of its memory: by the camera, size and
/// preprocessing in the memory's header. `options` change the scene, but not camera and size. A
/// robot with a route also takes lines from these images. `scene` and `find_set_option` as for
/// `SimulatedWorld`; `executor` must outlive the place. Throws FileError if the memory does not
/// state the elevations of its views; else as `SimulatedWorld`.
[[nodiscard]] MissionPlace make_mission_place(const std::string& scene,
                                              SimulatedWorldOptions options,
                                              const RobotNavigator& robot,
                                              const FindSetOption& find_set_option,
                                              Executor& executor, ImageReport report = {});

}  // namespace panonav::simulation
