#include "panonav/kernels/feature_match.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

TEST(NearestDescriptors, AgreeWithTheirDefinitionOnEveryInstructionSet) {
  Random random(1);
  int checked = 0;
  for (const auto& [a_count, b_count] :
       {std::pair<std::size_t, std::size_t>{1, 1}, {7, 256}, {256, 3}, {120, 99}, {0, 5}, {5, 0}}) {
    std::vector<std::uint64_t> a(4 * a_count), b(4 * b_count);
    // Few different words, so that many are equally near.
    for (auto* words : {&a, &b}) {
      for (auto& word : *words) word = random.index(4) == 0 ? random.next() : random.index(3);
    }
    const auto nearest = [](const std::vector<std::uint64_t>& from, std::size_t i,
                            const std::vector<std::uint64_t>& to) {
      int least = 257;
      std::uint16_t found = 9999;
      for (std::size_t j = 0; j < to.size() / 4; ++j) {
        int distance = 0;
        for (std::size_t w = 0; w < 4; ++w) {
          distance += std::popcount(from[4 * i + w] ^ to[4 * j + w]);
        }
        if (distance < least) {
          least = distance;
          found = static_cast<std::uint16_t>(j);
        }
      }
      return found;
    };
    for (const Instructions set : available_instructions()) {
      std::vector<std::uint16_t> of_a(a_count, 9999), of_b(b_count, 9999);
      nearest_descriptors(a, b, of_a, of_b, set);
      for (std::size_t i = 0; i < a_count; ++i) EXPECT_EQ(of_a[i], nearest(a, i, b)) << name(set);
      for (std::size_t j = 0; j < b_count; ++j) EXPECT_EQ(of_b[j], nearest(b, j, a)) << name(set);
      ++checked;
    }
  }
  EXPECT_GE(checked, 6);
  std::vector<std::uint64_t> words(4 * 257);
  std::vector<std::uint16_t> many(257), one(1);
  EXPECT_THROW(
      nearest_descriptors(words, std::span(words).first(4), many, one, Instructions::scalar),
      ContractError);
  EXPECT_THROW(nearest_descriptors(std::span(words).first(5), std::span(words).first(4), one, one,
                                   Instructions::scalar),
               ContractError);
}

// A landmark whose bearings were computed from its place is explained by the true direction.
TEST(CountExplained, CountsLandmarksAndNothingElseAlikeOnEveryInstructionSet) {
  Random random(2);
  constexpr std::size_t count = 32;
  std::vector<float> directions;
  for (std::size_t d = 0; d < count; ++d) {
    directions.push_back(static_cast<float>(std::cos(0.19634954 * static_cast<double>(d))));
    directions.push_back(static_cast<float>(std::sin(0.19634954 * static_cast<double>(d))));
  }
  for (const std::size_t moved : {0, 5, 17, 31}) {
    std::vector<BearingLane> lanes(3);
    for (auto& lane : lanes) {
      for (int i = 0; i < BearingLane::size; ++i) {
        const double x = random.uniform(-6.0, 6.0);
        const double y = random.uniform(-6.0, 6.0);
        const double height = random.uniform(-1.0, 2.0);
        const double dx = x - directions[2 * moved];
        const double dy = y - directions[2 * moved + 1];
        const double far = std::hypot(x, y);
        const double from_query = std::hypot(dx, dy);
        const double sign = (dy * x - dx * y) < 0.0 ? -1.0 : 1.0;
        lane.query_sine[i] = static_cast<float>(sign * dy / from_query);
        lane.query_cosine[i] = static_cast<float>(sign * dx / from_query);
        lane.query_tangent[i] = static_cast<float>(height / from_query);
        lane.reference_sine[i] = static_cast<float>(sign * y / far);
        lane.reference_cosine[i] = static_cast<float>(sign * x / far);
        lane.reference_tangent[i] = static_cast<float>(height / far);
        lane.min_sine[i] = i == 15 ? 2.0F : -1e-4F;
      }
    }
    std::vector<std::int32_t> first;
    for (const Instructions set : available_instructions()) {
      std::vector<std::int32_t> counts(count);
      count_explained(lanes, directions, 1e-6F, counts, set);
      if (first.empty()) first = counts;
      EXPECT_EQ(counts, first) << name(set);
    }
    EXPECT_EQ(first[moved], 45);
    EXPECT_LT(first[(moved + 16) % count], 20);
  }
}

}  // namespace
}  // namespace panonav::kernels
