#include "panonav_simulation/floor.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav_simulation/internal/mesh_library.hpp"
#include "panonav_simulation/internal/shapes.hpp"
#include "panonav_simulation/internal/solids.hpp"
#include "panonav_simulation/load_gazebo.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::simulation {
namespace {

void add(Scene& scene, const Mesh& mesh, Vector3 centre, const std::string& name) {
  Affine3 place;
  place.translation = centre;
  place_mesh(scene, mesh, place, name, 0);
}

// A scene whose floor area is `half_m` around the origin, with a ground plane of 100 m at z = 0.
Scene ground_with_area(double half_x_m, double half_y_m) {
  Scene scene;
  scene.materials.push_back({});
  scene.floor_low = {-half_x_m, -half_y_m};
  scene.floor_high = {half_x_m, half_y_m};
  add(scene, make_rectangle_mesh(100.0, 100.0), {}, "ground");
  return scene;
}

struct Found {
  Scene scene;
  FreeSpaceOptions options;
  FreeSpace space;
};
Found find(Scene scene, const FloorKnowledge& known = {}) {
  FreeSpaceOptions options;
  FreeSpace space = find_free_space(scene, options, known);
  return {std::move(scene), options, std::move(space)};
}

TEST(Solids, CountBodiesButNotBuildingsAndOpenSurfaces) {
  Scene scene = ground_with_area(10.0, 10.0);
  add(scene, make_box_mesh({3.0, 4.0, 0.8}), {0.0, 0.0, 0.4}, "table");
  add(scene, make_cylinder_mesh(1.0, 2.0), {6.0, 0.0, 1.0}, "tank");
  // A building: a box around a hollow, whose corners run in the opposite order.
  add(scene, make_box_mesh({6.0, 6.0, 3.0}), {-7.0, 0.0, 1.5}, "house");
  Mesh hollow = make_box_mesh({5.6, 5.6, 2.8});
  for (auto& triangle : hollow.triangles) std::swap(triangle[0], triangle[1]);
  add(scene, hollow, {-7.0, 0.0, 1.5}, "house");
  add(scene, make_box_mesh({1.0, 1.0, 1.0}), {-7.0, 0.0, 0.6}, "cupboard");
  // A box without a bottom, mirrored.
  Mesh lid = make_box_mesh({2.0, 2.0, 1.0});
  lid.triangles.resize(10);
  place_mesh(
      scene, lid,
      [] {
        Affine3 place = Affine3::scaling(-1.0, 1.0, 1.0);
        place.translation = {0.0, 8.0, 0.5};
        return place;
      }(),
      "lid", 0);
  const Solids solids(scene);
  EXPECT_EQ(solids.count_around({1.2, -1.7, 0.3}), 1U);
  EXPECT_EQ(solids.count_around({1.2, -1.7, 0.9}), 0U);
  EXPECT_EQ(solids.count_around({1.6, -1.7, 0.3}), 0U);
  EXPECT_EQ(solids.count_around({6.5, 0.5, 1.0}), 1U);
  EXPECT_EQ(solids.count_around({-5.0, 2.0, 1.0}), 0U) << "in the house";
  EXPECT_EQ(solids.count_around({-4.1, 2.0, 1.0}), 1U) << "in its wall";
  EXPECT_EQ(solids.count_around({-7.2, 0.2, 0.5}), 1U) << "in the cupboard in the house";
  EXPECT_EQ(solids.count_around({0.0, 8.0, 0.5}), 1U);
  EXPECT_EQ(solids.count_around({3.0, 6.0, 0.5}), 0U);
}

TEST(Floor, NoPlaceIsInsideOfATable) {
  Scene scene = ground_with_area(1.5, 2.0);
  add(scene, make_box_mesh({3.0, 4.0, 0.8}), {0.0, 0.0, 0.4}, "table");
  const Found found = find(scene);
  EXPECT_FALSE(found.space.is_inside_solid());
  const auto places = found.space.grid(0.25);
  EXPECT_GT(places.size(), 100U);
  for (const GridPosition& place : places) {
    const double outside_m =
        std::max(std::abs(place.position.x_m) - 1.5, std::abs(place.position.y_m) - 2.0);
    EXPECT_GE(outside_m, found.options.robot_radius_m);
  }
}

TEST(Floor, ARoomOfOneClosedSurfaceIsARoomInAMeshFileOnly) {
  Scene scene;
  scene.materials.push_back({});
  scene.floor_low = {-3.0, -2.0};
  scene.floor_high = {3.0, 2.0};
  add(scene, make_box_mesh({6.0, 4.0, 2.5}), {0.0, 0.0, 1.25}, "room");
  const auto is_driven_on_inside = [](const Scene& room, const FloorKnowledge& known) {
    const Found found = find(room, known);
    return found.options.floor_height_m == 0.0 && found.space.is_free({0.0, 0.0});
  };
  EXPECT_TRUE(is_driven_on_inside(scene, {.may_be_room = true}));
  EXPECT_FALSE(is_driven_on_inside(scene, {}));
  // A thick ground is no room, as things stand on it.
  Scene ground = scene;
  add(ground, make_box_mesh({0.5, 0.5, 1.0}), {2.0, 0.0, 3.0}, "post");
  EXPECT_EQ(find(ground, {.may_be_room = true}).options.floor_height_m, 2.5);
  // The corners the other way round: a room seen from inside.
  for (Mesh& mesh : scene.meshes) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  }
  EXPECT_TRUE(is_driven_on_inside(scene, {}));
}

TEST(Floor, ASmallThingOnALargeGroundHasRoomAroundIt) {
  Scene scene = ground_with_area(0.15, 0.2);
  add(scene, make_box_mesh({0.3, 0.4, 0.8}), {0.0, 0.0, 0.4}, "table");
  const Found found = find(scene);
  EXPECT_GT(found.space.area_m2(), 10.0);
  EXPECT_TRUE(found.space.is_free({1.0, 1.0}));
  EXPECT_FALSE(found.space.is_free({0.3, 0.0}));
  EXPECT_EQ(found.options.floor_height_m, 0.0);
  // The area ends where the ground does.
  Scene pad = ground_with_area(0.15, 0.2);
  pad.meshes.clear();
  add(pad, make_rectangle_mesh(3.0, 3.0), {}, "ground");
  add(pad, make_box_mesh({0.3, 0.4, 0.8}), {0.0, 0.0, 0.4}, "table");
  EXPECT_TRUE(find(pad).space.is_free({1.4, 1.4}));
  EXPECT_FALSE(find(pad).space.is_free({1.6, 1.4}));
}

TEST(Floor, ItsHeightIsThatOfTheGroundWithRoomAboveIt) {
  for (const double top_m : {-0.3, 0.049, 0.05, 0.12, 0.25}) {
    SCOPED_TRACE(top_m);
    Scene scene = ground_with_area(10.0, 10.0);
    add(scene, make_box_mesh({20.0, 20.0, 4.0}), {0.0, 0.0, top_m - 2.0}, "slab");
    add(scene, make_box_mesh({0.4, 0.4, 1.0}), {3.0, 2.0, top_m + 0.5}, "post");
    if (top_m < 0.0) scene.meshes.erase(scene.meshes.begin());
    const Found found = find(scene);
    EXPECT_NEAR(found.options.floor_height_m, top_m, 1e-6);
    EXPECT_TRUE(found.space.is_free({0.0, 0.0}));
    EXPECT_FALSE(found.space.is_free({3.0, 2.3}));
  }
}

TEST(Floor, RoofsTablesAndTopsOfWallsAreNoFloors) {
  Scene scene = ground_with_area(5.0, 5.0);
  add(scene, make_box_mesh({10.0, 10.0, 0.2}), {0.0, 0.0, 3.1}, "roof");
  for (int i = -2; i <= 2; ++i)
    add(scene, make_box_mesh({1.0, 9.0, 0.7}), {2.0 * i, 0.0, 0.35}, "table " + std::to_string(i));
  FreeSpaceOptions options;
  const auto heights = find_floor_heights(scene, options);
  ASSERT_FALSE(heights.empty());
  EXPECT_EQ(find(scene).options.floor_height_m, 0.0);
  // Four walls without any ground: the robot drives on the level of their lower edges.
  Scene walls;
  walls.materials.push_back({});
  walls.floor_low = {-3.0, -3.0};
  walls.floor_high = {3.0, 3.0};
  for (const double side : {-1.0, 1.0}) {
    add(walls, make_box_mesh({0.2, 6.0, 2.0}), {2.9 * side, 0.0, 2.0}, "wall");
    add(walls, make_box_mesh({6.0, 0.2, 2.0}), {0.0, 2.9 * side, 2.0}, "wall");
  }
  EXPECT_TRUE(find_floor_heights(walls, options).empty());
  const Found found = find(walls);
  EXPECT_EQ(found.options.floor_height_m, 1.0);
  EXPECT_TRUE(found.space.is_free({0.0, 0.0}));
  // Nor are tops of things without any ground.
  Scene things;
  things.materials.push_back({});
  things.floor_low = {0.0, 0.0};
  things.floor_high = {12.0, 8.0};
  for (const double x_m : {0.5, 11.5})
    add(things, make_box_mesh({1.0, 1.0, 1.0}), {x_m, x_m > 1.0 ? 7.5 : 0.5, 5.5}, "box");
  EXPECT_EQ(find(things).options.floor_height_m, 5.0);
  EXPECT_FALSE(find(things).space.is_free({0.5, 0.5}));
}

TEST(Floor, ARoadAboveTheGroundIsDrivenOn) {
  Scene scene = ground_with_area(15.0, 3.0);
  add(scene, make_rectangle_mesh(30.0, 6.0), {0.0, 0.0, 0.1}, "road");
  add(scene, make_box_mesh({0.5, 0.5, 1.0}), {5.0, 2.0, 0.6}, "post");
  const Found found = find(scene);
  EXPECT_NEAR(found.options.floor_height_m, 0.1, 1e-6);
  EXPECT_TRUE(found.space.is_free({0.0, 0.0}));
}

TEST(Floor, LargeGroundsGetLargerCellsUnlessTheyAreSet) {
  Scene scene = ground_with_area(300.0, 400.0);
  scene.meshes.clear();
  add(scene, make_rectangle_mesh(600.0, 800.0), {}, "ground");
  const Found found = find(scene);
  EXPECT_NEAR(found.space.area_m2(), 480000.0, 2000.0);
  EXPECT_GT(found.options.cell_m, 0.3);
  EXPECT_THROW((void)find(scene, {.is_cell_known = true}), ContractError);
}

TEST(Floor, AHeightThatIsSetIsKept) {
  Scene scene = ground_with_area(3.0, 3.0);
  add(scene, make_box_mesh({6.0, 6.0, 0.2}), {0.0, 0.0, 3.1}, "roof");
  FreeSpaceOptions options;
  options.floor_height_m = 3.2;
  const FreeSpace space = find_free_space(scene, options, {.is_height_known = true});
  EXPECT_EQ(options.floor_height_m, 3.2);
  EXPECT_TRUE(space.is_free({0.0, 0.0}));
}

TEST(Roads, AreStripsAlongTheirPoints) {
  const testing::TemporaryFolder folder;
  const auto world = [&](const std::string& road) {
    return load_gazebo(folder.write("w.world", "<sdf version='1.6'><world name='w'>" + road +
                                                   "<model name='m'><link name='l'><visual "
                                                   "name='v'><geometry><box><size>1 1 1</size>"
                                                   "</box></geometry></visual></link></model>"
                                                   "</world></sdf>"));
  };
  const Scene scene = world(
      "<road name='street'><width>2</width><point>0 0 0.1</point><point>10 0 0.1</point>"
      "<point>10 5 0.1</point></road>");
  EXPECT_TRUE(scene.warnings.empty());
  ASSERT_EQ(scene.meshes.size(), 2U);
  const Mesh& street = scene.meshes[0];
  EXPECT_EQ(street.object, "street");
  ASSERT_EQ(street.vertices.size(), 6U);
  EXPECT_EQ(street.triangles.size(), 4U);
  EXPECT_EQ(street.vertices[0], (Vector3{0.0, 1.0, 0.1}));
  EXPECT_EQ(street.vertices[1], (Vector3{0.0, -1.0, 0.1}));
  EXPECT_EQ(street.vertices[4], (Vector3{9.0, 5.0, 0.1}));
  for (const auto& [a, b, c] : street.triangles) {  // all look up
    const Vector3& p = street.vertices[a];
    const Vector3& q = street.vertices[b];
    const Vector3& r = street.vertices[c];
    EXPECT_GT((q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m), 0.0);
  }
  const Scene faulty = world("<road name='street'><point>0 0 0</point></road>");
  EXPECT_EQ(faulty.meshes.size(), 1U);
  ASSERT_EQ(faulty.warnings.size(), 1U);
  EXPECT_TRUE(testing::contains(faulty.warnings[0],
                                "road \"street\" is left out: it has fewer than two points"));
}

TEST(Actors, StandWhereTheirPathBegins) {
  const testing::TemporaryFolder folder;
  folder.write("man.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 2\nf 1 2 4\nf 1 3 4\n");
  const auto load = [&](const std::string& actor) {
    return load_gazebo(folder.write(
        "w.world", "<sdf version='1.6'><world name='w'>" + actor +
                       "<model name='m'><link name='l'><visual name='v'><geometry><box><size>1 1 1"
                       "</size></box></geometry></visual></link></model></world></sdf>"));
  };
  const std::string skin = "<skin><filename>man.obj</filename><scale>0.5</scale></skin>";
  const Scene walking =
      load("<actor name='man'><pose>9 9 9 0 0 0</pose>" + skin +
           "<animation name='walk'><filename>absent.bvh</filename></animation><script><trajectory "
           "id='0' type='walk'><waypoint><time>0</time><pose>3 4 0.5 0 0 1.5707963267948966</pose>"
           "</waypoint><waypoint><time>5</time><pose>8 8 0 0 0 0</pose></waypoint></trajectory>"
           "</script></actor>");
  ASSERT_EQ(walking.meshes.size(), 2U);
  EXPECT_EQ(walking.meshes[0].object, "man");
  const auto bounds = [](const Scene& scene) {
    Scene man;
    man.meshes.push_back(scene.meshes[0]);
    return extent(man).value();
  };
  EXPECT_NEAR(bounds(walking).first.x_m, 2.5, 1e-9);
  EXPECT_NEAR(bounds(walking).second.y_m, 4.5, 1e-9);
  EXPECT_NEAR(bounds(walking).second.z_m, 1.5, 1e-9);
  ASSERT_EQ(walking.warnings.size(), 1U);
  EXPECT_TRUE(testing::contains(walking.warnings[0], "model \"man\": actors do not move"));
  // Without a path, at its own pose.
  const Scene standing = load("<actor name='man'><pose>9 9 9 0 0 0</pose>" + skin + "</actor>");
  EXPECT_NEAR(bounds(standing).first.x_m, 9.0, 1e-9);
  // One whose skin cannot be read is left out.
  folder.write("damaged.dae", "<COLLADA>");
  for (const std::string file : {"absent.dae", "damaged.dae"}) {
    const Scene without =
        load("<actor name='man'><skin><filename>" + file + "</filename></skin></actor>");
    EXPECT_EQ(without.meshes.size(), 1U);
    ASSERT_EQ(without.warnings.size(), 1U);
    EXPECT_TRUE(testing::contains(without.warnings[0], "actor \"man\" is left out: "));
    EXPECT_TRUE(testing::contains(without.warnings[0], file));
  }
}

}  // namespace
}  // namespace panonav::simulation
