// Memory files on a disk without a free byte.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <vector>

#include "panonav/storage/memory_file.hpp"
#include "support/child_process.hpp"
#include "support/memory_samples.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

// A file system of its own with no free byte, where one may be mounted.
class FullDisk : public MemoryFileTest {
 protected:
  static constexpr int cannot_mount = 97;

  /// Copies the memory, with its log if there is one, to a full disk, and returns what `body`
  /// says of the copy there, in a process of its own.
  [[nodiscard]] int run_on_full_disk(const std::function<int(const fs::path& copy)>& body) const {
    return exit_code_of(start_child([&] {
      const fs::path disk = folder / "disk";
      fs::create_directory(disk);
      if (::unshare(CLONE_NEWNS) != 0 ||
          ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
          ::mount("none", disk.c_str(), "tmpfs", 0, "size=4m") != 0) {
        return cannot_mount;
      }
      const fs::path copy = disk / path.filename();
      fs::copy(path, copy);
      if (fs::exists(path.string() + "-wal"))
        fs::copy(path.string() + "-wal", copy.string() + "-wal");
      const int filler = ::open((disk / "filler").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
      const std::vector<char> bytes(4096);
      while (::write(filler, bytes.data(), bytes.size()) > 0) continue;
      ::close(filler);
      const int said = body(copy);
      if (said != 0) return said;
      fs::remove(disk / "filler");  // with room again, it is read and changed as before
      MemoryFile file = MemoryFile::open(copy, Access::read_write);
      file.append(numbered_view(small_header().shape, 77));
      return file.verify().empty() ? 0 : 50;
    }));
  }
  static int read_all(const fs::path& copy, std::size_t views) {
    for (int time = 0; time < 2; ++time) {
      const MemoryFile file = MemoryFile::open(copy, Access::read_only);
      if (file.load().size() != views || !file.verify().empty()) return 1;
    }
    return 0;
  }
};

TEST_F(FullDisk, AMemoryIsRead) {
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    for (int i = 0; i < 5; ++i) file.append(numbered_view(small_header().shape, i));
  }
  const int said = run_on_full_disk([](const fs::path& copy) { return read_all(copy, 5); });
  if (said == cannot_mount) GTEST_SKIP() << "no file system can be mounted here";
  EXPECT_EQ(said, 0);
}

TEST_F(FullDisk, AMemoryWithTheLogOfAKilledWriterIsRead) {
  EXPECT_EQ(exit_code_of(start_child([&] {
              MemoryFile file = MemoryFile::create(path, small_header());
              for (int i = 0; i < 5; ++i) file.append(numbered_view(small_header().shape, i));
              ::kill(::getpid(), SIGKILL);
              return 0;
            })),
            -1);
  ASSERT_GT(fs::file_size(path.string() + "-wal"), 0U);
  const int said = run_on_full_disk([](const fs::path& copy) { return read_all(copy, 5); });
  if (said == cannot_mount) GTEST_SKIP() << "no file system can be mounted here";
  EXPECT_EQ(said, 0);
}

}  // namespace
}  // namespace panonav::testing
