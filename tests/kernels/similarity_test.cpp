#include "panonav/kernels/similarity.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

SimilarityLanes random_lanes(Random& random) {
  SimilarityLanes lanes{};
  for (int i = 0; i < similarity_lanes; ++i) {
    const bool used = i < 10;
    lanes.x_m[i] = used ? static_cast<float>(random.uniform(-1.0, 1.0)) : 1e6F;
    lanes.y_m[i] = static_cast<float>(random.uniform(-1.0, 1.0));
    lanes.log_similarity[i] = std::log(used ? static_cast<float>(random.uniform(0.0, 0.5)) : 0.0F);
    lanes.other_log_similarity[i] =
        std::log(used ? static_cast<float>(random.uniform(0.0, 0.3)) : 0.0F);
    lanes.heading_rad[i] = static_cast<float>(random.uniform(-6.0, 6.0));
    lanes.other_heading_rad[i] = static_cast<float>(random.uniform(-6.0, 6.0));
    lanes.per_square_turn[i] = random.index(3) == 0 ? 0.0F : -4.0F;
  }
  return lanes;
}

double explained(const SimilarityLanes& lanes, const SimilarityLanes::Decay& decay, double x,
                 double y, double heading) {
  double product = 0.0;
  double square = 0.0;
  for (int i = 0; i < similarity_lanes; ++i) {
    const double apart = std::sqrt(std::pow(lanes.x_m[i] - x, 2) + std::pow(lanes.y_m[i] - y, 2) +
                                   static_cast<double>(decay.blur_square_m2));
    const double expected = std::exp(-apart * static_cast<double>(decay.per_metre));
    const auto facing = [&](double reported) {
      const double turn = std::remainder(heading - reported, 2.0 * std::numbers::pi);
      return std::exp(turn * turn * static_cast<double>(lanes.per_square_turn[i]));
    };
    const double similarity =
        std::max(std::exp(static_cast<double>(lanes.log_similarity[i])) *
                     facing(static_cast<double>(lanes.heading_rad[i])),
                 std::exp(static_cast<double>(lanes.other_log_similarity[i])) *
                     facing(static_cast<double>(lanes.other_heading_rad[i])));
    product += similarity * expected;
    square += expected * expected;
  }
  return product * product / square;
}

TEST(ExplainSimilarity, AgreesWithItsDefinitionOnEveryInstructionSet) {
  Random random(1);
  int checked = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const SimilarityLanes lanes = random_lanes(random);
    const SimilarityLanes::Decay decay{static_cast<float>(random.uniform(0.5, 5.0)),
                                       trial % 2 == 0 ? 0.0F : 0.04F};
    std::vector<float> x, y, heading, found(17);
    for (std::size_t p = 0; p < found.size(); ++p) {
      x.push_back(static_cast<float>(random.uniform(-1.5, 1.5)));
      y.push_back(static_cast<float>(random.uniform(-1.5, 1.5)));
      heading.push_back(static_cast<float>(random.uniform(-3.1, 3.1)));
    }
    std::vector<float> plain(found.size());
    explain_similarity(lanes, decay, x, y, heading, plain, Instructions::scalar);
    for (const Instructions set : available_instructions()) {
      explain_similarity(lanes, decay, x, y, heading, found, set);
      EXPECT_EQ(found, plain) << name(set);
      for (std::size_t p = 0; p < found.size(); ++p) {
        const double expected =
            explained(lanes, decay, static_cast<double>(x[p]), static_cast<double>(y[p]),
                      static_cast<double>(heading[p]));
        EXPECT_NEAR(static_cast<double>(found[p]), expected, 1e-6 + 1e-4 * expected) << name(set);
        ++checked;
      }
    }
  }
  EXPECT_GE(checked, 40 * 17);
}

TEST(ExplainSimilarity, FarFromEveryReferenceNothingIsExplained) {
  Random random(2);
  const SimilarityLanes lanes = random_lanes(random);
  const std::vector<float> x{1e4F}, y{1e4F}, heading{0.0F};
  for (const Instructions set : available_instructions()) {
    std::vector<float> found{-1.0F};
    explain_similarity(lanes, {10.0F, 0.0F}, x, y, heading, found, set);
    EXPECT_GE(found[0], 0.0F);
    EXPECT_LT(found[0], 1e-3F);
  }
}

TEST(Exponentials, AgreeWithTheirDefinitionOnEveryInstructionSet) {
  std::vector<float> logarithms;
  for (int i = 0; i < 1001; ++i) logarithms.push_back(-0.1F * static_cast<float>(i));
  std::vector<float> plain(logarithms.size());
  exponentials(logarithms, 0.75F, plain, Instructions::scalar);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const double expected = std::exp(0.75 * static_cast<double>(logarithms[i]));
    EXPECT_NEAR(static_cast<double>(plain[i]), expected, 1e-5 * expected);
  }
  for (const Instructions set : available_instructions()) {
    std::vector<float> found(logarithms.size());
    exponentials(logarithms, 0.75F, found, set);
    EXPECT_EQ(found, plain) << name(set);
  }
  exponentials(logarithms, 1e6F, plain, Instructions::scalar);
  EXPECT_EQ(plain[0], 1.0F);
  EXPECT_GT(plain.back(), 0.0F);
  EXPECT_LT(plain.back(), 2e-38F);
  std::vector<float> shorter(3);
  EXPECT_THROW(exponentials(logarithms, 1.0F, shorter, Instructions::scalar), ContractError);
}

TEST(ExplainSimilarity, RefusesSpansOfDifferentSizes) {
  const SimilarityLanes lanes{};
  const std::vector<float> two(2), one(1);
  std::vector<float> out(2);
  EXPECT_THROW(explain_similarity(lanes, {1.0F, 0.0F}, two, one, two, out, Instructions::scalar),
               ContractError);
}

}  // namespace
}  // namespace panonav::kernels
