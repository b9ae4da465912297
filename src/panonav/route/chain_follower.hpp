#pragma once

#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/route/chain_pilot.hpp"
#include "panonav/route/snapshot_chain.hpp"

namespace panonav {

void visit_options(ChainFollowerOptions& options, OptionVisitor& visitor);

/// Repeats a route along a chain of snapshots: a `ChainPilot` that owns its chain and checks its
/// arguments.
class ChainFollower {
 public:
  /// Throws OptionError; ContractError on a chain without nodes.
  ChainFollower(SnapshotChain chain, ChainDirection direction,
                const ChainFollowerOptions& options = {});
  ChainFollower(const ChainFollower&) = delete;  // the pilot refers to the chain
  ChainFollower& operator=(const ChainFollower&) = delete;
  ChainFollower(ChainFollower&&) = default;
  ChainFollower& operator=(ChainFollower&&) = default;
  ~ChainFollower() = default;

  /// Decides the next motion as `ChainPilot::decide`; the view may have more rows and components
  /// than the snapshots. Throws ContractError as `ChainRecorder::add`.
  [[nodiscard]] ChainDecision decide(const HomingView& view, const Pose2& moved);

  /// The estimated pose in the frame of the chain, in which snapshots have the heading 0.
  [[nodiscard]] const Pose2& chain_from_robot() const noexcept { return pilot_.chain_from_robot(); }

 private:
  SnapshotChain chain_;
  std::vector<ChainStop> stops_;
  std::vector<float> workspace_;
  ChainPilot pilot_;
};

}  // namespace panonav
