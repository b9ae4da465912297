#include "panonav/localisation/column_ranking.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/localisation/internal/profile_cache.hpp"
#include "panonav/localisation/localiser.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

/// Somebody stands before a tenth of the columns, in one grey.
Panorama with_somebody_in_view(Panorama view, Random& random) {
  const int columns = view.columns();
  const auto first = static_cast<int>(random.index(static_cast<std::uint64_t>(columns)));
  const auto grey = static_cast<float>(random.uniform(0.0, 1.0));
  for (int y = 0; y < view.rows(); ++y) {
    for (int i = 0; i < columns / 10; ++i) view.at(y, (first + i) % columns) = grey;
  }
  return view;
}

std::vector<PackedSignature> random_queries(const RememberedRoom& place, int count) {
  Random random(1);
  std::vector<PackedSignature> queries;
  for (int i = 0; i < count; ++i) {
    queries.push_back(
        pack(compute_signature(place.room.see(place.room.between(place.grid, 0.4, random))),
             place.memory.full_scale()));
  }
  return queries;
}

void expect_same(const std::vector<RankedMatch>& a, const std::vector<RankedMatch>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].match, b[k].match);
    EXPECT_EQ(a[k].columns.difference, b[k].columns.difference);
    EXPECT_EQ(a[k].columns.heading_rad, b[k].columns.heading_rad);
  }
}

TEST(ColumnRanking, IsInOrderAndTheSameForEveryNumberOfCachedProfiles) {
  const RememberedRoom place(61, {}, 0.4);
  ASSERT_GT(place.memory.size(), 60);
  const ColumnRanking uncached(place.memory, 0, 0);
  for (const std::size_t max_cached : {std::size_t{1}, std::size_t{7}, std::size_t{1000}}) {
    const ColumnRanking ranking(place.memory, 0, max_cached);
    for (const PackedSignature& query : random_queries(place, 10)) {
      const SearchResult found = place.memory.search(query, {.top = 20});
      const auto ranked = ranking.rank(query, found.matches);
      expect_same(ranked, uncached.rank(query, found.matches));
      EXPECT_LE(ranking.cached_profiles(), max_cached);
      EXPECT_GE(ranking.cached_profiles(), std::min<std::size_t>(max_cached, 20));
      ASSERT_EQ(ranked.size(), found.matches.size());
      for (std::size_t k = 0; k < ranked.size(); ++k) {
        EXPECT_TRUE(std::ranges::find(found.matches, ranked[k].match) != found.matches.end());
        if (k > 0) {
          EXPECT_GE(ranked[k].score(), ranked[k - 1].score());
        }
      }
    }
  }
  EXPECT_EQ(uncached.cached_profiles(), 0);
  EXPECT_THROW((void)ColumnRanking(place.memory, 16), ContractError);
}

TEST(ColumnRanking, IsTheSameFromSeveralThreads) {
  const RememberedRoom place(61, {}, 0.4);
  const auto queries = random_queries(place, 24);
  const auto rank_all = [&](const ColumnRanking& ranking, int threads) {
    std::vector<std::vector<RankedMatch>> ranked(queries.size());
    Executor executor(threads);
    executor.for_each_chunk(queries.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
      ranked[i] = ranking.rank(queries[i], place.memory.search(queries[i], {.top = 30}).matches);
    });
    return ranked;
  };
  const ColumnRanking alone(place.memory);
  const ColumnRanking shared(place.memory, 0, 5);
  const auto expected = rank_all(alone, 1);
  const auto found = rank_all(shared, 4);
  for (std::size_t i = 0; i < queries.size(); ++i) expect_same(found[i], expected[i]);
  EXPECT_EQ(shared.cached_profiles(), 5);
}

TEST(ColumnRanking, LocalisesEquallyWithFewCachedProfiles) {
  const RememberedRoom place(61, {}, 0.4);
  const Localiser localiser(place.memory);
  const auto queries = random_queries(place, 10);
  std::vector<Place> first;
  for (const PackedSignature& query : queries) first.push_back(localiser.localise(query));
  for (std::size_t i = 0; i < queries.size(); ++i) {  // with cached profiles
    const Place again = localiser.localise(queries[i]);
    EXPECT_EQ(again.known_probability, first[i].known_probability);
    ASSERT_EQ(again.matches.size(), first[i].matches.size());
    EXPECT_EQ(again.matches[0].view, first[i].matches[0].view);
    ASSERT_TRUE(again.position && first[i].position);
    EXPECT_EQ(again.position->x_m, first[i].position->x_m);
  }
}

TEST(ProfileCache, DropsTheProfilesThatWereNotRequestedForTheLongestTime) {
  const RememberedRoom place(61, {}, 0.4);
  const auto make = [&](std::size_t i) {
    return std::make_shared<const ColumnProfiles>(place.memory.packed(place.memory.views()[i]));
  };
  ProfileCache cache(3);
  for (std::uint32_t i = 0; i < 3; ++i) cache.insert({i}, make(i));
  const auto first = cache.find({0});
  ASSERT_TRUE(first);
  cache.insert({3}, make(3));
  EXPECT_FALSE(cache.find({1})) << "requested before all others";
  EXPECT_EQ(cache.find({0}), first);
  ASSERT_TRUE(cache.find({3}));
  EXPECT_EQ(*cache.find({3}), *make(3));
  EXPECT_EQ(cache.size(), 3);
  cache.insert({3}, make(1));  // already cached
  EXPECT_EQ(*cache.find({3}), *make(3));
  EXPECT_EQ(cache.size(), 3);
}

TEST(ColumnRanking, FindsThePlaceWhereSomebodyStandsInView) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  int by_columns = 0;
  int by_dissimilarity = 0;
  int queries = 0;
  double heading_error = 0.0;
  for (std::uint64_t seed = 70; seed < 74; ++seed) {
    const RememberedRoom place(seed, {6.0, 4.0, 4, 0.15}, 0.4);
    const Localiser localiser(place.memory);
    const Localiser plain(place.memory, localiser.place_model(), localiser.position_model(),
                          {.reranked_views = 0});
    Random random(seed, 5);
    for (int i = 0; i < 25; ++i) {
      const Pose2 pose = place.room.between(place.grid, place.step_m, random);
      const PackedSignature query =
          pack(compute_signature(with_somebody_in_view(place.room.see(pose), random)),
               place.memory.full_scale());
      const auto error_m = [&](const Place& found) {
        return distance(place.memory.info(found.matches[0].view).pose->position(), pose.position());
      };
      const Place found = localiser.localise(query);
      by_columns += error_m(found) < place.step_m ? 1 : 0;
      by_dissimilarity += error_m(plain.localise(query)) < place.step_m ? 1 : 0;
      const PlaceMatch& best = found.matches[0];
      heading_error += std::abs(angle_difference(
          *place.memory.info(best.view).pose->heading_rad + *best.heading_rad, pose.heading_rad));
      ++queries;
    }
  }
  RecordProperty("by_columns", by_columns);
  RecordProperty("by_dissimilarity", by_dissimilarity);
  EXPECT_GE(by_columns, 0.95 * queries);
  EXPECT_LE(by_dissimilarity, 0.9 * queries) << "the test asks nothing";
  EXPECT_LE(heading_error / queries, radians(4.0));
}

}  // namespace
}  // namespace panonav::testing
