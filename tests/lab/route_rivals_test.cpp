#include "lab/baselines/route_rivals.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::lab {
namespace {

constexpr int picture_columns = 144;
constexpr int picture_rows = 20;

// A world of coloured columns that stand in a wide ring: edges in azimuth and in elevation.
struct ColumnWorld {
  struct Column {
    Point2 at;
    double radius_m = 0.5;
    double height_m = 2.0;
    float grey = 0.5F;
  };
  std::vector<Column> all;

  explicit ColumnWorld(std::uint64_t seed, int count = 40) {
    Random random(seed);
    for (int i = 0; i < count; ++i) {
      const double azimuth = 2.0 * std::numbers::pi * (i + random.uniform()) / count;
      const double distance_m = random.uniform(3.0, 8.0);
      all.push_back({{distance_m * std::cos(azimuth), distance_m * std::sin(azimuth)},
                     random.uniform(0.2, 0.6),
                     random.uniform(0.8, 4.0),
                     static_cast<float>(random.uniform())});
    }
  }

  // The view from 1 m above the floor: the nearest column, or sky and floor.
  [[nodiscard]] Panorama view(const Pose2& pose) const {
    Panorama seen(picture_rows, picture_columns, ElevationBand{radians(-30.0), radians(40.0)});
    for (int c = 0; c < picture_columns; ++c) {
      const double azimuth = pose.heading_rad + seen.azimuth_rad(c);
      double nearest_m = 1e9;
      const Column* hit = nullptr;
      for (const Column& column : all) {
        const double dx = column.at.x_m - pose.x_m;
        const double dy = column.at.y_m - pose.y_m;
        const double along_m = dx * std::cos(azimuth) + dy * std::sin(azimuth);
        const double beside_m = dy * std::cos(azimuth) - dx * std::sin(azimuth);
        if (along_m <= 0.0 || std::abs(beside_m) > column.radius_m || along_m > nearest_m) continue;
        nearest_m = along_m;
        hit = &column;
      }
      for (int y = 0; y < picture_rows; ++y) {
        const double height_m = 1.0 + nearest_m * std::tan(seen.elevation_rad(y));
        const bool is_column = hit != nullptr && height_m >= 0.0 && height_m <= hit->height_m;
        seen.at(y, c) = is_column ? hit->grey : (seen.elevation_rad(y) > 0.0 ? 0.9F : 0.3F);
      }
    }
    return seen;
  }

  // Pictures every 0.1 m along the x axis from -2 m to 2 m.
  [[nodiscard]] std::vector<RoutePicture> route() const {
    std::vector<RoutePicture> pictures;
    for (int i = 0; i <= 40; ++i) {
      pictures.push_back(
          {view({-2.0 + 0.1 * i, 0.0, 0.0}), i == 0 ? Pose2{} : Pose2{0.1, 0.0, 0.0}});
    }
    return pictures;
  }
};

// Turns of a robot against the route, in headings of the scan.
constexpr std::array<int, 5> tried_turns{-10, -3, 0, 4, 9};

RoutePicture turned(const Panorama& panorama, int headings) {
  return {rotate_columns(panorama, picture_columns / HeadingScan::columns * headings), {}};
}

TEST(PerfectMemory, FindsAStoredViewAndItsTurnExactly) {
  const auto route = ColumnWorld(1).route();
  const auto memory = make_perfect_memory();
  memory->learn(route);
  for (std::size_t i = 0; i < route.size(); i += 3) {
    for (const int turn : tried_turns) {
      const RouteDirection found = memory->steer(turned(route[i].panorama, turn));
      EXPECT_EQ(found.place, i);
      EXPECT_NEAR(found.turn_rad, -radians(5.0) * turn, 1e-9);
    }
  }
  EXPECT_EQ(memory->bytes(), 14.0 * 720.0);
}

TEST(FamiliarityNetworks, TurnTowardsTheHeadingOfALearntView) {
  const auto route = ColumnWorld(2).route();
  for (const auto& make : {make_infomax_network, make_mushroom_body}) {
    const auto network = make();
    network->learn(route);
    int right = 0;
    int all = 0;
    for (std::size_t i = 0; i < route.size(); i += 3) {
      for (const int turn : tried_turns) {
        const double error =
            network->steer(turned(route[i].panorama, turn)).turn_rad + radians(5.0) * turn;
        right += std::abs(error) < radians(7.5) ? 1 : 0;
        ++all;
      }
    }
    EXPECT_GE(right, 9 * all / 10) << network->name();
    EXPECT_FALSE(network->reports_arrival());
  }
}

// A network that has learnt another world has no reason to prefer the heading of this route.
TEST(FamiliarityNetworks, KnowLearntViewsBetterThanThoseOfAnotherWorld) {
  const auto route = ColumnWorld(3).route();
  const auto other = ColumnWorld(4).route();
  for (const auto& make : {make_infomax_network, make_mushroom_body}) {
    const auto own = make();
    const auto foreign = make();
    own->learn(route);
    foreign->learn(other);
    double own_error = 0.0;
    double foreign_error = 0.0;
    for (std::size_t i = 0; i < route.size(); i += 3) {
      for (const int turn : tried_turns) {
        const RoutePicture picture = turned(route[i].panorama, turn);
        own_error += std::abs(own->steer(picture).turn_rad + radians(5.0) * turn);
        foreign_error += std::abs(foreign->steer(picture).turn_rad + radians(5.0) * turn);
      }
    }
    EXPECT_LT(own_error, 0.3 * foreign_error) << own->name();
  }
}

TEST(SequenceMatching, FindsAShiftedSequence) {
  const ColumnWorld world(5);
  const auto route = world.route();
  const auto method = make_sequence_matching();
  method->learn(route);
  // Driven 5 cm beside the route and from its middle on, at the same spacing.
  for (int i = 15; i <= 39; i += 3) {
    const RouteDirection found = method->steer({world.view({-2.0 + 0.1 * i, 0.05, 0.0}), {}});
    if (i < 24) continue;  // a sequence needs some pictures
    ASSERT_TRUE(found.place.has_value());
    EXPECT_NEAR(static_cast<double>(*found.place), i, 3.0);
    EXPECT_NEAR(found.turn_rad, 0.0, radians(7.5));
  }
}

TEST(MinWarping, FindsDirectionAndTurnAmongColumns) {
  const ColumnWorld world(6);
  const Panorama snapshot = shrink_panorama(world.view({}), picture_rows, 72);
  for (int i = 0; i < 12; ++i) {
    const double azimuth = 2.0 * std::numbers::pi * i / 12.0;
    const double heading = radians(10.0) * (i % 5 - 2);
    const Pose2 here{0.6 * std::cos(azimuth), 0.6 * std::sin(azimuth), heading};
    const Warp warp =
        compute_min_warp(snapshot, shrink_panorama(world.view(here), picture_rows, 72));
    EXPECT_NEAR(warp.turn_rad, heading, radians(7.5)) << i;
    const double home = azimuth + std::numbers::pi - heading;
    EXPECT_LT(std::abs(angle_difference(warp.home_rad, home)), radians(25.0)) << i;
    EXPECT_LT(warp.cost, 0.5);
  }
  // At home with a turn alone, every column fits at once.
  const Warp turn = compute_min_warp(snapshot, rotate_columns(snapshot, 6));
  EXPECT_NEAR(turn.turn_rad, radians(30.0), 1e-9);
  EXPECT_NEAR(turn.cost, 0.0, 1e-6);
  EXPECT_THROW((void)compute_min_warp(snapshot, world.view({})), ContractError);
}

TEST(RouteMethods, LeadAlongTheirRouteAndRefuseASinglePicture) {
  const ColumnWorld world(7);
  const auto route = world.route();
  for (const auto& make :
       {make_perfect_memory, make_infomax_network, make_mushroom_body, make_sequence_matching,
        make_min_warping, make_snapshot_chain, make_horizon_chain, make_route_panorama}) {
    const auto method = make();
    EXPECT_THROW(method->learn(std::span(route).first(1)), ContractError) << method->name();
    method->learn(route);
    EXPECT_GT(method->bytes(), 0.0) << method->name();
    const RouteDirection first = method->steer({route.front().panorama, {}});
    EXPECT_LT(std::abs(first.turn_rad), radians(45.0)) << method->name();
    EXPECT_GT(first.advance_m, 0.0) << method->name();
  }
}

}  // namespace
}  // namespace panonav::lab
