#include "panonav_simulation/free_space.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/motion/path.hpp"
#include "panonav_simulation/internal/affine3.hpp"
#include "panonav_simulation/internal/mesh_library.hpp"
#include "panonav_simulation/internal/occupancy.hpp"
#include "panonav_simulation/internal/shapes.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::simulation {
namespace {

void add_box(Scene& scene, const std::string& name, Vector3 centre, Vector3 size) {
  Affine3 place;
  place.translation = centre;
  place_mesh(scene, make_box_mesh(size), place, name, 0);
}

// A room of 6 x 4 m with a wall across at x = 3, with a door of 1 m at the top, and a carpet.
Scene two_rooms() {
  Scene scene;
  scene.materials.push_back({});
  scene.floor_low = {-1.0, -1.0};
  scene.floor_high = {7.0, 5.0};
  add_box(scene, "floor", {3.0, 2.0, -0.05}, {6.0, 4.0, 0.1});
  add_box(scene, "carpet", {1.0, 1.0, 0.01}, {1.0, 1.0, 0.02});
  add_box(scene, "lamp", {1.0, 1.0, 1.5}, {0.5, 0.5, 0.1});
  add_box(scene, "left", {-0.05, 2.0, 1.0}, {0.1, 4.2, 2.0});
  add_box(scene, "right", {6.05, 2.0, 1.0}, {0.1, 4.2, 2.0});
  add_box(scene, "bottom", {3.0, -0.05, 1.0}, {6.2, 0.1, 2.0});
  add_box(scene, "top", {3.0, 4.05, 1.0}, {6.2, 0.1, 2.0});
  add_box(scene, "across", {3.0, 1.5, 1.0}, {0.1, 3.0, 2.0});
  return scene;
}

TEST(Occupancy, DistancesAreThoseOfAFullSearch) {
  Random random(1);
  for (int run = 0; run < 20; ++run) {
    const Raster raster{{0.0, 0.0},
                        0.1,
                        1 + static_cast<int>(random.index(40)),
                        1 + static_cast<int>(random.index(40))};
    std::vector<std::uint8_t> cells(static_cast<std::size_t>(raster.columns * raster.rows));
    for (auto& cell : cells) cell = random.uniform() < 0.02 ? 1 : 0;
    const auto distances = compute_distances_to_cells(cells, raster);
    for (int j = 0; j < raster.rows; ++j) {
      for (int i = 0; i < raster.columns; ++i) {
        double nearest = std::numeric_limits<double>::infinity();
        for (int v = 0; v < raster.rows; ++v) {
          for (int u = 0; u < raster.columns; ++u) {
            if (cells[static_cast<std::size_t>(v * raster.columns + u)] != 0)
              nearest = std::min(nearest, std::hypot(u - i, v - j));
          }
        }
        const auto found =
            static_cast<double>(distances[static_cast<std::size_t>(j * raster.columns + i)]);
        if (std::isinf(nearest)) {
          EXPECT_TRUE(std::isinf(found));
        } else {
          EXPECT_NEAR(found, nearest, 1e-4);
        }
      }
    }
  }
}

TEST(Occupancy, EverySampledPointOfATriangleLiesInAMarkedCellAndNoCellIsFar) {
  Random random(2);
  const Raster raster{{0.0, 0.0}, 0.05, 40, 40};
  int sampled = 0;
  for (int run = 0; run < 50; ++run) {
    Scene scene;
    scene.materials.push_back({});
    Mesh mesh;
    for (int i = 0; i < 3; ++i)
      mesh.vertices.push_back(
          {random.uniform(0.0, 2.0), random.uniform(0.0, 2.0), random.uniform(-1.0, 2.0)});
    mesh.triangles.push_back({0, 1, 2});
    scene.meshes.push_back(mesh);
    const auto cells = find_occupied_cells(scene, raster, 0.0, 0.6);
    std::vector<std::uint8_t> hit(cells.size(), 0);
    for (int n = 0; n < 20000; ++n) {
      double s = random.uniform();
      double t = random.uniform();
      if (s + t > 1.0) {
        s = 1.0 - s;
        t = 1.0 - t;
      }
      const auto mix = [&](double a, double b, double c) { return a + s * (b - a) + t * (c - a); };
      const auto& v = mesh.vertices;
      if (const double z = mix(v[0].z_m, v[1].z_m, v[2].z_m); z < 0.0 || z > 0.6) continue;
      const int i = static_cast<int>(mix(v[0].x_m, v[1].x_m, v[2].x_m) / raster.cell_m);
      const int j = static_cast<int>(mix(v[0].y_m, v[1].y_m, v[2].y_m) / raster.cell_m);
      hit[static_cast<std::size_t>(j * raster.columns + i)] = 1;
      ++sampled;
      ASSERT_EQ(cells[static_cast<std::size_t>(j * raster.columns + i)], 1) << "run " << run;
    }
    // Marked cells that no sample fell into lie at the rim, next to one that was hit.
    for (int j = 0; j < raster.rows; ++j) {
      for (int i = 0; i < raster.columns; ++i) {
        if (cells[static_cast<std::size_t>(j * raster.columns + i)] == 0) continue;
        bool near = false;
        for (int v = std::max(0, j - 2); v <= std::min(raster.rows - 1, j + 2); ++v) {
          for (int u = std::max(0, i - 2); u <= std::min(raster.columns - 1, i + 2); ++u) {
            near = near || hit[static_cast<std::size_t>(v * raster.columns + u)] != 0;
          }
        }
        EXPECT_TRUE(near) << "run " << run << " cell " << i << " " << j;
      }
    }
  }
  EXPECT_GT(sampled, 10000);
}

TEST(FreeSpace, KeepsTheRobotItsRadiusAwayFromEverythingInItsHeight) {
  const FreeSpace space(two_rooms());
  EXPECT_TRUE(space.is_free({1.0, 1.0}));    // on the carpet, under the lamp
  EXPECT_TRUE(space.is_free({0.25, 2.0}));   // 25 cm from the wall
  EXPECT_FALSE(space.is_free({0.15, 2.0}));  // 15 cm
  EXPECT_FALSE(space.is_free({2.8, 1.0}));   // 15 cm from the wall across
  EXPECT_TRUE(space.is_free({3.0, 3.5}));    // in the door
  EXPECT_FALSE(space.is_free({-0.5, 2.0}));  // outside, no floor
  EXPECT_FALSE(space.is_free({100.0, 2.0}));
  EXPECT_FALSE(space.is_free({std::nan(""), 2.0}));
  // Two rooms less a rim of 20 cm (and up to 1.5 cells), and less the wall with its rim.
  const double max_area_m2 = 5.6 * 3.6 - 0.5 * 3.0;
  EXPECT_LT(space.area_m2(), max_area_m2 + 0.05);
  EXPECT_GT(space.area_m2(), max_area_m2 - 0.9);
  FreeSpaceOptions tall;
  tall.robot_height_m = 1.6;
  EXPECT_FALSE(FreeSpace(two_rooms(), tall).is_free({1.0, 1.0}));  // the lamp
}

TEST(FreeSpace, ClearanceIsALowerBoundWithinOneAndAHalfCells) {
  const FreeSpace space(two_rooms());
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const Point2 p = space.random_pose(random).position();
    EXPECT_TRUE(space.is_free(p));
    const double to_walls = std::min({p.x_m, 6.0 - p.x_m, p.y_m, 4.0 - p.y_m});
    const double dx = std::max(0.0, std::abs(p.x_m - 3.0) - 0.05);
    const double dy = std::max(0.0, p.y_m - 3.0);
    const double truth = std::min(to_walls, std::hypot(dx, dy));
    EXPECT_LE(space.clearance_m(p), truth + 1e-6);
    EXPECT_GE(space.clearance_m(p), truth - 3.0 * 0.025);
    EXPECT_GE(truth, 0.2);
  }
}

TEST(FreeSpace, OnlyOneConnectedPartIsKept) {
  Scene scene = two_rooms();
  add_box(scene, "door", {3.0, 3.5, 1.0}, {0.1, 1.0, 2.0});
  add_box(scene, "cupboard", {5.0, 1.0, 0.5}, {1.5, 1.5, 1.0});
  const FreeSpace larger(scene);
  EXPECT_TRUE(larger.is_free({1.0, 1.0}));
  EXPECT_FALSE(larger.is_free({4.0, 3.5}));
  EXPECT_FALSE(larger.is_free({5.0, 1.0}));  // inside the hollow cupboard
  const FreeSpace right(scene, {}, Point2{4.0, 3.5});
  EXPECT_TRUE(right.is_free({4.0, 3.5}));
  EXPECT_FALSE(right.is_free({1.0, 1.0}));
  EXPECT_THROW(FreeSpace(scene, {}, Point2{-0.5, 0.0}), ContractError);
}

TEST(FreeSpace, DrivableAreasRestrict) {
  Scene scene = two_rooms();
  scene.drivable = {{{0.5, 0.5}, {1.5, 1.5}}};
  const FreeSpace space(scene);
  EXPECT_TRUE(space.is_free({1.0, 1.0}));
  EXPECT_FALSE(space.is_free({2.0, 2.0}));
  EXPECT_NEAR(space.area_m2(), 1.0, 0.06);
}

TEST(FreeSpace, PathsAreFreeAndShort) {
  const FreeSpace space(two_rooms());
  const Point2 a{2.0, 0.5};
  const Point2 b{4.0, 0.5};
  const auto path = space.shortest_path(a, b);
  ASSERT_TRUE(path.has_value());
  EXPECT_EQ(path->front(), a);
  EXPECT_EQ(path->back(), b);
  for (std::size_t i = 1; i < path->size(); ++i) {
    EXPECT_TRUE(space.is_free_between((*path)[i - 1], (*path)[i]));
  }
  // Tangents and arcs round the two corners of the wall's end, (3 -+ 0.05, 3), at distance r.
  const auto taut = [](double r) {
    const double to_corner = std::hypot(0.95, 2.5);
    const double arc = 0.5 * std::numbers::pi + std::atan2(2.5, 0.95) - std::acos(r / to_corner);
    return 2.0 * (std::sqrt(to_corner * to_corner - r * r) + r * arc) + 0.1;
  };
  EXPECT_GT(path_length_m(*path), taut(0.2) - 1e-6);
  EXPECT_LT(path_length_m(*path), 1.01 * taut(0.2 + 2.0 * 0.025));
  Random random(4);
  for (int i = 0; i < 30; ++i) {
    const Point2 p = space.random_pose(random).position();
    const Point2 q = space.random_pose(random).position();
    const auto way = space.shortest_path(p, q);
    ASSERT_TRUE(way.has_value());
    for (std::size_t k = 1; k < way->size(); ++k) {
      // Sampled, independently of is_free_between.
      for (int n = 0; n <= 200; ++n) {
        const double t = n / 200.0;
        EXPECT_TRUE(space.is_free({(*way)[k - 1].x_m + t * ((*way)[k].x_m - (*way)[k - 1].x_m),
                                   (*way)[k - 1].y_m + t * ((*way)[k].y_m - (*way)[k - 1].y_m)}));
      }
    }
    if (space.is_free_between(p, q)) {
      EXPECT_NEAR(path_length_m(*way), distance(p, q), 0.03 * distance(p, q) + 0.05);
    }
  }
  EXPECT_FALSE(space.shortest_path(a, {-0.5, 0.0}).has_value());
  EXPECT_EQ(space.shortest_path(a, a)->size(), 2U);
}

TEST(FreeSpace, GridAndRandomPosesCoverTheFreeArea) {
  const FreeSpace space(two_rooms());
  const auto grid = space.grid(0.25);
  EXPECT_NEAR(static_cast<double>(grid.size()) * 0.0625, space.area_m2(), 0.15 * space.area_m2());
  for (const auto& place : grid) EXPECT_TRUE(space.is_free(place.position));
  Random a(5), b(5);
  double right = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const Pose2 pose = space.random_pose(a);
    EXPECT_EQ(pose, space.random_pose(b));
    EXPECT_TRUE(space.is_free(pose.position()));
    if (pose.x_m > 3.0) right += 1.0;
  }
  // The rooms are alike: half the poses in each; 5 standard deviations stray once in 1.7 million.
  EXPECT_NEAR(right / 2000.0, 0.5, 5.0 * std::sqrt(0.25 / 2000.0) + 0.01);
}

TEST(FreeSpace, BuiltInScenesHaveRoomForTheirRobot) {
  for (const char* name : {"office", "hall", "lab"}) {
    const Scene scene = make_scene(name);
    FreeSpaceOptions options;
    options.robot_height_m = scene.camera_height_m;
    const FreeSpace space(scene, options);
    EXPECT_GT(space.area_m2(), 5.0) << name;
  }
}

TEST(FreeSpace, BadInputIsNamed) {
  const Scene scene = two_rooms();
  FreeSpaceOptions options;
  options.cell_m = 0.0;
  EXPECT_THROW(FreeSpace(scene, options), OptionError);
  options = {};
  options.step_height_m = 1.0;
  EXPECT_THROW(FreeSpace(scene, options), ContractError);
  options = {};
  options.robot_radius_m = 3.0;
  EXPECT_THROW(FreeSpace(scene, options), ContractError);
  Scene huge = scene;
  huge.floor_high = {1e6, 1e6};
  EXPECT_THROW(FreeSpace{huge}, ContractError);
  Scene empty = scene;
  empty.floor_high = empty.floor_low;
  EXPECT_THROW(FreeSpace{empty}, ContractError);
}

}  // namespace
}  // namespace panonav::simulation
