#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>

#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {

/// A walk with one's own camera: images in a folder, without positions, odometry or description.
class OwnImages : public ::testing::Test {
 protected:
  static constexpr std::size_t count = 40;

  void SetUp() override {
    std::filesystem::create_directory(walk());
    for (std::size_t i = 0; i < count; ++i) {
      const double along_m = 0.08 * static_cast<double>(i);
      write_picture(walk() / view_name(i), world, {along_m - 1.5, 0.2 * std::sin(along_m), 0.0});
    }
  }
  [[nodiscard]] std::filesystem::path walk() const {
    return std::filesystem::path(std::string(folder / "walk"));
  }
  [[nodiscard]] std::string memory() const { return folder / "walk.panonav"; }
  void memorise() const {
    run_well({"memorise", memory(), walk(), "--kind", "panorama", "--elevation-deg", "-20", "20"});
  }

  const ToyWorld world = landmark_world(8);
  TemporaryFolder folder;
};

}  // namespace panonav::testing
