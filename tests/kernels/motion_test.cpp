#include "panonav/kernels/motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/kernels/similarity.hpp"

namespace panonav::kernels {
namespace {

TEST(NormalPairs, AreThoseOfTheGeneratorOnEveryInstructionSet) {
  Random generator(3);
  Random same(3);
  std::vector<std::uint64_t> bits;
  std::vector<std::pair<double, double>> expected;
  for (int i = 0; i < 10007; ++i) {
    bits.push_back(generator.next());
    expected.push_back(same.normal_pair());
  }
  // Both ends of both halves.
  for (const std::uint64_t end : {0x00000000FFFFFFFFULL, 0xFFFFFFFF00000000ULL, 0ULL, ~0ULL}) {
    bits.push_back(end);
  }
  std::vector<float> plain_first(bits.size()), plain_second(bits.size());
  normal_pairs(bits, plain_first, plain_second, Instructions::scalar);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_NEAR(plain_first[i], expected[i].first, 2e-6);
    ASSERT_NEAR(plain_second[i], expected[i].second, 2e-6);
  }
  for (std::size_t i = expected.size(); i < bits.size(); ++i) {
    const float radius = std::hypot(plain_first[i], plain_second[i]);
    EXPECT_NEAR(radius, bits[i] >> 63U != 0 ? 0.0F : 6.764F, 0.002F) << bits[i];
  }
  for (const Instructions set : available_instructions()) {
    std::vector<float> first(bits.size()), second(bits.size());
    normal_pairs(bits, first, second, set);
    EXPECT_EQ(first, plain_first) << name(set);
    EXPECT_EQ(second, plain_second) << name(set);
  }
}

struct Columns {
  std::vector<double> x_m, y_m, heading_rad;
};

TEST(MovePoses, AgreesWithItsDefinitionOnEveryInstructionSet) {
  Random random(5);
  for (const double share : {0.0, 0.5}) {
    Columns start;
    std::vector<double> forward, left, error;
    for (int i = 0; i < 1003; ++i) {
      start.x_m.push_back(random.uniform(-1e4, 1e4));
      start.y_m.push_back(random.uniform(-50.0, 50.0));
      start.heading_rad.push_back(random.uniform(-3.2, 3.2));
      forward.push_back(random.uniform(-1.0, 1.0));
      left.push_back(random.uniform(-1.0, 1.0));
      error.push_back(random.normal(0.0, i % 10 == 0 ? 1000.0 : 0.3));
    }
    const double turn = random.uniform(-3.0, 3.0);
    const auto moved = [&](Instructions set) {
      Columns poses = start;
      move_poses({poses.x_m, poses.y_m, poses.heading_rad}, {forward, left, error, turn, share},
                 set);
      return poses;
    };
    const Columns plain = moved(Instructions::scalar);
    for (std::size_t i = 0; i < forward.size(); ++i) {
      const double direction = start.heading_rad[i] + share * error[i];
      const double c = std::cos(direction);
      const double s = std::sin(direction);
      ASSERT_NEAR(plain.x_m[i], start.x_m[i] + c * forward[i] - s * left[i], 4e-12);
      ASSERT_NEAR(plain.y_m[i], start.y_m[i] + s * forward[i] + c * left[i], 4e-12);
      ASSERT_NEAR(plain.heading_rad[i], start.heading_rad[i] + turn + error[i], 1e-12);
    }
    for (const Instructions set : available_instructions()) {
      const Columns found = moved(set);
      EXPECT_EQ(found.x_m, plain.x_m) << name(set);
      EXPECT_EQ(found.y_m, plain.y_m) << name(set);
      EXPECT_EQ(found.heading_rad, plain.heading_rad) << name(set);
    }
  }
}

TEST(MovePoses, RefusesSpansOfDifferentSizes) {
  std::vector<double> two(2), one(1);
  EXPECT_THROW(move_poses({two, two, two}, {two, two, one, 0.0, 0.5}, Instructions::scalar),
               ContractError);
  std::vector<float> first(2), second(1);
  const std::vector<std::uint64_t> bits(2);
  EXPECT_THROW(normal_pairs(bits, first, second, Instructions::scalar), ContractError);
}

template <class Number>
std::uint64_t sum_of_bytes(const std::vector<Number>& numbers) {  // FNV-1a
  std::uint64_t sum = 1469598103934665603ULL;
  for (const std::byte byte : std::as_bytes(std::span(numbers))) {
    sum = (sum ^ std::to_integer<std::uint64_t>(byte)) * 1099511628211ULL;
  }
  return sum;
}

// The sums were written down on x86-64; those of 64-bit ARM are the same.
TEST(Motion, HasTheSameBitsOnEveryProcessor) {
  Random random(7);
  constexpr int count = 10007;
  std::vector<std::uint64_t> bits(count);
  for (auto& number : bits) number = random.next();
  std::vector<double> uniform(count);
  for (double& number : uniform) number = random.uniform();
  EXPECT_EQ(sum_of_bytes(uniform), 1451085779581026341ULL);
  for (const Instructions set : available_instructions()) {
    SCOPED_TRACE(name(set));
    std::vector<float> first(count), second(count), logarithms(count), values(count);
    normal_pairs(bits, first, second, set);
    EXPECT_EQ(sum_of_bytes(first), 10814958429094395755ULL);
    EXPECT_EQ(sum_of_bytes(second), 3295923205418411501ULL);
    Columns poses{uniform, uniform, uniform};
    move_poses({poses.x_m, poses.y_m, poses.heading_rad}, {uniform, uniform, uniform, 0.3, 0.5},
               set);
    EXPECT_EQ(sum_of_bytes(poses.x_m), 2493289068217550661ULL);
    EXPECT_EQ(sum_of_bytes(poses.y_m), 7882735404004982888ULL);
    for (int i = 0; i < count; ++i) logarithms[i] = -80.0F * static_cast<float>(uniform[i]);
    exponentials(logarithms, 0.7F, values, set);
    EXPECT_EQ(sum_of_bytes(values), 3420407362764142580ULL);
  }
}

}  // namespace
}  // namespace panonav::kernels
