// Learning around homes in simulated scenes, and finding home again after flights.

#include <gtest/gtest.h>

#include "lab/s06/chains.hpp"
#include "lab/s06/home_areas.hpp"
#include "panonav/core/error.hpp"
#include "support/skips.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

TEST(WindyOdometry, DoesNotSeeTheWind) {
  WindyOdometry calm(0.0, 3);
  WindyOdometry windy(0.1, 3);
  Pose2 by_calm;
  Pose2 by_windy;
  for (int i = 0; i < 100; ++i) {
    const Pose2 from{0.1 * i, 0.0, 0.0};
    const Pose2 to{0.1 * (i + 1), 0.0, 0.0};
    by_calm = by_calm * calm.measure(from, to);
    by_windy = by_windy * windy.measure(from, to);
  }
  EXPECT_NEAR(distance(by_calm.position(), by_windy.position()), 1.0, 0.15) << "10 % of 10 m";
}

TEST(HomeFlight, ArrivesOnlyAtHome) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  EXPECT_THROW((void)make_home_scene("moon", 1), ContractError);
  Executor executor(2);
  const HomingPlace place =
      make_homing_place(make_home_scene("garden", 1), chain_camera(), executor);
  const HomeTask task;
  const LearntHome home = learn_home(place, task, 5, executor);
  EXPECT_LE(home.area.chain.pack().size(), static_cast<std::size_t>(task.max_bytes));
  EXPECT_GE(home.area.returns, 2U);
  EXPECT_GT(home.area.homeward_component(), 0.7);
  int at_home = 0;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const HomeFlight flight = fly_home(place, home, task, seed);
    at_home += flight.is_home(0.5) ? 1 : 0;
    EXPECT_FALSE(flight.has_arrived_elsewhere(0.5));
    EXPECT_GE(flight.out_m, task.min_flight_m - 1.0);
    if (seed > 1) continue;
    EXPECT_EQ(fly_home(place, home, task, seed).end_distance_m, flight.end_distance_m)
        << "the same seed";
  }
  EXPECT_GE(at_home, 2);
}

}  // namespace
}  // namespace panonav::lab
