#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "cli/session.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

/// How a map is made of a recording.
struct MapSettings {
  MappingOptions mapping;
  VisualOdometryOptions odometry;
  LoopClosureOptions closure;
  PoseGraphOptions graph;
  bool thumbnails = true;
};

/// What came of it.
struct MappedRun {
  TopologicalMap map;
  std::vector<std::size_t> entries;  ///< number in the recording of each node
  std::size_t skipped = 0;           ///< pictures that differed too little from the node before
  double scale_m = 0.0;              ///< metres for each unit of length of the views
  bool wheels = false;               ///< the recording has odometry, and lengths come from it
  double mapping_s = 0.0;            ///< time of the mapping itself, without reading pictures
};

/// Appends the views of the recording to the memory file, as many as become nodes, and maps them in
/// order. Views that the file knows by name are not appended again; their ids must ascend in the
/// order of the recording. What was appended stays, whatever happens later. Throws FileError.
[[nodiscard]] MappedRun map_recording(const Dataset& recording, const ViewEncoder& pipeline,
                                      const MapSettings& settings, MemoryFile& memory,
                                      Session& session);

/// Steps of the wheels between two entries; empty unless both have odometry.
[[nodiscard]] std::optional<Pose2> wheel_step(const DatasetEntry& before,
                                              const DatasetEntry& after);

/// The part with the most nodes, of equal ones the first.
[[nodiscard]] std::size_t largest_part(const TopologicalMap& map);

}  // namespace panonav::command
