#include "panonav/motion/path.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {
namespace {

TEST(Path, LengthIsThatOfTheLine) {
  const std::vector<Pose2> path{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {1.0, 1.0, 0.0}};
  EXPECT_NEAR(path_length_m(path), 2.0, 1e-12);
}

TEST(Path, HeadingsFollowACircleAndScatterHardlyTurnsThem) {
  Random random(3);
  std::vector<Point2> exact;
  std::vector<Point2> scattered;
  for (int i = 0; i < 200; ++i) {
    const double at = 0.02 * i;
    exact.push_back({2.0 * std::cos(at), 2.0 * std::sin(at)});
    scattered.push_back({exact.back().x_m + random.normal(0.0, 0.005),
                         exact.back().y_m + random.normal(0.0, 0.005)});
  }
  const auto headed = estimate_headings(exact);
  const auto rough = estimate_headings(scattered);
  ASSERT_EQ(headed.size(), 200U);
  for (std::size_t i = 20; i < 180; ++i) {
    const double heading = 0.02 * static_cast<double>(i) + radians(90.0);
    EXPECT_NEAR(angle_difference(headed[i].heading_rad, heading), 0.0, 1e-3);
    EXPECT_NEAR(angle_difference(rough[i].heading_rad, heading), 0.0, radians(2.5));
    EXPECT_EQ(headed[i].position(), exact[i]);
  }
}

TEST(Path, NeighboursAreEnoughForAHeading) {
  const auto headed = estimate_headings(std::vector<Point2>{{0.0, 0.0}, {0.0, 5.0}, {5.0, 5.0}});
  ASSERT_EQ(headed.size(), 3U);
  EXPECT_NEAR(headed[0].heading_rad, radians(90.0), 1e-9);
  EXPECT_NEAR(headed[1].heading_rad, radians(45.0), 1e-9);
  EXPECT_NEAR(headed[2].heading_rad, 0.0, 1e-9);
  EXPECT_TRUE(estimate_headings({}).empty());
  EXPECT_EQ(estimate_headings(std::vector<Point2>{{1.0, 2.0}}).size(), 1U);
  EXPECT_THROW((void)estimate_headings({}, -1.0), ContractError);
}

}  // namespace
}  // namespace panonav
