// Runs the fuzz targets on their first inputs and on those that failed, in every build.
#include <gtest/gtest.h>

#include <ctime>
#include <filesystem>

#include "fuzz/targets.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

/// Processor time of this thread: other tests run concurrently.
double processor_time_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

TEST(FuzzCorpus, EveryFileGivesAValueOrOneLineInTime) {
  for (const FuzzTarget& target : fuzz_targets()) {
    const fs::path folder = fs::path(PANONAV_FUZZ_CORPUS) / target.name;
    int files = 0;
    for (const auto& file : fs::directory_iterator(folder)) {
      SCOPED_TRACE(file.path().string());
      const std::string bytes = bytes_of(file.path());
      const double start_s = processor_time_s();
      EXPECT_NO_THROW(
          target.read({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}));
      EXPECT_LT(processor_time_s() - start_s, 5.0);
      ++files;
    }
    EXPECT_GE(files, 2) << folder;
  }
}

}  // namespace
}  // namespace panonav::testing
