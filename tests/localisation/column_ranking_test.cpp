#include "panonav/localisation/column_ranking.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "panonav/core/error.hpp"
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

TEST(ColumnRanking, IsInOrderAndTheSameWhetherProfilesAreKept) {
  const RememberedRoom place(61, {}, 0.4);
  const ColumnRanking kept(place.memory);
  const ColumnRanking made_anew(place.memory, 0, 1);
  Random random(1);
  for (int i = 0; i < 10; ++i) {
    const PackedSignature query =
        pack(compute_signature(place.room.see(place.room.between(place.grid, 0.4, random))),
             place.memory.full_scale());
    const SearchResult found = place.memory.search(query, {.top = 20});
    const auto ranked = kept.rank(query, found.matches);
    const auto again = made_anew.rank(query, found.matches);
    ASSERT_EQ(ranked.size(), found.matches.size());
    for (std::size_t k = 0; k < ranked.size(); ++k) {
      EXPECT_EQ(ranked[k].match, again[k].match);
      EXPECT_EQ(ranked[k].columns.difference, again[k].columns.difference);
      EXPECT_TRUE(std::ranges::find(found.matches, ranked[k].match) != found.matches.end());
      if (k > 0) {
        EXPECT_GE(ranked[k].score(), ranked[k - 1].score());
      }
    }
  }
  EXPECT_THROW((void)ColumnRanking(place.memory, 16), ContractError);
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
