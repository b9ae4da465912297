// Areas of a memory, and files that hold some of them.
#include <algorithm>
#include <cmath>

#include "fleet/synchronised_memory.hpp"
#include "panonav/core/error.hpp"
#include "panonav_fleet/memory_changes.hpp"

namespace panonav::fleet {
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
          areas, to_memory_area(x_m + distance_m * std::cos(angle_rad),
                                y_m + distance_m * std::sin(angle_rad))));
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
    file.link(std::vector<Link>{{ids[0], ids[1], Link::Kind::sequence},
                                {ids[0], ids[39], Link::Kind::closure},
                                {ids[1], ids[40], Link::Kind::neighbour}});
  }
  (void)sync("a");
  const auto all = content(folder / "a");
  const SynchronisationOptions near{areas_around(5.0, 5.0, 12.0)};
  ASSERT_EQ(near.areas->size(), 9U);  // that of (5, 5) and those around it
  const SynchronisationReport received = sync("b", near);
  EXPECT_EQ(received.downloaded, 4U);  // all others of these areas lie at negative positions
  EXPECT_EQ(received.links_downloaded, 1U);
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
    file.link(std::vector<Link>{{ids[1], file.find("view_39.png").value(), Link::Kind::neighbour}});
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
  // Views that somebody moves away or removes leave the file.
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

}  // namespace
}  // namespace panonav::fleet
