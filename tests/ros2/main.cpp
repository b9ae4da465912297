#include <gtest/gtest.h>

#include "support/fast_peer.hpp"

int main(int count, char** words) {
  ::testing::InitGoogleTest(&count, words);
  if (!panonav::ros2::enter_own_network()) {
    ::testing::GTEST_FLAG(filter) = "MotionHistory.*:FrameTree.*:Names.*:RosArguments.*";
    std::puts("no network of one's own is allowed here: tests over the wire are left out");
  }
  return RUN_ALL_TESTS();
}
