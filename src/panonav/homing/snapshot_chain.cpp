#include "panonav/homing/snapshot_chain.hpp"

#include <cmath>
#include <string>

#include "panonav/core/error.hpp"

namespace panonav {

void validate(const SnapshotChain& chain) {
  require(!chain.snapshots.empty(), "snapshots of the chain", 0.0, ">= 1");
  const HomingView& first = chain.snapshots.front().view;
  double before_m = 0.0;
  for (std::size_t i = 0; i < chain.snapshots.size(); ++i) {
    const Snapshot& snapshot = chain.snapshots[i];
    const std::string at = " of snapshot " + std::to_string(i);
    require(snapshot.view.rows() == first.rows(), "rows" + at, snapshot.view.rows(),
            to_text(first.rows()) + ", as of the first snapshot");
    require(snapshot.view.components() == first.components(), "components" + at,
            snapshot.view.components(), to_text(first.components()) + ", as of the first snapshot");
    if (snapshot.view.elevations() != first.elevations()) {
      throw ContractError("elevations" + at, "another band", "that of the first snapshot");
    }
    require(std::isfinite(snapshot.travelled_m) && snapshot.travelled_m >= before_m,
            "travelled_m" + at, snapshot.travelled_m, ">= " + to_text(before_m));
    before_m = snapshot.travelled_m;
    const Pose2& step = snapshot.previous_from_this;
    for (const double value : {step.x_m, step.y_m, step.heading_rad}) {
      require(std::isfinite(value), "previous_from_this" + at, value, "a finite number");
    }
  }
}

std::size_t chain_bytes(const SnapshotChain& chain) noexcept {
  std::size_t bytes = 0;
  for (const Snapshot& snapshot : chain.snapshots) {
    bytes += snapshot_bytes(snapshot.view) + 4 * sizeof(float);
  }
  return bytes;
}

double chain_length_m(const SnapshotChain& chain) noexcept {
  if (chain.snapshots.size() < 2) return 0.0;
  return chain.snapshots.back().travelled_m - chain.snapshots.front().travelled_m;
}

double bytes_per_metre(const SnapshotChain& chain) noexcept {
  const double length_m = chain_length_m(chain);
  return length_m > 0.0 ? static_cast<double>(chain_bytes(chain)) / length_m : 0.0;
}

}  // namespace panonav
