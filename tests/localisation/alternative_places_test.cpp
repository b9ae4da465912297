#include "panonav/localisation/alternative_places.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

/// Places with one match each; the match's score is the number of its features.
std::vector<PlaceShare> make_places(int count) {
  std::vector<PlaceShare> places;
  for (int i = 0; i < count; ++i) {
    RankedMatch match;
    match.match.view = ViewId{static_cast<std::uint32_t>(i)};
    places.push_back({{match}, 1.0 / count});
  }
  return places;
}

VerifiedFeatureCounter count_as(const std::vector<std::optional<int>>& counts) {
  return [counts](const RankedMatch& match) { return counts.at(match.match.view.value); };
}

TEST(AlternativePlaces, MoreSharedFeaturesRaiseTheShareOfAPlace) {
  auto places = make_places(3);
  ASSERT_TRUE(share_probability_by_features(places, count_as({20, 30, 20})));
  EXPECT_EQ(places[0].matches[0].match.view, ViewId{1});
  EXPECT_EQ(places[0].matches[0].verified_features, 30);
  EXPECT_GT(places[0].share, 0.9);
  EXPECT_DOUBLE_EQ(places[1].share, places[2].share);
  EXPECT_NEAR(places[0].share + places[1].share + places[2].share, 1.0, 1e-12);

  // The odds depend on the difference of the numbers only.
  auto same = make_places(3);
  ASSERT_TRUE(share_probability_by_features(same, count_as({60, 70, 60})));
  EXPECT_DOUBLE_EQ(same[0].share, places[0].share);
}

TEST(AlternativePlaces, APlaceWithoutFeaturesLeavesTheSharesAsTheyWere) {
  auto places = make_places(2);
  places[0].share = 0.7;
  places[1].share = 0.3;
  EXPECT_FALSE(share_probability_by_features(places, count_as({20, std::nullopt})));
  EXPECT_EQ(places[0].share, 0.7);
  EXPECT_EQ(places[1].share, 0.3);
}

TEST(AlternativePlaces, TheRadiusHoldsWhicheverPlaceIsRight) {
  EXPECT_NEAR(radius_over_places(0.4, 1.0, {}), 0.4, 1e-12);
  Random random(5);
  for (const double share : {0.3, 0.6, 0.9, 0.945, 0.96, 0.98, 0.999}) {
    const double second = 0.8 * (1.0 - share);
    const std::vector<OtherPlace> others{{9.4, 1.0 - share - second}, {4.4, second}};
    const double radius_m = radius_over_places(0.4, share, others);
    const double deviation_m = 0.4 / std::sqrt(2.0 * std::log(20.0));
    constexpr int draws = 20'000;
    int inside = 0;
    for (int i = 0; i < draws; ++i) {
      const double place = random.uniform(0.0, 1.0);
      const double x_m = random.normal(0.0, deviation_m) + (place < share            ? 0.0
                                                            : place < share + second ? 4.0
                                                                                     : 9.0);
      inside += std::hypot(x_m, random.normal(0.0, deviation_m)) <= radius_m ? 1 : 0;
    }
    EXPECT_GE(inside, 0.945 * draws) << share;
    EXPECT_LE(radius_m, share >= 0.96 ? 0.6 : share >= 0.8 ? 4.4 : 9.4) << share;
  }
}

/// Half a hall, which looks the same after half a turn about its centre.
struct SymmetricHall {
  static constexpr Point2 sum{10.0, 4.0};  // of a position and of that after half a turn
  Room half{53, {5.0, 4.0, 4, 0.12}};
  Random random{53};
  VisualMemory memory;

  explicit SymmetricHall(double spacing_m) : memory(remember(spacing_m)) {}

  PackedSignature see(const Pose2& pose) {
    return pack(compute_signature(half.see(pose, 16, 96, {1.0, 0.01}, random.next())),
                memory.full_scale());
  }

 private:
  VisualMemory remember(double spacing_m) {
    std::vector<FourierSignature> signatures;
    std::vector<std::optional<ReferencePose>> poses;
    for (double x_m = 0.3; x_m < 5.0; x_m += spacing_m) {
      for (double y_m = 0.3; y_m < 4.0; y_m += spacing_m) {
        if (!half.is_free({x_m, y_m})) continue;
        for (const bool is_opposite : {false, true}) {
          signatures.push_back(
              compute_signature(half.see({x_m, y_m, 0.0}, 16, 96, {1.0, 0.01}, random.next())));
          poses.push_back(is_opposite
                              ? ReferencePose{sum.x_m - x_m, sum.y_m - y_m, -std::numbers::pi}
                              : ReferencePose{x_m, y_m, 0.0});
        }
      }
    }
    return make_memory(signatures, poses);
  }
};

// Near the centre the two sides are nearer to each other than three spacings.
TEST(AlternativePlaces, AreNamedWhereTheyAreNearButTurned) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  SymmetricHall hall(0.5);
  const Localiser localiser(hall.memory);
  int known = 0;
  int named = 0;
  int within = 0;
  for (int i = 0; i < 60; ++i) {
    const Pose2 pose{hall.random.uniform(4.0, 4.7), hall.random.uniform(0.6, 3.4),
                     hall.random.uniform(-3.0, 3.0)};
    if (!hall.half.is_free(pose.position())) continue;
    const Place found = localiser.localise(hall.see(pose));
    if (!found.known) continue;
    ++known;
    ASSERT_TRUE(found.position && found.position->radius_m);
    EXPECT_LE(found.probability, found.known_probability);
    named += found.alternatives.empty() ? 0 : 1;
    // The answer chooses either of two equal sides.
    const bool is_opposite = i % 2 == 0;
    const Point2 truth =
        is_opposite ? Point2{SymmetricHall::sum.x_m - pose.x_m, SymmetricHall::sum.y_m - pose.y_m}
                    : pose.position();
    within += distance(found.position->position(), truth) <= *found.position->radius_m ? 1 : 0;
  }
  ASSERT_GE(known, 25);
  EXPECT_GE(named, 0.9 * known);
  EXPECT_GE(within, 0.9 * known);
}

// With a model that tells places hardly apart, the particles stay where they are.
TEST(AlternativePlaces, ATrackedPoseIsDoubtedWhereTheImageFitsAnotherPlaceBetter) {
  const RememberedRoom place(31, {5.0, 4.0, 4, 0.15}, 0.4);
  auto ranking = std::make_shared<const ColumnRanking>(place.memory);
  ObservationModel model = learn_observation_model(*ranking, {.sampled_views = 8});
  model.sharpness *= 1e-3;
  const auto see = [&](const Pose2& pose, double noise_deviation) {
    return pack(compute_signature(place.room.see(pose, 16, 96, {1.0, noise_deviation}, 7)),
                place.memory.full_scale());
  };
  const auto view_pose = [&](std::size_t i) {
    const ReferencePose pose = *place.memory.info(place.memory.views()[i]).pose;
    return Pose2{pose.x_m, pose.y_m, *pose.heading_rad};
  };
  const Pose2 here = view_pose(0);
  const Pose2 there = view_pose(place.memory.size() - 1);
  ASSERT_GE(distance(here.position(), there.position()), 3.0);
  MonteCarloLocaliser filter(ranking, model);
  filter.start_at(here, 0.05, 0.05);
  const auto before = filter.observe(see(here, 0.01));
  ASSERT_EQ(before.state, LocalisationState::localised);
  EXPECT_GE(before.probability, 0.9);
  // Carried elsewhere without a motion of the odometry.
  for (int i = 0; i < 3; ++i) {
    const auto after = filter.observe(see(there, 0.01));
    ASSERT_TRUE(after.position);
    ASSERT_LE(distance(*after.position, here.position()), 0.5) << "else the test shows nothing";
    EXPECT_NE(after.state, LocalisationState::localised);
    EXPECT_LE(after.probability, 0.5);
  }
  // An image that shows no place at all is no evidence against the tracked one.
  const auto noise = filter.observe(see(here, 5.0));
  EXPECT_GE(noise.difference_anywhere.value(), model.explained_difference);
  EXPECT_EQ(noise.state, LocalisationState::localised);
}

}  // namespace
}  // namespace panonav::testing
