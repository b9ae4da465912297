#pragma once

#include <string>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/chain_route.hpp"

namespace panonav::command {

/// Adds the size and spacing of a chain to a JSON object.
void add_chain_fields(ordered_json& json, const ChainSummary& chain);
/// Describes size and spacing for people.
[[nodiscard]] std::string format_chain(const ChainSummary& chain, const Session& session);

/// Names of a memory and of a route in it.
struct NamedChain {
  std::string memory;
  std::string name;
};

/// Records a drive as a chain of snapshots and prints the result. Throws as
/// `panonav::record_chain`. `images`: number of images of the recording, with those without pose.
void record_chain_run(const NamedChain& chain, MemoryFile& memory, const DrivePoses& drive,
                      std::size_t images, const ChainSpacing& spacing, Session& session);

/// Prints for every N-th image of a run the motion of a robot that follows the chain, until it has
/// arrived or is lost. Images without odometry are skipped. Throws FileError if fewer than two
/// images have odometry. Exit code: no answer if lost.
[[nodiscard]] ExitCode follow_chain_run(ChainGuide& guide, const Dataset& run, int every_nth,
                                        Session& session);

}  // namespace panonav::command
