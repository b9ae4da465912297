// Every verb that changes a memory is killed at random moments. PANONAV_KILLS says how often each;
// without it a few times. tools/kill_verbs runs it with 84 and prints the table.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <set>
#include <thread>

#include "panonav/core/random.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/child_process.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// Everything that a memory holds but the time when it was made, the times of the pictures' files
/// and what can be undone.
std::string content_of(const fs::path& memory) {
  sqlite3* database = nullptr;
  EXPECT_EQ(sqlite3_open(memory.c_str(), &database), SQLITE_OK);
  std::string text;
  const auto append = [](void* to, int columns, char** row, char**) {
    for (int i = 0; i < columns; ++i) *static_cast<std::string*>(to) += std::string(row[i]) + "|";
    return 0;
  };
  EXPECT_EQ(sqlite3_exec(
                database,
                "SELECT id, name, quote(x_m), quote(y_m), quote(heading_rad), quote(stamp_s), "
                "hex(signature), checksum FROM views ORDER BY id;SELECT part, "
                "hex(bytes), quote(checksum) FROM thumbnails ORDER BY part;SELECT a, b, kind, "
                "checksum FROM links "
                "ORDER BY a, b;SELECT name, hex(nodes), hex(edges), checksum FROM maps ORDER BY "
                "name;SELECT name, columns, lines, checksum FROM routes ORDER BY name;SELECT "
                "route, number, hex(lines), checksum FROM route_blocks ORDER BY 1, 2;SELECT key, "
                "quote(value), checksum FROM settings WHERE key NOT IN ('created_s', "
                "'parameter.recordings') ORDER BY key",
                append, &text, nullptr),
            SQLITE_OK)
      << sqlite3_errmsg(database);
  sqlite3_close(database);
  return text;
}

/// Names of views and lines of routes: what commands report as the memory's content.
std::set<std::string> acknowledged_in(const fs::path& memory) {
  std::set<std::string> held;
  if (!fs::exists(memory)) return held;
  const MemoryFile file = MemoryFile::open(memory, Access::read_only);
  for (auto& name : file.names()) held.insert(std::move(name));
  for (const auto& name : file.route_names()) {
    const auto route = file.route(name);
    for (std::size_t i = 0; route && i < route->size(); ++i) {
      held.insert(name + " line " + std::to_string(i));
    }
  }
  return held;
}

/// Starts the command with standard error in the file `messages`.
pid_t start(const std::vector<std::string>& arguments, const fs::path& messages = "/dev/null") {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::dup2(::open("/dev/null", O_RDWR), STDOUT_FILENO);
  ::dup2(::open(messages.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
  std::vector<std::string> words = with({PANONAV_COMMAND}, arguments);
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  ::execv(argv.front(), argv.data());
  ::_exit(127);
}

int number_of_kills() {
  const char* text = std::getenv("PANONAV_KILLS");
  return text == nullptr ? 3 : std::atoi(text);
}

class Kill : public ::testing::Test {
 protected:
  void SetUp() override {
    // A round and a quarter.
    std::vector<Pose2> poses;
    for (int i = 0; i < 150; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / 120.0;
      poses.push_back({2.0 + 1.2 * std::sin(angle), 2.0 - 1.2 * std::cos(angle), 0.0});
    }
    write_dataset(run(), landmark_world(3), poses);
    // The same pictures without positions, so that the map's become theirs.
    fs::copy(run(), bare());
    std::string list = "file\n";
    for (std::size_t i = 0; i < poses.size(); ++i) list += view_name(i) + "\n";
    write_file(bare() / "list.csv", std::string_view(list));
    std::string toml;
    for (const auto& line : lines(bytes_of(bare() / "dataset.toml"))) {
      toml += line == "[poses]"                ? "[list]"
              : line == "file = \"poses.csv\"" ? "file = \"list.csv\""
                                               : line;
      toml += "\n";
    }
    write_file(bare() / "dataset.toml", std::string_view(toml));
  }
  void TearDown() override {
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path();
    }
  }
  [[nodiscard]] fs::path run() const { return folder_ / "run"; }
  [[nodiscard]] fs::path bare() const { return folder_ / "bare"; }

  /// The words of a verb, then the memory, then the arguments `after` it; `base`: the memory that
  /// it changes, empty: none. `whole`: the verb's changes are one transaction. `repeats`: run
  /// again, it makes what a run that nobody killed makes.
  void kill_at_random(const std::vector<std::string>& words, const std::vector<std::string>& after,
                      const fs::path& base, bool whole, bool repeats = true) {
    const std::string verb = words.front() == "route" ? "route record" : words.front();
    const fs::path memory = folder_ / "m.panonav";
    const auto arguments = with(with(words, {memory}), after);
    const auto restore = [&] {
      for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(memory.string() + suffix);
      if (!base.empty()) fs::copy(base, memory);
    };
    restore();
    const auto begin = Clock::now();
    run_well(arguments);
    auto duration = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - begin);
    const std::string expected = content_of(memory);
    const std::string unchanged = base.empty() ? "" : content_of(base);
    ASSERT_TRUE(expected != unchanged) << "the verb does nothing";

    const std::uint64_t seed = 17;
    Random random(seed);
    const int kills = number_of_kills();
    int killed = 0, untouched = 0, partly = 0, complete = 0, lost = 0, faults = 0, different = 0;
    for (int round = 0; killed < kills && round < 4 * kills; ++round) {
      SCOPED_TRACE(verb + ", round " + std::to_string(round));
      restore();
      const pid_t child = start(arguments);
      ASSERT_GT(child, 0);
      std::this_thread::sleep_for(
          std::chrono::microseconds(random.index(static_cast<std::size_t>(duration.count()))));
      std::set<std::string> acknowledged;
      if (whole && !base.empty()) {
        // The earlier file is either still there or was dropped with all the rest.
      } else if (round % 2 == 0) {
        acknowledged = acknowledged_in(memory);
      }
      ::kill(child, SIGKILL);
      int status = 0;
      ASSERT_EQ(::waitpid(child, &status, 0), child);
      if (!WIFSIGNALED(status)) {
        // On a busy machine the first run took longer than others do.
        EXPECT_EQ(WEXITSTATUS(status), 0);
        duration = std::max(duration * 3 / 4, std::chrono::microseconds(1));
        continue;
      }
      ++killed;

      const bool there = fs::exists(memory);
      if (there) {
        const auto verified = run_panonav({"verify", memory});
        EXPECT_EQ(verified.exit_code, 0) << verified.err;
        faults += verified.exit_code != 0;
      }
      const auto held = acknowledged_in(memory);
      const bool none_lost = std::ranges::includes(held, acknowledged);
      EXPECT_TRUE(none_lost);
      lost += !none_lost;
      const std::string left = there ? content_of(memory) : "";
      if (left == expected) {
        ++complete;
        continue;
      }
      const bool nothing_done = left == unchanged;
      untouched += nothing_done;
      partly += !nothing_done;
      EXPECT_TRUE(nothing_done || !whole) << "half of the change is there";
      const auto again = run_panonav(arguments);
      EXPECT_EQ(again.exit_code, 0) << again.err;
      const bool same = !repeats || content_of(memory) == expected;
      EXPECT_TRUE(same) << "running it again gives another memory";
      different += !same;
      EXPECT_FALSE(fs::exists(memory.string() + "-wal"));
    }
    EXPECT_EQ(killed, kills);
    std::printf("| %-12s | %5d | %9d | %6d | %8d | %4d | %13d | %9d |\n", verb.c_str(), killed,
                untouched, partly, complete, lost, faults, different);
  }

  /// A memory with links and a map.
  fs::path mapped() {
    const fs::path base = folder_ / "base.panonav";
    run_well({"map", base, run()});
    return base;
  }

  /// A memory of another drive through the same room, a little to the side.
  fs::path make_second() {
    std::vector<Pose2> poses;
    for (int i = 0; i < 40; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / 40.0;
      poses.push_back({2.0 + 1.1 * std::sin(angle), 2.0 - 1.1 * std::cos(angle), 0.0});
    }
    write_dataset(folder_ / "second", landmark_world(3), poses);
    const fs::path memory = folder_ / "second.panonav";
    run_well({"map", memory, folder_ / "second"});
    return memory;
  }

  TemporaryFolder folder_;
};

TEST_F(Kill, Memorise) {
  kill_at_random({"memorise"}, {run()}, {}, false);
}

TEST_F(Kill, Map) {
  kill_at_random({"map"}, {bare()}, {}, false);
}

TEST_F(Kill, RouteRecord) {
  kill_at_random({"route", "record"}, {run(), "--every-m", "0.05"}, {}, false);
}

TEST_F(Kill, Arrange) {
  const fs::path base = folder_ / "base.panonav";
  run_well({"memorise", base, run()});
  kill_at_random({"arrange"}, {}, base, true);
}

TEST_F(Kill, Forget) {
  kill_at_random({"forget"}, {view_name(3), view_name(4), view_name(70), view_name(149)}, mapped(),
                 true);
}

TEST_F(Kill, Rename) {
  kill_at_random({"rename"}, {view_name(3), "door"}, mapped(), true);
}

TEST_F(Kill, LocaliseUpdate) {
  const fs::path base = folder_ / "base.panonav";
  write_dataset(folder_ / "grid", landmark_world(3), grid_poses(6));
  run_well({"memorise", base, folder_ / "grid"});
  // Along y = 1 m, with something else in the middle.
  std::vector<Pose2> drive;
  for (int i = 0; i < 21; ++i) drive.push_back({0.125 * i, 1.05, 0.0});
  write_dataset(folder_ / "drive", landmark_world(3), drive);
  std::string csv = "file,odom_x_m,odom_y_m,odom_heading_deg\n";
  for (std::size_t i = 0; i < drive.size(); ++i) {
    if (i >= 9 && i < 13) {
      write_picture(folder_ / "drive" / view_name(i), landmark_world(9), drive[i]);
    }
    csv += view_name(i) + "," + to_text(drive[i].x_m) + "," + to_text(drive[i].y_m) + ",0\n";
  }
  write_file(folder_ / "drive" / "poses.csv", std::string_view(csv));
  kill_at_random({"localise"}, {folder_ / "drive", "--update"}, base, true);
}

TEST_F(Kill, Merge) {
  const fs::path second = make_second();
  kill_at_random({"merge", mapped(), second, "-o"}, {}, {}, true);
}

TEST_F(Kill, Copy) {
  kill_at_random({"copy", mapped()}, {}, {}, true);
}

TEST_F(Kill, Undo) {
  const fs::path base = mapped();
  run_well({"forget", base, view_name(3), view_name(70)});
  kill_at_random({"undo"}, {}, base, true);
}

TEST_F(Kill, LocaliseAdd) {
  // The views that it adds depend on those that it knows, so that a second run adds others.
  kill_at_random({"localise"}, {run(), "--add"}, {}, false, false);
}

// Ctrl-C says what is kept and how to continue, and the same command then does so.
TEST_F(Kill, InterruptionIsExplained) {
  struct Case {
    std::vector<std::string> arguments;
    fs::path begun;  // exists once the verb has begun to write
    std::string message;
  };
  const fs::path memory = folder_ / "m.panonav";
  const fs::path tried = folder_ / "tried";
  const std::vector<Case> cases = {
      {{"memorise", memory, run()},
       memory,
       "panonav memorise: interrupted. Views stored so far are kept. To continue, run the same "
       "command again.\n"},
      {{"try", run(), "-o", tried},
       tried / "run.panonav",
       "panonav try: interrupted. The page is not complete. To start over, run the same command "
       "again.\n"},
  };
  for (const Case& interrupted : cases) {
    SCOPED_TRACE(interrupted.arguments.front());
    bool was_interrupted = false;
    for (int round = 0; round < 20 && !was_interrupted; ++round) {
      fs::remove(memory);
      fs::remove_all(tried);
      const pid_t child = start(interrupted.arguments, folder_ / "messages");
      while (!fs::exists(interrupted.begun) && ::waitpid(child, nullptr, WNOHANG) == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      ::kill(child, SIGINT);
      int status = 0;
      was_interrupted = ::waitpid(child, &status, 0) == child && WIFSIGNALED(status);
      if (was_interrupted) {
        EXPECT_EQ(WTERMSIG(status), SIGINT);
      }
    }
    ASSERT_TRUE(was_interrupted) << "the verb ended before each signal";
    EXPECT_EQ(bytes_of(folder_ / "messages"), interrupted.message);
    const auto again = run_panonav(interrupted.arguments);
    EXPECT_EQ(again.exit_code, 0) << again.err;
  }
  EXPECT_TRUE(contains(bytes_of(tried / "index.html"), "Next commands"));
}

// One succeeds and the other is refused because the memory exists: neither replaces the other's.
TEST_F(Kill, TwoMergesAtOnce) {
  const std::vector<std::string> arguments = {"merge", mapped(), make_second(), "-o",
                                              folder_ / "m.panonav"};
  for (int round = 0; round < number_of_kills(); ++round) {
    fs::remove(folder_ / "m.panonav");
    const std::array children{start(arguments), start(arguments)};
    std::array exit_codes{exit_code_of(children[0]), exit_code_of(children[1])};
    std::ranges::sort(exit_codes);
    EXPECT_EQ(exit_codes, (std::array{0, 2}));
    run_well({"verify", folder_ / "m.panonav"});
  }
}

TEST_F(Kill, Prune) {
  kill_at_random({"prune"}, {"--max-difference", "0.05"}, mapped(), true);
}

}  // namespace
}  // namespace panonav::testing
