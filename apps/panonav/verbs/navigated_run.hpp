#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "experiments/runs/mission.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"
#include "verbs/route_reading.hpp"
#include "verbs/simulated_recording.hpp"

namespace panonav::command {

/// What the edges of a memory are taken from.
enum class GraphOrigin {
  map,          ///< of the verb `map`: motions as the map has them
  lattice,      ///< of the verb `arrange`: directions from the views' phases
  links,        ///< of the memory: lengths, too
  arrangement,  ///< none of these is there: the views are arranged first
};
/// "map", "lattice", "links", "arrangement".
[[nodiscard]] std::string_view name_of(GraphOrigin origin);
[[nodiscard]] std::optional<GraphOrigin> graph_origin(std::string_view name);

/// What a robot remembers that has this memory file, and where its edges are from.
struct Remembered {
  RememberedPlace place;
  GraphOrigin origin = GraphOrigin::map;
};

/// Reads a memory file; `wanted` empty: the first of `GraphOrigin` that is there. Throws FileError
/// when it holds no views, and when what is wanted is not there.
[[nodiscard]] Remembered remember(const MemoryFile& file, std::optional<GraphOrigin> wanted,
                                  Executor& executor);

/// The route `name` of a memory file with those of the views that lie beside it, by their poses:
/// both must have been recorded with the poses of one data set. Throws FileError when there is no
/// such route, it is in the frame of odometry, or none of the views lies beside it.
[[nodiscard]] KnownRoute route_among_views(const MemoryFile& file, const std::string& name,
                                           const VisualMemory& memory,
                                           const KnownRouteOptions& options);

/// What a robot sees through a simulated camera, as the memory compares it: to be a
/// `MissionPlace::sight`. `executor` empty: each picture is made by the thread that asks, so that
/// any number of them may; else it must outlive the answer and one thread may ask.
[[nodiscard]] std::function<FourierSignature(const Pose2& pose, std::uint64_t seed)> sight_through(
    std::shared_ptr<const Renderer> renderer, const RecordingCamera& camera,
    const FrameOptions& frame, const SensorOptions& sensor,
    std::shared_ptr<const ViewEncoder> pipeline, Executor* executor);

/// A robot in a simulated world that sees as the memory's views were seen: by the camera, size and
/// preprocessing of its header. `wanted.simulation` says what differs in the scene, the rest of it
/// is the header's. `route`: it takes lines from these pictures, too, as that route's were taken.
/// Throws FileError when the memory does not know which elevations its rows show; else as
/// `SimulatedWorld`. `session` must outlive the place.
[[nodiscard]] MissionPlace place_as_remembered(
    const std::string& scene, SimulationArguments wanted, const MemoryFile& memory,
    const std::optional<RouteSource>& route,
    const std::function<bool(const std::string&, const std::string&)>& given, Session& session);

}  // namespace panonav::command
