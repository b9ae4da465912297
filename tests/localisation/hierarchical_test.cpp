#include "panonav/localisation/hierarchical.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "panonav/core/error.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

std::vector<Match> all_views(const VisualMemory& memory) {
  std::vector<Match> matches;
  for (const ViewId view : memory.views()) matches.push_back({view, 0});
  return matches;
}

TEST(ReferenceAreas, OfAGridAreStepSquared) {
  const RememberedRoom place(41, {4.0, 3.0, 0, 0.15}, 0.5);
  const ReferenceAreas areas(place.memory);
  EXPECT_NEAR(areas.spacing_m(), 0.5, 1e-9);
  EXPECT_NEAR(areas.area_m2(all_views(place.memory)).value(),
              0.25 * static_cast<double>(place.grid.size()), 1e-9);
  EXPECT_NEAR(polygon_area_m2(areas.cell(place.memory.views()[0])), 0.25, 1e-9);
  EXPECT_EQ(areas.area_m2({}).value(), 0.0);
  EXPECT_FALSE(areas.enclosing_circle({}));
}

TEST(ReferenceAreas, AreUnknownWhereAPoseIs) {
  RememberedRoom place(41, {4.0, 3.0, 0, 0.15}, 0.5);
  place.memory.set_pose(place.memory.views()[2], std::nullopt);
  const ReferenceAreas areas(place.memory);
  EXPECT_FALSE(areas.area_m2(all_views(place.memory)));
  EXPECT_FALSE(areas.enclosing_circle(all_views(place.memory)));
  EXPECT_TRUE(areas.cell(place.memory.views()[2]).empty());
  const std::vector<Match> posed = {{place.memory.views()[0], 0}};
  EXPECT_TRUE(areas.area_m2(posed));
}

TEST(LocaliseHierarchically, AreasAndRadiiAreNestedAndEndAtTheNearestView) {
  const RememberedRoom place(42, {}, 0.3);
  const ReferenceAreas areas(place.memory);
  Random random(1);
  double first_area_m2 = 0.0;
  double last_area_m2 = 0.0;
  for (int i = 0; i < 30; ++i) {
    const Pose2 pose = place.room.between(place.grid, place.step_m, random);
    const PackedSignature query =
        pack(compute_signature(place.room.see(pose)), place.memory.full_scale());
    for (const double tolerance : {0.0, 0.2}) {
      const auto levels =
          localise_hierarchically(place.memory, areas, query, {.tolerance = tolerance});
      ASSERT_EQ(levels.size(), 15U);
      for (std::size_t m = 0; m < levels.size(); ++m) {
        const LocalisationLevel& level = levels[m];
        EXPECT_EQ(level.components, static_cast<int>(m) + 1);
        ASSERT_TRUE(level.area_m2 && level.region);
        for (const Match& match : level.candidates) {
          EXPECT_LE(distance(place.memory.info(match.view).pose->position(), level.region->centre),
                    level.region->radius_m);
        }
        if (m == 0) continue;
        EXPECT_LE(*level.area_m2, *levels[m - 1].area_m2 + 1e-12);
        EXPECT_LE(level.region->radius_m, levels[m - 1].region->radius_m + 1e-9);
        EXPECT_GE(level.bytes_read, levels[m - 1].bytes_read);
        for (const Match& match : level.candidates) {
          EXPECT_TRUE(std::ranges::any_of(levels[m - 1].candidates,
                                          [&](const Match& b) { return b.view == match.view; }));
        }
      }
      EXPECT_EQ(levels.back().candidates[0], place.memory.search(query).matches[0]);
      if (tolerance == 0.0) {
        first_area_m2 += *levels.front().area_m2;
        last_area_m2 += *levels.back().area_m2;
      }
    }
  }
  EXPECT_GT(first_area_m2, 2.0 * last_area_m2);  // more components do tell more
}

TEST(LocaliseHierarchically, StopsAtTheWantedAccuracyAndPaysLess) {
  const RememberedRoom place(43, {}, 0.3);
  const ReferenceAreas areas(place.memory);
  const PackedSignature query =
      pack(compute_signature(place.room.see({2.0, 2.0, 1.0})), place.memory.full_scale());
  const auto all = localise_hierarchically(place.memory, areas, query);
  const auto three = localise_hierarchically(place.memory, areas, query, {.components = 3});
  EXPECT_EQ(three.size(), 3U);
  const double wanted_m = 0.5 * (all.front().region->radius_m + all.back().region->radius_m);
  const auto coarse = localise_hierarchically(place.memory, areas, query, {.radius_m = wanted_m});
  ASSERT_LT(coarse.size(), all.size());
  EXPECT_LE(coarse.back().region->radius_m, wanted_m);
  for (std::size_t m = 0; m + 1 < coarse.size(); ++m)
    EXPECT_GT(coarse[m].region->radius_m, wanted_m);
  EXPECT_LT(coarse.back().bytes_read, all.back().bytes_read);
}

TEST(LocaliseHierarchically, RefusesBadOptionsAndStandsAnEmptyMemory) {
  const VisualMemory empty({16, 15}, 1.0F, std::nullopt);
  const RememberedRoom place(44, {}, 0.5);
  const PackedSignature query = place.memory.packed(place.memory.views()[0]);
  EXPECT_TRUE(localise_hierarchically(empty, ReferenceAreas(empty), query).empty());
  const ReferenceAreas areas(place.memory);
  EXPECT_THROW((void)localise_hierarchically(place.memory, areas, query, {.tolerance = -1.0}),
               OptionError);
  EXPECT_THROW((void)localise_hierarchically(place.memory, areas, query, {.components = 16}),
               ContractError);
}

}  // namespace
}  // namespace panonav::testing
