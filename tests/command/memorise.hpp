#pragma once

// Gives the tests of `memorise` a data set, and reads the memory that it makes.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {

inline nlohmann::json info_of(const std::string& memory) {
  return answer_of({"info", memory, "--json"});
}

inline int views_in(const std::string& memory) {
  return info_of(memory).value("views", -1);
}

inline void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path) << text;
}

/// A data set of 16 pictures, and the name of a memory that is not there yet.
class Memorise : public ::testing::Test {
 protected:
  void SetUp() override { write_dataset(data(), world_, grid_poses(4)); }
  [[nodiscard]] std::filesystem::path data() const { return folder_ / "data"; }
  [[nodiscard]] std::string memory() const { return folder_ / "m.panonav"; }

  TemporaryFolder folder_;
  ToyWorld world_ = landmark_world(5);
};

}  // namespace panonav::testing
