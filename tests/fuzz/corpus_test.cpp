// What the fuzzers start from and what they found, on every build.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>

#include "fuzz/targets.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

TEST(FuzzCorpus, EveryFileGivesAValueOrOneLineInTime) {
  for (const FuzzTarget& target : fuzz_targets()) {
    const fs::path folder = fs::path(PANONAV_FUZZ_CORPUS) / target.name;
    int files = 0;
    for (const auto& file : fs::directory_iterator(folder)) {
      SCOPED_TRACE(file.path().string());
      const std::string bytes = bytes_of(file.path());
      const auto start = std::chrono::steady_clock::now();
      EXPECT_NO_THROW(
          target.read({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}));
      EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
      ++files;
    }
    EXPECT_GE(files, 2) << folder;
  }
}

}  // namespace
}  // namespace panonav::testing
