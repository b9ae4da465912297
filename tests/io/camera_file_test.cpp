#include "panonav/io/camera_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "panonav/core/error.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_cameras.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

Camera mirror_camera(CameraModel model) {
  Camera camera;
  camera.model = std::move(model);
  camera.image_size = {640, 480};
  camera.centre = {322.5, 239.25};
  camera.rim_radius_px = 230.0;
  camera.inner_radius_px = 40.0;
  camera.forward_angle_rad = 0.3;
  return camera;
}

std::string error_of(const fs::path& path) {
  return message_of<FileError>([&] { (void)read_camera(path); });
}

using CameraFiles = InTemporaryFolder;

TEST_F(CameraFiles, APinholeLensReadsBackTheSame) {
  const fs::path path = folder / "camera.toml";
  Camera camera;
  camera.model = PinholeModel{500.0, 0.7, -0.1, 0.05};
  camera.image_size = {640, 480};
  camera.centre = {322.5, 239.25};
  write_camera(path, {camera, std::nullopt});
  EXPECT_EQ(read_camera(path).camera, camera);
  std::ofstream(path) << "model = \"pinhole\"\nfocal_length_px = -1\nazimuth_rad = 0\n"
                         "elevation_rad = 0\nroll_rad = 0\nwidth_px = 640\nheight_px = 480\n"
                         "centre_u_px = 320\ncentre_v_px = 240\n";
  EXPECT_TRUE(contains(error_of(path), "focal_length_px"));
}

TEST_F(CameraFiles, EveryModelReadsBackTheSame) {
  const fs::path path = folder / "camera.toml";
  int models = 0;
  for (const CameraModel& model :
       {CameraModel{HyperboloidalModel{}}, CameraModel{PolynomialModel{{-180.0, 0.0, 0.002}}},
        CameraModel{UnifiedModel{0.9, 280.0}},
        CameraModel{UnifiedModel{0.9, 280.0, UnifiedModel::Axis::up}},
        CameraModel{EquiangularModel{-1.0, 0.3}}, CameraModel{FisheyeModel{}},
        CameraModel{FisheyeModel{150.0, 0.01, -0.002, 1e-3, -1e-4, 1.6, UnifiedModel::Axis::up}}}) {
    CameraFile file{mirror_camera(model), std::nullopt};
    file.camera.affine = {1.001, -0.0002, 0.0003};
    if (std::holds_alternative<UnifiedModel>(model)) {
      file.camera.distortion = {-0.01, 0.002, 1e-4, -2e-4, 3e-5};
    }
    write_camera(path, file);
    const CameraFile back = read_camera(path);
    EXPECT_EQ(back.camera.model, model);
    EXPECT_EQ(back.camera.affine, file.camera.affine);
    EXPECT_EQ(back.camera.distortion, file.camera.distortion);
    EXPECT_EQ(back.camera.centre, file.camera.centre);
    EXPECT_NEAR(back.camera.forward_angle_rad, 0.3, 1e-12);
    EXPECT_EQ(back.camera.direction, file.camera.direction);
    ++models;
  }
  EXPECT_EQ(models, 7);
  const CameraFile dual{dual_fisheye_camera(), std::nullopt};
  write_camera(path, dual);
  EXPECT_EQ(read_camera(path).camera, dual.camera);
}

TEST_F(CameraFiles, SeveralCamerasMakeARig) {
  const fs::path path = folder / "rig.toml";
  const CameraFile rig{rig_camera(3), Image(480, 120)};
  write_camera(path, rig);
  EXPECT_EQ(read_camera(path).camera, rig.camera);
  EXPECT_TRUE(read_camera(path).mask.has_value());
  std::ifstream in(path);
  const std::string good((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.rfind(from), from.size(), to);
    std::ofstream(path) << text;
    return error_of(path);
  };
  EXPECT_TRUE(contains(with("\"pinhole\"", "\"rig\""), "[camera 3] model is \"rig\""));
  EXPECT_TRUE(contains(with("focal_length_px", "focal_px"), "[camera 3] focal_length_px"));
  EXPECT_TRUE(contains(with("[[camera]]", "[camera]"), "camera"));
  EXPECT_TRUE(
      contains(with("width_px = 160", "width_px = 160\nwidth = 2"), "width is not a known"));
  EXPECT_TRUE(contains(with("centre_u_px = 80", "centre_u_px = 900"), "camera 2 of the rig"));
  std::ofstream(path) << good.substr(0, good.find("[[camera]]", good.find("[[camera]]") + 2));
  EXPECT_TRUE(contains(error_of(path), "cameras of a rig"));
  std::ofstream(path) << "camera = 3\n";
  EXPECT_TRUE(contains(error_of(path), "camera is 3; allowed"));
}

TEST_F(CameraFiles, WithoutAnAxisTheUnifiedModelLooksDown) {
  const fs::path path = folder / "camera.toml";
  write_camera(path, {mirror_camera(UnifiedModel{0.9, 280.0}), std::nullopt});
  std::ifstream in(path);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  EXPECT_FALSE(contains(text, "axis"));  // as programs wrote it that knew no axis
  std::ofstream(path) << text << "axis = \"sideways\"\n";
  EXPECT_TRUE(contains(error_of(path), "axis"));
  write_camera(path, {mirror_camera(HyperboloidalModel{}), std::nullopt});
  std::ofstream(path, std::ios::app) << "axis = \"up\"\n";
  EXPECT_TRUE(contains(error_of(path), "axis is not a known field"));
}

TEST_F(CameraFiles, FaultsNameFieldValueAndRange) {
  const fs::path path = folder / "camera.toml";
  write_camera(path, {mirror_camera(HyperboloidalModel{}), std::nullopt});
  std::ifstream in(path);
  std::string good((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, text.find('\n', at) - at, to);
    std::ofstream(path) << text;
    return error_of(path);
  };
  EXPECT_TRUE(contains(with("model", "model = \"periscope\""), "periscope"));
  EXPECT_TRUE(contains(with("rim_radius_px", "rim_radius_px = nan"), "rim_radius_px"));
  EXPECT_TRUE(contains(with("width_px", "width_px = 0.5"), "width_px is 0.5"));
  EXPECT_TRUE(contains(with("centre_u_px", ""), "centre_u_px is missing"));
  EXPECT_TRUE(contains(with("columns", "colums = \"clockwise\""), "colums is not a known field"));
  EXPECT_NE(error_of(folder / "no_such_camera.toml"), "no error");

  write_camera(path, {dual_fisheye_camera(), std::nullopt});
  std::ifstream dual(path);
  good.assign((std::istreambuf_iterator<char>(dual)), std::istreambuf_iterator<char>());
  EXPECT_TRUE(contains(with("lens1_gain", "lens1_gain = -1"), "lens1_gain is -1"));
  EXPECT_TRUE(contains(with("lens0_k3", "lens0_k3 = nan"), "lens0_k3"));
  EXPECT_TRUE(contains(with("lens0_centre_u_px", "lens0_centre_u_px = 500"), "0 .. 320"));
  EXPECT_TRUE(contains(with("lens1_roll_rad", ""), "lens1_roll_rad is missing"));
  EXPECT_TRUE(contains(with("baseline_m", "rim_radius_px = 3\nbaseline_m = 0"), "rim_radius_px"));
}

}  // namespace
}  // namespace panonav::testing
