// Maps in a memory file.
#include <gtest/gtest.h>

#include <limits>

#include "panonav/core/error.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/memory_samples.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

std::vector<ViewId> append_views(MemoryFile& file, int count) {
  Random random(9);
  std::vector<ViewId> views;
  for (int i = 0; i < count; ++i) {
    views.push_back(file.append(random_view(random, small_header().shape, i)));
  }
  return views;
}

TopologicalMap random_map(const std::vector<ViewId>& views, std::uint64_t seed) {
  Random random(seed);
  const auto pose = [&] {
    return Pose2{random.normal(), random.normal(), random.uniform(-3.0, 3.0)};
  };
  TopologicalMap map;
  for (std::size_t i = 0; i < views.size(); ++i) {
    map.nodes.push_back({views[i], pose(), i < 5 ? 0U : 1U});
    if (i > 0) map.edges.push_back({views[i - 1], views[i], pose(), Link::Kind::sequence, 1.0});
  }
  if (views.size() > 3) {
    map.edges.push_back({views[0], views[3], pose(), Link::Kind::closure, 0.625});
  }
  return map;
}

using MapTables = MemoryFileTest;

TEST_F(MapTables, WhatIsSavedIsReadBackBitForBit) {
  TopologicalMap map;
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    const auto views = append_views(file, 12);
    EXPECT_TRUE(file.map_names().empty());
    EXPECT_FALSE(file.map("map").has_value());
    map = random_map(views, 1);
    file.save_map("other", random_map(views, 2));
    file.save_map("map", random_map(views, 3));
    file.save_map("map", map);
    EXPECT_EQ(file.info().maps, 2U);
    file.save_map("empty", {});
  }
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  EXPECT_EQ(file.map_names(), (std::vector<std::string>{"empty", "map", "other"}));
  EXPECT_EQ(file.map("map"), map);
  EXPECT_EQ(file.map("empty"), TopologicalMap{});
  EXPECT_TRUE(file.verify().empty());
  EXPECT_EQ(file.load().size(), 12U);
  file.remove_map("other");
  EXPECT_FALSE(file.map("other").has_value());
  EXPECT_THROW(file.remove_map("other"), ContractError);
}

TEST_F(MapTables, ForgottenViewsLeaveTheMap) {
  MemoryFile file = MemoryFile::create(path, small_header());
  const auto views = append_views(file, 6);
  file.save_map("map", random_map(views, 1));
  const std::vector<ViewId> dropped{views[3]};
  file.remove(dropped);
  const auto map = file.map("map");
  ASSERT_TRUE(map.has_value());
  EXPECT_EQ(map->nodes.size(), 5U);
  EXPECT_EQ(map->edges.size(), 3U);  // 0-1, 1-2, 4-5
  EXPECT_TRUE(file.verify().empty());
}

TEST_F(MapTables, WrongMapsAreRefusedAndChangeNothing) {
  MemoryFile file = MemoryFile::create(path, small_header());
  const auto views = append_views(file, 4);
  const TopologicalMap good = random_map(views, 1);
  file.save_map("map", good);
  EXPECT_THROW(file.save_map("", good), ContractError);
  TopologicalMap map = good;
  map.nodes[2].pose.y_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(file.save_map("map", map), ContractError);
  map = good;
  std::swap(map.nodes[1], map.nodes[2]);
  EXPECT_THROW(file.save_map("map", map), ContractError);
  map = good;
  map.edges[0].b = map.edges[0].a;
  EXPECT_THROW(file.save_map("map", map), ContractError);
  map = good;
  map.edges[0].weight = 1.5;
  EXPECT_THROW(file.save_map("map", map), ContractError);
  map = good;
  map.nodes.back().view = ViewId{99};
  EXPECT_THROW(file.save_map("map", map), ContractError);
  EXPECT_EQ(file.map("map"), good);
}

TEST_F(MapTables, RowsThatWereTamperedWith) {
  for (const std::string sql :
       {"UPDATE maps SET nodes = x'00'", "UPDATE maps SET nodes = substr(nodes, 33)",
        "UPDATE maps SET edges = substr(edges, 45)", "UPDATE maps SET name = 'other'",
        "UPDATE maps SET checksum = checksum + 1"}) {
    std::filesystem::remove(path);
    {
      MemoryFile file = MemoryFile::create(path, small_header());
      file.save_map("map", random_map(append_views(file, 4), 1));
    }
    run_sql(path, sql);
    const MemoryFile file = MemoryFile::open(path, Access::read_only);
    EXPECT_FALSE(file.verify().empty()) << sql;
    const std::string name = file.map_names().front();
    EXPECT_THROW((void)file.map(name), FileError) << sql;
    EXPECT_EQ(file.load().size(), 4U);  // the views are not harmed
  }
}

}  // namespace
}  // namespace panonav::testing
