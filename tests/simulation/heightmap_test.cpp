#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>

#include "panonav/io/image_file.hpp"
#include "panonav_simulation/floor.hpp"
#include "panonav_simulation/internal/mesh_library.hpp"
#include "panonav_simulation/internal/shapes.hpp"
#include "panonav_simulation/load_gazebo.hpp"
#include "panonav_simulation/renderer.hpp"
#include "support/grey_png.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::simulation {
namespace {

using testing::contains;
using testing::make_grey_png_of_16_bits;

// Values of an image from a function of the position, u and v from 0 to 1, v downwards.
std::vector<std::uint16_t> make_levels(int side, const std::function<double(double, double)>& f) {
  std::vector<std::uint16_t> values;
  for (int v = 0; v < side; ++v) {
    for (int u = 0; u < side; ++u)
      values.push_back(
          static_cast<std::uint16_t>(std::lround(f(u / (side - 1.0), v / (side - 1.0)))));
  }
  return values;
}

class Heightmap : public testing::InTemporaryFolder {
 protected:
  [[nodiscard]] Scene load(const std::string& heightmap, const std::string& more = "",
                           const GazeboOptions& options = {}) const {
    return load_gazebo(
        folder.write("w.world",
                     "<sdf version='1.6'><world name='w'><model "
                     "name='land'><link name='l'><visual name='v'>"
                     "<geometry><heightmap>" +
                         heightmap + "</heightmap></geometry></visual></link></model>" + more +
                         "</world></sdf>"),
        options);
  }
};

struct FoundFloor {
  Scene scene;
  FreeSpaceOptions options;
  FreeSpace space;
};
FoundFloor find_floor(Scene scene, const FloorKnowledge& known = {},
                      FreeSpaceOptions options = {}) {
  FreeSpace space = find_free_space(scene, options, known);
  return {std::move(scene), options, std::move(space)};
}

TEST_F(Heightmap, SpansItsSizeWithTheFirstRowInTheNorthAndTheLargestLevelOnTop) {
  // North row 0 100 400, then 0 0 0, then 200 0 0; 400 is the largest level, far below white.
  folder.write("h.png", make_grey_png_of_16_bits(3, 3, {0, 100, 400, 0, 0, 0, 200, 0, 0}));
  const Scene scene =
      load("<uri>h.png</uri><size>4 2 10</size><pos>1 2 3</pos><sampling>2</sampling>");
  EXPECT_TRUE(scene.warnings.empty());
  ASSERT_EQ(scene.meshes.size(), 1U);
  const auto& vertices = scene.meshes[0].vertices;
  ASSERT_EQ(vertices.size(), 9U);
  EXPECT_EQ(scene.meshes[0].triangles.size(), 8U);
  const auto height_at = [&](double x_m, double y_m) {
    for (const Vector3& v : vertices) {
      if (std::abs(v.x_m - x_m) < 1e-9 && std::abs(v.y_m - y_m) < 1e-9) return v.z_m;
    }
    return std::nan("");
  };
  EXPECT_NEAR(height_at(3.0, 3.0), 13.0, 1e-9) << "north-east";
  EXPECT_NEAR(height_at(1.0, 3.0), 5.5, 1e-9);
  EXPECT_NEAR(height_at(-1.0, 3.0), 3.0, 1e-9) << "north-west";
  EXPECT_NEAR(height_at(-1.0, 1.0), 8.0, 1e-9) << "south-west";
  for (const auto& [a, b, c] : scene.meshes[0].triangles) {  // all look up
    const Vector3& p = vertices[a];
    const Vector3& q = vertices[b];
    const Vector3& r = vertices[c];
    EXPECT_GT((q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m), 0.0);
  }
}

TEST_F(Heightmap, BitDepthAndFileFormatDoNotMatter) {
  const std::vector<std::uint8_t> grey{0, 10, 40, 0, 0, 0, 20, 0, 0};
  folder.write("deep.png", make_grey_png_of_16_bits(3, 3, {grey.begin(), grey.end()}));
  const Image flat(3, 3, 1, grey);
  write_png(folder / "flat.png", flat.view());
  std::vector<std::uint8_t> colour;
  for (const std::uint8_t value : grey) colour.insert(colour.end(), 3, value);
  const Image coloured(3, 3, 3, colour);
  write_png(folder / "colour.png", coloured.view());
  const Scene deep = load("<uri>deep.png</uri><size>4 2 10</size>");
  for (const std::string name : {"flat.png", "colour.png"}) {
    const Scene other = load("<uri>" + name + "</uri><size>4 2 10</size>");
    for (std::size_t i = 0; i < deep.meshes[0].vertices.size(); ++i)
      EXPECT_NEAR(other.meshes[0].vertices[i].z_m, deep.meshes[0].vertices[i].z_m, 1e-9) << name;
  }
}

TEST_F(Heightmap, OfOneLevelOrWithNegativeHeightIsAsInGazebo) {
  folder.write("black.png", make_grey_png_of_16_bits(2, 2, {0, 0, 0, 0}));
  const Scene flat = load("<uri>black.png</uri><size>4 4 10</size>");
  for (const Vector3& v : flat.meshes[0].vertices) EXPECT_EQ(v.z_m, 0.0);
  folder.write("h.png", make_grey_png_of_16_bits(2, 2, {0, 0, 0, 9}));
  const Scene inverse = load("<uri>h.png</uri><size>4 4 -3</size>");
  for (const Vector3& v : inverse.meshes[0].vertices)
    EXPECT_EQ(v.z_m, v.x_m > 0.0 && v.y_m < 0.0 ? -2.0 : 1.0);
}

TEST_F(Heightmap, FaultyOnesAreLeftOutWithAReason) {
  const std::string box =
      "<model name='b'><link name='l'><visual name='v'><geometry><box><size>1 1 1</size></box>"
      "</geometry></visual></link></model>";
  folder.write("text.png", "no image");
  folder.write("cut.png", make_grey_png_of_16_bits(2, 2, {1, 2, 3, 4}).substr(0, 60));
  folder.write("dot.png", make_grey_png_of_16_bits(1, 1, {7}));
  folder.write("h.png", make_grey_png_of_16_bits(2, 2, {1, 2, 3, 4}));
  for (const auto& [heightmap, why] : {
           std::pair{"<uri>absent.png</uri>", "its heightmap \"absent.png\" was not found"},
           std::pair{"<uri>text.png</uri>", "text.png: is not an image that can be read"},
           std::pair{"<uri>cut.png</uri>", "cut.png: damaged PNG"},
           std::pair{"<uri>dot.png</uri>", "has fewer than 2 x 2 pixels"},
           std::pair{"<uri>h.png</uri><size>0 1 1</size>", "its size in x or y is not above 0"},
           std::pair{"<uri>h.png</uri><size>1 1</size>", "the size of its heightmap"},
           std::pair{"<uri>h.png</uri><texture><size>-1</size></texture>",
                     "the size of a texture is not above 0"},
       }) {
    SCOPED_TRACE(heightmap);
    const Scene scene = load(heightmap, box);
    EXPECT_EQ(scene.meshes.size(), 1U);
    ASSERT_EQ(scene.warnings.size(), 1U);
    EXPECT_TRUE(contains(scene.warnings[0], "visual \"v\" is left out: ")) << scene.warnings[0];
    EXPECT_TRUE(contains(scene.warnings[0], why)) << scene.warnings[0];
  }
}

TEST_F(Heightmap, TexturesChangeAtTheHeightsOfBlends) {
  folder.write("h.png", make_grey_png_of_16_bits(
                            65, 65, make_levels(65, [](double u, double) { return 1000.0 * u; })));
  const Image texture(2, 2);
  for (const char* name : {"low.png", "mid.png", "top.png"})
    write_png(folder / name, texture.view());
  GazeboOptions options;
  options.textures.read = [](const std::filesystem::path& path) { return read_image(path); };
  const Scene scene = load(
      "<uri>h.png</uri><size>64 64 8</size>"
      "<texture><diffuse>low.png</diffuse><size>4</size></texture>"
      "<texture><diffuse>mid.png</diffuse><size>8</size></texture>"
      "<texture><diffuse>top.png</diffuse><size>8</size></texture>"
      "<blend><min_height>2</min_height><fade_dist>1</fade_dist></blend>"
      "<blend><min_height>6</min_height><fade_dist>1</fade_dist></blend>",
      "", options);
  EXPECT_TRUE(scene.warnings.empty());
  ASSERT_EQ(scene.meshes.size(), 3U);
  const std::vector<std::pair<double, double>> ranges{{0.0, 2.0}, {2.0, 6.0}, {6.0, 8.0}};
  std::size_t triangles = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Mesh& mesh = scene.meshes[i];
    triangles += mesh.triangles.size();
    EXPECT_NE(scene.materials.at(static_cast<std::size_t>(mesh.material)).texture, nullptr);
    for (const Vector3& v : mesh.vertices) {
      EXPECT_GE(v.z_m, ranges[i].first - 0.1);
      EXPECT_LE(v.z_m, ranges[i].second + 0.1);
    }
    ASSERT_EQ(mesh.texture_coordinates.size(), mesh.vertices.size());
    const double tile_m = i == 0 ? 4.0 : 8.0;
    EXPECT_NEAR(mesh.texture_coordinates[0][0], mesh.vertices[0].x_m / tile_m, 1e-5);
  }
  EXPECT_EQ(triangles, 2U * 64U * 64U);
}

TEST_F(Heightmap, RobotsStandOnTheGroundBetweenThings) {
  // A slope of 20 % to the east; in the middle a box that stands on it.
  folder.write("h.png", make_grey_png_of_16_bits(129, 129, make_levels(129, [](double u, double) {
                                                   return 65535.0 * u;
                                                 })));
  const std::string box =
      "<model name='box'><pose>0 0 2.3 0 0 0</pose><link name='l'><visual name='v'><geometry><box>"
      "<size>1 1 1</size></box></geometry></visual></link></model>";
  const FoundFloor found = find_floor(load("<uri>h.png</uri><size>20 20 4</size>", box));
  ASSERT_NE(found.scene.ground, nullptr);
  for (const double x_m : {-9.0, -3.3, 0.0, 4.0, 9.5})
    EXPECT_NEAR(found.scene.ground->height_m({x_m, 5.0}), 2.0 + 0.2 * x_m, 1e-3);
  EXPECT_NEAR(found.options.floor_height_m, 2.0, 0.01);
  EXPECT_TRUE(found.space.is_free({8.0, 8.0}));
  EXPECT_TRUE(found.space.is_free({-8.0, -8.0}));
  EXPECT_TRUE(found.space.is_free_between({-8.0, 3.0}, {8.0, 3.0}));
  EXPECT_TRUE(found.space.is_free({0.9, 0.0}));
  EXPECT_FALSE(found.space.is_free({0.6, 0.0})) << "the box";
  EXPECT_FALSE(found.space.is_free({0.0, 0.0})) << "inside of the box";
  EXPECT_FALSE(found.space.is_inside_solid());
  EXPECT_GT(found.space.area_m2(), 370.0);
  EXPECT_NEAR(found.space.max_slope_rad(), std::atan(0.2), 0.01);
  ASSERT_EQ(found.scene.warnings.size(), 1U);
  EXPECT_TRUE(contains(found.scene.warnings[0], "slopes by up to 11 degrees"));
}

TEST_F(Heightmap, SteepHillsAndThingsAboveTheRobotAreNoGround) {
  // A cone of 45 degrees in gentle waves.
  folder.write("h.png", make_grey_png_of_16_bits(
                            129, 129, make_levels(129, [](double u, double v) {
                              const double x_m = 32.0 * (u - 0.5);
                              const double y_m = 32.0 * (0.5 - v);
                              const double waves_m =
                                  0.6 * std::sin(0.3 * x_m) + 0.4 * std::cos(0.2 * y_m) + 1.0;
                              return 10000.0 * std::max(waves_m, 5.0 - std::hypot(x_m, y_m));
                            })));
  const std::string roof =
      "<model name='roof'><pose>10 10 4 0 0 0</pose><link name='l'><visual name='v'><geometry><box>"
      "<size>6 6 0.2</size></box></geometry></visual></link></model>";
  const FoundFloor found = find_floor(load("<uri>h.png</uri><size>32 32 5</size>", roof));
  ASSERT_NE(found.scene.ground, nullptr);
  EXPECT_FALSE(found.space.is_free({1.5, 1.0})) << "the cone";
  EXPECT_TRUE(found.space.is_free({10.0, 10.0})) << "below the roof";
  EXPECT_TRUE(found.space.is_free({-9.0, 12.0}));
  EXPECT_LT(found.scene.ground->height_m({10.0, 10.0}), 2.1);
  EXPECT_GT(found.space.area_m2(), 850.0);
  EXPECT_LE(found.space.max_slope_rad(), std::numbers::pi / 6.0 + 1e-3);
}

TEST(SlopingGround, OfPlanesAndMeshesIsFollowed) {
  Scene scene;
  scene.materials.push_back({});
  scene.floor_low = {-0.5, -0.5};
  scene.floor_high = {0.5, 0.5};
  // A plane that rises by 5 degrees to the north, and a small thing on it.
  const double slope_rad = 5.0 * std::numbers::pi / 180.0;
  Affine3 place;
  place.matrix = {1.0,
                  0.0,
                  0.0,
                  0.0,
                  std::cos(slope_rad),
                  -std::sin(slope_rad),
                  0.0,
                  std::sin(slope_rad),
                  std::cos(slope_rad)};
  place_mesh(scene, make_rectangle_mesh(60.0, 60.0), place, "plane", 0);
  Affine3 above;
  above.translation = {0.0, 0.0, 0.5};
  place_mesh(scene, make_box_mesh({0.4, 0.4, 1.2}), above, "post", 0);
  const FoundFloor found = find_floor(scene);
  ASSERT_NE(found.scene.ground, nullptr);
  EXPECT_TRUE(found.space.is_free({0.0, 2.2}));
  EXPECT_FALSE(found.space.is_free({0.0, 0.3}));
  ASSERT_EQ(found.scene.warnings.size(), 1U);
  EXPECT_TRUE(contains(found.scene.warnings[0], "slopes by up to 5 degrees"));
  // A set height is kept, and the notice says so.
  FreeSpaceOptions options;
  options.floor_height_m = 0.0;
  const FoundFloor level = find_floor(scene, {.is_height_known = true}, options);
  EXPECT_EQ(level.scene.ground, nullptr);
  ASSERT_EQ(level.scene.warnings.size(), 1U);
  EXPECT_TRUE(contains(level.scene.warnings[0], "stays at the set floor height 0 m"));
  // A ramp in a hall is an obstacle.
  Scene hall;
  hall.materials.push_back({});
  hall.floor_low = {-8.0, -8.0};
  hall.floor_high = {8.0, 8.0};
  place_mesh(hall, make_rectangle_mesh(16.0, 16.0), {}, "floor", 0);
  place.translation = {6.0, 6.0, 0.2};
  place_mesh(hall, make_rectangle_mesh(2.0, 4.0), place, "ramp", 0);
  const FoundFloor flat = find_floor(hall);
  EXPECT_EQ(flat.scene.ground, nullptr);
  EXPECT_TRUE(flat.scene.warnings.empty());
}

TEST(SlopingGround, CamerasFollowItsHeightAndStayUpright) {
  // Black ground that rises by 10 % to the east until x = 40 m, and a white sky.
  Scene scene;
  scene.materials.push_back({.colour = {0.0F, 0.0F, 0.0F}});
  scene.background = {1.0F, 1.0F, 1.0F};
  scene.floor_low = {-40.0, -40.0};
  scene.floor_high = {40.0, 40.0};
  Mesh slope;
  slope.vertices = {
      {-40.0, -40.0, -4.0}, {40.0, -40.0, 4.0}, {40.0, 40.0, 4.0}, {-40.0, 40.0, -4.0}};
  slope.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes.push_back(slope);
  FoundFloor found = find_floor(scene);
  ASSERT_NE(found.scene.ground, nullptr);
  raise_scene(found.scene, 7.0);  // as when the floor is moved to z = 0
  const Renderer renderer(found.scene);
  EXPECT_NEAR(renderer.ground_height_m({20.0, 0.0}), 9.0, 1e-3);
  Executor here(1);
  constexpr double height_m = 0.6;
  for (const double x_m : {-20.0, 10.0}) {
    const Panorama view = renderer.render_panorama(
        {.pose = {x_m, 0.0, 0.0}, .height_m = height_m},
        {.rows = 400, .columns = 4, .elevations = {-0.2, 0.2}, .rays_per_axis = 1}, here);
    const auto horizon_rad = [&](int column) {
      int sky_rows = 0;
      while (sky_rows < view.rows() && view.row(sky_rows)[static_cast<std::size_t>(column)] > 0.5F)
        ++sky_rows;
      return 0.2 - 0.001 * sky_rows;
    };
    const double east_m = 40.0 - x_m;
    const double west_m = 40.0 + x_m;
    EXPECT_NEAR(horizon_rad(0), std::atan2(0.1 * east_m - height_m, east_m), 0.002);
    EXPECT_NEAR(horizon_rad(2), std::atan2(-0.1 * west_m - height_m, west_m), 0.002);
  }
}

}  // namespace
}  // namespace panonav::simulation
