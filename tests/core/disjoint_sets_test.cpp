#include "panonav/core/disjoint_sets.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

TEST(DisjointSets, AreTheConnectedComponentsWhateverTheOrderOfJoining) {
  Random random(7);
  int joined_sets = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const std::size_t size = 1 + random.index(30);
    DisjointSets sets(size);
    // The oracle gives both sets the smaller name.
    std::vector<std::size_t> name(size);
    for (std::size_t i = 0; i < size; ++i) name[i] = i;
    for (std::size_t join = 0; join < size / 2; ++join) {
      const std::size_t a = random.index(size);
      const std::size_t b = random.index(size);
      const auto [low, high] = std::minmax({name[a], name[b]});
      const bool apart = low != high;
      EXPECT_EQ(sets.join(a, b), apart);
      std::ranges::replace(name, std::size_t{high}, std::size_t{low});
      joined_sets += apart ? 1 : 0;
    }
    for (std::size_t i = 0; i < size; ++i) EXPECT_EQ(sets.find(i), name[i]);
  }
  EXPECT_GT(joined_sets, 100);
}

TEST(DisjointSets, AreNumberedInTheOrderOfTheirFirstMembers) {
  DisjointSets sets(6);
  EXPECT_TRUE(sets.join(4, 1));
  EXPECT_TRUE(sets.join(5, 2));
  EXPECT_FALSE(sets.join(1, 4));
  EXPECT_EQ(sets.number_sets(), (std::vector<std::size_t>{0, 1, 2, 3, 1, 2}));
  EXPECT_TRUE(DisjointSets(0).number_sets().empty());
}

}  // namespace
}  // namespace panonav
