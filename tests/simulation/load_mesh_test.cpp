#include "panonav_simulation/load_mesh.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "panonav/core/error.hpp"
#include "panonav_simulation/internal/mesh_library.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::simulation {
using namespace testing;
namespace {

namespace fs = std::filesystem;

const fs::path meshes = fs::path(PANONAV_TEST_DATA) / "models/crate/meshes";

// Says which file it was asked for by the size of the picture.
TextureOptions fake_textures() {
  return {.read = [](const fs::path& path) {
    return Image(static_cast<int>(path.stem().string().size()), 3, 1);
  }};
}

void expect_extent(const Scene& scene, const Vector3& low, const Vector3& high) {
  const auto found = extent(scene);
  ASSERT_TRUE(found.has_value());
  for (const auto& [a, b] : {std::pair(found->first, low), std::pair(found->second, high)}) {
    EXPECT_NEAR(a.x_m, b.x_m, 1e-6);
    EXPECT_NEAR(a.y_m, b.y_m, 1e-6);
    EXPECT_NEAR(a.z_m, b.z_m, 1e-6);
  }
}

class MeshFile : public ::testing::Test {
 protected:
  const TemporaryFolder folder_;
};

TEST_F(MeshFile, ColladaUnitIsAppliedAndZStaysUp) {
  const Scene scene = load_mesh(meshes / "crate_z_up_cm.dae", {.textures = fake_textures()});
  expect_extent(scene, {0.0, 0.0, 0.0}, {1.0, 0.5, 0.25});
  EXPECT_NO_THROW(validate(scene));
  ASSERT_EQ(scene.meshes.size(), 1U);
  EXPECT_EQ(scene.meshes[0].triangles.size(), 12U);
  EXPECT_EQ(scene.meshes[0].texture_coordinates.size(), scene.meshes[0].vertices.size());
  EXPECT_EQ(scene.floor_low, (Point2{0.0, 0.0}));
  EXPECT_NEAR(scene.floor_high.x_m, 1.0, 1e-6);
  EXPECT_FALSE(scene.lights.empty());
}

TEST_F(MeshFile, TextureIsFoundByItsBaseNameWhateverTheEndingAndFolder) {
  const Scene scene = load_mesh(meshes / "crate_z_up_cm.dae", {.textures = fake_textures()});
  ASSERT_EQ(scene.materials.size(), 1U);
  ASSERT_NE(scene.materials[0].texture,
            nullptr);  // written as C:\artist\crate.tga; there is Crate.png
  EXPECT_EQ(scene.materials[0].texture->width(), 5);
  EXPECT_EQ(scene.materials[0].colour, (std::array<float, 3>{1.0F, 1.0F, 1.0F}));
  EXPECT_TRUE(scene.warnings.empty());
}

TEST_F(MeshFile, YUpIsTurnedUprightAndAMissingTextureIsAWarning) {
  const Scene scene = load_mesh(meshes / "crate_y_up_m.dae", {.textures = fake_textures()});
  expect_extent(scene, {0.0, -0.25, 0.0}, {1.0, 0.0, 0.5});
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_TRUE(contains(scene.warnings[0], "lost.png"));
  EXPECT_EQ(scene.materials[0].texture, nullptr);
}

TEST_F(MeshFile, AnUnreadableTextureIsAWarningToo) {
  const TextureOptions textures{
      .read = [](const fs::path& path) -> Image { throw FileError(path.string(), "damaged"); }};
  const Scene scene = load_mesh(meshes / "crate_z_up_cm.dae", {.textures = textures});
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_TRUE(contains(scene.warnings[0], "Crate.png: damaged"));
  EXPECT_EQ(scene.materials[0].texture, nullptr);
}

TEST_F(MeshFile, LargeTexturesAreHalved) {
  TextureOptions textures{.read = [](const fs::path&) {
    Image image(64, 7, 3);
    for (auto& value : image.pixels()) value = 100;
    return image;
  }};
  textures.max_side_px = 20;
  const Scene scene = load_mesh(meshes / "crate_z_up_cm.dae", {.textures = textures});
  ASSERT_NE(scene.materials[0].texture, nullptr);
  EXPECT_EQ(scene.materials[0].texture->size(), (ImageSize{16, 1}));
  EXPECT_EQ(scene.materials[0].texture->at(15, 0, 2), 100);
  textures.max_side_px = 0;
  EXPECT_THROW((void)load_mesh(meshes / "crate_z_up_cm.dae", {.textures = textures}),
               ContractError);
}

TEST_F(MeshFile, ObjAndStlAreZUpUnlessSaidOtherwise) {
  const auto obj =
      folder_.write("part.obj", "o part\nv 0 0 0\nv 2 0 0\nv 0 3 0\nv 0 0 4\nf 1 2 3\nf 1 2 4\n");
  expect_extent(load_mesh(obj), {0.0, 0.0, 0.0}, {2.0, 3.0, 4.0});
  expect_extent(load_mesh(obj, {.up = UpAxis::y}), {0.0, -4.0, 0.0}, {2.0, 0.0, 3.0});
  expect_extent(load_mesh(obj, {.scale = 0.5}), {0.0, 0.0, 0.0}, {1.0, 1.5, 2.0});
  EXPECT_THROW((void)load_mesh(obj, {.scale = 0.0}), ContractError);
}

// A square of 4 m with what `body` says of it; vertices 4 to 7 are a square of 2 m in its middle, 8
// to 10 a triangle of 0.3 square metres beside that.
std::string collada(const std::string& body, const std::string& colour = "1 0 0 1") {
  return R"(<?xml version="1.0"?><COLLADA version="1.4.1"><asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
    <library_effects><effect id="e"><profile_COMMON><technique sid="c"><lambert><diffuse><color>)" +
         colour +
         R"(</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
    <library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="33">
      0 0 0 4 0 0 4 4 0 0 4 0 1 1 0 3 1 0 3 3 0 1 3 0 1 3.2 0 1.5 3.8 0 0.5 3.8 0</float_array><technique_common>
      <accessor source="#a" count="11" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
      <param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>)" +
         body +
         R"(</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s">
    <node id="n"><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
    <scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

double area(const Scene& scene) {
  double sum = 0.0;
  for (const Mesh& mesh : scene.meshes) {
    for (const auto& t : mesh.triangles) {
      const Vector3& a = mesh.vertices[t[0]];
      const Vector3& b = mesh.vertices[t[1]];
      const Vector3& c = mesh.vertices[t[2]];
      sum += 0.5 * std::abs((b.x_m - a.x_m) * (c.y_m - a.y_m) - (c.x_m - a.x_m) * (b.y_m - a.y_m));
    }
  }
  return sum;
}

TEST_F(MeshFile, ColladaPolygonsMayHaveHoles) {
  const auto polygon_area = [&](const std::string& polygons) {
    return area(load_mesh(folder_.write(
        "holes.dae",
        collada("<polygons count='1'><input semantic='VERTEX' source='#v' offset='0'/>" + polygons +
                "</polygons>"))));
  };
  EXPECT_NEAR(polygon_area("<p>0 1 2 3</p>"), 16.0, 1e-5);
  EXPECT_NEAR(polygon_area("<ph><p>0 1 2 3</p><h>4 7 6 5</h></ph>"), 12.0, 1e-5);
  // Turned the same way as the outline, which exporters do as well.
  EXPECT_NEAR(polygon_area("<ph><p>0 1 2 3</p><h>4 5 6 7</h></ph>"), 12.0, 1e-5);
  EXPECT_NEAR(polygon_area("<ph><p>0 1 2 3</p><h>4 7 6 5</h><h>8 9 10</h></ph>"), 11.7, 1e-5);
  EXPECT_THROW((void)polygon_area("<ph><p>0 1 2 3</p><h>4 5 99</h></ph>"), FileError);
}

TEST_F(MeshFile, ColladaNumbersMayHaveBlanksBeforeThem) {
  const std::string triangles =
      "<triangles count='1'><input semantic='VERTEX' source='#v' offset='0'/><p> 0 1 2 "
      "</p></triangles>";
  const Scene scene =
      load_mesh(folder_.write("blanks.dae", collada(triangles, "\n   0.5 0.5 0.5 1 ")));
  EXPECT_NEAR(area(scene), 8.0, 1e-5);
}

TEST_F(MeshFile, WhatIsNotShownMayBeFaulty) {
  const std::string triangles =
      "<triangles count='2'><input semantic='VERTEX' source='#v' offset='0'/><p>0 1 2 0 2 "
      "3</p></triangles>";
  const std::string good = collada(triangles);
  const auto replace = [&](std::string_view old, const std::string& by) {
    std::string text = good;
    const auto at = text.find(old);
    EXPECT_NE(at, std::string::npos) << old;
    return text.replace(at, old.size(), by);
  };
  const std::string camera =
      "<library_cameras><camera id='c' name='View'><optics/></camera></library_cameras>";
  const std::string camera_node = "<node id='View' name='View'><instance_camera url='#c'/></node>";
  struct Fault {
    const char* kind;
    std::string text;
  };
  for (const Fault& fault : {
           Fault{"nothing", good},
           {"two cameras of one name",
            replace("<node id=\"n\">", camera_node + camera_node + "<node id='n'>")
                .replace(good.find("<library_effects"), 0, camera)},
           {"unknown light", replace("</node>", "<instance_light url='#no'/></node>")},
           {"animation of nothing",
            replace("<library_effects>",
                    "<library_animations><animation><channel source='#no' target='no/x'/>"
                    "</animation></library_animations><library_effects>")},
           {"missing image",
            replace("<color>1 0 0 1</color>", "<texture texture='lost' texcoord='UV'/>")},
           {"normals that do not exist",
            replace("<p>0 1 2 0 2 3</p>",
                    "<input semantic='NORMAL' source='#no' offset='1'/><p>0 9 1 9 2 9 0 9 2 9 3 "
                    "9</p>")},
           {"texture coordinates that do not exist",
            replace(
                "<p>0 1 2 0 2 3</p>",
                "<input semantic='TEXCOORD' source='#no' offset='1' set='0'/><p>0 9 1 9 2 9 0 9 "
                "2 9 3 9</p>")},
           {"wrong numbers of triangles and values",
            replace("count='2'", "count='7'").replace(good.find("count=\"33\""), 10, "count='90'")},
           {"a triangle of vertices that do not exist",
            replace("<p>0 1 2 0 2 3</p>", "<p>0 1 2 0 2 3 0 1 77</p>")},
           {"a vertex that is no number",
            replace("0.5 3.8 0</float_array>", "1.#QNAN 3.8 0</float_array>")},
           {"lines beside the triangles",
            replace("<triangles", "<lines count='9'><p>0 1 2 3 4 5</p></lines><triangles")},
           {"skin",
            replace("<instance_geometry url=\"#g\"/>",
                    "<instance_controller url='#k'><skeleton>#no</skeleton></instance_controller>")
                .replace(good.find("<library_visual_scenes"), 0,
                         "<library_controllers><controller id='k'><skin source='#g'><joints/>"
                         "<vertex_weights count='99'/></skin></controller></library_controllers>")},
       }) {
    SCOPED_TRACE(fault.kind);
    const Scene scene = load_mesh(folder_.write("faulty.dae", fault.text));
    EXPECT_NO_THROW(validate(scene));
    EXPECT_NEAR(area(scene), 16.0, 1e-5);
    expect_extent(scene, {0.0, 0.0, 0.0}, {4.0, 4.0, 0.0});
  }
}

TEST_F(MeshFile, AllPrimitivesOfColladaAreRead) {
  const std::string vertices = "<input semantic='VERTEX' source='#v' offset='0'/>";
  for (const std::string& primitives :
       {"<triangles>" + vertices + "<p>0 1 2 0 2 3</p></triangles>",
        "<polylist>" + vertices + "<vcount>4</vcount><p>0 1 2 3</p></polylist>",
        "<polygons>" + vertices + "<p>0 1 2 3</p></polygons>",
        "<trifans>" + vertices + "<p>0 1 2 3</p></trifans>",
        "<tristrips>" + vertices + "<p>1 2 0 3</p></tristrips>"}) {
    SCOPED_TRACE(primitives);
    const Scene scene = load_mesh(folder_.write("part.dae", collada(primitives)));
    EXPECT_NEAR(area(scene), 16.0, 1e-5);
    // All corners counter-clockwise seen from above.
    for (const Mesh& mesh : scene.meshes) {
      for (const auto& t : mesh.triangles) {
        const Vector3& a = mesh.vertices[t[0]];
        const Vector3& b = mesh.vertices[t[1]];
        const Vector3& c = mesh.vertices[t[2]];
        EXPECT_GT((b.x_m - a.x_m) * (c.y_m - a.y_m) - (c.x_m - a.x_m) * (b.y_m - a.y_m), 0.0);
      }
    }
  }
}

TEST_F(MeshFile, PipesThatAMeshNamesAreMissingFiles) {
  ASSERT_EQ(mkfifo((folder_ / "pipe.mtl").c_str(), 0600), 0);
  const auto mesh =
      folder_.write("m.obj", "mtllib pipe.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n");
  EXPECT_EQ(load_mesh(mesh).meshes.size(), 1U);  // the program does not wait for a writer
}

TEST_F(MeshFile, BrokenFilesGiveOneClearLine) {
  const std::string good = [] {
    std::ifstream stream(meshes / "crate_z_up_cm.dae");
    return std::string(std::istreambuf_iterator<char>(stream), {});
  }();
  std::vector<fs::path> files{folder_.write("empty.dae", ""),
                              folder_.write("text.obj", "no mesh at all\n"),
                              folder_.write("noise.stl", "\x01\x02\x03"),
                              folder_.write("unknown.xyz", "1 2 3"),
                              folder_.write("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
                              folder_.write("index.obj", "v 0 0 0\nv 1 0 0\nf 1 2 99\n"),
                              folder_.path(),
                              folder_ / "nothing.dae"};
  for (std::size_t length = 0; length < good.size(); length += 397) {
    files.push_back(folder_.write("cut" + std::to_string(length) + ".dae", good.substr(0, length)));
  }
  ASSERT_GT(files.size(), 10U);
  for (const fs::path& file : files) {
    const auto text = message_of<FileError>([&] { (void)load_mesh(file); });
    EXPECT_EQ(text.find(file.string()), 0U) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace panonav::simulation
