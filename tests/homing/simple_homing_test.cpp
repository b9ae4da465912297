#include "panonav/homing/simple_homing.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {
namespace {

constexpr double pi = std::numbers::pi;

// Dark posts at a distance of 1 around (0, 0), seen from (x, y).
std::vector<float> posts_from(double x, double y, double heading) {
  constexpr int columns = 720;
  std::vector<float> row(columns, 0.9F);
  for (int post = 0; post < 9; ++post) {
    const double azimuth = 2.0 * pi * post / 9.0 + 0.1 * std::sin(3.0 * post);
    const double seen = std::atan2(std::sin(azimuth) - y, std::cos(azimuth) - x) - heading;
    const int middle = static_cast<int>(std::lround(wrap_angle(seen) / (2.0 * pi) * columns));
    for (int c = middle - 4; c <= middle + 4; ++c) row[(c + 2 * columns) % columns] = 0.1F;
  }
  return row;
}

TEST(LandmarkHoming, PointsHomeAndTellsTheDistance) {
  const auto home = average_landmark_vector(posts_from(0.0, 0.0, 0.0));
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const double angle = random.uniform(-pi, pi);
    const double heading = random.uniform(-pi, pi);
    constexpr double d = 0.15;
    const auto current =
        average_landmark_vector(posts_from(d * std::cos(angle), d * std::sin(angle), heading));
    const HomeVector v = landmark_home_vector(home, current, -heading);
    EXPECT_LT(std::abs(angle_difference(v.direction_rad(), angle + pi - heading)), radians(20.0));
    EXPECT_NEAR(v.length(), d, 0.06);
  }
}

TEST(LandmarkHoming, AtHomeThereIsNoVectorAndAFlatRowHasNoLandmarks) {
  const auto home = average_landmark_vector(posts_from(0.1, 0.0, 0.0));
  EXPECT_EQ(landmark_home_vector(home, home, 0.0).length(), 0.0);
  EXPECT_EQ(landmark_home_vector(home, home, 0.0).confidence, 0.0);
  EXPECT_EQ(average_landmark_vector(std::vector<float>(10, 0.3F)), AverageLandmarkVector{});
  EXPECT_THROW((void)average_landmark_vector(std::vector<float>(3)), ContractError);
}

TEST(DescentDirection, LeadsDownABowl) {
  const auto bowl = [](double x, double y) {
    return (x - 1.0) * (x - 1.0) + 2.0 * (y + 1.0) * (y + 1.0);
  };
  std::vector<NearbyDifference> nearby;
  for (int i = 0; i < 8; ++i) {
    const double angle = pi * i / 4.0;
    const Point2 offset{0.02 * std::cos(angle), 0.02 * std::sin(angle)};
    nearby.push_back({offset, bowl(0.5 + offset.x_m, 0.5 + offset.y_m)});
  }
  const auto direction = descent_direction_rad(bowl(0.5, 0.5), nearby);
  ASSERT_TRUE(direction.has_value());
  // Against the gradient (-1, 6).
  EXPECT_NEAR(angle_difference(*direction, std::atan2(-6.0, 1.0)), 0.0, 1e-6);
}

TEST(DescentDirection, HasNoAnswerWhereTheNeighboursTellNone) {
  const std::array<NearbyDifference, 2> line{{{{0.1, 0.0}, 1.0}, {{-0.2, 0.0}, 2.0}}};
  EXPECT_FALSE(descent_direction_rad(1.5, line).has_value());
  EXPECT_FALSE(descent_direction_rad(1.5, {}).has_value());
  const std::array<NearbyDifference, 2> level{{{{0.1, 0.0}, 1.0}, {{0.0, 0.1}, 1.0}}};
  EXPECT_FALSE(descent_direction_rad(1.0, level).has_value());
  EXPECT_THROW((void)descent_direction_rad(std::nan(""), level), ContractError);
}

}  // namespace
}  // namespace panonav
