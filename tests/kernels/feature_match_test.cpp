#include "panonav/kernels/feature_match.hpp"

#include <gtest/gtest.h>

#include <array>
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
      int min_distance = 257;
      std::uint16_t found = 9999;
      for (std::size_t j = 0; j < to.size() / 4; ++j) {
        int distance = 0;
        for (std::size_t w = 0; w < 4; ++w) {
          distance += std::popcount(from[4 * i + w] ^ to[4 * j + w]);
        }
        if (distance < min_distance) {
          min_distance = distance;
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
TEST(NearestHistograms, AgreeWithTheirDefinitionOnEveryInstructionSet) {
  Random random(2);
  int checked = 0;
  for (const auto& [a_count, b_count] :
       {std::pair<std::size_t, std::size_t>{1, 1}, {7, 60}, {300, 40}, {5, 700}, {0, 5}, {5, 0}}) {
    std::vector<std::uint8_t> a(histogram_dimensions * a_count), b(histogram_dimensions * b_count);
    for (auto* values : {&a, &b}) {
      for (auto& value : *values) {
        value = static_cast<std::uint8_t>(random.index(9) == 0 ? 15 : random.index(3));
      }
    }
    const auto distance = [&](std::size_t i, std::size_t j) {
      int sum = 0;
      for (std::size_t k = 0; k < histogram_dimensions; ++k) {
        const int apart = a[histogram_dimensions * i + k] - b[histogram_dimensions * j + k];
        sum += apart * apart;
      }
      return sum;
    };
    for (const Instructions set : available_instructions()) {
      std::vector<std::uint16_t> of_a(a_count, 9999), of_b(b_count, 9999);
      std::vector<std::int32_t> distances(a_count);
      nearest_histograms(a, b, of_a, distances, of_b, set);
      for (std::size_t i = 0; i < a_count && b_count > 0; ++i) {
        EXPECT_EQ(distance(i, of_a[i]), distances[i]) << name(set);
        for (std::size_t j = 0; j < b_count; ++j) {
          EXPECT_GE(distance(i, j), distances[i] + (j < of_a[i] ? 1 : 0)) << name(set);
        }
      }
      for (std::size_t j = 0; j < b_count && a_count > 0; ++j) {
        for (std::size_t i = 0; i < a_count; ++i) {
          EXPECT_LE(distance(of_b[j], j) + (i < of_b[j] ? 1 : 0), distance(i, j)) << name(set);
        }
      }
      ++checked;
    }
  }
  EXPECT_GE(checked, 5);
  std::vector<std::uint8_t> few(histogram_dimensions);
  std::vector<std::uint16_t> one(1), two(2);
  std::vector<std::int32_t> distances(1);
  EXPECT_THROW(nearest_histograms(few, few, one, distances, two, Instructions::scalar),
               ContractError);
}

TEST(CountExplained, CountsLandmarksAndNothingElseAlikeOnEveryInstructionSet) {
  Random random(2);
  constexpr std::size_t axis_count = motion_axes;
  MotionHypotheses hypotheses{.tolerance_sine = 1e-3F, .tolerance_cosine = 1.0F, .max_ratio = 1e6F};
  for (std::size_t d = 0; d < axis_count; ++d) {
    hypotheses.cosine[d] = static_cast<float>(std::cos(0.19634954 * static_cast<double>(d)));
    hypotheses.sine[d] = static_cast<float>(std::sin(0.19634954 * static_cast<double>(d)));
  }
  for (const std::size_t moved : {0, 5, 17, 31}) {
    for (const double turn_rad : {0.0, 1.3, -2.9}) {
      std::array<std::vector<float>, 8> bearings;
      std::ptrdiff_t within_right_angle = 0;
      for (int i = 0; i < 45; ++i) {
        const double x = random.uniform(-6.0, 6.0);
        const double y = random.uniform(-6.0, 6.0);
        const double height = random.uniform(-1.0, 2.0);
        const double angle = 0.19634954 * static_cast<double>(moved);
        const double dx = x - std::cos(angle);
        const double dy = y - std::sin(angle);
        // The frame of the directions lies between both, half the turn from either.
        const double of_query = std::atan2(dy, dx) - 0.5 * turn_rad;
        const double of_reference = std::atan2(y, x) + 0.5 * turn_rad;
        const double apart = of_query - of_reference;
        const std::array numbers{
            std::sin(of_query),     std::cos(of_query),     height / std::hypot(dx, dy),
            std::sin(of_reference), std::cos(of_reference), height / std::hypot(x, y),
            std::sin(apart),        std::cos(apart)};
        for (std::size_t n = 0; n < numbers.size(); ++n) {
          bearings[n].push_back(static_cast<float>(numbers[n]));
        }
        within_right_angle += std::cos(apart + turn_rad) > 0.0 ? 1 : 0;
      }
      const MatchedBearings matched{bearings[0].data(), bearings[1].data(), bearings[2].data(),
                                    bearings[3].data(), bearings[4].data(), bearings[5].data(),
                                    bearings[6].data(), bearings[7].data(), 45};
      const MatchedBearings::Turn turn{static_cast<float>(std::sin(turn_rad)),
                                       static_cast<float>(std::cos(turn_rad)),
                                       static_cast<float>(std::sin(0.5 * turn_rad)),
                                       static_cast<float>(std::cos(0.5 * turn_rad))};
      std::vector<std::int32_t> first;
      for (const Instructions set : available_instructions()) {
        std::vector<std::int32_t> counts(2 * axis_count);
        count_explained(matched, turn, hypotheses, counts, set);
        if (first.empty()) first = counts;
        EXPECT_EQ(counts, first) << name(set);
      }
      EXPECT_EQ(first[moved], within_right_angle) << moved << " " << turn_rad;
      EXPECT_LT(first[(moved + axis_count) % (2 * axis_count)], 20);
    }
  }
  std::vector<std::int32_t> counts(3);
  EXPECT_THROW(count_explained({}, {}, hypotheses, counts, Instructions::scalar), ContractError);
}

}  // namespace
}  // namespace panonav::kernels
