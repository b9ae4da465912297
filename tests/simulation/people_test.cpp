#include "panonav_simulation/people.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav_simulation/scene.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::simulation {
namespace {

std::shared_ptr<const FreeSpace> hall() {
  const Scene scene = make_scene("hall", {.seed = 5});
  return std::make_shared<const FreeSpace>(scene, free_space_options(scene));
}

constexpr Point2 nowhere{1e6, 1e6};

TEST(People, WalkAtAWalkingPaceThroughFreePlaces) {
  const auto space = hall();
  People people(space, 5, 3);
  ASSERT_EQ(people.size(), 5U);
  double walked_m = 0.0;
  for (int i = 0; i < 200; ++i) {
    std::vector<Point2> before;
    for (std::size_t k = 0; k < people.size(); ++k) before.push_back(people.position(k));
    people.advance(0.5, nowhere, 0.2);
    for (std::size_t k = 0; k < people.size(); ++k) {
      EXPECT_LE(distance(before[k], people.position(k)), 0.4 + 1e-9);
      EXPECT_GT(space->clearance_m(people.position(k)), 0.0);
      walked_m += distance(before[k], people.position(k));
    }
  }
  // Five people, 100 seconds, 0.8 m/s: nearly always on their way.
  EXPECT_GT(walked_m, 0.8 * 5 * 100 * 0.8);
}

TEST(People, NeverWalkIntoARobotAndGoAnotherWayInTheEnd) {
  const auto space = hall();
  People people(space, 6, 4);
  const double robot_radius_m = 0.2;
  const Point2 robot = people.position(0);
  // Whoever stands there goes first.
  int moments_on_top = 0;
  for (int i = 0; i < 400; ++i) {
    const bool touched = people.has_person_within(robot, robot_radius_m);
    people.advance(0.1, robot, robot_radius_m);
    const bool touches = people.has_person_within(robot, robot_radius_m);
    // Nobody comes to touch it.
    EXPECT_TRUE(touched || !touches) << i;
    moments_on_top += static_cast<int>(touches);
  }
  EXPECT_LT(moments_on_top, 200);
}

TEST(People, TheSameSeedGivesTheSameWalks) {
  const auto space = hall();
  People one(space, 3, 8);
  People two(space, 3, 8);
  for (int i = 0; i < 50; ++i) {
    one.advance(0.3, nowhere, 0.2);
    two.advance(0.3, nowhere, 0.2);
    for (std::size_t k = 0; k < one.size(); ++k) EXPECT_EQ(one.position(k), two.position(k));
  }
}

TEST(People, AreSeenWhereTheyStand) {
  const auto space = hall();
  const People people(space, 1, 6);
  const Point2 person = people.position(0);
  // A camera one metre beside the person that looks anywhere.
  bool seen = false;
  for (int k = 0; k < 8 && !seen; ++k) {
    const double way_rad = k * std::numbers::pi / 4.0;
    const Point2 at{person.x_m + std::cos(way_rad), person.y_m + std::sin(way_rad)};
    if (!space->is_free_between(at, person)) continue;
    seen = true;
    const Pose2 camera{at.x_m, at.y_m, 0.7};
    Panorama view(40, 360, ElevationBand{-0.5, 0.7});
    std::ranges::fill(view.values(), 1.0F);
    people.paint(view, camera, 0.6);
    const Point2 there = inverse(camera) * person;
    const double bearing_rad = std::atan2(there.y_m, there.x_m);
    // The belt lies above the camera here; the horizon shows trousers, behind it is nothing.
    int painted = 0;
    const auto row = view.row(*view.horizon_row());
    for (int c = 0; c < view.columns(); ++c) {
      const double off = std::remainder(view.azimuth_rad(c) - bearing_rad, 2.0 * std::numbers::pi);
      const bool is_person = row[static_cast<std::size_t>(c)] < 1.0F;
      painted += static_cast<int>(is_person);
      // asin(0.22 / 1) is 0.222.
      EXPECT_EQ(is_person, std::abs(off) <= 0.222) << off;
    }
    EXPECT_GT(painted, 20);
  }
  EXPECT_TRUE(seen);
}

TEST(People, CannotBeFewerThanNone) {
  EXPECT_THROW(People(hall(), -1, 1), ContractError);
}

}  // namespace
}  // namespace panonav::simulation
