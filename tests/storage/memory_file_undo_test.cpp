// Taking back the last change.
#include <gtest/gtest.h>

#include "panonav/core/error.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/memory_samples.hpp"

namespace panonav::testing {
namespace {

class MemoryFileUndo : public MemoryFileTest {
 protected:
  void SetUp() override {
    file.emplace(MemoryFile::create(path, small_header()));
    Random random(5);
    for (int number = 0; number < 12; ++number) {
      ids.push_back(file->append(random_view(random, small_header().shape, number)));
    }
    for (std::size_t i = 1; i < ids.size(); ++i) {
      file->link(std::vector<Link>{{ids[i - 1], ids[i], Link::Kind::sequence}});
      map.nodes.push_back({ids[i], {static_cast<double>(i), 0.0, 0.0}});
    }
    file->save_map("map", map);
    file->set_parameter("recordings", "one");
    before.emplace(file->load());
  }
  void forget(const std::vector<ViewId>& views) {
    file->change(
        [&] {
          file->set_parameter("recordings", "");
          file->remove(views);
        },
        "forget " + std::to_string(views.size()));
  }
  std::optional<MemoryFile> file;
  std::vector<ViewId> ids;
  TopologicalMap map;
  std::optional<VisualMemory> before;
};

TEST_F(MemoryFileUndo, BringsBackAllThatWasDropped) {
  EXPECT_FALSE(file->undoable());
  EXPECT_TRUE(contains(message_of<ContractError>([&] { file->undo(); }), "undo"));
  const auto thumbnail = file->thumbnail(ids[4]);
  ASSERT_TRUE(thumbnail);
  forget({ids[1]});
  forget({ids[4], ids[5]});
  EXPECT_EQ(file->load().size(), 9U);
  file.reset();
  file.emplace(MemoryFile::open(path, Access::read_write));
  EXPECT_EQ(file->undoable(), "forget 2");
  const VisualMemory now = file->load();
  file->require_undo_possible();
  EXPECT_TRUE(same_content(file->load(), now)) << "only a check";
  EXPECT_EQ(file->undoable(), "forget 2");
  file->undo();  // the last change before the one before it
  EXPECT_EQ(file->load().size(), 11U);
  EXPECT_EQ(file->thumbnail(ids[4]), thumbnail);
  EXPECT_EQ(file->map("map")->nodes.size(), 10U);
  EXPECT_EQ(file->undoable(), "forget 1");
  EXPECT_TRUE(file->verify().empty());
  file->undo();
  EXPECT_TRUE(same_content(file->load(), *before));
  EXPECT_EQ(file->map("map"), map);
  EXPECT_FALSE(file->undoable());
  EXPECT_TRUE(file->verify().empty());
}

TEST_F(MemoryFileUndo, HistoryIsBoundedAndToldNewestFirst) {
  EXPECT_TRUE(file->history().empty());
  constexpr auto levels = static_cast<int>(MemoryFile::max_undo_levels);
  constexpr auto lines = static_cast<int>(MemoryFile::max_history);
  for (int i = 0; i < lines + 5; ++i) {
    file->change([&] { file->set_parameter("mark", std::to_string(i)); }, std::to_string(i));
  }
  const auto history = file->history();
  ASSERT_EQ(history.size(), MemoryFile::max_history);
  for (int i = 0; i < lines; ++i) {
    const MemoryFile::KeptChange& kept = history[static_cast<std::size_t>(i)];
    EXPECT_EQ(kept.what, std::to_string(lines + 4 - i));
    EXPECT_EQ(kept.undoable, i < levels);
    EXPECT_EQ(kept.bytes > 0, i < levels);
    EXPECT_TRUE(kept.stamp_s);
  }
  for (int i = 0; i < levels; ++i) file->undo();
  EXPECT_EQ(file->parameter("mark"), std::to_string(lines + 4 - levels));
  EXPECT_FALSE(file->undoable());
  EXPECT_FALSE(message_of<ContractError>([&] { file->undo(); }).empty());
  EXPECT_EQ(file->history().size(), MemoryFile::max_history - MemoryFile::max_undo_levels);
  EXPECT_TRUE(file->verify().empty());
}

TEST_F(MemoryFileUndo, BringsBackTheSameMemory) {
  forget({ids[4], ids[0], ids[11]});
  EXPECT_FALSE(same_content(file->load(), *before));
  file->undo();
  EXPECT_TRUE(same_content(file->load(), *before));
  EXPECT_EQ(file->map("map"), map);
  EXPECT_EQ(file->parameter("recordings"), "one");
  EXPECT_TRUE(file->verify().empty());
}

TEST_F(MemoryFileUndo, BringsBackNames) {
  RoutePanorama route(16);
  for (int i = 0; i < 600; ++i) {
    (void)route.append({0.1 * i, 0.0, 0.0},
                       std::vector<std::uint8_t>(16, static_cast<std::uint8_t>(i)));
  }
  file->append_route("way", route);
  file->set_parameter("route.way", "half_band_rad 0.1");
  file->change(
      [&] {
        file->rename(ids[4], "door");
        file->rename_route("way", "path");
      },
      "rename");
  EXPECT_EQ(file->find("door"), ids[4]);
  EXPECT_FALSE(file->find("view_4.png"));
  EXPECT_EQ(file->load().info(ids[4]).pose, before->info(ids[4]).pose);
  EXPECT_EQ(file->route("path"), route);
  EXPECT_FALSE(file->route("way"));
  EXPECT_EQ(file->parameter("route.path"), "half_band_rad 0.1");
  EXPECT_FALSE(file->parameter("route.way"));
  EXPECT_TRUE(file->verify().empty());
  file->undo();
  EXPECT_TRUE(same_content(file->load(), *before));
  EXPECT_EQ(file->route("way"), route);
  EXPECT_EQ(file->parameter("route.way"), "half_band_rad 0.1");
  EXPECT_TRUE(file->verify().empty());
}

TEST_F(MemoryFileUndo, NamesAreRefusedThatAreTakenOrNone) {
  RoutePanorama route(16);
  (void)route.append({}, std::vector<std::uint8_t>(16, 7));
  file->append_route("way", route);
  file->append_route("path", route);
  const auto refused = [&](const auto& body, const std::string& word) {
    EXPECT_TRUE(contains(message_of<ContractError>(body), word));
  };
  refused([&] { file->rename(ids[4], "view_5.png"); }, "already contains");
  refused([&] { file->rename(ids[4], ""); }, "view name is empty");
  refused([&] { file->rename(ids[4], std::string("a\0b", 3)); }, "control characters");
  refused([&] { file->rename(ViewId{99}, "x"); }, "view is 99");
  refused([&] { file->rename_route("way", "path"); }, "route name is \"path\", which");
  refused([&] { file->rename_route("nobody", "x"); }, "a route of the memory file");
  file->rename(ids[4], "view_4.png");  // its own name
  EXPECT_TRUE(same_content(file->load(), *before));
  EXPECT_EQ(file->route_names(), (std::vector<std::string>{"path", "way"}));
}

TEST_F(MemoryFileUndo, LeavesWhatWasAddedSince) {
  forget({ids[4]});
  Random random(6);
  const ViewId added = file->append(random_view(random, small_header().shape, 99));
  file->set_parameter("recordings", "two");
  file->undo();
  EXPECT_EQ(file->load().size(), 13U);
  EXPECT_EQ(file->find("view_99.png"), added);
  EXPECT_EQ(file->parameter("recordings"), "two");
  EXPECT_TRUE(file->verify().empty());
}

TEST_F(MemoryFileUndo, IsRefusedWhereItWouldOverwrite) {
  forget({ids[4]});
  Random random(6);
  NewView same_name = random_view(random, small_header().shape, 4);
  file->append(same_name);
  const VisualMemory now = file->load();
  const auto message = message_of<FileError>([&] { file->undo(); });
  EXPECT_TRUE(
      contains(message, "cannot undo \"forget 1\": a later change altered the same views; "));
  EXPECT_TRUE(contains(message, "panonav rename")) << message;
  EXPECT_EQ(message_of<FileError>([&] { file->require_undo_possible(); }), message);
  EXPECT_TRUE(same_content(file->load(), now));
  EXPECT_TRUE(file->undoable());
  EXPECT_TRUE(file->verify().empty());
}

// A later link or map may refer to a view that would go.
TEST_F(MemoryFileUndo, IsRefusedWhereALinkOrAMapWouldLackAView) {
  Random random(6);
  ViewId added;
  file->change([&] { added = file->append(random_view(random, small_header().shape, 99)); },
               "update");
  const auto expect_refusal = [&](const char* fault) {
    const VisualMemory now = file->load();
    const auto message = message_of<FileError>([&] { file->undo(); });
    EXPECT_TRUE(contains(message, "cannot undo \"update\": the memory would be damaged: "));
    EXPECT_TRUE(contains(message, fault));
    EXPECT_TRUE(same_content(file->load(), now));
    EXPECT_EQ(file->undoable(), "update");
    EXPECT_TRUE(file->verify().empty());
  };
  const Link link{ids[3], added, Link::Kind::sequence};
  file->link(std::vector<Link>{link});
  expect_refusal("of which one is missing");
  file->unlink(link.a, link.b);
  TopologicalMap with_added = map;
  with_added.nodes.push_back({added, {20.0, 0.0, 0.0}});
  file->save_map("since", with_added);
  expect_refusal("map since");
  file->remove_map("since");
  file->undo();
  EXPECT_TRUE(same_content(file->load(), *before));
}

TEST_F(MemoryFileUndo, DamageIsNotApplied) {
  forget({ids[4]});
  file.reset();
  run_sql(path, "UPDATE history SET changes = CAST(changes || x'00' AS BLOB)");
  file.emplace(MemoryFile::open(path, Access::read_write));
  EXPECT_TRUE(
      contains(message_of<FileError>([&] { file->undo(); }), "does not match its checksum"));
  EXPECT_EQ(file->load().size(), 11U);
  EXPECT_FALSE(file->verify().empty());
}

}  // namespace
}  // namespace panonav::testing
