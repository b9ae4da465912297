// A robot's memory file and a memory on a PostgreSQL server, whose address is PANONAV_TEST_SERVER
// (tests/fleet/test_server.py starts one).
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <iostream>
#include <map>
#include <set>

#include "panonav/core/error.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_fleet/memory_changes.hpp"
#include "panonav_fleet/memory_synchronisation.hpp"
#include "support/child_process.hpp"
#include "support/memory_samples.hpp"

namespace panonav::fleet {
using namespace testing;
namespace {

TEST(MemoryAreas, AroundAPositionAreThoseThatTouchTheCircle) {
  EXPECT_EQ(areas_around(5.0, -5.0, 0.0), (std::vector<MemoryArea>{{0.0, -1.0}}));
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const double x_m = random.uniform(-50.0, 50.0);
    const double y_m = random.uniform(-50.0, 50.0);
    const double radius_m = random.uniform(0.0, 40.0);
    const auto areas = areas_around(x_m, y_m, radius_m);
    EXPECT_TRUE(std::ranges::is_sorted(areas));
    // Each position within the circle lies in one of them.
    for (int i = 0; i < 50; ++i) {
      const double angle_rad = random.uniform(0.0, 6.28);
      const double distance_m = radius_m * random.uniform();
      EXPECT_TRUE(std::ranges::binary_search(
          areas,
          area_of(x_m + distance_m * std::cos(angle_rad), y_m + distance_m * std::sin(angle_rad))));
    }
    // And none lies wholly beyond it.
    for (const MemoryArea& area : areas) {
      double nearest_m = 1e9;
      for (int i = 0; i <= 20; ++i) {
        for (int j = 0; j <= 20; ++j) {
          nearest_m = std::min(nearest_m, std::hypot(10.0 * area.column + 0.5 * i - x_m,
                                                     10.0 * area.row + 0.5 * j - y_m));
        }
      }
      EXPECT_LE(nearest_m, radius_m + 0.5);
    }
  }
  EXPECT_THROW((void)areas_around(0.0, 0.0, -1.0), ContractError);
  EXPECT_THROW((void)areas_around(0.0, 0.0, 1e6), ContractError);
  EXPECT_THROW((void)areas_around(std::nan(""), 0.0, 1.0), ContractError);
}

TEST(Synchronisation, PathsAndAddressesAreToldApart) {
  EXPECT_THROW((void)synchronise_memory("a.panonav", "b.panonav"), ContractError);
  EXPECT_THROW((void)synchronise_memory("postgresql:///d?memory=a", "postgresql:///d?memory=b"),
               ContractError);
}

/// What a view is, whatever its id.
struct Seen {
  ReferenceInfo info;
  PackedSignature signature;
  std::optional<std::vector<std::uint8_t>> thumbnail, features;
  std::set<std::pair<std::string, int>> links;  // name of the other end, kind
  friend bool operator==(const Seen&, const Seen&) = default;
};

std::map<std::string, Seen> content(const std::filesystem::path& path) {
  const MemoryFile file = MemoryFile::open(path, Access::read_only);
  EXPECT_TRUE(file.verify().empty());
  const VisualMemory memory = file.load();
  std::map<std::string, Seen> content;
  for (const ViewId view : memory.views()) {
    content[memory.info(view).name] = {
        memory.info(view), memory.packed(view), file.thumbnail(view), file.features(view), {}};
  }
  for (const Link& link : memory.links()) {
    const std::string& a = memory.info(link.a).name;
    const std::string& b = memory.info(link.b).name;
    content.at(a).links.emplace(b, static_cast<int>(link.kind));
    content.at(b).links.emplace(a, static_cast<int>(link.kind));
  }
  return content;
}

/// Which views differ.
::testing::AssertionResult is_same(const std::map<std::string, Seen>& a,
                                   const std::map<std::string, Seen>& b) {
  std::string different;
  for (const auto& [name, seen] : a) {
    const auto other = b.find(name);
    if (other == b.end() || !(other->second == seen)) different += " " + name;
  }
  for (const auto& [name, seen] : b) {
    if (!a.contains(name)) different += " " + name + " (only here)";
  }
  if (different.empty()) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "different:" << different;
}

std::set<std::string> names(const std::filesystem::path& path) {
  std::set<std::string> names;
  for (const auto& [name, seen] : content(path)) names.insert(name);
  return names;
}

class SynchronisedMemory : public InTemporaryFolder {
 protected:
  void SetUp() override {
    if (std::getenv("PANONAV_TEST_SERVER") == nullptr) GTEST_SKIP() << "no PANONAV_TEST_SERVER";
  }
  [[nodiscard]] std::string server(const std::string& robot) const {
    return std::string(std::getenv("PANONAV_TEST_SERVER")) +
           "&memory=" + folder.path().filename().string() + "&robot=" + robot;
  }
  SynchronisationReport sync(const std::string& robot,
                             const SynchronisationOptions& options = {}) const {
    return synchronise_memory(folder / robot, server(robot), options);
  }
  [[nodiscard]] MemoryFile open(const std::string& robot) const {
    return MemoryFile::open(folder / robot, Access::read_write);
  }
  [[nodiscard]] MemoryFile on_server() const {
    return MemoryFile::open(server("x"), Access::read_write);
  }
  /// A file with views of these numbers, uploaded, and the same in the files of these robots.
  void share(std::initializer_list<const char*> robots, int views) const {
    for (const char* robot : robots) {
      if (robot == *robots.begin()) {
        MemoryFile file = MemoryFile::create(folder / robot, small_header());
        file.append(numbered(0, views));
      }
      (void)sync(robot);
    }
  }
  static NewView numbered(int number) {
    Random random(41, static_cast<std::uint64_t>(number));
    NewView view = random_view(random, small_header().shape, number);
    if (number % 5 == 0) view.features = {4, 5, static_cast<std::uint8_t>(number % 256)};
    return view;
  }
  static std::vector<NewView> numbered(int first, int count) {
    std::vector<NewView> views;
    for (int i = first; i < first + count; ++i) views.push_back(numbered(i));
    return views;
  }
  static NewView named(const std::string& name, int number) {
    NewView view = numbered(number);
    view.info.name = name;
    return view;
  }
};

TEST_F(SynchronisedMemory, TakesAllThereIsAndThenNothing) {
  {
    MemoryFile file = MemoryFile::create(folder / "a", small_header());
    const auto ids = file.append(numbered(0, 700));  // several messages
    file.link(std::vector<Link>{{ids[0], ids[1], LinkKind::sequence},
                                {ids[5], ids[600], LinkKind::closure}});
    file.set_parameter("recordings", "1234");
  }
  const SynchronisationReport first = sync("a");
  EXPECT_EQ(first.uploaded, 700U);
  EXPECT_EQ(first.links_uploaded, 2U);
  EXPECT_EQ(first.views, 700U);
  EXPECT_EQ(first.downloaded + first.withheld + first.conflicts + first.renamed, 0U);
  const SynchronisationReport second = sync("b");  // which is made
  EXPECT_EQ(second.downloaded, 700U);
  EXPECT_EQ(second.links_downloaded, 2U);
  EXPECT_EQ(open("b").header(), small_header());
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "b")));
  EXPECT_TRUE(is_same(content(folder / "a"), content(server("x"))));
  for (const char* robot : {"a", "b", "a"}) {
    SynchronisationReport none = sync(robot);
    EXPECT_GT(none.seconds, 0.0);
    none.seconds = 0.0;
    SynchronisationReport expected;
    expected.views = 700;
    EXPECT_EQ(none, expected);
  }
  EXPECT_EQ(open("a").parameter("recordings"), "1234");
  EXPECT_EQ(open("b").parameter("recordings"), std::nullopt);
}

TEST_F(SynchronisedMemory, WhatOneDoesOthersGet) {
  share({"a", "b"}, 20);
  {
    MemoryFile file = open("a");
    file.set_parameter("recordings", "1");
    file.append(numbered(20, 3));
    file.set_pose(ViewId{2}, ReferencePose{1.0, 2.0, 0.5});
    file.rename(ViewId{3}, "the door");
    file.remove(std::vector{ViewId{5}, ViewId{6}});
    file.link(std::vector<Link>{{ViewId{1}, ViewId{21}, LinkKind::neighbour}});
  }
  const SynchronisationReport sent = sync("a");
  EXPECT_EQ(sent.uploaded, 3U);
  EXPECT_EQ(sent.updated_on_server, 2U);
  EXPECT_EQ(sent.removed_on_server, 2U);
  EXPECT_EQ(sent.links_uploaded, 1U);
  open("b").set_parameter("recordings", "2");
  const SynchronisationReport taken = sync("b");
  EXPECT_EQ(taken.downloaded, 3U);
  EXPECT_EQ(taken.updated_in_file, 2U);
  EXPECT_EQ(taken.removed_in_file, 2U);
  EXPECT_EQ(taken.links_downloaded, 1U);
  EXPECT_EQ(taken.conflicts, 0U);
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "b")));
  EXPECT_EQ(names(folder / "b").count("the door"), 1U);
  // Of what was removed or renamed a recording may bring views back: none counts as known.
  EXPECT_EQ(open("b").parameter("recordings"), "");
  // Links change and go, too.
  {
    MemoryFile file = open("b");
    const auto link = file.links().front();
    file.unlink(link.a, link.b);
  }
  EXPECT_EQ(sync("b").links_uploaded, 1U);
  EXPECT_EQ(sync("a").links_downloaded, 1U);
  EXPECT_TRUE(open("a").links().empty());
  // What was removed comes back by an undo, as a view of its own.
  {
    MemoryFile file = open("a");
    file.change([&] { file.remove(std::vector{ViewId{7}}); }, "forget");
  }
  (void)sync("a");
  EXPECT_EQ(sync("b").removed_in_file, 1U);
  open("a").undo();
  EXPECT_EQ(sync("a").uploaded, 1U);
  EXPECT_EQ(sync("b").downloaded, 1U);
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "b")));
}

TEST_F(SynchronisedMemory, WhatWasFirstHolds) {
  share({"a", "b"}, 12);
  const auto change = [&](const char* robot, double x_m) {
    MemoryFile file = open(robot);
    file.set_pose(file.find("view_1.png").value(), ReferencePose{x_m, 0.0, 0.0});
    return file;
  };
  change("b", 2.0).remove(std::vector{open("b").find("view_3.png").value()});
  {
    MemoryFile file = change("a", 1.0);
    file.set_pose(file.find("view_3.png").value(), ReferencePose{9.0, 9.0, 0.0});
    file.set_pose(file.find("view_4.png").value(), ReferencePose{4.0, 4.0, 0.0});
    file.remove(std::vector{file.find("view_5.png").value()});
  }
  {
    MemoryFile file = open("b");
    file.set_pose(file.find("view_4.png").value(), ReferencePose{4.0, 4.0, 0.0});  // the same
    file.set_pose(file.find("view_5.png").value(), ReferencePose{5.0, 5.0, 0.0});
  }
  EXPECT_EQ(sync("a").updated_on_server, 3U);
  const SynchronisationReport second = sync("b");
  EXPECT_EQ(second.conflicts, 2U);  // views 1 and 5
  EXPECT_EQ(second.removed_on_server, 1U);
  EXPECT_EQ(second.removed_in_file, 1U);
  EXPECT_EQ(second.updated_in_file, 1U);
  EXPECT_EQ(sync("a").removed_in_file, 1U);
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "b")));
  const auto now = content(folder / "a");
  EXPECT_EQ(now.at("view_1.png").info.pose->x_m, 1.0);
  EXPECT_FALSE(now.contains("view_3.png"));  // a removal wins over a change
  EXPECT_FALSE(now.contains("view_5.png"));
}

TEST_F(SynchronisedMemory, ReplacementsOfOneViewStandBesideEachOther) {
  share({"a", "b"}, 6);
  for (const char* robot : {"a", "b"}) {
    MemoryFile file = open(robot);
    file.change(
        [&] {
          file.remove(std::vector{file.find("view_1.png").value()});
          file.append(named("view_1 again", robot[0]));
        },
        "learnt");
  }
  (void)sync("a");
  const SynchronisationReport second = sync("b");
  EXPECT_EQ(second.renamed, 1U);
  EXPECT_EQ(second.uploaded, 1U);
  (void)sync("a");
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "b")));
  const auto now = content(folder / "a");
  EXPECT_FALSE(now.contains("view_1.png"));
  EXPECT_EQ(now.at("view_1 again").signature, numbered('a').signature);
  EXPECT_EQ(now.at("b/view_1 again").signature, numbered('b').signature);
}

TEST_F(SynchronisedMemory, NamesThatOthersHaveBecomeTheRobots) {
  share({"a", "b", "c"}, 3);
  open("a").append(named("door", 100));
  open("b").append(std::vector{named("door", 101), named("b/door", 102)});
  open("c").rename(open("c").find("view_2.png").value(), "door");
  (void)sync("a");
  EXPECT_EQ(sync("b").renamed, 1U);
  EXPECT_EQ(sync("c").renamed, 1U);
  (void)sync("a");
  (void)sync("b");
  EXPECT_EQ(names(folder / "a"), (std::set<std::string>{"view_0.png", "view_1.png", "c/door",
                                                        "door", "b/door", "b/door (2)"}));
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "b")));
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "c")));
  EXPECT_EQ(content(folder / "b").at("b/door (2)").signature, numbered(101).signature);
  // Two views that change names with each other.
  {
    MemoryFile file = on_server();
    const ViewId first = file.find("door").value();
    const ViewId second = file.find("b/door").value();
    file.change([&] {
      file.rename(first, "x");
      file.rename(second, "door");
      file.rename(first, "b/door");
    });
  }
  EXPECT_EQ(sync("a").renamed, 0U);
  EXPECT_TRUE(is_same(content(folder / "a"), content(server("x"))));
}

TEST_F(SynchronisedMemory, WhatBothHadIsNotDoubled) {
  {
    MemoryFile file = MemoryFile::create(folder / "a", small_header());
    file.append(numbered(0, 300));
    file.copy_to(server("x"));
    file.copy_to(folder / "b");
    file.set_pose(ViewId{3}, ReferencePose{7.0, 7.0, 0.0});
  }
  const SynchronisationReport first = sync("a");
  EXPECT_EQ(first.adopted, 300U);
  EXPECT_EQ(first.uploaded + first.downloaded + first.updated_on_server, 0U);
  EXPECT_EQ(first.updated_in_file, 1U);  // what the server knew first
  EXPECT_EQ(sync("b").adopted, 300U);
  EXPECT_EQ(on_server().views().size(), 300U);
  // Copies by the operating system know what their file knew.
  std::filesystem::copy_file(folder / "a", folder / "c");
  open("a").append(numbered(300));
  open("c").append(std::vector{numbered(301), numbered(300)});
  EXPECT_EQ(sync("a").uploaded, 1U);
  const SynchronisationReport third = sync("c");
  EXPECT_EQ(third.uploaded, 1U);
  EXPECT_EQ(third.adopted, 1U);
  (void)sync("a");
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "c")));
  EXPECT_EQ(on_server().views().size(), 302U);
}

// A name that makes way for another must not be one that comes with it.
TEST_F(SynchronisedMemory, NamesThatComeTogetherMakeWay) {
  share({"a", "b"}, 3);
  open("a").append(std::vector{named("b/door", 100), named("door", 101)});
  (void)sync("a");
  open("b").append(named("door", 102));
  const SynchronisationReport taken = sync("b");
  EXPECT_EQ(taken.renamed, 1U);
  (void)sync("a");
  EXPECT_EQ(names(folder / "b"), (std::set<std::string>{"view_0.png", "view_1.png", "view_2.png",
                                                        "b/door", "door", "b/door (2)"}));
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "b")));
}

// In whatever order robots work and synchronise, they end at the same, and nothing that was added
// and not removed is missing or there twice.
TEST_F(SynchronisedMemory, EveryOrderConverges) {
  const std::array<const char*, 3> robots{"a", "b", "c"};
  share({"a", "b", "c"}, 8);
  Random random(5);
  int next = 1000;
  std::map<std::string, PackedSignature> added;  // by the name that it was given
  for (int step = 0; step < 100; ++step) {
    const char* robot = robots[random.index(3)];
    if (random.index(4) == 0) {
      (void)sync(robot);
      continue;
    }
    MemoryFile file = open(robot);
    const auto views = file.views();
    const auto any = [&] { return views[random.index(views.size())]; };
    switch (random.index(6)) {
      case 0:
      case 1: {
        const NewView view = named(robot + std::to_string(next), next);
        ++next;
        file.append(view);
        added.emplace(view.info.name, view.signature);
        break;
      }
      case 2:
        if (views.size() > 4) {
          const ViewId view = any();
          added.erase(file.load(std::vector{view}).info(view).name);
          file.remove(std::vector{view});
        }
        break;
      case 3:
        file.set_pose(any(), ReferencePose{random.uniform(0.0, 9.0), 1.0, std::nullopt});
        break;
      case 4: {
        const ViewId a = any();
        const ViewId b = any();
        if (a != b) file.link(std::vector<Link>{{a, b, LinkKind(random.index(3))}});
        break;
      }
      default: {
        const auto links = file.links();
        if (links.empty()) break;
        const Link link = links[random.index(links.size())];
        file.unlink(link.a, link.b);
      }
    }
  }
  for (int round = 0; round < 2; ++round) {
    for (const char* robot : robots) (void)sync(robot);
  }
  const auto all = content(server("x"));
  for (const char* robot : robots) EXPECT_TRUE(is_same(content(folder / robot), all)) << robot;
  EXPECT_GT(added.size(), 8U);
  for (const auto& [name, signature] : added) {
    ASSERT_TRUE(all.contains(name)) << name;
    EXPECT_EQ(all.at(name).signature, signature);
  }
  std::set<std::vector<std::uint8_t>> different;
  for (const auto& [name, seen] : all) different.insert(seen.signature.magnitudes);
  EXPECT_EQ(different.size(), all.size());
  const SynchronisationReport last = sync("a");
  EXPECT_EQ(last.uploaded + last.downloaded + last.links_uploaded + last.links_downloaded +
                last.updated_in_file + last.updated_on_server,
            0U);
}

TEST_F(SynchronisedMemory, AFileKeepsTheAreasAroundIt) {
  {
    MemoryFile file = MemoryFile::create(folder / "a", small_header());
    std::vector<NewView> views;
    for (int i = 0; i < 40; ++i) {
      views.push_back(numbered(i));
      views.back().info.pose = ReferencePose{5.0 + 10.0 * (i % 8), 5.0 + 10.0 * (i / 8), {}};
    }
    views.push_back(numbered(40));
    views.back().info.pose = std::nullopt;
    const auto ids = file.append(views);
    file.link(std::vector<Link>{{ids[0], ids[1], LinkKind::sequence},
                                {ids[0], ids[39], LinkKind::closure},
                                {ids[1], ids[40], LinkKind::neighbour}});
  }
  (void)sync("a");
  const auto all = content(folder / "a");
  const SynchronisationOptions near{areas_around(5.0, 5.0, 12.0)};
  ASSERT_EQ(near.areas->size(), 9U);  // that of (5, 5) and those around it
  const SynchronisationReport taken = sync("b", near);
  EXPECT_EQ(taken.downloaded, 4U);  // all others of these areas lie at negative positions
  EXPECT_EQ(taken.links_downloaded, 1U);
  // A view that leaves the file is not removed from the server, nor are its links.
  const SynchronisationOptions far{areas_around(75.0, 45.0, 1.0)};
  const SynchronisationReport moved = sync("b", far);
  EXPECT_EQ(moved.left, 4U);
  EXPECT_EQ(moved.downloaded, 1U);
  EXPECT_EQ(moved.removed_on_server + moved.links_uploaded, 0U);
  EXPECT_EQ(sync("b", far).left, 0U);
  EXPECT_TRUE(is_same(content(server("x")), all));
  // New views outside of the areas are uploaded, and leave then; those without a position stay.
  {
    MemoryFile file = open("b");
    NewView outside = numbered(200);
    outside.info.pose = ReferencePose{-500.0, 3.0, {}};
    NewView nowhere = numbered(201);
    nowhere.info.pose = std::nullopt;
    const auto ids = file.append(std::vector{outside, nowhere});
    file.link(std::vector<Link>{{ids[1], file.find("view_39.png").value(), LinkKind::neighbour}});
  }
  const SynchronisationReport added = sync("b", far);
  EXPECT_EQ(added.uploaded, 2U);
  EXPECT_EQ(added.left, 1U);
  EXPECT_EQ(names(folder / "b"), (std::set<std::string>{"view_39.png", "view_201.png"}));
  for (int i = 0; i < 2; ++i) {
    const SynchronisationReport none = sync("b", far);
    EXPECT_EQ(none.left + none.links_downloaded + none.links_uploaded + none.downloaded, 0U);
  }
  EXPECT_EQ(open("b").links().size(), 1U);
  EXPECT_EQ(names(server("x")).size(), all.size() + 2);
  // What somebody moves away leaves, what somebody removes goes.
  {
    MemoryFile file = on_server();
    file.set_pose(file.find("view_39.png").value(), ReferencePose{0.0, 0.0, {}});
    file.remove(std::vector{file.find("view_201.png").value()});
  }
  const SynchronisationReport gone = sync("b", far);
  EXPECT_EQ(gone.left, 1U);
  EXPECT_EQ(gone.removed_in_file, 1U);
  EXPECT_TRUE(names(folder / "b").empty());
  // And with no areas all of it comes.
  (void)sync("b");
  EXPECT_TRUE(is_same(content(folder / "b"), content(server("x"))));
}

TEST_F(SynchronisedMemory, AKillAtAnyMomentLosesAndDoublesNothing) {
  share({"a", "b"}, 10);
  Random random(8);
  int next = 100;
  int kills = 0;
  double longest_s = 0.02;
  std::set<std::string> expected = names(folder / "a");
  for (int round = 0; round < 24; ++round) {
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
    ::usleep(static_cast<useconds_t>(1e6 * random.uniform(0.0, 1.5 * longest_s)));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    kills += WIFSIGNALED(status) ? 1 : 0;
    if (WIFEXITED(status)) {
      ASSERT_EQ(WEXITSTATUS(status), 0);
    }
    if (round % 4 == 3) {
      const SynchronisationReport whole = sync("a");
      longest_s = std::max(longest_s, whole.seconds);
      ASSERT_EQ(whole.conflicts, 0U);
      ASSERT_EQ(names(folder / "a"), expected);
    }
  }
  EXPECT_GT(kills, 6);
  (void)sync("b");
  EXPECT_EQ(names(server("x")), expected);
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "b")));
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
  refused("a", other, "is synchronised with another memory");
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
  refused("noise", server("x"), "is no memory file");
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
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 7);
  EXPECT_TRUE(open("b").verify().empty());
  (void)sync("b");
  EXPECT_TRUE(is_same(content(folder / "b"), all));
}

/// What bench/synchronise_faults.py starts, kills and counts: a robot that changes its file, tells
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
  const auto name_of = [](const PackedSignature& signature) {
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
        say("adding", name_of(view.signature));
        file.append(view);
        return name_of(view.signature);
      };
      const std::vector<ViewId> views = file.views();
      const auto any = [&] { return views[random.index(views.size())]; };
      const auto told = [&](ViewId view) {
        return name_of(file.load(std::vector{view}).packed(view));
      };
      const std::uint64_t kind = views.size() < 5 ? 0 : random.index(20);
      if (kind < 12) {
        for (std::uint64_t i = random.index(3) + 1; i > 0; --i) say("added", add());
      } else if (kind < 15) {
        const ViewId view = any();
        const auto which = told(view);
        const double x_m = next++;
        say("moving", which, x_m);
        file.set_pose(view, ReferencePose{x_m, 0.0, std::nullopt});
        say("moved", which, x_m);
      } else if (kind == 15) {
        const ViewId view = any();
        const auto which = told(view);
        say("removing", which);
        file.remove(std::vector{view});
        say("removed", which);
      } else if (kind == 16) {
        const ViewId view = any();
        const auto which = told(view);
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
        if (a != b) file.link(std::vector<Link>{{a, b, LinkKind(random.index(3))}});
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
