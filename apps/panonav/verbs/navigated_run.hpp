#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "panonav/pipeline/robot_navigator.hpp"
#include "panonav_simulation/mission.hpp"
#include "verbs/simulated_recording.hpp"

namespace panonav::command {

/// The memory of a robot as a simulated run needs it beside the robot's own: the graph, and where
/// its views were taken. No signature is held.
[[nodiscard]] simulation::RememberedPlace remembered_by(const RobotNavigator& robot);

/// Hears of each picture that a simulated robot takes, and of its panorama.
using SightReport = std::function<void(const Image& picture, const Panorama& panorama)>;

/// What a robot sees through a simulated camera, as the memory compares it: to be a
/// `MissionPlace::sight`. `executor` empty: each picture is made by the thread that asks, so that
/// any number of them may; else it must outlive the answer and one thread may ask.
[[nodiscard]] std::function<FourierSignature(const Pose2& pose, std::uint64_t seed)> sight_through(
    std::shared_ptr<const simulation::Renderer> renderer, const simulation::RecordingCamera& camera,
    const simulation::FrameOptions& frame, const simulation::SensorOptions& sensor,
    std::shared_ptr<const ViewEncoder> pipeline, Executor* executor, SightReport seen = {});

/// A robot in a simulated world that sees as the memory's views were seen: by the camera, size and
/// preprocessing of its header. `wanted.simulation` says what differs in the scene, the rest of it
/// is the header's. Where the robot goes along a route it takes lines from these pictures, too.
/// Throws FileError when the memory does not know which elevations its rows show; else as
/// `SimulatedWorld`. `session` must outlive the place.
[[nodiscard]] simulation::MissionPlace place_as_remembered(const std::string& scene,
                                                           simulation::SimulatedWorldOptions wanted,
                                                           const RobotNavigator& robot,
                                                           const simulation::GivenOption& given,
                                                           Session& session, SightReport seen = {});

}  // namespace panonav::command
