#include "panonav/io/dataset.hpp"
#include "support/skips.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_cameras.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

class DatasetFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    Image picture(32, 8, 1);
    for (int u = 0; u < 32; ++u) {
      for (int v = 0; v < 8; ++v) picture.at(u, v) = static_cast<std::uint8_t>(8 * u);
    }
    write_png(folder / "a.png", picture.view());
    write_png(folder / "b.png", picture.view());
    write("dataset.toml", dataset_toml);
    write("poses.csv", "file,x_m,y_m,heading_deg\na.png,1,2,90\nb.png,3,4,-180\n");
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder / name) << text;
  }
  // The message of the error that reading throws.
  [[nodiscard]] std::string error() const {
    return message_of<FileError>([&] { (void)read_dataset(folder); });
  }
  void expect_error(const std::string& part) const {
    const std::string message = error();
    EXPECT_TRUE(contains(message, part)) << "message: " << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << "more than one line: " << message;
  }

  static constexpr const char* dataset_toml =
      "[images]\nkind = \"panorama\"\ncolumns = \"clockwise\"\nforward_column = 0.5\n"
      "[poses]\nfile = \"poses.csv\"\n";
  const TemporaryFolder temporary;
  const fs::path& folder = temporary.path();
};

TEST_F(DatasetFolder, ReadsPosesInRadians) {
  const Dataset dataset = read_dataset(folder);
  ASSERT_EQ(dataset.entries.size(), 2U);
  EXPECT_EQ(dataset.entries[0].file, "a.png");
  EXPECT_DOUBLE_EQ(dataset.entries[0].pose->x_m, 1.0);
  EXPECT_NEAR(*dataset.entries[0].pose->heading_rad, radians(90.0), 1e-12);
  EXPECT_NEAR(*dataset.entries[1].pose->heading_rad, radians(-180.0), 1e-12);
  EXPECT_FALSE(dataset.source.layout.elevations.has_value());
}

TEST_F(DatasetFolder, AnImageMayLackWhatOthersHave) {
  write("poses.csv",
        "file,stamp_s,x_m,y_m,heading_deg,odom_x_m,odom_y_m,odom_heading_deg,roll_deg,pitch_deg\n"
        "a.png,0,1,2,,,,,1,2\nb.png,1,,,,3,4,90,,\n");
  const Dataset dataset = read_dataset(folder);
  EXPECT_EQ(dataset.warnings,
            (std::vector<std::string>{folder.string() + ": 1 of 2 images have no position",
                                      folder.string() + ": 1 of 2 images have no odometry",
                                      folder.string() + ": 1 of 2 images have no roll and pitch"}));
  EXPECT_TRUE(dataset.entries[0].pose && dataset.entries[0].tilt);
  EXPECT_FALSE(dataset.entries[0].odometry || dataset.entries[0].pose->heading_rad);
  EXPECT_FALSE(dataset.entries[1].pose || dataset.entries[1].tilt);
  EXPECT_EQ(dataset.entries[1].odometry->position(), (Point2{3.0, 4.0}));
  write_dataset(dataset);
  EXPECT_EQ(read_dataset(folder).entries, dataset.entries);
  // A part of a pose is a fault.
  write("poses.csv", "file,x_m,y_m\na.png,1,\nb.png,1,2\n");
  expect_error("line 2: y_m is empty; allowed: a finite number");
}

TEST_F(DatasetFolder, WhatIsWrittenReadsBackTheSame) {
  Dataset dataset = read_dataset(folder);
  dataset.source.layout.elevations = ElevationBand{radians(-30.0), radians(40.0)};
  for (std::size_t i = 0; i < 2; ++i) {
    dataset.entries[i].stamp_s = 0.25 * static_cast<double>(i);
    dataset.entries[i].odometry = Pose2{0.1 * static_cast<double>(i), -0.7, 0.3};
    dataset.entries[i].tilt = Tilt{radians(-2.5), radians(3.0 * static_cast<double>(i))};
  }
  write_dataset(dataset);
  const Dataset back = read_dataset(folder);
  ASSERT_EQ(back.entries.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(back.entries[i].stamp_s, dataset.entries[i].stamp_s);
    EXPECT_NEAR(back.entries[i].odometry->heading_rad, 0.3, 1e-12);
    EXPECT_EQ(back.entries[i].pose->position(), dataset.entries[i].pose->position());
    EXPECT_EQ(back.entries[i].tilt, dataset.entries[i].tilt);
  }
  EXPECT_NEAR(back.source.layout.elevations->top_rad, radians(40.0), 1e-12);
}

TEST(RoundTripDegrees, AreRoundWhereThatReadsBackTheSame) {
  EXPECT_EQ(to_exact_degrees(radians(-30.0)), -30.0);
  EXPECT_EQ(to_exact_degrees(radians(118.1)), 118.1);
  int unchanged = 0;
  for (int i = 0; i < 1000; ++i) {
    const double angle_rad = std::sin(0.7 * i) * 3.0;
    const double back_rad = radians(to_exact_degrees(angle_rad));
    EXPECT_NEAR(back_rad, angle_rad, 1e-15);
    unchanged += back_rad == radians(degrees(angle_rad)) ? 1 : 0;
  }
  EXPECT_EQ(unchanged, 1000) << "rounding must not lose what was there";
}

TEST_F(DatasetFolder, EveryFaultHasItsLine) {
  const std::pair<const char*, const char*> tables[] = {
      {"file,x_m,y_m\na.png,1,nan\n", "line 2: y_m is 'nan'"},
      {"file,x_m,y_m\na.png,1,\n", "line 2: y_m is empty"},
      {"file,x_m\na.png,1\n", "no column 'y_m'"},
      {"file,x_m,y_m\na.png,1,2\na.png,1,2\n", "'a.png' for the second time"},
      {"file,x_m,y_m\nc.png,1,2\n", "'c.png', which does not exist"},
      {"file,x_m,y_m\n../a.png,1,2\n", "line 2: file is '../a.png'; allowed: an image in"},
      {"file,x_m,y_m\nb/../../a.png,1,2\n", "file is 'b/../../a.png'; allowed: an image in"},
      {"file,x_m,y_m\n/etc/a.png,1,2\n", "file is '/etc/a.png'; allowed: an image in"},
      {"file,x_m,y_m\na.png,1e308,2\n", "line 2: x_m is 1e308; allowed: -10000000 to 10000000 m"},
      {"file,odom_x_m,odom_y_m,odom_heading_deg\na.png,1,-1e200,2\n",
       "line 2: odom_y_m is -1e200; allowed: -10000000 to 10000000 m"},
      {"file,x_m,y_m,roll_deg\na.png,1,2,3\n", "no column 'pitch_deg'"},
      {"file,x_m,y_m,roll_deg,pitch_deg\na.png,1,2,3,-31\n",
       "line 2: pitch_deg is -31; allowed: -30 to 30"},
      {"file,x_m,y_m\n", "names no image"},
      {"file,x_m,y_m,colour\na.png,1,2,3\n", "'colour' is not known"},
      {"", "no header"},
      {"file,x_m,y_m\na.png,1\n", "line 2 has 2 fields"},
  };
  for (const auto& [table, part] : tables) {
    write("poses.csv", table);
    expect_error(part);
  }
  fs::remove(folder / "poses.csv");
  expect_error("poses.csv");
  write("dataset.toml", "[images]\nkind = \"panorama\"\n[list]\nfile = \"../poses.csv\"\n");
  expect_error("file is \"../poses.csv\"; allowed: a table in the data set's folder");
  write("dataset.toml", "[images]\nkind = \"film\"\n[list]\nfile = \"poses.csv\"\n");
  expect_error("kind is \"film\"; allowed: \"panorama\"");
  write("dataset.toml",
        "[images]\nkind = \"panorama\"\nforward_colum = 0.5\n[poses]\nfile = \"poses.csv\"\n");
  write("poses.csv", "file,x_m,y_m\na.png,1,2\n");
  expect_error("forward_colum is not a known field");
  write(
      "dataset.toml",
      "[images]\nkind = \"panorama\"\nelevation_deg = [40, -30]\n[poses]\nfile = \"poses.csv\"\n");
  expect_error("elevation_deg is [40, -30]");
  write("dataset.toml", "[images\n");
  expect_error("is not TOML");
}

TEST_F(DatasetFolder, MirrorPicturesWithTheirCameraAndMask) {
  Camera camera;
  camera.model = EquiangularModel{-0.6, 0.4};
  camera.image_size = {160, 120};
  camera.centre = {80.5, 59.0};
  camera.rim_radius_px = 55.0;
  camera.inner_radius_px = 12.0;
  camera.forward_angle_rad = 0.25;
  Image mask(160, 120);
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 80; ++u) mask.at(u, v) = 255;
  }
  Dataset dataset;
  dataset.folder = folder;
  dataset.source.kind = PictureKind::mirror;
  dataset.source.camera = camera;
  dataset.source.mask = mask;
  dataset.source.layout.kept_elevations = ElevationBand{-0.5, 0.25};
  // A white world, and a black robot where the mask is.
  write_png(folder / "white, \"1\".png", mask.view());
  dataset.entries.push_back({.file = "white, \"1\".png",
                             .path = folder / "white, \"1\".png",
                             .stamp_s = 0.5,
                             .pose = {},
                             .odometry = {}});
  write_dataset(dataset);
  EXPECT_TRUE(fs::exists(folder / "images.csv"));
  const Dataset back = read_dataset(folder);
  ASSERT_EQ(back.entries.size(), 1U);
  EXPECT_EQ(back.entries[0], dataset.entries[0]);
  EXPECT_EQ(back.source.camera->centre, camera.centre);
  EXPECT_NEAR(back.source.camera->forward_angle_rad, 0.25, 1e-12);
  EXPECT_EQ(back.source.mask, mask);
  EXPECT_NEAR(back.source.layout.kept_elevations->bottom_rad, -0.5, 1e-12);

  // The robot is seen without the mask, and nothing of it with the mask.
  const Panorama view = PanoramaReader(back.source, {16, 64}).read(back.entries[0].path);
  for (const float value : view.values()) ASSERT_NEAR(value, 1.0F, 1e-3F);
  PictureSource without = back.source;
  without.mask.reset();
  const Panorama bare = PanoramaReader(without, {16, 64}).read(back.entries[0].path);
  const auto dark = std::ranges::count_if(bare.values(), [](float v) { return v < 0.1F; });
  EXPECT_GT(dark, 16 * 64 / 3);
}

TEST_F(DatasetFolder, PerspectiveCamerasBelongToNarrowPictures) {
  const std::string poses = "[poses]\nfile = \"poses.csv\"\n";
  write("lens.yaml",
        "cam0:\n  camera_model: pinhole\n  intrinsics: [20, 20, 15.5, 3.5]\n"
        "  distortion_model: radtan\n  distortion_coeffs: [-0.01, 0, 0, 0]\n"
        "  resolution: [32, 8]\n");
  write("dataset.toml", "[images]\nkind = \"pinhole\"\ncamera = \"lens.yaml\"\n" + poses);
  const PictureSource source = read_dataset(folder).source;
  EXPECT_EQ(source.kind, PictureKind::pinhole);
  EXPECT_EQ(source.camera.value().distortion[0], -0.01);
  write("dataset.toml", "[images]\nkind = \"mirror\"\ncamera = \"lens.yaml\"\n" + poses);
  expect_error("shows a part of the azimuth");
}

TEST_F(DatasetFolder, CamerasOfARigHaveFoldersOfTheirOwn) {
  const Camera rig = rig_camera(3);
  write_camera(folder / "rig.toml", {rig, {}});
  Image image(160, 120);
  for (const char* name : {"left", "middle", "right"}) {
    fs::create_directory(folder / name);
    image.at(0, 0) = static_cast<std::uint8_t>(image.at(0, 0) + 50);
    for (const char* file : {"a.png", "b.png"}) write_png(folder / name / file, image.view());
  }
  write("list.csv", "file\nleft/a.png\nleft/b.png\n");
  const auto with = [&](const std::string& fields, const std::string& camera) {
    write("dataset.toml", "[images]\nkind = \"pinhole\"\n" + fields + "camera = \"" + camera +
                              "\"\n[list]\nfile = \"list.csv\"\n");
  };
  with("folders = [\"left\", \"middle\", \"right\"]\n", "rig.toml");
  const Dataset dataset = read_dataset(folder);
  ASSERT_EQ(dataset.entries.size(), 2U);
  const Image joined = read_picture(dataset.entries[1]);
  ASSERT_EQ(joined.size(), rig.image_size);
  EXPECT_EQ(joined.at(0, 0), 50);
  EXPECT_EQ(joined.at(160, 0), 100);
  EXPECT_EQ(joined.at(320, 0), 150);

  with("folders = [\"left\", \"right\"]\n", "rig.toml");
  expect_error("a list of 2");
  with("folders = [\"left\", \"middle\", 3]\n", "rig.toml");
  expect_error("folders is 3");
  with("folders = [\"left\", \"middle\", \"../right\"]\n", "rig.toml");
  expect_error("../right");
  with("folders = [\"middle\", \"left\", \"right\"]\n", "rig.toml");
  expect_error("not in the folder of the rig's first camera");
  with("folders = [\"left\", \"middle\", \"right\"]\n", "rig.toml");
  fs::remove(folder / "middle" / "b.png");
  expect_error("middle/b.png");
  write_camera(folder / "one.toml", {std::get<RigModel>(rig.model).cameras[0], {}});
  with("folders = [\"left\"]\n", "one.toml");
  expect_error("only for a rig");
}

TEST_F(DatasetFolder, WhatCannotBeReadBackIsNotWritten) {
  Dataset dataset = read_dataset(folder);
  dataset.entries[0].file = "two\nlines.png";
  EXPECT_THROW(write_dataset(dataset), ContractError);
  dataset.entries.clear();
  EXPECT_THROW(write_dataset(dataset), ContractError);
  EXPECT_EQ(read_dataset(folder).entries.size(), 2U);
}

TEST_F(DatasetFolder, APlainFolderIsReadInNaturalOrder) {
  const Image picture(8, 4, 1);
  for (const char* name : {"view_10.png", "view_9.png", "view_2.PNG"}) {
    write_png(folder / name, picture.view());
  }
  fs::remove(folder / "a.png");
  fs::remove(folder / "b.png");
  const Dataset dataset = read_picture_folder(folder, {});
  ASSERT_EQ(dataset.entries.size(), 3U);
  EXPECT_EQ(dataset.entries[0].file, "view_2.PNG");
  EXPECT_EQ(dataset.entries[1].file, "view_9.png");
  EXPECT_EQ(dataset.entries[2].file, "view_10.png");
}

TEST(RealDatasets, AllAreReadAndConverted) {
  const struct {
    const char* name;
    std::size_t pictures;
    bool headings;
  } expected[] = {
      {"gantry_plants", 196, true}, {"sussex_route", 455, false}, {"indoor_walk_360", 117, false}};
  for (const auto& each : expected) {
    const auto folder = real_data(each.name);
    PANONAV_REQUIRE_DATA(folder, each.name);
    const Dataset dataset = read_dataset(*folder);
    EXPECT_EQ(dataset.entries.size(), each.pictures) << each.name;
    EXPECT_EQ(dataset.entries[0].pose && dataset.entries[0].pose->heading_rad, each.headings)
        << each.name;
    const PanoramaReader reader(dataset.source, {});
    const Panorama view = reader.read(dataset.entries[0].path);
    EXPECT_GE(view.columns(), 90) << each.name;
  }
}

}  // namespace
}  // namespace panonav::testing
