#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "panonav/mapping/topological_map.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

void expect_views(const MemoryFile& file) {
  const VisualMemory memory = file.load();
  ASSERT_EQ(memory.size(), 5U);
  for (std::uint32_t i = 0; i < 5; ++i) {
    const ViewId view{i + 1};
    const ReferenceInfo& info = memory.info(view);
    EXPECT_EQ(info.name, "view_" + std::to_string(i) + ".png");
    EXPECT_EQ(file.find(info.name), view);
    ASSERT_EQ(info.pose.has_value(), i != 4);
    if (info.pose) {
      EXPECT_EQ(info.pose->x_m, 0.25 * i);
      EXPECT_EQ(info.pose->y_m, -0.5 * i);
      ASSERT_EQ(info.pose->heading_rad.has_value(), i < 3);
      if (i < 3) {
        EXPECT_EQ(*info.pose->heading_rad, 0.125 * i);
      }
    }
    ASSERT_EQ(info.stamp_s.has_value(), i % 2 == 0);
    if (info.stamp_s) {
      EXPECT_EQ(*info.stamp_s, 10.0 + i);
    }
    const PackedSignature packed = memory.packed(view);
    ASSERT_EQ(packed.magnitudes.size(), 35U);
    for (std::uint32_t j = 0; j < 35; ++j) {
      EXPECT_EQ(packed.magnitudes[j], static_cast<std::uint8_t>(7 * i + 3 * j));
      EXPECT_EQ(packed.phases[j], static_cast<std::uint8_t>(11 * i + 5 * j));
    }
    EXPECT_EQ(file.thumbnail(view).has_value(), i == 1);
  }
  ASSERT_EQ(memory.links().size(), 2U);
  EXPECT_EQ(memory.links()[1].b, ViewId{4});
  EXPECT_EQ(memory.links()[1].kind, Link::Kind::closure);
}

// data/version_1.panonav is as the library wrote it, and stays as it is: five views with numbers
// that follow from those of the view, a map, a route, two changes that can be undone, and the
// state of a synchronisation with a server.
TEST(GoldenMemoryFile, IsReadAndGrows) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "m.panonav";
  std::filesystem::copy_file(std::filesystem::path(PANONAV_TEST_DATA) / "version_1.panonav", path);
  {
    const MemoryFile file = MemoryFile::open(path, Access::read_only);
    EXPECT_EQ(file.info().format_version, 1);
    EXPECT_TRUE(file.verify().empty());
    EXPECT_EQ(file.header().full_scale, 0.5F);
    EXPECT_EQ(file.header().panorama_columns, 90);
    EXPECT_EQ(file.header().elevations, (ElevationBand{-0.5, 0.25}));
    EXPECT_EQ(file.header().created_s, 1700000000.5);
    EXPECT_EQ(file.parameter("learnt"), "a model");
    expect_views(file);
    const auto history = file.history();
    ASSERT_EQ(history.size(), 2U);
    EXPECT_EQ(history[0].what, "back again");
    EXPECT_EQ(history[1].what, "learnt again");
    EXPECT_TRUE(history[1].undoable);
    const auto map = file.map("map");
    ASSERT_TRUE(map.has_value());
    ASSERT_EQ(map->nodes.size(), 3U);
    EXPECT_EQ(map->nodes[1].pose, (Pose2{1.0, 0.5, 0.25}));
    EXPECT_EQ(map->nodes[2].component, 1U);
    ASSERT_EQ(map->edges.size(), 1U);
    EXPECT_EQ(map->edges[0].weight, 0.75);
    const auto route = file.route("round");
    ASSERT_TRUE(route.has_value());
    ASSERT_EQ(route->size(), 3U);
    EXPECT_EQ(route->line(2)[15], 55);
    EXPECT_NEAR(route->poses()[2].x_m, 0.2, 1e-6);
  }
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  NewView more;
  more.info.name = "more.png";
  more.signature = file.load().packed(ViewId{1});
  EXPECT_EQ(file.append(more), ViewId{6});
  file.change([&] { file.remove(std::array{ViewId{6}}); }, "removed");
  EXPECT_TRUE(file.verify().empty());
  expect_views(file);
}

}  // namespace
}  // namespace panonav::testing
