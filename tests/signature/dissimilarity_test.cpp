#include "panonav/signature/dissimilarity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "panonav/core/error.hpp"
#include "support/random_views.hpp"

namespace panonav::testing {
namespace {

TEST(Dissimilarity, FollowsTheFormulas) {
  // Two rows, three components, by hand.
  const std::vector<float> zero(6, 0.0F);
  const FourierSignature a({2, 3}, {1, 2, 3, 4, 5, 6}, zero, std::nullopt);
  const FourierSignature b({2, 3}, {2, 2, 1, 4, 9, 6.5F}, zero, std::nullopt);
  EXPECT_DOUBLE_EQ(dissimilarity_l1(a, b), 7.5);
  EXPECT_DOUBLE_EQ(dissimilarity_l1(a, b, 1), 1.0);
  EXPECT_DOUBLE_EQ(dissimilarity_l1(a, b, 2), 3.0);
  EXPECT_DOUBLE_EQ(dissimilarity_l1(a, b, 3), 7.5);
  EXPECT_DOUBLE_EQ(dissimilarity_l2(a, b), std::sqrt(1.0 + 4.0 + 16.0 + 0.25));
  EXPECT_DOUBLE_EQ(dissimilarity_l2(a, b, 2), std::sqrt(5.0));
  EXPECT_DOUBLE_EQ(dissimilarity_weighted(a, b, std::vector<double>{1.0, 0.0, 2.0}), 10.0);
  EXPECT_DOUBLE_EQ(dissimilarity_weighted(a, b, std::vector<double>{1.0, 3.0}), 7.0);
  const PackedSignature packed_a = pack(a, 255.0F);
  const PackedSignature packed_b = pack(b, 255.0F);
  EXPECT_EQ(dissimilarity_packed(packed_a, packed_b, 2), 3U);
  EXPECT_EQ(dissimilarity_packed(packed_a, packed_b), 3U + 4U + 1U);  // 6.5 is packed as 7
}

TEST(Dissimilarity, IsAMetricIndifferentToTurns) {
  Random random(1);
  const std::vector<double> weights{0.5, 1.0, 0.0, 2.0, 1.0};
  int positive = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const SignatureShape shape{5, 7};
    const FourierSignature a = random_signature(random, shape);
    const FourierSignature b = random_signature(random, shape);
    const FourierSignature c = random_signature(random, shape);
    for (int measure = 0; measure < 4; ++measure) {
      const auto distance = [&](const FourierSignature& p, const FourierSignature& q) -> double {
        switch (measure) {
          case 0:
            return dissimilarity_l1(p, q);
          case 1:
            return dissimilarity_l2(p, q, 4);
          case 2:
            return dissimilarity_weighted(p, q, weights);
          default:
            return dissimilarity_packed(pack(p, 1.0F), pack(q, 1.0F));
        }
      };
      EXPECT_EQ(distance(a, a), 0.0);
      EXPECT_EQ(distance(a, b), distance(b, a));
      EXPECT_LE(distance(a, c), (distance(a, b) + distance(b, c)) * (1.0 + 1e-12));
      EXPECT_EQ(distance(turn(a, 1.3), b), distance(a, b));
      positive += distance(a, b) > 0.1;
    }
  }
  EXPECT_EQ(positive, 200);
}

TEST(Dissimilarity, RefusesOtherShapesAndWeights) {
  Random random(2);
  const FourierSignature a = random_signature(random, {5, 7});
  for (const SignatureShape other : {SignatureShape{5, 6}, SignatureShape{4, 7}}) {
    const FourierSignature b = random_signature(random, other);
    EXPECT_THROW(static_cast<void>(dissimilarity_l1(a, b)), ContractError);
    EXPECT_THROW(static_cast<void>(dissimilarity_l2(a, b)), ContractError);
    EXPECT_THROW(static_cast<void>(dissimilarity_packed(pack(a, 1), pack(b, 1))), ContractError);
    EXPECT_THROW(static_cast<void>(dissimilarity_weighted(a, b, std::vector<double>{1.0})),
                 ContractError);
  }
  EXPECT_THROW(static_cast<void>(dissimilarity_l1(a, a, 8)), ContractError);
  EXPECT_THROW(static_cast<void>(dissimilarity_l1(a, a, -1)), ContractError);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& weights : {std::vector<double>{}, std::vector<double>(8, 1.0),
                              std::vector<double>{-1.0}, std::vector<double>{nan}}) {
    EXPECT_THROW(static_cast<void>(dissimilarity_weighted(a, a, weights)), ContractError);
  }
}

TEST(Similarities, RunFrom0To1000) {
  // [M04 eq. 3]
  const auto result = similarities(std::vector<double>{3.0, 1.0, 2.0, 5.0});
  EXPECT_EQ(result, (std::vector<double>{500.0, 1000.0, 750.0, 0.0}));
  EXPECT_EQ(similarities(std::vector<double>{2.0, 2.0}), (std::vector<double>{1000.0, 1000.0}));
  EXPECT_EQ(similarities(std::vector<double>{7.0}), (std::vector<double>{1000.0}));
  EXPECT_TRUE(similarities({}).empty());
  EXPECT_THROW(static_cast<void>(similarities(std::vector<double>{1.0, std::nan("")})),
               ContractError);
}

}  // namespace
}  // namespace panonav::testing
