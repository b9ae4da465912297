#include "panonav_simulation/load_gazebo.hpp"
#include "support/skips.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "panonav/core/error.hpp"
#include "panonav_simulation/free_space.hpp"
#include "panonav_simulation/internal/mesh_library.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::simulation {
using namespace testing;
namespace {

namespace fs = std::filesystem;

const fs::path data = PANONAV_TEST_DATA;

GazeboOptions options() {
  GazeboOptions result;
  result.textures.read = [](const fs::path& path) {
    return Image(static_cast<int>(path.stem().string().size()), 3, 1);
  };
  return result;
}

std::pair<Vector3, Vector3> extent_of(const Scene& scene, const std::string& object) {
  Scene part;
  for (const Mesh& mesh : scene.meshes) {
    if (mesh.object == object) part.meshes.push_back(mesh);
  }
  const auto found = extent(part);
  if (!found) throw Error("no object " + object);
  return *found;
}

void expect_box(const std::pair<Vector3, Vector3>& found, const Vector3& low, const Vector3& high) {
  for (const auto& [a, b] : {std::pair(found.first, low), std::pair(found.second, high)}) {
    EXPECT_NEAR(a.x_m, b.x_m, 1e-6);
    EXPECT_NEAR(a.y_m, b.y_m, 1e-6);
    EXPECT_NEAR(a.z_m, b.z_m, 1e-6);
  }
}

const Material& material_of(const Scene& scene, const std::string& object, std::size_t number) {
  for (const Mesh& mesh : scene.meshes) {
    if (mesh.object == object && number-- == 0)
      return scene.materials.at(static_cast<std::size_t>(mesh.material));
  }
  throw Error("no such part of " + object);
}

class GazeboWorld : public ::testing::Test {
 protected:
  const TemporaryFolder folder_;
};

TEST_F(GazeboWorld, PosesScalesAndUnitsAreComposed) {
  const Scene scene = load_gazebo(data / "worlds/tiny.world", options());
  EXPECT_NO_THROW(validate(scene));
  EXPECT_EQ(scene.name, "tiny");
  // 100 x 50 x 25 cm, twice as long, raised by 0.5 m, turned by 90 degrees at (2, 1).
  expect_box(extent_of(scene, "crate_turned"), {1.5, 1.0, 0.5}, {2.0, 3.0, 0.75});
  // 1 x 0.5 x 0.25 m, written with <up_axis>Y_UP</up_axis>, which Gazebo ignores; the large glass
  // ball is left out.
  expect_box(extent_of(scene, "stand"), {-3.0, 0.0, 1.0}, {-2.0, 0.5, 1.25});
  expect_box(extent_of(scene, "red_wall"), {-4.0, 3.9, 0.0}, {4.0, 4.1, 2.0});
  expect_box(extent_of(scene, "ground"), {-50.0, -50.0, 0.0}, {50.0, 50.0, 0.0});
  // The plate lies first, then stands: rolled by 90 degrees, its y side points up.
  expect_box(extent_of(scene, "painted"), {-2.5, -4.5, 0.0}, {2.25, -3.5, 1.0});
  // The floor is where things stand, not the whole ground plane.
  EXPECT_NEAR(scene.floor_low.x_m, -4.0, 1e-6);
  EXPECT_NEAR(scene.floor_low.y_m, -4.5, 1e-6);
  EXPECT_NEAR(scene.floor_high.y_m, 4.1, 1e-6);
}

TEST_F(GazeboWorld, MaterialsComeFromScriptsColoursAndTextures) {
  const Scene scene = load_gazebo(data / "worlds/tiny.world", options());
  EXPECT_EQ(material_of(scene, "red_wall", 0).colour, (std::array<float, 3>{1.0F, 0.0F, 0.0F}));
  EXPECT_EQ(material_of(scene, "painted", 0).colour, (std::array<float, 3>{0.25F, 0.5F, 0.75F}));
  ASSERT_NE(material_of(scene, "painted", 1).texture, nullptr);
  EXPECT_EQ(material_of(scene, "painted", 1).texture->width(), 5);
  EXPECT_EQ(material_of(scene, "painted", 2).colour, (std::array<float, 3>{0.1F, 0.9F, 0.3F}));
  ASSERT_NE(material_of(scene, "crate_turned", 0).texture, nullptr);
  EXPECT_EQ(material_of(scene, "stand", 0).texture, nullptr);
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_TRUE(contains(scene.warnings[0], "lost.png"));
}

TEST_F(GazeboWorld, LightsKeepTheirPlaceAndTheirFading) {
  const Scene scene = load_gazebo(data / "worlds/tiny.world", options());
  EXPECT_NEAR(scene.ambient, 0.2, 1e-6);
  EXPECT_NEAR(scene.background[2], 0.3, 1e-6);
  ASSERT_EQ(scene.directional_lights.size(), 1U);
  EXPECT_NEAR(scene.directional_lights[0].towards_light.z, 1.0, 1e-6);
  EXPECT_NEAR(scene.directional_lights[0].intensity, 0.5, 1e-6);
  ASSERT_EQ(scene.lights.size(), 1U);
  EXPECT_EQ(scene.lights[0].position, (Vector3{1.0, 2.0, 2.0}));
  // 0.2 / (0.5 + 0.5 d^2)
  EXPECT_NEAR(scene.lights[0].intensity, 0.4, 1e-6);
  EXPECT_NEAR(scene.lights[0].radius_m, 1.0, 1e-6);
}

TEST_F(GazeboWorld, LightBeyondWhiteIsScaledDownAsAWhole) {
  const auto world = folder_.write("bright.world", R"(<sdf version="1.6"><world name="bright">
    <scene><ambient>1 1 1 1</ambient></scene>
    <light name="sun" type="directional"><diffuse>1 1 1 1</diffuse><direction>0 0 -1</direction></light>
    <model name="m"><static>true</static><link name="l"><visual name="v"><geometry><box><size>1 1 1</size></box>
    </geometry></visual></link></model></world></sdf>)");
  const Scene scene = load_gazebo(world);
  EXPECT_NEAR(scene.ambient, 0.5, 1e-6);
  EXPECT_NEAR(scene.directional_lights.at(0).intensity, 0.5, 1e-6);
}

TEST_F(GazeboWorld, ModelFoldersMayLieElsewhere) {
  const std::string text = R"(<sdf version="1.6"><world name="far">
    <include><uri>model://crate</uri></include></world></sdf>)";
  const auto world = folder_.write("far.world", text);
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)load_gazebo(world, options()); }),
                       "model://crate"));
  GazeboOptions with_folder = options();
  with_folder.model_folders.push_back(data / "models");
  expect_box(extent_of(load_gazebo(world, with_folder), "crate"), {0.0, 0.0, 0.5},
             {2.0, 0.5, 0.75});
  ASSERT_EQ(setenv("GAZEBO_MODEL_PATH", ("/nowhere::" + (data / "models").string()).c_str(), 1), 0);
  const auto folders = gazebo_model_folders_of_environment();
  unsetenv("GAZEBO_MODEL_PATH");
  ASSERT_GE(folders.size(), 2U);
  EXPECT_EQ(folders[1], data / "models");
}

TEST_F(GazeboWorld, ASingleModelIsAScene) {
  const Scene scene = load_gazebo(data / "models/crate/model.sdf", [] {
    GazeboOptions result = options();
    result.model_folders.push_back(data / "models");
    return result;
  }());
  EXPECT_EQ(scene.name, "crate");
  EXPECT_EQ(scene.meshes.size(), 1U);
}

TEST_F(GazeboWorld, BrokenFilesGiveOneClearLineAndNothingOnTheConsole) {
  const std::string head = R"(<sdf version="1.6"><world name="w">)";
  const std::string visual = R"(<model name="m"><link name="l"><visual name="v"><geometry>)";
  const std::string visual_end = "</geometry></visual></link></model></world></sdf>";
  std::vector<fs::path> files{
      folder_ / "nothing.world",
      folder_.path(),
      folder_.write("empty.world", ""),
      folder_.write("text.world", "not xml"),
      folder_.write("cut.world", head),
      folder_.write("no_world.world", R"(<sdf version="1.6"></sdf>)"),
      folder_.write("no_visual.world", head + "</world></sdf>"),
      folder_.write("newer.world", R"(<sdf version="99.0"><world name="w"></world></sdf>)"),
      folder_.write("no_mesh.world",
                    head + visual + "<mesh><uri>model://a/b.dae</uri></mesh>" + visual_end),
      folder_.write("no_model.world",
                    head + "<include><uri>model://absent</uri></include></world></sdf>"),
      folder_.write(
          "twins.world",
          head +
              R"(<model name="m"><link name="l"/></model><model name="m"><link name="l"/></model></world></sdf>)"),
      folder_.write(
          "pose.world",
          head +
              R"(<model name="m"><pose>nan 0 0 0 0 0</pose><link name="l"><visual name="v"><geometry>)" +
              "<box><size>1 1 1</size></box>" + visual_end),
  };
  {
    std::ifstream stream(data / "worlds/tiny.world");
    const std::string good(std::istreambuf_iterator<char>(stream), {});
    for (std::size_t length = 100; length + 10 < good.size(); length += 331) {
      files.push_back(
          folder_.write("cut" + std::to_string(length) + ".world", good.substr(0, length)));
    }
  }
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  std::vector<std::string> failures;
  for (const fs::path& file : files) {
    const auto text = message_of<FileError>([&] { (void)load_gazebo(file, options()); });
    if (text.find(file.string()) != 0 || text.find('\n') != std::string::npos) {
      failures.push_back(file.string() + ": " + text);
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  for (const auto& failure : failures) ADD_FAILURE() << failure;
}

TEST_F(GazeboWorld, WhatIsMissingOrFaultyIsLeftOutAndNamed) {
  struct Fault {
    const char* kind;
    const char* body;
    const char* warning;  // "": there is none
  };
  const auto visual = [](const std::string& geometry) {
    return R"(<model name="odd"><link name="l"><visual name="v"><geometry>)" + geometry +
           "</geometry></visual></link></model>";
  };
  const std::string mesh = visual("<mesh><uri>model://shelf/meshes/shelf.dae</uri></mesh>");
  folder_.write("damaged.dae", "<COLLADA>");
  folder_.write("robot.urdf", "<robot name='r'/>");
  const std::string damaged = visual("<mesh><uri>damaged.dae</uri></mesh>");
  const std::string no_size = visual("<sphere/>");
  const std::string negative = visual("<box><size>1 -1 1</size></box>");
  const std::string height_map = visual("<heightmap><uri>a.png</uri></heightmap>");
  const std::string far = visual("<box><size>1e300 1 1</size></box>");
  const std::string blanks = visual("<box><size> 1\t1\n 1 </size></box>");
  for (const Fault& fault : {
           Fault{"mesh", mesh.c_str(), "model \"odd\": visual \"v\" is left out: its mesh \"model"},
           {"damaged mesh", damaged.c_str(), "damaged.dae: not a readable mesh file"},
           {"no size", no_size.c_str(), "the radius of its sphere is not a finite number"},
           {"negative", negative.c_str(), "the size of its box is not above 0"},
           {"height map", height_map.c_str(), "its heightmap \"a.png\" was not found"},
           {"far", far.c_str(), "reaches farther than 1000 km"},
           {"blanks", blanks.c_str(), ""},
           {"include", "<include><uri>model://absent</uri></include>",
            "include \"model://absent\" is left out: it was not found in "},
           {"another format", "<include><uri>robot.urdf</uri></include>", "is <robot>, not <sdf>"},
           {"actor", "<actor name='a'/>", "actor \"a\" is left out: it has no skin"},
           {"pose", "<model name='odd'><pose>nan 0 0 0 0 0</pose><link name='l'/></model>",
            "model \"odd\" is left out: its pose is not 6 finite numbers"},
           {"frame",
            "<model name='odd'><link name='l'><pose relative_to='no'>1 0 0 0 0 "
            "0</pose></link></model>",
            "is relative to \"no\", which does not exist"},
           {"duplicates",
            "<model name='good'><link name='l'><collision name='c'/><collision name='c'/><visual "
            "name='v'/><visual name='v'/></link><link name='l'/></model>",
            ""},
           {"reserved names", "<model name='world'><link name='__model__'/></model>", ""},
           {"comment", "<!-- a -- b !-->", ""},
           {"sun", "<include><uri>model://sun</uri></include>", ""},
           {"ground of a server",
            "<include><uri>https://fuel.gazebosim.org/1.0/openrobotics/models/Ground Plane</uri>"
            "</include>",
            ""},
       }) {
    SCOPED_TRACE(fault.kind);
    const auto path = folder_.write(
        "odd.world", std::string("\n<?xml version='1.0'?><sdf version='1.6'><world name='world'>") +
                         fault.body + R"(<model name="good"><link name="l"><visual name="v">
            <geometry><box><size>1 2 4</size></box></geometry></visual></link></model></world></sdf>)");
    const Scene scene = load_gazebo(path, options());
    EXPECT_NO_THROW(validate(scene));
    EXPECT_EQ(scene.name, "world");
    expect_box(extent_of(scene, "good"), {-0.5, -1.0, -2.0}, {0.5, 1.0, 2.0});
    ASSERT_EQ(scene.warnings.size(), std::string(fault.warning).empty() ? 0U : 1U);
    if (scene.warnings.empty()) continue;
    EXPECT_EQ(scene.warnings[0].find(path.string() + ": "), 0U) << scene.warnings[0];
    EXPECT_TRUE(contains(scene.warnings[0], fault.warning)) << scene.warnings[0];
  }
}

TEST_F(GazeboWorld, WarningsAreCountedNotRepeated) {
  std::string models;
  for (const std::string name : {"a", "b", "c", "d", "e"}) {
    models += "<model name='" + name + "'><link name='l'>" +
              "<visual name='v'><geometry><mesh><uri>model://no</uri></mesh></geometry></visual>" +
              "<visual name='w'><geometry><box><size>1 1 1</size></box></geometry></visual>" +
              "</link></model>";
  }
  const std::string include = "<include><uri>model://absent</uri></include>";
  const auto world = folder_.write(
      "w.world", "<sdf><world name='w'>" + models + include + include + "</world></sdf>");
  const Scene scene = load_gazebo(world, options());
  EXPECT_EQ(scene.meshes.size(), 5U);
  ASSERT_EQ(scene.warnings.size(), 2U);
  EXPECT_TRUE(contains(scene.warnings[0], "models \"a\", \"b\", \"c\" and 2 more: visual \"v\""));
  EXPECT_TRUE(contains(scene.warnings[1], "(2 times)"));
}

TEST_F(GazeboWorld, MeshesKeepTheirAxesAsInGazebo) {
  // A tetrahedron 1.6 m high along z, in each format.
  const auto collada = [](const std::string& up_axis, const std::string& unit) {
    return "<COLLADA version='1.4.1'><asset><unit meter='" + unit + "'/><up_axis>" + up_axis +
           "</up_axis></asset><library_geometries><geometry id='g'><mesh><source id='s'>"
           "<float_array id='a' count='12'>0 0 0 1 0 0 0 1 0 0 0 1.6</float_array>"
           "<technique_common><accessor source='#a' count='4' stride='3'/></technique_common>"
           "</source><vertices id='v'><input semantic='POSITION' source='#s'/></vertices>"
           "<triangles count='2'><input semantic='VERTEX' source='#v' offset='0'/>"
           "<p>0 1 3 0 1 2</p></triangles></mesh></geometry></library_geometries>"
           "<library_visual_scenes><visual_scene id='w'><node><instance_geometry url='#g'/></node>"
           "</visual_scene></library_visual_scenes><scene><instance_visual_scene url='#w'/></scene>"
           "</COLLADA>";
  };
  folder_.write("x.dae", collada("X_UP", "1"));
  folder_.write("y.dae", collada("Y_UP", "1"));
  folder_.write("z.dae", collada("Z_UP", "1"));
  folder_.write("y_cm.dae", collada("Y_UP", "0.01"));
  folder_.write("part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1.6\nf 1 2 4\nf 1 2 3\n");
  // The corners (0, 0, 0), (1, 1, 0), (0, 1, 1.6) as three times three floats.
  folder_.write("part.gltf", R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
      "nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
      "min":[0,0,0],"max":[1,1,1.6]}],"bufferViews":[{"buffer":0,"byteLength":36}],
      "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)"
                             "AAAAAAAAAAAAAAAAAACAPwAAgD8AAAAAAAAAAAAAgD/NzMw/\"}]}");
  for (const auto& [file, scale] :
       {std::pair("x.dae", 1.0), std::pair("y.dae", 1.0), std::pair("z.dae", 1.0),
        std::pair("y_cm.dae", 0.01), std::pair("part.obj", 1.0), std::pair("part.gltf", 1.0)}) {
    SCOPED_TRACE(file);
    const auto world = folder_.write(
        "axes.world", std::string("<sdf version='1.6'><model name='m'><link name='l'><visual "
                                  "name='v'><geometry><mesh><uri>") +
                          file + "</uri></mesh></geometry></visual></link></model></sdf>");
    const auto [low, high] = extent_of(load_gazebo(world, options()), "m");
    EXPECT_NEAR(low.z_m, 0.0, 1e-6);
    EXPECT_NEAR(high.z_m, 1.6 * scale, 1e-6);
    EXPECT_NEAR(high.x_m, scale, 1e-6);
    EXPECT_NEAR(high.y_m, scale, 1e-6);
  }
}

TEST_F(GazeboWorld, LettersOfOtherCaseAreFound) {
  const auto world = folder_.write("case.world", R"(<sdf version="1.6"><world name="w">
    <include><uri>model://CRATE</uri></include>
    <model name="direct"><link name="l"><visual name="v"><geometry><mesh>
      <uri>model://Crate/Meshes/Crate_Z_Up_cm.DAE</uri></mesh></geometry></visual></link></model>
    <model name="painted"><link name="l"><visual name="v"><geometry><box><size>1 1 1</size></box></geometry>
      <material><pbr><metal><albedo_map>model://crate/materials/textures/crate.PNG</albedo_map></metal></pbr>
      </material></visual></link></model></world></sdf>)");
  GazeboOptions with_folder = options();
  with_folder.model_folders.push_back(data / "models");
  const Scene scene = load_gazebo(world, with_folder);
  expect_box(extent_of(scene, "crate"), {0.0, 0.0, 0.5}, {2.0, 0.5, 0.75});
  expect_box(extent_of(scene, "direct"), {0.0, 0.0, 0.0}, {1.0, 0.5, 0.25});
  EXPECT_NE(material_of(scene, "painted", 0).texture, nullptr);
  ASSERT_EQ(scene.warnings.size(), 3U);
  EXPECT_TRUE(contains(scene.warnings[0], "\"model://CRATE\" was not found; taken instead"));
  EXPECT_TRUE(contains(scene.warnings[0], (data / "models/crate").string()));
  EXPECT_TRUE(contains(scene.warnings[1], "meshes/crate_z_up_cm.dae"));
  EXPECT_TRUE(contains(scene.warnings[2], "textures/Crate.png"));
}

TEST_F(GazeboWorld, SunAndGroundPlaneAreKnown) {
  const auto world = folder_.write("base.world", R"(<sdf version="1.6"><world name="w">
    <include><uri>model://sun</uri></include><include><uri>model://ground_plane</uri></include>
    </world></sdf>)");
  const Scene scene = load_gazebo(world, options());
  ASSERT_EQ(scene.directional_lights.size(), 1U);
  EXPECT_NEAR(scene.directional_lights[0].towards_light.z, 0.9, 1e-6);
  expect_box(extent_of(scene, "ground_plane"), {-50.0, -50.0, 0.0}, {50.0, 50.0, 0.0});
  EXPECT_TRUE(scene.warnings.empty());
}

TEST_F(GazeboWorld, PosesMayBeRelativeToFrames) {
  // A cube of 0.2 m, each time at (1, 2, 3) of the world.
  const std::string cube = "<geometry><box><size>0.2 0.2 0.2</size></box></geometry>";
  const auto expect_at = [&](const std::string& model) {
    SCOPED_TRACE(model);
    const auto world =
        folder_.write("w.world", "<sdf version='1.9'><world name='w'>" + model + "</world></sdf>");
    const Scene scene = load_gazebo(world, options());
    EXPECT_TRUE(scene.warnings.empty());
    expect_box(extent_of(scene, "m"), {0.9, 1.9, 2.9}, {1.1, 2.1, 3.1});
  };
  expect_at(
      "<frame name='f'><pose degrees='true'>1 0 0 0 0 90</pose></frame><model name='m'><pose "
      "relative_to='f'>2 0 3 0 0 0</pose><link name='l'><visual name='v'>" +
      cube + "</visual></link></model>");
  expect_at(
      "<model name='m'><joint name='j'><pose>0 0 1 0 0 0</pose><child>a</child></joint><link "
      "name='a'><pose>1 2 0 0 0 0</pose></link><link name='l'><pose "
      "relative_to='j'>0 0 2 0 0 0</pose><visual name='v'>" +
      cube + "</visual></link></model>");
  expect_at(
      "<model name='m'><frame name='f' attached_to='l'><pose>0 0 1 0 0 0</pose></frame><link "
      "name='l'><pose>1 0 0 0 0 1.5</pose><visual name='v'><pose relative_to='__model__'>1 2 3 "
      "0 0 0</pose>" +
      cube + "</visual></link></model>");
  expect_at(
      "<model name='m' placement_frame='in::f'><pose>1 2 0 0 0 0</pose><model name='in'><pose>5 "
      "0 0 0 0 0</pose><frame name='f'><pose>0 7 0 0 0 0</pose></frame></model><link "
      "name='l'><pose>5 7 3 0 0 0</pose><visual name='v'>" +
      cube + "</visual></link></model>");
  // A quarter turn about z as a quaternion.
  expect_at(
      "<model name='m'><pose rotation_format='quat_xyzw'>1 0 3 0 0 0.70710678 0.70710678</pose>"
      "<link name='l'><pose>2 0 0 0 0 0</pose><visual name='v'>" +
      cube + "</visual></link></model>");
  // The form of SDF 1.0.
  expect_at(
      "<model name='m'><origin pose='1 2 3 0 0 0'/><link name='l'><visual name='v'><geometry><box "
      "size='0.2 0.2 0.2'/></geometry></visual></link></model>");
}

TEST_F(GazeboWorld, ModelsAreFoundByTheNameOfThePackage) {
  fs::create_directories(folder_ / "pack/worlds");
  fs::create_directories(folder_ / "pack/models/cube");
  folder_.write("pack/models/cube/model.sdf",
                "<sdf version='1.6'><model name='cube'><link name='l'><visual name='v'><geometry>"
                "<box><size>1 1 1</size></box></geometry></visual></link></model></sdf>");
  for (const std::string uri : {"model://pack/models/cube", "package://pack/models/cube",
                                "model://cube", "file://../models/cube"}) {
    SCOPED_TRACE(uri);
    // A pose without angles is a position.
    const auto world = folder_.write("pack/worlds/w.world",
                                     "<sdf version='1.6'><world name='w'><include><uri>" + uri +
                                         "</uri><pose>1 2 3</pose></include></world></sdf>");
    expect_box(extent_of(load_gazebo(world, options()), "cube"), {0.5, 1.5, 2.5}, {1.5, 2.5, 3.5});
  }
}

TEST_F(GazeboWorld, AModelThatIncludesItselfIsLeftOut) {
  const auto world = folder_.write("loop.world", R"(<sdf version="1.6"><world name="w">
    <include><uri>model://loop</uri></include></world></sdf>)");
  GazeboOptions with_folder = options();
  with_folder.model_folders.push_back(data / "models");
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)load_gazebo(world, with_folder); }),
                       "includes itself"));
}

TEST_F(GazeboWorld, IncludesAreBoundedInDepthAndNumber) {
  // Each model includes the next one, `copies` times.
  const auto refusal = [&](int models, int copies) {
    const fs::path folder = folder_ / ("chain" + std::to_string(copies));
    fs::create_directory(folder);
    const auto name = [](int i) { return "m" + std::to_string(i) + ".sdf"; };
    for (int i = 0; i < models; ++i) {
      std::ofstream file(folder / name(i));
      file << "<sdf version='1.6'><model name='m'><link name='l'/>";
      for (int copy = 0; i + 1 < models && copy < copies; ++copy) {
        file << "<include><name>c" << copy << "</name><uri>" << name(i + 1) << "</uri></include>";
      }
      file << "</model></sdf>";
    }
    return message_of<FileError>([&] { (void)load_gazebo(folder / name(0), options()); });
  };
  EXPECT_TRUE(contains(refusal(33, 1), "is included more than 32 models deep"));
  EXPECT_TRUE(contains(refusal(32, 2), "includes more than 100000 models in all"));
  EXPECT_TRUE(contains(refusal(3, 2), "shows nothing"));
}

TEST_F(GazeboWorld, DevicesAndPipesAreNotRead) {
  const fs::path pipe = folder_ / "pipe.sdf";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string file : {"/dev/zero", pipe.c_str()}) {
    const auto world =
        folder_.write("w.world", "<sdf version='1.6'><world name='w'><include><uri>" + file +
                                     "</uri></include></world></sdf>");
    EXPECT_TRUE(contains(message_of<FileError>([&] { (void)load_gazebo(world, options()); }),
                         file + ": is no regular file"));
    const auto mesh = folder_.write("m.world", R"(<sdf version="1.6"><model name="m"><link name="l">
        <visual name="v"><geometry><mesh><uri>)" + file +
                                                   "</uri></mesh></geometry></visual></link>"
                                                   "</model></sdf>");
    EXPECT_TRUE(contains(message_of<FileError>([&] { (void)load_gazebo(mesh, options()); }),
                         file + ": is no regular file"));
  }
}

TEST_F(GazeboWorld, RealWorldsLoadWithTheirWalls) {
  const auto scenes = real_data("scenes");
  PANONAV_REQUIRE_DATA(scenes, "scenes");
  struct Expected {
    const char* path;
    std::size_t objects, min_textures, max_warnings;
    double size_x_m, size_y_m, min_free_m2, max_free_m2;
  };
  // Sizes are those that the wall models state; free areas by counting squares of the floor plans.
  for (const Expected& expected :
       {Expected{"small_warehouse/worlds/small_warehouse.world", 26, 20, 0, 14.0, 20.9, 170.0,
                 230.0},
        Expected{"small_warehouse/worlds/no_roof_small_warehouse.world", 25, 20, 0, 14.0, 20.9,
                 170.0, 230.0},
        Expected{"small_house/worlds/small_house.world", 70, 60, 4, 19.0, 11.4, 100.0, 150.0}}) {
    const fs::path path = *scenes / expected.path;
    ASSERT_TRUE(fs::exists(path)) << path;
    const Scene scene = load_gazebo(path, options());
    EXPECT_NO_THROW(validate(scene));
    std::vector<std::string> objects;
    for (const Mesh& mesh : scene.meshes) objects.push_back(mesh.object);
    std::sort(objects.begin(), objects.end());
    objects.erase(std::unique(objects.begin(), objects.end()), objects.end());
    EXPECT_GE(objects.size(), expected.objects) << path;
    const auto textured = std::count_if(scene.materials.begin(), scene.materials.end(),
                                        [](const Material& m) { return m.texture != nullptr; });
    EXPECT_GE(static_cast<std::size_t>(textured), expected.min_textures) << path;
    EXPECT_LE(scene.warnings.size(), expected.max_warnings) << path;
    EXPECT_NEAR(scene.floor_high.x_m - scene.floor_low.x_m, expected.size_x_m, 0.1);
    EXPECT_NEAR(scene.floor_high.y_m - scene.floor_low.y_m, expected.size_y_m, 0.1);
    const FreeSpace space(scene);
    EXPECT_GE(space.area_m2(), expected.min_free_m2) << path;
    EXPECT_LE(space.area_m2(), expected.max_free_m2) << path;
  }
}

}  // namespace
}  // namespace panonav::simulation
