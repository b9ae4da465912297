#pragma once

// Makes a walk of pictures in every form that the command reads.

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {

/// Returns the standard output of a shell command; expects exit code 0.
inline std::string said_by_shell(const std::string& command, const std::filesystem::path& folder) {
  const std::filesystem::path out = folder / "shell_output";
  EXPECT_EQ(std::system((command + " > " + quote_for_shell(out.string())).c_str()), 0) << command;
  std::ostringstream text;
  text << std::ifstream(out).rdbuf();
  return text.str();
}

inline std::vector<nlohmann::json> objects(const std::string& text) {
  std::vector<nlohmann::json> values;
  for (const std::string& line : lines(text)) values.push_back(nlohmann::json::parse(line));
  return values;
}

/// A walk of 36 pictures, as PNG and JPEG files, as a video without loss and as a JPEG stream.
class Walk : public ::testing::Test {
 protected:
  static constexpr std::size_t count = 36;  ///< pictures of the walk

  void SetUp() override {
    poses_ = grid_poses(6);
    write_dataset(folder / "walk", landmark_world(5), poses_);
    const std::string pictures = "ffmpeg -nostdin -v error -framerate 10 -i " +
                                 quote_for_shell((folder / "walk/view_%03d.png").string()) +
                                 " -pix_fmt ";
    std::filesystem::create_directories(folder / "jpegs");
    const auto make = [&](const std::string& words, const std::string& to) {
      const std::string command = pictures + words + " " + quote_for_shell((folder / to).string());
      ASSERT_EQ(std::system(command.c_str()), 0) << command;
    };
    make("rgb24 -c:v libx264rgb -qp 0", "walk.mp4");
    make("yuvj444p -q:v 2 -start_number 1", "jpegs/%06d.jpg");
    std::string stream;
    for (std::size_t i = 1; i <= count; ++i) stream += jpeg(i);
    write_file(folder / "walk.mjpeg", std::string_view(stream));
  }

  [[nodiscard]] std::string jpeg(std::size_t number) const {
    const std::string digits = std::to_string(number);
    std::ifstream file(folder / "jpegs" / (std::string(6 - digits.size(), '0') + digits + ".jpg"),
                       std::ios::binary);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    return bytes.str();
  }
  /// Writes the walk as the pictures that the camera of v4l2_shim.cpp sees.
  void write_camera_pictures() const {
    std::string pictures;
    for (std::size_t i = 1; i <= count; ++i) {
      const std::string bytes = jpeg(i);
      const auto length = static_cast<std::uint32_t>(bytes.size());
      pictures.append(reinterpret_cast<const char*>(&length), sizeof(length));
      pictures += bytes;
    }
    write_file(folder / "pictures", std::string_view(pictures));
  }
  [[nodiscard]] std::string path(const std::string& name) const { return folder / name; }
  [[nodiscard]] static VisualMemory views(const std::string& memory) {
    return MemoryFile::open(memory, Access::read_only).load();
  }

  const std::vector<std::string> panoramas_{"--kind", "panorama", "--elevation-deg", "-20", "20"};
  TemporaryFolder folder;
  std::vector<Pose2> poses_;
};

}  // namespace panonav::testing
