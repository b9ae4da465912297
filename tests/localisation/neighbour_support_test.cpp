#include "panonav/localisation/neighbour_support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "panonav/localisation/localiser.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

TEST(NeighbourSupport, NeighboursOfAGridAreTheEightAround) {
  const RememberedRoom place(81, {4.0, 4.0, 0, 0.15}, 0.5);
  const ColumnRanking ranking(place.memory);
  const NeighbourSupport support(ranking);
  int inner = 0;
  for (const ViewId view : place.memory.views()) {
    const Point2 at = place.memory.info(view).pose->position();
    const std::vector<ViewId> found = support.neighbours(view);
    for (const ViewId other : found) {
      EXPECT_NE(other, view);
      EXPECT_LE(distance(place.memory.info(other).pose->position(), at), 0.5 * 1.5);
    }
    // Compares all by brute force.
    const auto near = std::ranges::count_if(place.memory.views(), [&](ViewId other) {
      return other != view && distance(place.memory.info(other).pose->position(), at) <= 0.75;
    });
    EXPECT_EQ(static_cast<std::ptrdiff_t>(found.size()), near);
    inner += found.size() == 8 ? 1 : 0;
  }
  EXPECT_GE(inner, 16);
}

TEST(NeighbourSupport, NeighboursAreOnTheSameFloor) {
  const RememberedRoom a(84, {4.0, 4.0, 0, 0.15}, 0.5);
  const RememberedRoom b(85, {4.0, 4.0, 0, 0.15}, 0.5);
  const VisualMemory memory = remember_floors(a, b);
  const ColumnRanking ranking(memory);
  const NeighbourSupport support(ranking);
  const ColumnRanking alone(a.memory);
  const NeighbourSupport expected(alone);
  EXPECT_DOUBLE_EQ(support.spacing_m(), expected.spacing_m());
  const auto names = [](const VisualMemory& of, const std::vector<ViewId>& views) {
    std::vector<std::string> all;
    for (const ViewId view : views) all.push_back(of.info(view).name);
    return all;
  };
  for (const ViewId view : a.memory.views()) {
    auto on_a = names(a.memory, expected.neighbours(view));
    for (std::string& name : on_a) name = make_name_on_floor("a", name);
    const ViewId here = *memory.find(make_name_on_floor("a", a.memory.info(view).name));
    EXPECT_EQ(names(memory, support.neighbours(here)), on_a);
  }
}

TEST(NeighbourSupport, OfAViewWithoutNeighboursIsItsOwnDifference) {
  const RememberedRoom place(82, {}, 0.4);
  Random random(3);
  const PackedSignature query =
      pack(compute_signature(place.room.see(place.room.between(place.grid, 0.4, random))),
           place.memory.full_scale());
  const auto ranked =
      ColumnRanking(place.memory).rank(query, place.memory.search(query, {.top = 5}).matches);
  VisualMemory memory = place.memory;
  memory.set_pose(ranked.at(0).match.view, ReferencePose{1000.0, 0.0, 0.0});
  const ColumnRanking ranking(memory);
  const NeighbourSupport support(ranking);
  EXPECT_TRUE(support.neighbours(ranked[0].match.view).empty());
  const auto found = support.supported_difference(ColumnProfiles(query), ranked[0]);
  ASSERT_TRUE(found);
  // Each column may choose between three turns.
  EXPECT_LE(*found, ranked[0].columns.difference + 1e-3);
  EXPECT_GT(*found, 0.7 * ranked[0].columns.difference);
}

TEST(NeighbourSupport, NeedsHeadings) {
  const RememberedRoom place(83, {}, 0.4);
  VisualMemory memory = place.memory;
  for (const ViewId view : memory.views()) {
    ReferencePose pose = *memory.info(view).pose;
    pose.heading_rad.reset();
    memory.set_pose(view, pose);
  }
  const ColumnRanking ranking(memory);
  const NeighbourSupport support(ranking);
  const PackedSignature query = memory.packed(memory.views()[4]);
  auto ranked = ranking.rank(query, memory.search(query, {.top = 20}).matches);
  const auto before = ranked;
  EXPECT_TRUE(support.neighbours(memory.views()[4]).empty());
  EXPECT_FALSE(support.supported_difference(ColumnProfiles(query), ranked[0]));
  support.rank_by_support(ColumnProfiles(query), ranked);
  for (std::size_t i = 0; i < ranked.size(); ++i) EXPECT_EQ(ranked[i].match, before[i].match);
}

TEST(NeighbourSupport, PutsThePlaceAndItsNeighboursFirst) {
  const RememberedRoom place(84, {5.0, 4.0, 3, 0.15}, 0.4);
  const ColumnRanking ranking(place.memory);
  const NeighbourSupport support(ranking);
  Random random(4);
  int first_right = 0;
  for (int i = 0; i < 30; ++i) {
    const Pose2 pose = place.room.between(place.grid, place.step_m, random);
    const PackedSignature query =
        pack(compute_signature(place.room.see(pose)), place.memory.full_scale());
    auto ranked = ranking.rank(query, place.memory.search(query, {.top = 60}).matches);
    const std::size_t size = ranked.size();
    support.rank_by_support(ColumnProfiles(query), ranked);
    ASSERT_EQ(ranked.size(), size);
    const Point2 best = place.memory.info(ranked[0].match.view).pose->position();
    first_right += distance(best, pose.position()) < place.step_m ? 1 : 0;
    // A group of neighbours, in order, then all others, in order.
    std::size_t k = 1;
    while (k < size && ranked[k].score() >= ranked[k - 1].score()) {
      ++k;
    }
    for (std::size_t j = k + 1; j < size; ++j) {
      EXPECT_GE(ranked[j].score(), ranked[j - 1].score());
    }
  }
  EXPECT_GE(first_right, 29);
}

}  // namespace
}  // namespace panonav::testing
