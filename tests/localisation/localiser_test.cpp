#include "panonav/localisation/localiser.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

TEST(Localiser, FindsAMemorisedViewItsPositionAndTheTurn) {
  const RememberedRoom place(51, {}, 0.4);
  const Localiser localiser(place.memory);
  Random random(1);
  for (const ViewId view : place.memory.views()) {
    const ReferencePose& truth = *place.memory.info(view).pose;
    const Place same = localiser.localise(place.memory.packed(view));
    EXPECT_TRUE(same.known);
    EXPECT_EQ(same.matches[0].view, view);
    EXPECT_EQ(same.matches[0].dissimilarity, 0U);
    ASSERT_TRUE(same.position && same.heading_rad);
    EXPECT_NEAR(distance(same.position->position(), truth.position()), 0.0, 1e-6);
    EXPECT_NEAR(angle_difference(*same.heading_rad, *truth.heading_rad), 0.0, 1e-6);

    // A turn on the spot changes the heading and nothing else, but for rounding to bytes.
    const double turned_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
    const Place turned = localiser.localise(
        pack(turn(place.memory.signature(view), turned_rad), place.memory.full_scale()));
    EXPECT_TRUE(turned.known);
    ASSERT_EQ(turned.matches.size(), same.matches.size());
    EXPECT_EQ(turned.matches[0].view, view);
    EXPECT_EQ(turned.matches[0].dissimilarity, 0U);
    ASSERT_TRUE(turned.matches[0].heading_rad);
    EXPECT_NEAR(angle_difference(*turned.matches[0].heading_rad, turned_rad), 0.0, radians(0.5));
    ASSERT_TRUE(turned.heading_rad);
    EXPECT_NEAR(angle_difference(*turned.heading_rad, *truth.heading_rad + turned_rad), 0.0,
                radians(0.5));
    // The turn lies between two steps of the columns.
    EXPECT_LT(distance(turned.position->position(), truth.position()), 0.25 * place.step_m);
  }
}

TEST(Localiser, TellsTheFloorAndUsesOnlyItsViews) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const RememberedRoom a(61, {}, 0.4);
  const RememberedRoom b(62, {}, 0.4);
  const VisualMemory memory = remember_floors(a, b);
  const Localiser localiser(memory);
  EXPECT_NEAR(localiser.position_model().spacing_m, 0.4, 1e-6);
  EXPECT_NEAR(NeighbourSupport(ColumnRanking(memory)).spacing_m(), 0.4, 1e-6);
  Random random(61);
  int known = 0;
  int near = 0;
  for (int i = 0; i < 60; ++i) {
    const RememberedRoom& room = i % 2 == 0 ? a : b;
    const std::string floor = i % 2 == 0 ? "a" : "b";
    const Pose2 pose = room.room.between(room.grid, 0.4, random);
    const Place place =
        localiser.localise(pack(compute_signature(room.room.see(pose)), memory.full_scale()));
    if (!place.known) continue;
    ++known;
    EXPECT_EQ(place.floor(), floor);
    ASSERT_TRUE(place.position);
    near += distance(place.position->position(), pose.position()) <= 0.4 ? 1 : 0;
    for (const PositionEstimate::Share& share : place.position->shares) {
      EXPECT_EQ(floor_of(memory.info(share.view).name), floor);
    }
    for (const AlternativePlace& other : place.alternatives) {
      EXPECT_EQ(floor_of(other.match.name), other.floor());
    }
  }
  EXPECT_GE(known, 54);
  EXPECT_GE(near, known - 3);
}

// The hall looks the same after half a turn about its centre.
TEST(Localiser, NamesTheOppositeSideOfASymmetricHallAndSharesTheProbability) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const Room half(53, {5.0, 4.0, 4, 0.12});
  constexpr Point2 sum{10.0, 4.0};  // of a position and of that after half a turn
  Random random(53);
  std::vector<FourierSignature> signatures;
  std::vector<std::optional<ReferencePose>> poses;
  const auto add_grid = [&](Point2 first, bool is_opposite) {
    for (double x_m = first.x_m; x_m < 5.0; x_m += 0.3) {
      for (double y_m = first.y_m; y_m < 4.0; y_m += 0.3) {
        if (!half.is_free({x_m, y_m})) continue;
        signatures.push_back(
            compute_signature(half.see({x_m, y_m, 0.0}, 16, 96, {1.0, 0.01}, random.next())));
        poses.push_back(is_opposite ? ReferencePose{sum.x_m - x_m, sum.y_m - y_m, -std::numbers::pi}
                                    : ReferencePose{x_m, y_m, 0.0});
      }
    }
  };
  add_grid({0.3, 0.3}, false);
  const VisualMemory one_side = make_memory(signatures, poses);
  add_grid({0.4, 0.25}, true);
  const VisualMemory both_sides = make_memory(signatures, poses);
  const Localiser with_one(one_side);
  const Localiser with_both(both_sides);
  int known = 0;
  int named = 0;
  int named_with_one = 0;
  for (int i = 0; i < 40; ++i) {
    const Pose2 pose{random.uniform(0.6, 4.4), random.uniform(0.6, 3.4), random.uniform(-3.0, 3.0)};
    if (!half.is_free(pose.position())) continue;
    const FourierSignature seen =
        compute_signature(half.see(pose, 16, 96, {1.0, 0.01}, random.next()));
    const Place single = with_one.localise(pack(seen, one_side.full_scale()));
    named_with_one += single.alternatives.empty() ? 0 : 1;
    const Place found = with_both.localise(pack(seen, both_sides.full_scale()));
    if (!found.known) continue;
    ++known;
    double shared = found.probability;
    for (const AlternativePlace& other : found.alternatives) {
      EXPECT_GE(other.probability, 0.05 * found.known_probability);
      shared += other.probability;
    }
    EXPECT_LE(shared, found.known_probability + 1e-9);  // others are too improbable to be named
    EXPECT_GE(shared, 0.8 * found.known_probability);
    if (found.alternatives.empty()) continue;
    const AlternativePlace& other = found.alternatives.front();
    ASSERT_TRUE(other.position && other.heading_rad);
    const bool is_opposite =
        std::abs(found.position->x_m + other.position->x_m - sum.x_m) < 0.3 &&
        std::abs(found.position->y_m + other.position->y_m - sum.y_m) < 0.3 &&
        std::abs(angle_difference(*found.heading_rad, *other.heading_rad + std::numbers::pi)) <
            radians(15.0);
    named += is_opposite && found.probability < 0.95 * found.known_probability ? 1 : 0;
  }
  EXPECT_GE(known, 25);
  EXPECT_GE(named, 0.9 * known);
  EXPECT_LE(named_with_one, 0.1 * known);
}

// Leaving a view out is only then honest when its neighbours are not supported by it either.
TEST(Localiser, AnExcludedViewTellsAsMuchAsOneThatIsNotThere) {
  const RememberedRoom place(51, {}, 0.4);
  const Localiser whole(place.memory);
  int known = 0;
  for (const ViewId view : place.memory.views()) {
    VisualMemory others = place.memory;
    others.remove(view);
    const Localiser without(others, whole.place_model(), whole.position_model(), {}, 0.4);
    const PackedSignature query = place.memory.packed(view);
    const Place expected = without.localise(query);
    const std::array excluded{view};
    const Place found = whole.localise(query, {.excluded_views = excluded});
    ASSERT_EQ(found.matches.size(), expected.matches.size());
    for (std::size_t i = 0; i < found.matches.size(); ++i) {
      EXPECT_EQ(found.matches[i].view, expected.matches[i].view);
    }
    EXPECT_EQ(found.known_probability, expected.known_probability);
    ASSERT_EQ(found.position.has_value(), expected.position.has_value());
    if (!found.position) continue;
    ++known;
    EXPECT_EQ(found.position->position(), expected.position->position());
  }
  EXPECT_GE(known, 10);
}

TEST(Localiser, HeadingBetweenReferencesIsBetterThanByTheNearestAlone) {
  const RememberedRoom place(52, {}, 0.3);
  const Localiser localiser(place.memory);
  Random random(2);
  double sum_interpolated = 0.0;
  double sum_nearest = 0.0;
  int count = 0;
  for (int i = 0; i < 80; ++i) {
    const Pose2 pose = place.room.between(place.grid, place.step_m, random);
    const Place found = localiser.localise(
        pack(compute_signature(place.room.see(pose)), place.memory.full_scale()));
    if (!found.heading_rad) continue;
    const auto& nearest = found.matches[0];
    const double of_nearest =
        *place.memory.info(nearest.view).pose->heading_rad + *nearest.heading_rad;
    sum_interpolated += std::abs(angle_difference(*found.heading_rad, pose.heading_rad));
    sum_nearest += std::abs(angle_difference(of_nearest, pose.heading_rad));
    ++count;
  }
  ASSERT_GE(count, 76);
  EXPECT_LT(sum_interpolated, 0.9 * sum_nearest);
  EXPECT_LT(sum_interpolated / count, radians(1.0));
}

TEST(Localiser, ListsMatchesOfAnUnknownPlaceButClaimsNothing) {
  const RememberedRoom place(53, {}, 0.3);
  const Localiser localiser(place.memory, {.top = 4});
  const Room elsewhere(777, {6.0, 3.0, 6, 0.2});
  const Place found = localiser.localise(
      pack(compute_signature(elsewhere.see({3.0, 1.5, 0.0})), place.memory.full_scale()));
  EXPECT_FALSE(found.known);
  EXPECT_EQ(found.matches.size(), 4U);
  EXPECT_FALSE(found.position);
  EXPECT_FALSE(found.heading_rad);
  EXPECT_GT(found.bytes_read, 0U);
}

TEST(Localiser, KnowsNoAbsoluteHeadingWithoutHeadingsAndNoPositionWithoutPoses) {
  RememberedRoom place(54, {}, 0.4);
  for (const ViewId view : place.memory.views()) {
    ReferencePose pose = *place.memory.info(view).pose;
    pose.heading_rad.reset();
    place.memory.set_pose(view, pose);
  }
  const PackedSignature query = place.memory.packed(place.memory.views()[5]);
  const Place without_heading = Localiser(place.memory).localise(query);
  EXPECT_TRUE(without_heading.known && without_heading.position);
  EXPECT_FALSE(without_heading.heading_rad);
  EXPECT_TRUE(without_heading.matches[0].heading_rad);
  for (const ViewId view : place.memory.views()) place.memory.set_pose(view, std::nullopt);
  const Place without_pose = Localiser(place.memory).localise(query);
  EXPECT_TRUE(without_pose.known);
  EXPECT_FALSE(without_pose.position);
  EXPECT_FALSE(without_pose.heading_rad);
}

TEST(Localiser, LeavesOutExcludedViewsAndRowsThatDoNotCount) {
  const RememberedRoom place(55, {}, 0.4);
  const Localiser localiser(place.memory);
  const ViewId view = place.memory.views()[7];
  const std::array excluded = {view};
  const Place others = localiser.localise(place.memory.packed(view),
                                          {.excluded_views = excluded, .allowed_rows = {}});
  for (const PlaceMatch& match : others.matches) EXPECT_NE(match.view, view);
  // Four rows are spoilt; without them the view is found as if nothing had happened.
  PackedSignature spoilt = place.memory.packed(view);
  std::vector<std::uint8_t> allowed(16, 1);
  for (std::size_t i = 0; i < spoilt.magnitudes.size(); ++i) {
    if (i % 16 < 4) spoilt.magnitudes[i] = 255;
  }
  for (int row = 0; row < 4; ++row) allowed[row] = 0;
  const Place found = localiser.localise(spoilt, {.excluded_views = {}, .allowed_rows = allowed});
  EXPECT_EQ(found.matches[0].view, view);
  EXPECT_EQ(found.matches[0].dissimilarity, 0U);
  EXPECT_EQ(found.matches[0].column_difference, 0.0);
  EXPECT_TRUE(found.known);
}

TEST(Localiser, ComparesTheComponentsAskedFor) {
  const RememberedRoom place(56, {}, 0.4);
  const Localiser localiser(place.memory, {.components = 4});
  const Place found = localiser.localise(place.memory.packed(place.memory.views()[3]));
  EXPECT_EQ(found.components, 4);
  EXPECT_EQ(found.matches[0].dissimilarity, 0U);
  EXPECT_NEAR(distance(found.position->position(),
                       place.memory.info(place.memory.views()[3]).pose->position()),
              0.0, 1e-6);
}

TEST(Localiser, GivesTheSameAnswerWithModelsLearntBefore) {
  const RememberedRoom place(57, {}, 0.4);
  const Localiser one(place.memory);
  const Localiser two(place.memory, one.place_model(), one.position_model());
  Random random(3);
  const PackedSignature query =
      pack(compute_signature(place.room.see(place.room.between(place.grid, 0.4, random))),
           place.memory.full_scale());
  const Place a = one.localise(query);
  const Place b = two.localise(query);
  EXPECT_EQ(a.matches[0].column_difference, b.matches[0].column_difference);
  EXPECT_EQ(a.heading_rad, b.heading_rad);
  ASSERT_EQ(a.position.has_value(), b.position.has_value());
  if (a.position) {
    EXPECT_EQ(a.position->position(), b.position->position());
  }
  EXPECT_THROW(Localiser(place.memory, one.place_model(), one.position_model(), {.components = 3}),
               ContractError);
}

TEST(Localiser, AnswersByAnIndexAsTheHeldMemoryDoes) {
  const RememberedRoom place(57, {}, 0.4);
  const Localiser held(place.memory);
  const double spacing_m = NeighbourSupport(ColumnRanking(place.memory)).spacing_m();
  HeldViewIndex index(place.memory);
  const auto drawn = std::make_shared<const VisualMemory>(
      index.load(sample_reference_views(place.memory.views())));
  const Localiser searched(drawn, held.place_model(), held.position_model(), {}, spacing_m);
  const std::vector<ViewId> excluded{place.memory.views()[3]};
  Random random(4);
  PackedSignature query;
  for (int i = 0; i < 5; ++i) {
    query = pack(compute_signature(place.room.see(place.room.between(place.grid, 0.4, random))),
                 place.memory.full_scale());
    const Place expected = held.localise(query, {.excluded_views = excluded});
    const Place found = searched.localise(index, query, {.excluded_views = excluded});
    EXPECT_EQ(found.known_probability, expected.known_probability);
    EXPECT_EQ(found.heading_rad, expected.heading_rad);
    ASSERT_EQ(found.matches.size(), expected.matches.size());
    EXPECT_EQ(found.matches[0].view, expected.matches[0].view);
    EXPECT_EQ(found.matches[0].heading_rad, expected.matches[0].heading_rad);
  }
  EXPECT_THROW((void)searched.localise(query), ContractError);
}

TEST(Localiser, RefusesBadInput) {
  const RememberedRoom place(58, {}, 0.5);
  EXPECT_THROW(Localiser(place.memory, {.top = 0}), OptionError);
  EXPECT_THROW(Localiser(place.memory, {.components = 16}), ContractError);
  const Localiser localiser(place.memory);
  EXPECT_THROW(
      (void)localiser.localise(pack(compute_signature(place.room.see({1, 1, 0}), 10), 1.0F)),
      ContractError);
}

}  // namespace
}  // namespace panonav::testing
