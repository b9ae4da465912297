#include "panonav/localisation/feature_ranking.hpp"

#include <gtest/gtest.h>

namespace panonav {
namespace {

TEST(FeatureTrial, TellMoreWhereChanceRarelyGivesAsManyGains) {
  const auto trial = [](int gained, int lost) {
    return FeatureTrial{.gained = gained, .lost = lost}.is_significantly_better();
  };
  EXPECT_FALSE(trial(0, 0));
  EXPECT_FALSE(trial(4, 0));  // 1 in 16
  EXPECT_TRUE(trial(5, 0));   // 1 in 32
  EXPECT_FALSE(trial(6, 1));  // 8 in 128
  EXPECT_TRUE(trial(7, 1));   // 9 in 256
  EXPECT_FALSE(trial(20, 20));
  EXPECT_FALSE(trial(0, 9));
  EXPECT_TRUE(trial(40, 0));
}

}  // namespace
}  // namespace panonav
