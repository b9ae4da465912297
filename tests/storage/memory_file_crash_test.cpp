// Memory files whose writer dies or whose disk is full.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <map>
#include <thread>

#include "panonav/core/error.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/child_process.hpp"
#include "support/memory_samples.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

struct Acknowledgement {
  int number;
  std::uint32_t id;
};

using MemoryFileCrash = MemoryFileTest;

TEST_F(MemoryFileCrash, EveryAcknowledgedViewSurvivesAKill) {
  const SignatureShape shape = small_header().shape;
  { (void)MemoryFile::create(path, small_header()); }

  std::map<int, std::uint32_t> acknowledged;
  int next = 0;
  Random random(1);
  constexpr int kills = 50;
  int kills_while_appending = 0;
  for (int round = 0; round < kills; ++round) {
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = start_child([&] {
      MemoryFile file = MemoryFile::open(path, Access::read_write);
      for (int number = next;; ++number) {
        // A name may be there already: written by a process that was killed before it could say so.
        const NewView view = numbered_view(shape, number);
        const auto known = file.find(view.info.name);
        const Acknowledgement done{number, known ? known->value : file.append(view).value};
        if (::write(ends[1], &done, sizeof(done)) != sizeof(done)) return 1;
      }
    });
    ASSERT_GT(child, 0);
    ::close(ends[1]);
    if (round % 2 == 0) {  // on any machine, half of the kills come after the first append
      pollfd appended{ends[0], POLLIN, 0};
      ASSERT_EQ(::poll(&appended, 1, -1), 1);
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random.index(60000)));
    ASSERT_EQ(::kill(child, SIGKILL), 0);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the writer ended by itself";
    Acknowledgement done{};
    int in_this_round = 0;
    while (::read(ends[0], &done, sizeof(done)) == sizeof(done)) {
      acknowledged[done.number] = done.id;
      next = done.number + 1;
      ++in_this_round;
    }
    ::close(ends[0]);
    kills_while_appending += in_this_round > 0;

    const MemoryFile file = MemoryFile::open(path, Access::read_only);
    ASSERT_TRUE(file.verify().empty());
    const VisualMemory memory = file.load();
    for (const auto& [number, id] : acknowledged) {
      const NewView expected = numbered_view(shape, number);
      const ViewId view{id};
      ASSERT_TRUE(memory.contains(view)) << "view " << number << " was lost in round " << round;
      ASSERT_EQ(memory.info(view), expected.info);
      ASSERT_EQ(memory.packed(view), expected.signature);
    }
    // At most the one view that was written but not acknowledged is there besides.
    ASSERT_LE(memory.size(), acknowledged.size() + 1);
  }
  EXPECT_GE(kills_while_appending, kills / 2);
  EXPECT_GE(acknowledged.size(), static_cast<std::size_t>(kills / 2));
}

// Appends views from the number on in a process that ends without closing the file.
void append_and_die(const std::filesystem::path& path, int first, int count) {
  ASSERT_EQ(exit_code_of(start_child([&] {
              MemoryFile file = MemoryFile::open(path, Access::read_write);
              for (int number = first; number < first + count; ++number) {
                file.append(numbered_view(file.header().shape, number));
              }
              std::_Exit(0);
              return 0;
            })),
            0);
  ASSERT_GT(std::filesystem::file_size(path.string() + "-wal"), 0U);
}

void append_and_close(const std::filesystem::path& path, int first, int count) {
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  for (int number = first; number < first + count; ++number) {
    file.append(numbered_view(file.header().shape, number));
  }
}

class LogBesideAFile : public MemoryFileTest {
 protected:
  void SetUp() override {
    { (void)MemoryFile::create(path, small_header()); }
    append_and_close(path, 0, 3);
    backup = bytes_of(path);
  }
  [[nodiscard]] std::filesystem::path beside(const char* suffix) const {
    return path.string() + suffix;
  }
  // Neither a reader nor a writer takes the log, and the file stays as it is.
  void expect_refused(const std::string& content, const char* suffix) const {
    for (const Access access : {Access::read_only, Access::read_write, Access::read_only}) {
      const auto message = message_of<FileError>([&] { (void)MemoryFile::open(path, access); });
      EXPECT_TRUE(contains(message, "has a log beside it that is not its own"));
      EXPECT_TRUE(contains(message, beside(suffix).string()));
      EXPECT_EQ(message.find('\n'), std::string::npos);
      ASSERT_TRUE(bytes_of(path) == content) << "a foreign log was applied";
    }
  }
  std::string backup;
};

TEST_F(LogBesideAFile, IsNotAppliedToABackup) {
  append_and_close(path, 3, 40);
  append_and_die(path, 43, 4);
  folder.write("m.panonav", backup);  // the same inode
  expect_refused(backup, "-wal");
  folder.write("other", backup);
  std::filesystem::rename(folder / "other", path);  // another one
  expect_refused(backup, "-wal");
  for (const char* suffix : {"-wal", "-shm"}) std::filesystem::remove(beside(suffix));
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  EXPECT_TRUE(file.verify().empty());
  EXPECT_EQ(file.load().size(), 3U);
}

TEST_F(LogBesideAFile, IsNotAppliedToAnotherFile) {
  const auto other = folder / "other.panonav";
  { (void)MemoryFile::create(other, small_header()); }
  append_and_close(other, 0, 3);
  append_and_die(other, 3, 4);
  std::filesystem::rename(other.string() + "-wal", beside("-wal"));
  expect_refused(backup, "-wal");
}

// SQLite's other kind of log holds what is to be written back.
TEST_F(LogBesideAFile, OfTheOtherKindIsNotApplied) {
  const auto other = folder / "other.panonav";
  { (void)MemoryFile::create(other, small_header()); }
  append_and_close(other, 0, 200);
  ASSERT_EQ(exit_code_of(start_child([&] {
              sqlite3* database = nullptr;
              sqlite3_open(other.c_str(), &database);
              sqlite3_exec(database,
                           "PRAGMA journal_mode=DELETE; PRAGMA cache_size=1; BEGIN; UPDATE views "
                           "SET signature = zeroblob(3000)",
                           nullptr, nullptr, nullptr);
              std::_Exit(0);
              return 0;
            })),
            0);
  ASSERT_GT(std::filesystem::file_size(other.string() + "-journal"), 512U);
  std::filesystem::rename(other.string() + "-journal", beside("-journal"));
  expect_refused(backup, "-journal");
}

TEST_F(LogBesideAFile, OfAKilledWriterIsItsOwn) {
  append_and_die(path, 3, 4);
  EXPECT_EQ(MemoryFile::open(path, Access::read_only).load().size(), 7U);
  append_and_die(path, 7, 4);
  // The file as it was when the log began is the file that the log belongs to, on another inode
  // too.
  const std::string now = bytes_of(path);
  std::filesystem::remove(path);
  folder.write("m.panonav", now);
  const MemoryFile file = MemoryFile::open(path, Access::read_write);
  EXPECT_EQ(file.load().size(), 11U);
  EXPECT_TRUE(file.verify().empty());
}

// A writer may be killed while its log goes into the file, page by page.
TEST_F(LogBesideAFile, IsItsOwnWhileItGoesIntoTheFile) {
  append_and_die(path, 3, 150);
  const std::string log = bytes_of(beside("-wal"));
  const std::string before = bytes_of(path);
  { ASSERT_EQ(MemoryFile::open(path, Access::read_only).load().size(), 153U); }
  const std::string after = bytes_of(path);
  constexpr std::size_t page_bytes = 8192;
  ASSERT_GT(after.size(), before.size() + page_bytes);
  ASSERT_FALSE(std::filesystem::exists(beside("-wal")));
  for (std::size_t written = 0; written <= after.size(); written += page_bytes) {
    std::string torn = after.substr(0, written);
    if (torn.size() < before.size()) torn += before.substr(torn.size());
    folder.write("m.panonav", torn);
    folder.write("m.panonav-wal", log);
    std::filesystem::remove(beside("-shm"));
    const MemoryFile file = MemoryFile::open(path, Access::read_only);
    ASSERT_EQ(file.load().size(), 153U) << written;
    ASSERT_TRUE(file.verify().empty());
  }
}

// A reader that opens the file in this process must not take this process's locks away, or another
// process that closes the file takes itself for the last one and removes the log.
TEST_F(LogBesideAFile, IsNotRemovedWhileItIsInUse) {
  MemoryFile writer = MemoryFile::open(path, Access::read_write);
  writer.append(numbered_view(small_header().shape, 3));
  { (void)MemoryFile::open(path, Access::read_only); }
  // Like another process: SQLite removes the log when no lock keeps it from it.
  EXPECT_EQ(exit_code_of(start_child([&] {
              sqlite3* database = nullptr;
              sqlite3_open(path.c_str(), &database);
              sqlite3_exec(database, "SELECT * FROM views", nullptr, nullptr, nullptr);
              return sqlite3_close(database);
            })),
            0);
  EXPECT_TRUE(std::filesystem::exists(beside("-wal")));
}

TEST_F(MemoryFileCrash, AFileThatIsTakenAwayIsNoticed) {
  const SignatureShape shape = small_header().shape;
  const auto refused = [&](const std::function<void()>& take_away) {
    std::filesystem::remove(path);
    MemoryFile file = MemoryFile::create(path, small_header());
    file.append(numbered_view(shape, 0));
    take_away();
    for (int number = 1; number < 3; ++number) {
      const auto message =
          message_of<FileError>([&] { file.append(numbered_view(shape, number)); });
      EXPECT_TRUE(contains(message, path.string() + ": was deleted, moved or replaced"));
    }
  };
  refused([&] { std::filesystem::remove(path); });
  for (const char* suffix : {"-wal", "-shm"}) std::filesystem::remove(path.string() + suffix);
  refused([&] {
    { (void)MemoryFile::create(folder / "other.panonav", small_header()); }
    std::filesystem::rename(folder / "other.panonav", path);
  });
  // The new file is what it was, and the log of the old one is not applied to it.
  for (const char* suffix : {"-wal", "-shm"}) std::filesystem::remove(path.string() + suffix);
  EXPECT_TRUE(MemoryFile::open(path, Access::read_only).load().empty());
}

TEST_F(MemoryFileCrash, ALeftTemporaryFileIsInNobodysWay) {
  { (void)MemoryFile::create(folder / "left", small_header()); }
  std::filesystem::rename(folder / "left", folder / ".m.panonav.tmp");
  folder.write(".m.panonav.tmp-journal", "left, too");
  { (void)MemoryFile::create(path, small_header()); }
  EXPECT_TRUE(MemoryFile::open(path, Access::read_only).verify().empty());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

// Without `change` the links are lost when the process is killed between the two.
TEST_F(MemoryFileCrash, ChangesInOneAreAllOrNothing) {
  const SignatureShape shape = small_header().shape;
  std::vector<ViewId> ids;
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    for (int number = 0; number < 4; ++number)
      ids.push_back(file.append(numbered_view(shape, number)));
    file.link(std::vector<Link>{{ids[0], ids[1], Link::Kind::sequence},
                                {ids[1], ids[2], Link::Kind::sequence}});
  }
  const auto prune = [&](MemoryFile& file, const std::function<void()>& between) {
    file.change([&] {
      file.remove(std::vector<ViewId>{ids[1]});
      between();
      file.link(std::vector<Link>{{ids[0], ids[2], Link::Kind::sequence}});
    });
  };
  const VisualMemory before = MemoryFile::open(path, Access::read_only).load();
  EXPECT_EQ(exit_code_of(start_child([&] {
              MemoryFile file = MemoryFile::open(path, Access::read_write);
              prune(file, [] { std::_Exit(7); });
              return 0;
            })),
            7);
  EXPECT_TRUE(same_content(MemoryFile::open(path, Access::read_only).load(), before));
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  EXPECT_THROW(prune(file, [] { throw ContractError("something", "wrong", "right"); }),
               ContractError);
  EXPECT_TRUE(same_content(file.load(), before));
  // A part that fails is taken back alone when the caller continues.
  file.change([&] {
    EXPECT_THROW(file.remove(std::vector<ViewId>{ids[3], ViewId{99}}), ContractError);
    file.set_parameter("note", "kept");
  });
  EXPECT_TRUE(same_content(file.load(), before));
  EXPECT_EQ(file.parameter("note"), "kept");
  prune(file, [] {});
  EXPECT_EQ(file.load().size(), 3U);
  EXPECT_EQ(file.links(), (std::vector<Link>{{ids[0], ids[2], Link::Kind::sequence}}));
  EXPECT_TRUE(file.verify().empty());
}

// A write beyond the limit fails as on a full disk.
TEST_F(MemoryFileCrash, AFullDiskLosesNothing) {
  MemoryHeader header = small_header();
  header.shape = {80, 15};
  header.panorama_columns = 512;
  { (void)MemoryFile::create(path, header); }
  constexpr rlim_t limit_bytes = 500000;
  const int appended = exit_code_of(start_child([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{limit_bytes, limit_bytes};
    if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) return 250;
    MemoryFile file = MemoryFile::open(path, Access::read_write);
    for (int number = 0; number < 200; ++number) {
      const std::string message =
          message_of<FileError>([&] { file.append(numbered_view(header.shape, number)); });
      if (message == "no error") continue;
      if (message.find(path.string() + ": cannot be ") != 0) return 251;
      if (message.find('\n') != std::string::npos) return 252;
      // The same object still reads what it had.
      return file.load().size() == static_cast<std::size_t>(number) ? number : 253;
    }
    return 254;
  }));
  ASSERT_GE(appended, 10);
  ASSERT_LT(appended, 200);

  MemoryFile file = MemoryFile::open(path, Access::read_write);
  EXPECT_TRUE(file.verify().empty());
  const VisualMemory memory = file.load();
  ASSERT_EQ(memory.size(), static_cast<std::size_t>(appended));
  for (int number = 0; number < appended; ++number) {
    const NewView expected = numbered_view(header.shape, number);
    const auto view = memory.find(expected.info.name);
    ASSERT_TRUE(view);
    EXPECT_EQ(memory.packed(*view), expected.signature);
  }
  // With room again the work continues.
  EXPECT_GT(file.append(numbered_view(header.shape, appended)), memory.views().back());
}

TEST_F(MemoryFileCrash, AFullDiskWhileCreatingLeavesNothing) {
  EXPECT_EQ(exit_code_of(start_child([&] {
              ::signal(SIGXFSZ, SIG_IGN);
              const rlimit limit{20000, 20000};
              if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) return 1;
              const auto message =
                  message_of<FileError>([&] { MemoryFile::create(path, small_header()); });
              return message == "no error" ? 2 : 0;
            })),
            0);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST_F(MemoryFileCrash, AFullDiskDoesNotKeepAMemoryFromBeingRead) {
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    file.append(numbered_view(small_header().shape, 0));
  }
  EXPECT_EQ(exit_code_of(start_child([&] {
              ::signal(SIGXFSZ, SIG_IGN);
              const rlimit limit{0, 0};
              if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) return 1;
              return MemoryFile::open(path, Access::read_only).load().size() == 1 ? 0 : 2;
            })),
            0);
}

// Runs `body` without the rights of the superuser, for whom no file is read-only.
int as_ordinary_user(const std::function<int()>& body) {
  return exit_code_of(start_child([&] {
    if (::geteuid() == 0) {
      constexpr uid_t nobody = 65534;
      if (::setgid(nobody) != 0 || ::setuid(nobody) != 0) return 98;
    }
    return body();
  }));
}

class ReadOnlyMemoryFile : public MemoryFileTest {
 protected:
  void SetUp() override {
    MemoryFile file = MemoryFile::create(path, small_header());
    for (int number = 0; number < 5; ++number) {
      file.append(numbered_view(small_header().shape, number));
    }
  }
  // Rights of an ordinary user: 0 reads all and is refused to change.
  [[nodiscard]] int read_and_try_to_change() const {
    return as_ordinary_user([&] {
      {
        const MemoryFile file = MemoryFile::open(path, Access::read_only);
        if (file.load().size() != 5 || !file.verify().empty()) return 1;
        if (file.info().views != 5) return 2;
      }
      const std::string message =
          message_of<FileError>([&] { (void)MemoryFile::open(path, Access::read_write); });
      return message.find("no permission to write") != std::string::npos ? 0 : 3;
    });
  }
  void set_permissions(const std::filesystem::path& what, unsigned mode) const {
    std::filesystem::permissions(what, static_cast<std::filesystem::perms>(mode));
  }
};

TEST_F(ReadOnlyMemoryFile, FileAndFolderReadOnly) {
  set_permissions(path, 0444);
  set_permissions(folder.path(), 0555);
  EXPECT_EQ(read_and_try_to_change(), 0);
}

TEST_F(ReadOnlyMemoryFile, FolderReadOnly) {
  set_permissions(path, 0666);
  set_permissions(folder.path(), 0555);
  EXPECT_EQ(read_and_try_to_change(), 0);
}

TEST_F(ReadOnlyMemoryFile, FileReadOnly) {
  set_permissions(path, 0444);
  set_permissions(folder.path(), 0777);
  EXPECT_EQ(read_and_try_to_change(), 0);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST_F(ReadOnlyMemoryFile, BesideARunningWriter) {
  const MemoryFile writer = MemoryFile::open(path, Access::read_write);
  MemoryFile(MemoryFile::open(path, Access::read_write))
      .set_parameter("written", "while others read");
  set_permissions(folder.path(), 0555);
  for (const char* suffix : {"", "-wal", "-shm"}) {
    set_permissions(path.string() + suffix, 0444);
  }
  EXPECT_EQ(
      as_ordinary_user([&] {
        const MemoryFile file = MemoryFile::open(path, Access::read_only);
        return file.parameter("written") == "while others read" && file.load().size() == 5 ? 0 : 1;
      }),
      0);
}

// A writer was killed and its log lies beside the file: without permission to write, what the log
// says cannot be read, and must not be left out silently either.
TEST_F(ReadOnlyMemoryFile, WithTheLogOfAKilledWriter) {
  const int code = exit_code_of(start_child([&] {
    MemoryFile file = MemoryFile::open(path, Access::read_write);
    file.append(numbered_view(small_header().shape, 5));
    std::_Exit(0);  // without closing
    return 0;
  }));
  ASSERT_EQ(code, 0);
  ASSERT_GT(std::filesystem::file_size(path.string() + "-wal"), 0U);
  std::filesystem::remove(path.string() + "-shm");
  set_permissions(folder.path(), 0555);
  EXPECT_EQ(
      as_ordinary_user([&] {
        const auto message =
            message_of<FileError>([&] { (void)MemoryFile::open(path, Access::read_only); });
        return message.find("open the file once with that permission") != std::string::npos ? 0 : 1;
      }),
      0);
  set_permissions(folder.path(), 0777);
  EXPECT_EQ(MemoryFile::open(path, Access::read_only).load().size(), 6U);
}

TEST_F(ReadOnlyMemoryFile, CreatingNeedsPermission) {
  set_permissions(folder.path(), 0555);
  EXPECT_EQ(as_ordinary_user([&] {
              const auto message = message_of<FileError>(
                  [&] { (void)MemoryFile::create(folder / "new.panonav", small_header()); });
              return message.find("no permission to write in") != std::string::npos ? 0 : 1;
            }),
            0);
}

}  // namespace
}  // namespace panonav::testing
