#pragma once

#include <string_view>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/core/options.hpp"
#include "panonav/homing/snapshot_chain.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

struct ChainJoinOptions {
  /// References, those most like a snapshot, that are tried for a link with it.
  int candidates = 5;
  /// How far the odometry of the chain's recording is trusted.
  CoarseMotionOptions odometry;
};
void visit_options(ChainJoinOptions& options, OptionVisitor& visitor);

/// A chain of snapshots as a part of a memory.
struct JoinedChain {
  std::vector<ViewId> views;  ///< of the snapshots, in their order
  std::vector<Link> links;    ///< those that were added
  /// From each snapshot to the next one, by the odometry of the recording: what
  /// `graph_of_links` and `arrange` go by.
  std::vector<CoarseMotion> motion;
};

/// Puts the snapshots into the memory as reference views "<name>/0", "<name>/1", .., linked in
/// their order, so that plans lead over the chain in both directions. A snapshot is linked with
/// references of the memory (LinkKind::closure) where both show one neighbourhood: they differ no
/// more than linked references do (PlaceScale::limit), and the phases of both agree on how they lie
/// to each other. Without any such reference the chain is a part of its own. Throws ContractError
/// when the chain is not valid or its views have other rows, components or elevations than the
/// memory's, as those of one row have; on an empty or known name; OptionError. The memory is then
/// unchanged. Cost: a search and `candidates` home vectors both ways for each snapshot.
JoinedChain join_chain(VisualMemory& memory, const SnapshotChain& chain, std::string_view name,
                       const ChainJoinOptions& options = {});

}  // namespace panonav
