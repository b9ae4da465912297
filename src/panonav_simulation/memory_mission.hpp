#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "panonav/pipeline/robot_navigator.hpp"
#include "panonav_simulation/mission.hpp"
#include "panonav_simulation/simulated_world.hpp"

namespace panonav::simulation {

/// Makes the world a place for missions: a robot of the chosen size and sensor in it.
[[nodiscard]] MissionPlace make_mission_place(const SimulatedWorld& world);

/// Makes the data that a simulated run needs from the robot's memory: its graph, and the true
/// poses of its views. No signature is held.
[[nodiscard]] RememberedPlace make_remembered_place(const RobotNavigator& robot);

/// Called with each image that a simulated robot takes, and with its panorama.
using ImageReport = std::function<void(const Image& image, const Panorama& panorama)>;

/// Makes a `MissionPlace::sight` of a camera and an encoder: what a robot sees, as its memory
/// compares it. With a null executor the thread that calls it renders alone, and any number of
/// threads may call; otherwise the executor must outlive it and one thread may call.
[[nodiscard]] std::function<FourierSignature(const Pose2& pose, std::uint64_t seed)>
make_view_sensor(std::shared_ptr<const Renderer> renderer, const RecordingCamera& camera,
                 const FrameOptions& frame, const SensorOptions& sensor,
                 std::shared_ptr<const ViewEncoder> encoder, Executor* executor,
                 ImageReport report = {});

/// Makes a place in which the robot sees as its memory's views were seen: by the camera, size and
/// preprocessing of the memory's header. `options` change the scene, camera and size excepted.
/// A robot with a route also takes lines from these images. `scene` and `find_set_option` as for
/// `SimulatedWorld`; `executor` must outlive the place. Throws FileError when the memory does not
/// know which elevations its rows show; else as `SimulatedWorld`.
[[nodiscard]] MissionPlace make_mission_place(const std::string& scene,
                                              SimulatedWorldOptions options,
                                              const RobotNavigator& robot,
                                              const FindSetOption& find_set_option,
                                              Executor& executor, ImageReport report = {});

}  // namespace panonav::simulation
