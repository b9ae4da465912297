#include "panonav_simulation/simulated_odometry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include "support/scene_views.hpp"

namespace panonav::simulation {
namespace {

TEST(SimulatedOdometry, ScaleErrorIsConstantWithinARunAndDiffersBetweenRuns) {
  OdometryNoise noise = testing::exact_odometry();
  noise.translation_scale_error = 0.05;
  noise.rotation_scale_error = 0.1;
  constexpr int runs = 2000;
  double travel_square = 0.0;
  double turn_square = 0.0;
  for (std::uint64_t seed = 0; seed < runs; ++seed) {
    SimulatedOdometry odometry(noise, seed);
    const double first = odometry.advance({1.0, 0.0, 0.0}).x_m;
    EXPECT_NEAR(odometry.advance({1.0, 0.0, 0.0}).x_m - first, first, 1e-12);
    travel_square += std::pow(first - 1.0, 2);
    turn_square += std::pow(odometry.advance({0.0, 0.0, 1.0}).heading_rad - 1.0, 2);
  }
  // A standard deviation of n draws strays by more than 5 / sqrt(2 n) of itself once in 1.7
  // million.
  constexpr double sigmas = 5.0;
  EXPECT_NEAR(std::sqrt(travel_square / runs), 0.05, sigmas * 0.05 / std::sqrt(2.0 * runs));
  EXPECT_NEAR(std::sqrt(turn_square / runs), 0.1, sigmas * 0.1 / std::sqrt(2.0 * runs));
}

TEST(SimulatedOdometry, SimulatedRunStartsAtZeroAndRepeatsWithItsSeed) {
  Random random(8);
  std::vector<Pose2> truth;
  for (int i = 0; i < 30; ++i) truth.push_back({0.1 * i, 0.01 * i * i, 0.02 * i});
  const auto a = simulate_odometry(truth, {}, 9);
  ASSERT_EQ(a.size(), truth.size());
  EXPECT_EQ(a.front(), Pose2{});
  EXPECT_EQ(a, simulate_odometry(truth, {}, 9));
  EXPECT_NE(a, simulate_odometry(truth, {}, 10));
  const auto exact = simulate_odometry(truth, testing::exact_odometry(), 9);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Pose2 pose = truth.front() * exact[i];
    EXPECT_NEAR(distance(pose.position(), truth[i].position()), 0.0, 1e-10);
    EXPECT_NEAR(angle_difference(pose.heading_rad, truth[i].heading_rad), 0.0, 1e-10);
  }
  EXPECT_TRUE(simulate_odometry({}, {}, 1).empty());
}

}  // namespace
}  // namespace panonav::simulation
