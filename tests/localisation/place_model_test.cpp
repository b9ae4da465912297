#include "panonav/localisation/place_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
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
  const LearningOptions options{.sampled_views = 20};
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
  EXPECT_TRUE(blind.learnt && posed.learnt && posed.nearest_view_difference);
  EXPECT_FALSE(blind.nearest_view_difference);
  EXPECT_EQ(blind.mirrored_difference, posed.mirrored_difference);
  // Positions can only make it stricter.
  EXPECT_GE(blind.threshold, posed.threshold);
}

// A quarter of the view, as people who stand beside the robot hide it.
Panorama with_hidden_quarter(Panorama view, Random& random) {
  const int first = static_cast<int>(random.index(static_cast<std::uint64_t>(view.columns())));
  for (int y = 0; y < view.rows(); ++y) {
    for (int c = 0; c < view.columns() / 4; ++c) {
      view.at(y, (first + c) % view.columns()) = 0.1F;
    }
  }
  return view;
}

// Rooms of several kinds, each remembered on a 25 cm grid, each asked for views between its own
// references with noise, as they are and with a quarter hidden, for views of all other rooms and
// for noise.
TEST(PlaceModel, AcceptsItsOwnPlacesAndRefusesOtherRooms) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const std::array kinds = {RoomKind{4.0, 3.0, 1, 0.2}, RoomKind{4.0, 3.5, 8, 0.15},
                            RoomKind{3.5, 3.5, 4, 0.04}, RoomKind{9.0, 1.8, 2, 0.12}};
  constexpr double step_m = 0.25;
  constexpr int queries = 50;
  std::vector<std::unique_ptr<RememberedRoom>> rooms;
  std::vector<std::vector<FourierSignature>> seen;
  std::vector<std::vector<FourierSignature>> hidden;
  std::vector<FourierSignature> noise;
  Random noisy(4);
  for (std::uint64_t seed = 100; seed < 108; ++seed) {
    rooms.push_back(std::make_unique<RememberedRoom>(seed, kinds[seed % kinds.size()], step_m));
    Random random(seed, 2);
    seen.emplace_back();
    hidden.emplace_back();
    for (int i = 0; i < queries; ++i) {
      const Pose2 pose = rooms.back()->room.between(rooms.back()->grid, step_m, random);
      const Panorama view =
          rooms.back()->room.see(pose, 16, 96, {random.uniform(0.95, 1.05), 0.01}, random.next());
      seen.back().push_back(compute_signature(view));
      hidden.back().push_back(compute_signature(with_hidden_quarter(view, random)));
    }
  }
  for (int i = 0; i < queries; ++i) {
    Panorama view(16, 96, ElevationBand{radians(-30.0), radians(40.0)});
    for (float& value : view.values()) value = static_cast<float>(noisy.uniform(0.0, 1.0));
    noise.push_back(compute_signature(view));
  }
  struct Count {
    int total = 0, known = 0;
  };
  Count own, own_hidden, foreign, of_noise;
  int sure = 0;
  int sure_and_own = 0;
  for (std::size_t i = 0; i < rooms.size(); ++i) {
    const VisualMemory& memory = rooms[i]->memory;
    const Localiser localiser(memory);
    EXPECT_TRUE(localiser.place_model().learnt);
    const auto ask = [&](const std::vector<FourierSignature>& views, Count& count) {
      for (const FourierSignature& view : views) {
        const Place found = localiser.localise(pack(view, memory.full_scale()));
        EXPECT_EQ(found.known, found.known_probability >= 0.5);
        EXPECT_EQ(found.known, found.position.has_value());
        ++count.total;
        count.known += found.known ? 1 : 0;
        if (found.known_probability < 0.9) continue;
        ++sure;
        sure_and_own += &count == &own || &count == &own_hidden ? 1 : 0;
      }
    };
    for (std::size_t j = 0; j < rooms.size(); ++j) ask(seen[j], i == j ? own : foreign);
    ask(hidden[i], own_hidden);
    ask(noise, of_noise);
  }
  EXPECT_GE(own.known, 0.97 * own.total);
  EXPECT_GE(own_hidden.known, 0.93 * own_hidden.total);
  EXPECT_LE(foreign.known, 0.01 * foreign.total);
  EXPECT_EQ(of_noise.known, 0);
  EXPECT_GE(sure, own.known / 2);
  EXPECT_GE(sure_and_own, 0.95 * sure);
}

// A few views, one of them twice; views that are all alike; all components looked at, whatever the
// search compares.
TEST(PlaceModel, KnowsAViewAgainAndNoOtherRoomInUnusualMemories) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const RememberedRoom here(91, {4.0, 3.0, 4, 0.2}, 0.5);
  const RememberedRoom there(92, {4.0, 3.0, 4, 0.2}, 0.5);
  std::vector<FourierSignature> views;
  for (const ViewId view : here.memory.views()) views.push_back(here.memory.signature(view));
  const std::vector<FourierSignature> alike(20, views[0]);
  using Views = std::vector<FourierSignature>;
  const std::array memories{make_memory(Views{views[0]}),
                            make_memory(Views{views[0], views[0], views[9]}), make_memory(alike)};
  for (const VisualMemory& memory : memories) {
    const Localiser localiser(memory);
    EXPECT_GE(localiser.localise(memory.packed(memory.views()[0])).known_probability, 0.9);
    int known = 0;
    for (const ViewId view : there.memory.views()) {
      known += localiser.localise(pack(there.memory.signature(view), memory.full_scale())).known;
    }
    EXPECT_LE(known, 0.05 * static_cast<double>(there.memory.size()));
  }
  const Localiser coarse(here.memory, {.components = 2});
  int known = 0;
  for (const ViewId view : there.memory.views()) {
    known += coarse.localise(pack(there.memory.signature(view), here.memory.full_scale())).known;
  }
  EXPECT_LE(known, 0.02 * static_cast<double>(there.memory.size()));
}

TEST(PlaceModel, ProbabilityFallsWithTheDifferenceAndIsNoneWhereNothingIsSeen) {
  PlaceEvidence evidence{.chance = 0.6, .views = 200, .components = 15};
  double last = 1.0;
  for (const double difference : {0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6}) {
    evidence.difference = difference;
    evidence.difference_of_all_columns = difference;
    evidence.tenth_best_difference = difference + 0.1;
    const double probability = place_probability(evidence);
    EXPECT_GE(probability, 0.0);
    EXPECT_LE(probability, last);
    last = probability;
  }
  EXPECT_LT(last, 0.05);
  evidence.difference = evidence.difference_of_all_columns = 0.05;
  EXPECT_GT(place_probability(evidence), 0.99);
  evidence.chance = 0.0;
  EXPECT_EQ(place_probability(evidence), 0.0);
  EXPECT_EQ(place_probability({}), 0.0);
  // Fewer components resolve fewer columns, which agree more often by chance.
  evidence = {.difference = 0.3,
              .difference_of_all_columns = 0.4,
              .tenth_best_difference = 0.35,
              .chance = 0.5,
              .views = 200,
              .components = 15};
  const double of_many = place_probability(evidence);
  evidence.components = 2;
  EXPECT_LT(place_probability(evidence), of_many);
  // A picture of one brightness shows no place, not even where such pictures are remembered.
  const FourierSignature flat = compute_signature(Panorama(16, 96, std::nullopt));
  const VisualMemory memory = make_memory(std::vector<FourierSignature>(10, flat));
  const Place found = Localiser(memory).localise(pack(flat, memory.full_scale()));
  EXPECT_EQ(found.known_probability, 0.0);
  EXPECT_FALSE(found.known);
  EXPECT_FALSE(found.matches.empty());
}

TEST(PlaceModel, VerifiedFeaturesCountWhereColumnsLeaveDoubtAlone) {
  PlaceEvidence doubtful{.difference = 0.42,
                         .difference_of_all_columns = 0.5,
                         .tenth_best_difference = 0.48,
                         .chance = 0.62,
                         .views = 200,
                         .components = 15};
  const double by_columns = place_probability(doubtful);
  ASSERT_TRUE(is_inconclusive(doubtful));
  double last = 0.0;
  for (const int verified : {0, 5, 10, 20, 40}) {
    doubtful.features = {.verified = verified, .chance = 5, .neighbour = 30, .seen = 100};
    EXPECT_GT(place_probability(doubtful), last);
    last = place_probability(doubtful);
  }
  EXPECT_GT(last, std::max(0.9, by_columns));
  // As many by chance, or many more between neighbours, and it is another, similar place.
  for (const auto& [chance, neighbour] : {std::pair{30, 30}, {5, 200}}) {
    doubtful.features = {.verified = 25, .chance = chance, .neighbour = neighbour, .seen = 250};
    EXPECT_LT(place_probability(doubtful), 0.5);
  }
  // A view of few corners is no worse for having them counted.
  doubtful.features = {.verified = 2, .chance = 2, .neighbour = 2, .seen = 4};
  EXPECT_EQ(place_probability(doubtful), by_columns);
  for (const double difference : {0.1, 0.7}) {
    PlaceEvidence certain = doubtful;
    certain.difference = certain.difference_of_all_columns = difference;
    certain.features.reset();
    EXPECT_FALSE(is_inconclusive(certain));
    const double probability = place_probability(certain);
    certain.features = {.verified = 40, .chance = 5, .neighbour = 30, .seen = 100};
    EXPECT_EQ(place_probability(certain), probability);
  }
}

// A navigator asks so, which holds a part of the memory only.
TEST(PlaceModel, EvidenceForOneViewIsThatOfTheBestMatchWhereItIsTheOne) {
  const RememberedRoom place(11, {}, 0.4);
  const VisualMemory& memory = place.memory;
  const ColumnRanking ranking(memory);
  const PlaceCriterion whole(ranking);
  const PlaceCriterion in_parts{MemoryViewSource(memory)};
  Random random(5);
  for (int i = 0; i < 10; ++i) {
    const Point2 at = place.grid[random.index(place.grid.size())];
    const PackedSignature query =
        pack(compute_signature(place.room.see({at.x_m + 0.1, at.y_m, 0.4}, 16, 96)),
             memory.full_scale());
    const auto matches = ranking.rank(query, memory.search(query, {.top = 16}).matches);
    const PlaceEvidence best = whole.evidence(query, matches);
    std::vector<PackedSignature> views;
    for (const RankedMatch& match : matches) views.push_back(memory.packed(match.match.view));
    int found = 0;
    for (std::size_t first = 0; first < views.size(); ++first) {
      std::swap(views.front(), views[first]);
      const PlaceEvidence one = in_parts.evidence_for_first(query, views);
      EXPECT_EQ(one.tenth_best_difference, best.tenth_best_difference);
      EXPECT_EQ(one.chance, best.chance);
      EXPECT_EQ(one.views, best.views);
      EXPECT_EQ(one.components, best.components);
      EXPECT_GE(one.difference, best.difference);
      EXPECT_LE(place_probability(one), place_probability(best));
      found += one.difference == best.difference;
    }
    EXPECT_EQ(found, 1);
  }
  EXPECT_EQ(place_probability(in_parts.evidence_for_first(memory.packed(memory.views()[0]), {})),
            0.0);
}

}  // namespace
}  // namespace panonav::testing
