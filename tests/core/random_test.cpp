#include "panonav/core/random.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <set>

namespace panonav {
namespace {

TEST(Random, GivesTheBitsOfTheDocumentedGenerators) {
  // From an independent implementation of SplitMix64 and xoshiro256++ that reproduces the published
  // first outputs of xoshiro256++ for the state {1, 2, 3, 4}.
  struct Case {
    std::uint64_t seed, stream;
    std::array<std::uint64_t, 3> expected;
  };
  const std::array cases = {
      Case{0, 0, {0x84f09bf307c1073aULL, 0xc82ffb597ceee51bULL, 0xadf96905c5df4417ULL}},
      Case{42, 0, {0x5b5e4a1bffcbb2f3ULL, 0xdad6b47570f6111dULL, 0xaa41d8357b710b2fULL}},
      Case{42, 7, {0x0d9893fc677d6169ULL, 0x8c202a1a1dd3b94dULL, 0xb20f071eca7887c8ULL}}};
  for (const auto& c : cases) {
    Random random(c.seed, c.stream);
    for (const auto value : c.expected) EXPECT_EQ(random.next(), value);
  }
}

TEST(Random, OneArgumentMeansStreamZero) {
  Random a(123);
  Random b(123, 0);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.next(), b.next());
}

TEST(Random, StreamsAndSeedsDiffer) {
  std::set<std::uint64_t> firsts;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    for (std::uint64_t stream = 0; stream < 40; ++stream)
      firsts.insert(Random(seed, stream).next());
  }
  EXPECT_EQ(firsts.size(), 1600U);
}

// Bounds of the statistical tests below are 5 standard errors: each fails by chance once in 1.7
// million seeds.
constexpr int samples = 200'000;

TEST(Random, UniformHasTheMomentsOfTheUniformDistribution) {
  Random random(1);
  double sum = 0.0;
  double sum2 = 0.0;
  for (int i = 0; i < samples; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    sum += u;
    sum2 += (u - 0.5) * (u - 0.5);
  }
  EXPECT_NEAR(sum / samples, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / samples));
  EXPECT_NEAR(sum2 / samples, 1.0 / 12.0, 5.0 * std::sqrt(1.0 / 180.0 / samples));
}

TEST(Random, UniformKeepsItsRange) {
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const double value = random.uniform(-3.0, -1.0);
    EXPECT_GE(value, -3.0);
    EXPECT_LT(value, -1.0);
  }
}

TEST(Random, NormalHasTheMomentsOfTheNormalDistribution) {
  Random random(3);
  double m1 = 0.0, m2 = 0.0, m3 = 0.0, m4 = 0.0;
  for (int i = 0; i < samples; ++i) {
    const double x = random.normal();
    ASSERT_TRUE(std::isfinite(x));
    m1 += x;
    m2 += x * x;
    m3 += x * x * x;
    m4 += x * x * x * x;
  }
  EXPECT_NEAR(m1 / samples, 0.0, 5.0 * std::sqrt(1.0 / samples));
  EXPECT_NEAR(m2 / samples, 1.0, 5.0 * std::sqrt(2.0 / samples));
  EXPECT_NEAR(m3 / samples, 0.0, 5.0 * std::sqrt(15.0 / samples));
  EXPECT_NEAR(m4 / samples, 3.0, 5.0 * std::sqrt(96.0 / samples));
}

TEST(Random, NormalShiftsAndScales) {
  Random a(4);
  Random b(4);
  for (int i = 0; i < 100; ++i) EXPECT_DOUBLE_EQ(a.normal(2.0, 0.5), 2.0 + 0.5 * b.normal());
}

TEST(Random, IndexIsUnbiased) {
  Random random(5);
  constexpr std::uint64_t faces = 7;
  std::array<int, faces> hits{};
  for (int i = 0; i < samples; ++i) {
    const std::uint64_t value = random.index(faces);
    ASSERT_LT(value, faces);
    ++hits[value];
  }
  const double expected = static_cast<double>(samples) / faces;
  for (const int h : hits) EXPECT_NEAR(h, expected, 5.0 * std::sqrt(expected));
  for (int i = 0; i < 10; ++i) EXPECT_EQ(random.index(1), 0U);
  // A count just above half of the range would show the bias of a plain modulo.
  const std::uint64_t large = (UINT64_MAX / 3) * 2;
  int low_half = 0;
  for (int i = 0; i < 20'000; ++i) low_half += random.index(large) < large / 2 ? 1 : 0;
  EXPECT_NEAR(low_half, 10'000, 5.0 * std::sqrt(5'000.0));
}

TEST(Random, ThePairHasTwoIndependentNormals) {
  Random pairs(11);
  double first_sum = 0.0;
  double first_square = 0.0;
  double sum = 0.0;
  double square = 0.0;
  double product = 0.0;
  constexpr int count = 40000;
  for (int i = 0; i < count; ++i) {
    const auto [first, second] = pairs.normal_pair();
    first_sum += first;
    first_square += first * first;
    sum += second;
    square += second * second;
    product += first * second;
  }
  EXPECT_NEAR(first_sum / count, 0.0, 0.025);
  EXPECT_NEAR(first_square / count, 1.0, 0.035);
  EXPECT_NEAR(sum / count, 0.0, 0.025);
  EXPECT_NEAR(square / count, 1.0, 0.035);
  EXPECT_NEAR(product / count, 0.0, 0.025);
}

}  // namespace
}  // namespace panonav
