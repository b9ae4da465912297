#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/chain_route.hpp"
#include "runs/run_record.hpp"

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
                      std::size_t images, const ChainSpacing& spacing,
                      const ChainOdometry& odometry, Session& session);

/// One image of a run along a chain, and the motion that follows from it.
struct ChainStep {
  std::size_t index = 0;  ///< in the data set, from 0
  std::string file;
  std::optional<double> stamp_s;
  ChainDecision decision;
  std::size_t snapshot = 0;  ///< from 1
  Pose2 pose;                ///< in the frame of the chain
};

/// Prints for every N-th image of a run the motion of a robot that follows the chain, until it has
/// arrived or is lost, and adds it to the record. Images without odometry are skipped. Throws
/// FileError if fewer than two images have odometry.
[[nodiscard]] std::vector<ChainStep> follow_chain_run(ChainGuide& guide, const Dataset& run,
                                                      int every_nth, RunRecord& record,
                                                      Session& session);

}  // namespace panonav::command
