// Synchronisation while processes are killed, answers are lost, disks are full and memories are
// other ones.
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <limits>

#include "fleet/synchronised_memory.hpp"
#include "panonav/core/error.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_scheme.hpp"
#include "panonav_fleet/internal/postgresql_connection.hpp"
#include "panonav_fleet/internal/server_address.hpp"
#include "support/child_process.hpp"

namespace panonav::fleet {
namespace {

TEST_F(SynchronisedMemory, AKillAtAnyMomentLosesAndDoublesNothing) {
  share({"a", "b"}, 10);
  Random random(8);
  int next = 100;
  int kills = 0;
  double duration_s = 0.02;  // of the latest whole synchronisation
  std::set<std::string> expected = names(folder / "a");
  // At a random moment within 1.5 times that duration two of three kills come in time; rounds go on
  // where the machine was busy meanwhile.
  constexpr int min_rounds = 24;
  constexpr int max_rounds = 120;
  constexpr int min_kills = 7;
  for (int round = 0; round < min_rounds || (kills < min_kills && round < max_rounds); ++round) {
    {
      MemoryFile file = open("a");
      for (const NewView& view : numbered(next, 30)) expected.insert(view.info.name);
      file.append(numbered(next, 30));
      next += 30;
      const auto views = file.views();
      file.set_pose(views[random.index(views.size())],
                    ReferencePose{0.1 * round, 0.0, std::nullopt});
      const ViewId gone = views[random.index(views.size())];
      expected.erase(file.load(std::vector{gone}).info(gone).name);
      file.remove(std::vector{gone});
    }
    const pid_t child = start_child([&] {
      (void)sync("a");
      return 0;
    });
    ASSERT_GT(child, 0);
    ::usleep(static_cast<useconds_t>(1e6 * random.uniform(0.0, 1.5 * duration_s)));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    kills += WIFSIGNALED(status) ? 1 : 0;
    if (WIFEXITED(status)) {
      ASSERT_EQ(WEXITSTATUS(status), 0);
    }
    if (round % 4 == 3) {
      const SynchronisationReport whole = sync("a");
      duration_s = whole.seconds;
      ASSERT_EQ(whole.conflicts, 0U);
      ASSERT_EQ(names(folder / "a"), expected);
    }
  }
  EXPECT_GE(kills, min_kills);
  (void)sync("b");
  EXPECT_EQ(names(server("x")), expected);
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "b")));
}

// A contributor of the server inserts rows that no program of ours writes, with right checksums.
TEST_F(SynchronisedMemory, BadRowsOfOthersAreLeftOutAndNamed) {
  share({"a", "b"}, 6);
  PostgresqlConnection connection(parse_server_address(server("x")));
  const auto insert = [&](const std::string& name, const ReferencePose& pose, int number) {
    const PostgresqlRows row = connection.run(
        "UPDATE panonav.memories SET last_view = last_view + 1 WHERE name = $1 "
        "RETURNING id, last_view",
        PostgresqlValues().add(std::string_view(memory_name(server("x")))));
    const ViewId id{static_cast<std::uint32_t>(row.integer(0, 1))};
    NewView view = numbered(number);
    view.info.name = name;
    view.info.pose = pose;
    std::vector<std::uint8_t> signature = view.signature.magnitudes;
    signature.insert(signature.end(), view.signature.phases.begin(), view.signature.phases.end());
    RecordBytes record;
    record.add(std::int64_t{id.value});
    record.add(std::string_view(name));
    record.add(pose.x_m);
    record.add(pose.y_m);
    record.add(pose.heading_rad);
    record.add(view.info.stamp_s);
    PostgresqlValues values;
    values.add(row.integer(0, 0)).add(std::int64_t{id.value}).add(std::string_view(name));
    values.add(std::optional(pose.x_m)).add(std::optional(pose.y_m));
    values.add(view.info.stamp_s).add(std::span<const std::uint8_t>(signature));
    values.add(static_cast<std::int64_t>(checksum(signature, checksum(record.bytes()))));
    (void)connection.run(
        "INSERT INTO panonav.views(memory, id, name, x_m, y_m, stamp_s, signature, checksum) "
        "VALUES($1, $2, $3, $4, $5, $6, $7, $8)",
        values);
    return id;
  };
  const ReferencePose nowhere{std::numeric_limits<double>::quiet_NaN(), 0.0, std::nullopt};
  const ReferencePose beyond{0.0, 1e9, std::nullopt};
  // The server's own constraints refuse them; a stranger's server has none.
  EXPECT_THROW((void)insert("nowhere", nowhere, 901), FileError);
  EXPECT_THROW((void)insert("beyond", beyond, 902), FileError);
  connection.execute(
      "ALTER TABLE panonav.views DROP CONSTRAINT views_x_m_check, DROP CONSTRAINT views_y_m_check");
  (void)insert("nowhere", nowhere, 901);
  (void)insert("beyond", beyond, 902);
  const ViewId good = insert("good", {1.0, 2.0, std::nullopt}, 903);
  connection.execute(
      "INSERT INTO panonav.links SELECT id, 1, 3, 0, 5 FROM panonav.memories WHERE name = '" +
      memory_name(server("x")) + "'");

  std::set<std::string> said;
  set_skipped_row_handler(
      [&](const auto&, const MemoryFile::Fault& row) { said.insert(row.what); });
  open("a").append(numbered(60));
  for (const char* robot : {"a", "b"}) {
    said.clear();
    const SynchronisationReport report = sync(robot);
    EXPECT_EQ(report.views, 8U);
    EXPECT_GE(said.size(), 3U);
    for (const char* part : {"pose x_m is nan", "pose y_m is 1e+09", "the link of views"}) {
      EXPECT_TRUE(std::ranges::any_of(said, [&](const std::string& line) {
        return contains(line, part);
      })) << part;
    }
    const MemoryFile file = open(robot);
    EXPECT_TRUE(file.verify().empty());
    EXPECT_TRUE(file.load().find("good"));
    EXPECT_TRUE(file.find("view_60.png"));
    EXPECT_FALSE(file.find("nowhere"));
    EXPECT_FALSE(file.find("beyond"));
  }
  set_skipped_row_handler({});
  // The memory on the server is used without them, and copied; verify names them.
  const MemoryFile there = on_server();
  EXPECT_EQ(there.load().size(), 8U);
  EXPECT_TRUE(there.load().contains(good));
  EXPECT_GE(there.left_out().size(), 3U);
  EXPECT_GE(there.verify().size(), 3U);
  there.copy_to(folder / "copy");
  EXPECT_EQ(MemoryFile::open(folder / "copy", Access::read_only).load().size(), 8U);
  EXPECT_TRUE(MemoryFile::open(folder / "copy", Access::read_only).verify().empty());
  // Others must find the server as it was.
  connection.execute("DELETE FROM panonav.views WHERE name IN ('nowhere', 'beyond')");
  connection.execute(
      "ALTER TABLE panonav.views ADD CHECK (x_m BETWEEN -1e7 AND 1e7), "
      "ADD CHECK (y_m BETWEEN -1e7 AND 1e7)");
}

// Nobody knows what a bad row on a server held: files keep what they have.
TEST_F(SynchronisedMemory, ABadLinkOnTheServerErasesNoLinkOfAFile) {
  share({"a"}, 4);
  open("a").link(std::vector<Link>{{ViewId{1}, ViewId{2}, Link::Kind::sequence},
                                   {ViewId{2}, ViewId{3}, Link::Kind::closure}});
  (void)sync("a");
  (void)sync("b");
  const auto whole = content(folder / "a");
  PostgresqlConnection connection(parse_server_address(server("x")));
  const std::string of_memory = " WHERE memory = (SELECT id FROM panonav.memories WHERE name = '" +
                                memory_name(server("x")) + "')";
  const PostgresqlRows row = connection.run("SELECT min(a) FROM panonav.links" + of_memory);
  const std::string of_first = of_memory + " AND a = " + std::to_string(row.integer(0, 0));
  connection.execute("UPDATE panonav.links SET checksum = checksum + 1" + of_first);
  for (const char* robot : {"a", "b"}) {
    (void)sync(robot);
    EXPECT_TRUE(is_same(content(folder / robot), whole)) << robot;
  }
  // A link that is removed there, goes.
  connection.execute("DELETE FROM panonav.links" + of_first);
  (void)sync("b");
  EXPECT_EQ(open("b").links().size(), 1U);
}

// A curator may write any row that is kept for undo; whoever undoes it may have more rights.
TEST_F(SynchronisedMemory, UndoChangesNoOtherTableOnTheServer) {
  share({"a"}, 4);
  MemoryFile there = on_server();
  there.change([&] { there.remove(std::vector{ViewId{1}}); }, "forget");
  PostgresqlConnection connection(parse_server_address(server("x")));
  connection.execute(
      "INSERT INTO panonav.undo_rows(memory, relation, before) SELECT id, 'members', "
      "'(evil,north)' "
      "FROM panonav.memories WHERE name = '" +
      memory_name(server("x")) + "'");
  const std::string message = message_of<FileError>([&] { there.undo(); });
  EXPECT_TRUE(contains(message, "members")) << message;
  EXPECT_EQ(
      connection.run("SELECT count(*) FROM panonav.members WHERE login = 'evil'").integer(0, 0), 0);
  connection.execute("DELETE FROM panonav.undo_rows WHERE relation = 'members'");
  there.undo();
  EXPECT_EQ(there.views().size(), 4U);
}

// The acknowledgement was lost, and the view changed, or was removed, before the next time.
TEST_F(SynchronisedMemory, WhatChangedAfterALostAnswerIsNoConflict) {
  share({"a"}, 10);
  {
    MemoryFile file = open("a");
    file.set_pose(ViewId{2}, ReferencePose{1.0, 0.0, 0.0});
    file.append(std::vector{numbered(50), numbered(51)});
  }
  // The file as it was when the views were sent: with the marks, without the answer.
  std::filesystem::path kept = folder / "kept";
  const int calls_before = static_cast<int>(on_server().views().size());
  bool stopped = false;
  try {
    (void)synchronise_memory(folder / "a", server("a"), {}, [&](std::size_t) {
      // The first view is acknowledged: what the file holds now is what a kill would leave.
      if (stopped) return;
      stopped = true;
      throw std::runtime_error("killed");
    });
  } catch (const std::runtime_error&) {
  }
  ASSERT_TRUE(stopped);
  ASSERT_EQ(on_server().views().size(), static_cast<std::size_t>(calls_before) + 2);
  std::filesystem::copy_file(folder / "a", kept);
  {
    MemoryFile file = open("a");
    file.set_pose(file.find("view_50.png").value(), ReferencePose{8.0, 8.0, 0.0});
    file.remove(std::vector{file.find("view_51.png").value()});
  }
  const SynchronisationReport next = sync("a");
  EXPECT_EQ(next.conflicts, 0U);
  EXPECT_EQ(next.uploaded, 0U);
  EXPECT_EQ(next.updated_on_server, 2U);  // views 2 and 50
  EXPECT_EQ(next.removed_on_server, 1U);
  const auto there = content(server("x"));
  EXPECT_EQ(there.at("view_50.png").info.pose->x_m, 8.0);
  EXPECT_FALSE(there.contains("view_51.png"));
  EXPECT_TRUE(is_same(content(folder / "a"), there));
  // The same robot with the file of before: nothing is doubled or brought back.
  std::filesystem::rename(kept, folder / "a");
  const SynchronisationReport old = sync("a");
  EXPECT_EQ(old.uploaded, 0U);
  EXPECT_TRUE(is_same(content(folder / "a"), there));
}

TEST_F(SynchronisedMemory, OthersRemoveWhatWasNotAcknowledged) {
  share({"a", "b"}, 4);
  open("a").append(numbered(60));
  bool stopped = false;
  EXPECT_THROW((void)synchronise_memory(folder / "a", server("a"), {},
                                        [&](std::size_t) {
                                          stopped = true;
                                          throw std::runtime_error("killed");
                                        }),
               std::runtime_error);
  ASSERT_TRUE(stopped);
  (void)sync("b");
  {
    MemoryFile file = open("b");
    file.remove(std::vector{file.find("view_60.png").value()});
  }
  (void)sync("b");
  const SynchronisationReport next = sync("a");
  EXPECT_EQ(next.uploaded, 0U);
  EXPECT_EQ(next.removed_in_file, 1U);
  EXPECT_FALSE(names(server("x")).contains("view_60.png"));
}

TEST_F(SynchronisedMemory, OtherMemoriesAndHeadersAreRefused) {
  share({"a"}, 4);
  const std::string before = bytes_of(folder / "a");
  const auto refused = [&](const std::string& robot, const std::string& address,
                           const std::string& saying) {
    const std::string message =
        message_of<Error>([&] { (void)synchronise_memory(folder / robot, address); });
    EXPECT_TRUE(contains(message, saying)) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  };
  const std::string other = std::string(std::getenv("PANONAV_TEST_SERVER")) +
                            "&memory=" + folder.path().filename().string() + "other";
  (void)MemoryFile::create(other, small_header());
  refused("a", other, "was synchronised with a memory other than");
  EXPECT_EQ(MemoryFile::open(other, Access::read_only).views().size(), 0U);
  EXPECT_EQ(open("a").views().size(), 4U);
  MemoryHeader coarser = small_header();
  coarser.full_scale = 0.25F;
  (void)MemoryFile::create(folder / "scale", coarser);
  refused("scale", server("x"), "full scale");
  MemoryHeader shorter = small_header();
  shorter.shape.rows = 5;
  (void)MemoryFile::create(folder / "shape", shorter);
  refused("shape", server("x"), "rows and components");
  MemoryHeader other_steps = small_header();
  other_steps.preprocessing.normalise_gain = false;
  (void)MemoryFile::create(folder / "steps", other_steps);
  refused("steps", server("x"), "preprocessing");
  folder.write("noise", std::string(5000, 'x'));
  refused("noise", server("x"), "is not a memory file");
  refused("absent", server("x") + "&memory=nothing", "no memory 'nothing'");
  EXPECT_FALSE(std::filesystem::exists(folder / "absent"));
  EXPECT_EQ(on_server().views().size(), 4U);
}

TEST_F(SynchronisedMemory, AFullDiskOfTheFileLosesNothing) {
  share({"a"}, 10);
  (void)sync("b");
  open("a").append(numbered(100, 600));
  (void)sync("a");
  const auto all = content(folder / "a");
  const pid_t child = start_child([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    constexpr rlim_t limit_bytes = 120000;
    const rlimit limit{limit_bytes, limit_bytes};
    if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) return 250;
    const std::string message = message_of<FileError>([&] { (void)sync("b"); });
    return message.find((folder / "b").string() + ": cannot be ") == 0 ? 7 : 251;
  });
  EXPECT_EQ(exit_code_of(child), 7);
  EXPECT_TRUE(open("b").verify().empty());
  (void)sync("b");
  EXPECT_TRUE(is_same(content(folder / "b"), all));
}

/// The robot that bench/synchronise_faults.py starts, kills and counts: changes its file, tells
/// each change before and after it was made, and synchronises now and then, for ever or for
/// PANONAV_TEST_STEPS steps; with -1 it synchronises once.
TEST_F(SynchronisedMemory, ARobotWorksUntilItIsKilled) {
  const char* file_path = std::getenv("PANONAV_TEST_ROBOT");
  if (file_path == nullptr) GTEST_SKIP() << "no PANONAV_TEST_ROBOT";
  const auto setting = [](const char* name) { return std::string(std::getenv(name)); };
  const std::string address = setting("PANONAV_TEST_SERVER");
  const std::string robot = setting("PANONAV_TEST_NAME");
  int next = std::stoi(setting("PANONAV_TEST_FIRST"));  // numbers of views that nobody had
  const int steps = std::stoi(setting("PANONAV_TEST_STEPS"));
  Random random(static_cast<std::uint64_t>(next));
  const auto say = [](const auto&... words) {
    ((std::cout << words << ' '), ...);
    std::cout << std::endl;
  };
  const auto to_string = [](const PackedSignature& signature) {
    return checksum(signature.magnitudes, checksum(signature.phases));
  };
  const auto synchronise = [&] {
    try {
      const auto report = synchronise_memory(file_path, address);
      const std::size_t others = report.adopted + report.updated_on_server +
                                 report.updated_in_file + report.removed_on_server +
                                 report.removed_in_file + report.renamed + report.links_uploaded +
                                 report.links_downloaded;
      say("synchronised", report.seconds, report.uploaded, report.downloaded, report.conflicts,
          others);
    } catch (const FileError& error) {
      say("refused", error.what());
    }
  };
  if (!std::filesystem::exists(file_path)) synchronise();
  if (!std::filesystem::exists(file_path) && robot == "0") {
    (void)MemoryFile::create(file_path, small_header());
  }
  if (steps < 0) synchronise();
  for (int step = 0; steps == 0 || step < steps; ++step) {
    try {
      MemoryFile file = MemoryFile::open(file_path, Access::read_write);
      const auto add = [&] {
        const int number = next++;
        NewView view = named("r" + robot + "_" + std::to_string(number), number);
        if (random.index(10) == 0) view.info.name = "door_" + std::to_string(random.index(10));
        if (file.find(view.info.name)) view.info.name += "_" + std::to_string(number);
        // The clock may be wrong: only people look at it.
        view.info.stamp_s =
            std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch())
                .count();
        say("adding", to_string(view.signature));
        file.append(view);
        return to_string(view.signature);
      };
      const std::vector<ViewId> views = file.views();
      const auto any = [&] { return views[random.index(views.size())]; };
      const auto identify = [&](ViewId view) {
        return to_string(file.load(std::vector{view}).packed(view));
      };
      const std::uint64_t kind = views.size() < 5 ? 0 : random.index(20);
      if (kind < 12) {
        for (std::uint64_t i = random.index(3) + 1; i > 0; --i) say("added", add());
      } else if (kind < 15) {
        const ViewId view = any();
        const auto which = identify(view);
        const double x_m = next++;
        say("moving", which, x_m);
        file.set_pose(view, ReferencePose{x_m, 0.0, std::nullopt});
        say("moved", which, x_m);
      } else if (kind == 15) {
        const ViewId view = any();
        const auto which = identify(view);
        say("removing", which);
        file.remove(std::vector{view});
        say("removed", which);
      } else if (kind == 16) {
        const ViewId view = any();
        const auto which = identify(view);
        say("removing", which);
        std::uint64_t instead = 0;
        file.change(
            [&] {
              file.remove(std::vector{view});
              instead = add();
            },
            "learnt");
        say("removed", which);
        say("added", instead);
      } else {
        const ViewId a = any();
        const ViewId b = any();
        if (a != b) file.link(std::vector<Link>{{a, b, Link::Kind(random.index(3))}});
      }
    } catch (const FileError& error) {
      say("refused", error.what());
    }
    if (random.index(3) == 0 || step + 1 == steps) synchronise();
    ::usleep(static_cast<useconds_t>(random.uniform(0.0, 4e5)));
  }
}

/// Tells bench/synchronise_faults.py what a memory holds.
TEST_F(SynchronisedMemory, AMemoryIsTold) {
  const char* memory = std::getenv("PANONAV_TEST_TOLD");
  if (memory == nullptr) GTEST_SKIP() << "no PANONAV_TEST_TOLD";
  for (const auto& [name, seen] : content(memory)) {
    std::cout << "view\t" << name << '\t'
              << checksum(seen.signature.magnitudes, checksum(seen.signature.phases)) << '\t'
              << (seen.info.pose ? seen.info.pose->x_m : -1.0) << '\t'
              << seen.info.stamp_s.value_or(-1.0) << '\t' << seen.thumbnail.has_value()
              << seen.features.has_value();
    for (const auto& [other, kind] : seen.links) std::cout << '\t' << other << ':' << kind;
    std::cout << '\n';
  }
}

}  // namespace
}  // namespace panonav::fleet
