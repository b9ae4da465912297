// A robot's memory file and a memory on a PostgreSQL server, whose address is PANONAV_TEST_SERVER
// (tests/fleet/test_server.py starts one).
#include <array>
#include <functional>

#include "fleet/synchronised_memory.hpp"
#include "panonav/core/error.hpp"

namespace panonav::fleet {
namespace {

TEST(Synchronisation, PathsAndAddressesAreToldApart) {
  EXPECT_THROW((void)synchronise_memory("a.panonav", "b.panonav"), ContractError);
  EXPECT_THROW((void)synchronise_memory("postgresql:///d?memory=a", "postgresql:///d?memory=b"),
               ContractError);
}

TEST_F(SynchronisedMemory, TakesAllThereIsAndThenNothing) {
  {
    MemoryFile file = MemoryFile::create(folder / "a", small_header());
    const auto ids = file.append(numbered(0, 700));  // several messages
    file.link(std::vector<Link>{{ids[0], ids[1], Link::Kind::sequence},
                                {ids[5], ids[600], Link::Kind::closure}});
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
    file.link(std::vector<Link>{{ViewId{1}, ViewId{21}, Link::Kind::neighbour}});
  }
  const SynchronisationReport sent = sync("a");
  EXPECT_EQ(sent.uploaded, 3U);
  EXPECT_EQ(sent.updated_on_server, 2U);
  EXPECT_EQ(sent.removed_on_server, 2U);
  EXPECT_EQ(sent.links_uploaded, 1U);
  open("b").set_parameter("recordings", "2");
  const SynchronisationReport received = sync("b");
  EXPECT_EQ(received.downloaded, 3U);
  EXPECT_EQ(received.updated_in_file, 2U);
  EXPECT_EQ(received.removed_in_file, 2U);
  EXPECT_EQ(received.links_downloaded, 1U);
  EXPECT_EQ(received.conflicts, 0U);
  EXPECT_TRUE(is_same(content(folder / "a"), content(folder / "b")));
  EXPECT_EQ(names(folder / "b").count("the door"), 1U);
  // A recording may bring removed or renamed views back: none counts as known.
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
  // Removed views come back by an undo, as a view of its own.
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
  const SynchronisationReport received = sync("b");
  EXPECT_EQ(received.renamed, 1U);
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
        if (a != b) file.link(std::vector<Link>{{a, b, Link::Kind(random.index(3))}});
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

}  // namespace
}  // namespace panonav::fleet
