#include "panonav/homing/snapshot_chain.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav {
namespace {

HomingView flat_view(int rows, int components) {
  const std::vector<float> zeros(static_cast<std::size_t>(rows) *
                                 static_cast<std::size_t>(components));
  return {rows, components, zeros, zeros};
}

SnapshotChain chain_of(const std::vector<double>& travelled_m) {
  SnapshotChain chain;
  for (const double way : travelled_m) chain.snapshots.push_back({flat_view(2, 4), way, {}});
  return chain;
}

TEST(SnapshotChain, CountsItsBytesPerMetre) {
  const SnapshotChain chain = chain_of({1.0, 3.0, 5.0});
  EXPECT_NO_THROW(validate(chain));
  // Two rows, frequencies 1 .. 3, two floats each; and four floats for the way.
  EXPECT_EQ(chain_bytes(chain), 3U * (2 * 3 * 2 * 4 + 16));
  EXPECT_EQ(chain_length_m(chain), 4.0);
  EXPECT_EQ(bytes_per_metre(chain), 48.0);
  EXPECT_EQ(bytes_per_metre(chain_of({2.0})), 0.0);
  EXPECT_EQ(chain_length_m({}), 0.0);
}

TEST(SnapshotChain, RefusesWhatIsNoChain) {
  EXPECT_THROW(validate(SnapshotChain{}), ContractError);
  EXPECT_THROW(validate(chain_of({1.0, 0.5})), ContractError) << "the way goes back";
  EXPECT_THROW(validate(chain_of({-1.0})), ContractError);
  EXPECT_THROW(validate(chain_of({0.0, std::numeric_limits<double>::quiet_NaN()})), ContractError);
  SnapshotChain rows = chain_of({0.0, 1.0});
  rows.snapshots[1].view = flat_view(3, 4);
  EXPECT_THROW(validate(rows), ContractError);
  SnapshotChain components = chain_of({0.0, 1.0});
  components.snapshots[1].view = flat_view(2, 5);
  EXPECT_THROW(validate(components), ContractError);
  SnapshotChain pose = chain_of({0.0, 1.0});
  pose.snapshots[1].previous_from_this.x_m = std::numeric_limits<double>::infinity();
  EXPECT_THROW(validate(pose), ContractError);
}

}  // namespace
}  // namespace panonav
