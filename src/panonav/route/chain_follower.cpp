#include "panonav/route/chain_follower.hpp"

#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

namespace {

std::vector<ChainStop> make_stops(const SnapshotChain& chain) {
  require(!chain.nodes().empty(), "nodes of the chain", 0.0, ">= 1");
  require(chain.nodes().back().has_snapshot(), "snapshots of the last node", 0.0, "1");
  std::vector<ChainStop> stops;
  for (const ChainNode& node : chain.nodes()) {
    stops.push_back(
        {node.position, node.has_snapshot() ? node.snapshot.data() : nullptr, node.is_fine});
  }
  return stops;
}

}  // namespace

void visit_options(ChainFollowerOptions& options, OptionVisitor& visitor) {
  using T = ChainFollowerOptions;
  constexpr OptionTable table{
      option<&T::max_step_m>("longest motion between two views", 0.001, 100),
      option<&T::stop_step_m>("homing ends when its steps are shorter than this", 0.001, 100),
      option<&T::max_homing_steps>("largest number of steps of one approach to a snapshot", 1, 1e6),
      option<&T::error_factor>("radius of the search for a snapshot, in errors of the odometry", 1,
                               100),
  };
  table.visit(options, visitor);
}

ChainFollower::ChainFollower(SnapshotChain chain, ChainDirection direction,
                             const ChainFollowerOptions& options)
    : chain_(std::move(chain)),
      stops_(make_stops(chain_)),
      workspace_(ChainPilot::workspace_size(chain_.shape())),
      pilot_({chain_.header(), stops_}, workspace_, direction, options) {
  validate(options);
}

ChainDecision ChainFollower::decide(const HomingView& view, const Pose2& moved) {
  require(is_finite(moved), "motion between views", moved.x_m, "finite");
  const HomingView reduced = reduce_view(view, chain_.shape().rows, chain_.shape().components);
  return pilot_.decide(view_coefficients(reduced), moved);
}

}  // namespace panonav
