#include "panonav/pipeline/memory_merge.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/route/snapshot_chain.hpp"
#include "support/remembered_worlds.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

constexpr int round = 110;  // views

std::vector<Pose2> drive(int first, int views) {
  std::vector<Pose2> poses;
  for (int i = first; i < first + views; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / round;
    poses.push_back({1.6 * std::sin(angle), -1.6 * std::cos(angle), wrap_angle(angle)});
  }
  return poses;
}

class Merge : public InTemporaryFolder {
 protected:
  /// A memory with the poses of a drive in the frame of its first view, and a route along it.
  fs::path remember(const std::string& name, std::uint64_t room, const std::vector<Pose2>& truth,
                    const std::string& prefix = "") {
    const ToyWorld world = round_room(4.0, room);
    MemoryHeader header;
    header.shape = round_room_shape;
    header.full_scale = 0.1F;
    header.panorama_columns = 96;
    const fs::path path = folder / name;
    MemoryFile file = MemoryFile::create(path, header);
    std::vector<NewView> views;
    RoutePanorama route(64);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const Pose2 here = inverse(truth.front()) * truth[i];
      NewView view;
      view.info.name = prefix + std::to_string(i);
      view.info.pose = ReferencePose{here.x_m, here.y_m, here.heading_rad};
      view.signature = pack(round_room_signature(world, truth[i]), header.full_scale);
      view.thumbnail = {1, static_cast<std::uint8_t>(i)};
      views.push_back(std::move(view));
      route.append(here, std::vector<float>(64, 0.5F));
    }
    file.append(views);
    file.append_route("route", route);
    return path;
  }
  fs::path merged = folder / "both.panonav";
};

TEST_F(Merge, TwoDrivesInOneRoomBecomeOneMemoryInTheFrameOfTheFirst) {
  const auto first_truth = drive(0, 110);
  const auto second_truth = drive(40, 110);
  const fs::path first = remember("first.panonav", 5, first_truth);
  const fs::path second = remember("second.panonav", 5, second_truth);
  SnapshotChain chain;
  chain.append({}, HomingView(8, 6, std::vector<float>(48), std::vector<float>(48)));
  MemoryFile::open(second, Access::read_write).save_chain("home", chain);
  std::size_t advanced = 0;
  const MergedMemory result = merge_memories(first, second, merged, {}, {}, [&] { ++advanced; });
  ASSERT_TRUE(result.alignment);
  EXPECT_EQ(result.views, 220U);
  EXPECT_EQ(advanced, 220U);
  EXPECT_EQ(result.shared, 0U);
  EXPECT_EQ(result.renamed, 111U) << "all views and the route had names that were taken";
  EXPECT_EQ(result.connected_components, 1U);
  EXPECT_EQ(result.without_position, 0U);
  const MemoryFile file = MemoryFile::open(merged, Access::read_only);
  EXPECT_TRUE(file.verify().empty());
  const VisualMemory memory = file.load();
  for (int i = 0; i < 110; ++i) {
    const auto view = memory.find("second/" + std::to_string(i));
    ASSERT_TRUE(view);
    const Pose2 here = inverse(first_truth.front()) * second_truth[static_cast<std::size_t>(i)];
    EXPECT_LT(distance(memory.info(*view).pose.value().position(), here.position()), 0.4) << i;
    EXPECT_EQ(file.thumbnail(*view), (std::vector<std::uint8_t>{1, static_cast<std::uint8_t>(i)}));
  }
  EXPECT_EQ(file.map(map_name).value().nodes.size(), 220U);
  EXPECT_EQ(file.route_names(), (std::vector<std::string>{"home", "route", "second/route"}));
  EXPECT_EQ(file.chain("home"), chain);
  const RoutePanorama route = file.route("second/route").value();
  const Pose2 start = inverse(first_truth.front()) * second_truth.front();
  EXPECT_LT(distance(route.poses().front().position(), start.position()), 0.4);
}

TEST_F(Merge, WithNothingInCommonTheSecondHasNoPositions) {
  const fs::path first = remember("first.panonav", 5, drive(0, 60));
  const fs::path second = remember("second.panonav", 6, drive(0, 60), "other_");
  const MergedMemory result = merge_memories(first, second, merged);
  EXPECT_FALSE(result.alignment);
  EXPECT_EQ(result.connected_components, 2U);
  EXPECT_EQ(result.without_position, 60U);
  EXPECT_EQ(result.renamed, 1U) << "the route";
  const MemoryFile file = MemoryFile::open(merged, Access::read_only);
  EXPECT_EQ(file.info().views_with_position, 60U);
  const VisualMemory memory = file.load();
  EXPECT_TRUE(memory.info(memory.find("7").value()).pose);
  EXPECT_FALSE(memory.info(memory.find("other_7").value()).pose);
}

TEST_F(Merge, FloorsKeepTheirFramesAndOnlyTheSharedOneIsAligned) {
  const fs::path ground = remember("ground.panonav", 5, drive(0, 110), "floor=ground/");
  const fs::path first = remember("first.panonav", 6, drive(0, 60), "floor=first/");
  const MergedMemory apart = merge_memories(ground, first, merged);
  EXPECT_FALSE(apart.has_shared_floor);
  EXPECT_EQ(apart.without_position, 0U);
  const auto load = [](const fs::path& path) {
    return MemoryFile::open(path, Access::read_only).load();
  };
  const VisualMemory before = load(first);
  const VisualMemory after = load(merged);
  for (const ViewId view : before.views()) {
    EXPECT_EQ(after.info(after.find(before.info(view).name).value()).pose, before.info(view).pose);
  }

  const fs::path again = remember("again.panonav", 5, drive(40, 110), "floor=ground/");
  const fs::path all = folder / "all.panonav";
  const MergedMemory joined = merge_memories(merged, again, all);
  EXPECT_TRUE(joined.has_shared_floor);
  ASSERT_TRUE(joined.alignment);
  EXPECT_EQ(joined.without_position, 0U);
  const VisualMemory three = load(all);
  EXPECT_EQ(three.size(), 280U);
  EXPECT_EQ(list_floors(three), (std::vector<std::string>{"first", "ground"}));
  EXPECT_TRUE(three.find("floor=ground/again/7"));
  for (const ViewId view : before.views()) {
    EXPECT_EQ(three.info(three.find(before.info(view).name).value()).pose, before.info(view).pose);
  }
  EXPECT_THROW((void)merge_memories(merged, all, folder / "none.panonav"), FileError)
      << "two floors are in both";
}

TEST_F(Merge, WhatBothHaveIsKeptOnce) {
  const fs::path first = remember("first.panonav", 5, drive(0, 60));
  const fs::path second = folder / "second.panonav";
  fs::copy_file(first, second);
  const MergedMemory result = merge_memories(first, second, merged);
  EXPECT_EQ(result.views, 60U);
  EXPECT_EQ(result.shared, 60U);
  ASSERT_TRUE(result.alignment);
  const Pose2& moved = result.alignment->first_from_second;
  EXPECT_LT(std::hypot(moved.x_m, moved.y_m) + std::abs(moved.heading_rad), 1e-9);
  const auto poses = [](const fs::path& path) {
    return MemoryFile::open(path, Access::read_only).load();
  };
  const VisualMemory before = poses(first);
  const VisualMemory after = poses(merged);
  for (const ViewId view : before.views()) {
    const auto there = after.find(before.info(view).name);
    ASSERT_TRUE(there);
    EXPECT_LT(distance(after.info(*there).pose->position(), before.info(view).pose->position()),
              1e-6);
  }
}

TEST_F(Merge, PositionsInAnotherFrameThanTheMapAreNeverReplaced) {
  const fs::path first = remember("first.panonav", 5, drive(0, 30));
  {
    MemoryFile file = MemoryFile::open(first, Access::read_write);
    TopologicalMap map;
    for (const ViewId view : file.views()) {
      map.nodes.push_back({view, {0.1 * static_cast<double>(map.nodes.size()), 0.0, 0.0}, 0});
    }
    file.save_map(map_name, map);
    file.set_pose(file.views().front(), ReferencePose{100.0, 200.0, std::nullopt});
  }
  EXPECT_THROW((void)merge_memories(first, first, merged), FileError);
  EXPECT_FALSE(fs::exists(merged));
}

TEST_F(Merge, WhatCannotBeMergedIsRefusedAndLeavesNothing) {
  const fs::path first = remember("first.panonav", 5, drive(0, 12));
  MemoryHeader header;
  header.shape = {round_room_shape.rows, round_room_shape.components - 1};
  header.panorama_columns = 96;
  const fs::path other = folder / "other.panonav";
  { const MemoryFile made = MemoryFile::create(other, header); }
  EXPECT_THROW((void)merge_memories(first, other, merged), ContractError);
  EXPECT_THROW((void)merge_memories(first, folder / "none.panonav", merged), FileError);
  EXPECT_THROW((void)merge_memories(first, first, merged, {.min_places = 0}), OptionError);
  EXPECT_THROW((void)merge_memories(first, first, first), FileError);
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(name.starts_with("first.panonav") || name.starts_with("other.panonav")) << name;
    ++files;
  }
  EXPECT_GE(files, 2U);
}

}  // namespace
}  // namespace panonav::testing
