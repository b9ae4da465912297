// Readers of text files meet bytes that nobody meant for them: a value or one clear line, never a
// crash.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/internal/toml_fields.hpp"
#include "panonav/io/option_file.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "support/picture_samples.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

constexpr std::string_view dataset_text =
    "[images]\nkind = \"equirectangular\"\ncolumns = \"clockwise\"\nforward_column = 0.5\n"
    "elevation_deg = [-30.0, 40.0]\n[poses]\nfile = \"poses.csv\"\n";
constexpr std::string_view poses_text =
    "file,stamp_s,x_m,y_m,heading_deg\na.png,0.5,1,2,90\n\"b.png\",1.5,-3e-2,4,-180\n";
constexpr std::string_view camera_text =
    "model = \"polynomial\"\ncoefficients = [-120.0, 0.0, 0.002]\nwidth_px = 64\nheight_px = 48\n"
    "centre_u_px = 32.5\ncentre_v_px = 24.0\nrim_radius_px = 22.0\ninner_radius_px = 5.0\n"
    "forward_angle_deg = 17.0\ncolumns = \"clockwise\"\n";
constexpr std::string_view tum_text =
    "# stamp x y z qx qy qz qw\n0 1 2 0 0 0 0 1\n0.5 1 2 0 0 0 1 0\n";
constexpr std::string_view csv_text = "stamp_s,x_m,y_m,heading_deg\n0,1,2,3\n1,2,3,4\n";

class AnyBytes : public ::testing::Test {
 protected:
  void SetUp() override {
    const Image picture = smooth_image(16, 8, 1);
    write_png(folder / "a.png", picture.view());
    write_png(folder / "b.png", picture.view());
    folder.write("dataset.toml", dataset_text);
    folder.write("poses.csv", poses_text);
  }

  // Damages `good`, writes it as `name` and reads; counts what was refused.
  void expect_values_or_lines(std::string_view name, std::string_view good,
                              const std::function<void(const std::filesystem::path&)>& read) {
    read(folder.write(name, good));
    Random random(1);
    constexpr std::string_view special = "\"'[]{}=,#.\n\r\t\\\0 -+e09_nai\x80\xFF";
    int refused = 0;
    constexpr int trials = 400;
    for (int trial = 0; trial < trials; ++trial) {
      std::string bytes(good);
      const auto any_byte = [&] {
        return random.index(2) == 0 ? special[random.index(special.size())]
                                    : static_cast<char>(random.index(256));
      };
      if (trial % 4 == 3) {
        // Nothing but noise.
        bytes.resize(random.index(200));
        for (auto& byte : bytes) byte = any_byte();
      } else {
        for (std::uint64_t edits = 1 + random.index(4); edits > 0; --edits) {
          const auto at = random.index(bytes.size());
          switch (random.index(3)) {
            case 0:
              bytes[at] = any_byte();
              break;
            case 1:
              bytes.insert(at, 1, any_byte());
              break;
            default:
              bytes.erase(at, 1 + random.index(10));
          }
          if (bytes.empty()) break;
        }
      }
      const auto path = folder.write(name, bytes);
      try {
        read(path);
      } catch (const FileError& error) {
        ++refused;
        const std::string message = error.what();
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_EQ(message.rfind(folder.path().string(), 0), 0U) << message;
      }
    }
    EXPECT_GT(refused, trials / 4);
  }

  TemporaryFolder folder;
};

TEST_F(AnyBytes, DatasetToml) {
  expect_values_or_lines("dataset.toml", dataset_text, [this](const auto&) {
    EXPECT_EQ(read_dataset(folder.path()).entries.size(), 2U);
  });
}

TEST_F(AnyBytes, PoseTable) {
  expect_values_or_lines("poses.csv", poses_text, [this](const auto&) {
    EXPECT_GE(read_dataset(folder.path()).entries.size(), 1U);
  });
}

TEST_F(AnyBytes, CameraFile) {
  expect_values_or_lines("camera.toml", camera_text,
                         [](const auto& path) { validate(read_camera(path).camera); });
}

TEST_F(AnyBytes, TumTrajectory) {
  expect_values_or_lines("t.tum", tum_text,
                         [](const auto& path) { EXPECT_GE(read_trajectory(path).size(), 1U); });
}

TEST_F(AnyBytes, CsvTrajectory) {
  expect_values_or_lines("t.csv", csv_text,
                         [](const auto& path) { EXPECT_GE(read_trajectory(path).size(), 1U); });
}

TEST_F(AnyBytes, TrajectoriesOfOtherFormats) {
  for (const char* text :
       {"1 0 0 0 0 1 0 0 0 0 1 0\n0 0 1 4 -1 0 0 5 0 -1 0 6\n",
        "#timestamp, p_RS_R_x [m]\n1403636580838555648,4.6,-1.7,0.7,0.6,-0.8,0,0,1,2\n"}) {
    expect_values_or_lines("t.txt", text, [](const auto& path) {
      EXPECT_GE(read_trajectory_file(path).poses.size(), 1U);
    });
  }
}

TEST_F(AnyBytes, CalibrationsOfOtherPrograms) {
  for (const char* text :
       {"cam0:\n  camera_model: omni\n  intrinsics: [1.3, 70, 70, 32, 24]\n"
        "  distortion_model: radtan\n  distortion_coeffs: [-0.2, 0.1, 0, 0]\n"
        "  resolution: [64, 48]\n",
        "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\nK: !!opencv-matrix\n   rows: 3\n"
        "   data: [ 20., 0., 32., 0.,\n     20., 24., 0., 0., 1. ]\nD: !!opencv-matrix\n"
        "   data: [ 0.1, 0., 0., 0. ]\n",
        "#polynomial\n3 -30 0 1e-2\n2 4 5\n24 32\n1 0 0\n48 64\n"}) {
    expect_values_or_lines("c.yaml", text,
                           [](const auto& path) { validate(read_camera(path).camera); });
  }
}

TEST_F(AnyBytes, OptionFile) {
  expect_values_or_lines("o.toml", "[search]\ntop = 3\n[other]\nname = \"x\"\nlist = [1, [2, 3]]\n",
                         [](const auto& path) { (void)OptionFile(path).has("search", "top"); });
}

TEST_F(AnyBytes, TomlBeyondAsciiStandsInQuotationMarksAlone) {
  const auto refusal = [&](std::string_view text) {
    return message_of<FileError>([&] { (void)OptionFile(folder.write("u.toml", text)); });
  };
  for (const std::string text : {"[s]\n\xC3\xA9 = 1\n", "[s]\na = \xC3\xA9\n",
                                 "[s]\na\xC3\xA9 = 1\n", "[s]\na = \"b\"\xC2\xA1\n"}) {
    EXPECT_TRUE(contains(refusal(text), "u.toml: line 2 is not TOML")) << text;
  }
  EXPECT_TRUE(contains(refusal("a = 1\"\xC3\xA9\"\n"), "line 1 is not TOML"));
  EXPECT_TRUE(contains(refusal("a = \"\xC3\xA9\n"), "line 1 is not TOML"));
  EXPECT_EQ(refusal("\xEF\xBB\xBF[s]\na = \"\xC3\xA9\"\nb = '\\\xC3\xA9' # \xC3\xA9\n"
                    "c = \"\\\"\xC3\xA9#\"\n\"\xC3\xA9\" = ''\n"),
            "no error");
}

TEST_F(AnyBytes, ANumberFollowedByATextBeyondAsciiIsNoToml) {
  for (const std::string text : {"a = [1, 2.\"x\xEF\xBB\xBB\"]\n", "a = 2[\"\xEF\xBF\xBD\"]\n"}) {
    EXPECT_TRUE(
        contains(message_of<FileError>([&] { (void)OptionFile(folder.write("u.toml", text)); }),
                 "line 1 is not TOML"))
        << text;
  }
  // Texts are read as they were written.
  const TomlTable table = read_toml(folder.write(
      "v.toml",
      "a = \"\xC3\xA9\\\"\xF0\x9F\x98\x80\"\nb = '\\\"\xC3\xA9' # \xC3\xA9\n\"\xC3\xA9\" = 1\n"));
  const auto text_of = [&](std::string_view name) {
    const auto found = std::ranges::find(table, name, &TomlField::name);
    return found == table.end() ? "" : std::get<std::string>(found->value.content);
  };
  EXPECT_EQ(text_of("a"), "\xC3\xA9\"\xF0\x9F\x98\x80");
  EXPECT_EQ(text_of("b"), "\\\"\xC3\xA9");
  EXPECT_TRUE(
      std::ranges::any_of(table, [](const TomlField& field) { return field.name == "\xC3\xA9"; }));
  EXPECT_TRUE(contains(
      message_of<FileError>([&] { (void)read_toml(folder.write("w.toml", "a = \"\xC3\"\n")); }),
      "line 1 is not TOML"));
  const TomlTable several = read_toml(folder.write("s.toml", "a = \"\"\"x\n\xC3\xA9\"\"\"\n"));
  EXPECT_EQ(std::get<std::string>(several[0].value.content), "x\n\xC3\xA9");
}

TEST_F(AnyBytes, DeeplyNestedToml) {
  const auto path = folder.write("deep.toml", "a = " + std::string(100000, '['));
  EXPECT_THROW(OptionFile file(path), FileError);
  std::string dotted = "a";
  for (int i = 0; i < 50000; ++i) dotted += ".a";
  EXPECT_THROW(OptionFile file(folder.write("dotted.toml", dotted + " = 1\n")), FileError);
  EXPECT_THROW(OptionFile file(folder.write("section.toml", "[" + dotted + "]\nx = 1\n")),
               FileError);
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)read_toml(folder / "section.toml"); }),
                       "line 1 has too many dots; allowed: up to 100"));
}

}  // namespace
}  // namespace panonav::testing
