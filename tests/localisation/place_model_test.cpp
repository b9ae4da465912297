#include "panonav/localisation/place_model.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/localisation/localiser.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

Panorama some_view(std::uint64_t seed) {
  const Room room(seed, {});
  const std::vector<Point2> grid = room.grid(0.5);
  return room.see({grid.at(0).x_m, grid.at(0).y_m, 0.4}, 16, 96);
}

TEST(PlaceModel, OfATinyMemoryIsNotLearnt) {
  const Room room(7, {});
  const std::vector<Point2> grid = room.grid(0.5);
  std::vector<FourierSignature> views;
  for (int i = 0; i < PlaceModel::min_views - 1; ++i) {
    views.push_back(compute_signature(room.see({grid[i].x_m, grid[i].y_m, 0.0})));
    const VisualMemory memory = make_memory(views);
    const PlaceModel model = learn_place_model(ColumnRanking(memory));
    EXPECT_FALSE(model.learnt);
    EXPECT_EQ(model.threshold, PlaceModel::unlearnt_threshold);
    // The view itself, turned, is known; a view of another room is not.
    const Localiser localiser(memory);
    EXPECT_TRUE(localiser.localise(pack(turn(views[0], 1.0), memory.full_scale())).known);
    EXPECT_FALSE(
        localiser.localise(pack(compute_signature(some_view(99)), memory.full_scale())).known);
  }
  const VisualMemory empty({16, 15}, 1.0F, std::nullopt);
  EXPECT_FALSE(learn_place_model(ColumnRanking(empty)).learnt);
  EXPECT_FALSE(Localiser(empty).localise(pack(views[0], 1.0F)).known);
}

TEST(PlaceModel, OfARobotThatStoodStillKnowsItsPlaceTurnedAndNoOther) {
  const FourierSignature view = compute_signature(some_view(8));
  const std::vector<FourierSignature> views(20, view);
  const VisualMemory memory = make_memory(views);
  const Localiser localiser(memory);
  EXPECT_TRUE(localiser.localise(pack(turn(view, 2.0), memory.full_scale())).known);
  EXPECT_FALSE(
      localiser.localise(pack(compute_signature(some_view(9)), memory.full_scale())).known);
}

TEST(PlaceModel, IsTheSameForTheSameSeedAndBoundedInItsSample) {
  const RememberedRoom place(11, {}, 0.4);
  const PlaceModelOptions options{.sampled_views = 20};
  const PlaceModel a = learn_place_model(ColumnRanking(place.memory), options);
  const PlaceModel b = learn_place_model(ColumnRanking(place.memory), options);
  EXPECT_TRUE(a.learnt);
  EXPECT_EQ(a.sampled_views, 20);
  EXPECT_EQ(a.threshold, b.threshold);
  EXPECT_NE(
      a.threshold,
      learn_place_model(ColumnRanking(place.memory), {.sampled_views = 20, .seed = 2}).threshold);
  EXPECT_THROW((void)learn_place_model(ColumnRanking(place.memory), {.compared_views = 1}),
               OptionError);
}

TEST(PlaceModel, DoesNotNeedPoses) {
  const RememberedRoom place(12, {}, 0.4);
  VisualMemory without = place.memory;
  for (const ViewId view : without.views()) without.set_pose(view, std::nullopt);
  const PlaceModel blind = learn_place_model(ColumnRanking(without));
  const PlaceModel posed = learn_place_model(ColumnRanking(place.memory));
  EXPECT_TRUE(blind.learnt && posed.learnt && posed.beside);
  EXPECT_FALSE(blind.beside);
  EXPECT_EQ(blind.mirrored, posed.mirrored);
  // Positions can only make it stricter.
  EXPECT_GE(blind.threshold, posed.threshold);
}

// Rooms of several kinds, each remembered on a 25 cm grid, each asked for views between its own
// references with noise, and for views of all other rooms.
TEST(PlaceModel, AcceptsItsOwnPlacesAndRefusesOtherRooms) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const std::array kinds = {RoomKind{4.0, 3.0, 1, 0.2}, RoomKind{4.0, 3.5, 8, 0.15},
                            RoomKind{3.5, 3.5, 4, 0.04}, RoomKind{9.0, 1.8, 2, 0.12}};
  constexpr double step_m = 0.25;
  constexpr int queries = 50;
  std::vector<std::unique_ptr<RememberedRoom>> rooms;
  std::vector<std::vector<PackedSignature>> asked;
  std::vector<std::vector<FourierSignature>> seen;
  for (std::uint64_t seed = 100; seed < 108; ++seed) {
    rooms.push_back(std::make_unique<RememberedRoom>(seed, kinds[seed % kinds.size()], step_m));
    Random random(seed, 2);
    seen.emplace_back();
    for (int i = 0; i < queries; ++i) {
      const Pose2 pose = rooms.back()->room.between(rooms.back()->grid, step_m, random);
      seen.back().push_back(compute_signature(
          rooms.back()->room.see(pose, 16, 96, {random.uniform(0.95, 1.05), 0.01}, random.next())));
    }
  }
  int own_rejected = 0;
  int own = 0;
  int foreign_accepted = 0;
  int foreign = 0;
  for (std::size_t i = 0; i < rooms.size(); ++i) {
    const VisualMemory& memory = rooms[i]->memory;
    const Localiser localiser(memory);
    EXPECT_TRUE(localiser.place_model().learnt);
    for (std::size_t j = 0; j < rooms.size(); ++j) {
      for (const FourierSignature& view : seen[j]) {
        const bool known = localiser.localise(pack(view, memory.full_scale())).known;
        (i == j ? own : foreign) += 1;
        if (i == j && !known) ++own_rejected;
        if (i != j && known) ++foreign_accepted;
      }
    }
  }
  RecordProperty("own_rejected_per_mille", 1000 * own_rejected / own);
  RecordProperty("foreign_accepted_per_mille", 1000 * foreign_accepted / foreign);
  EXPECT_LE(own_rejected, 0.05 * own);
  EXPECT_LE(foreign_accepted, 0.01 * foreign);
}

}  // namespace
}  // namespace panonav::testing
