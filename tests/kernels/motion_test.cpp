#include "panonav/kernels/motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

TEST(NormalPairs, AreThoseOfTheGeneratorOnEveryInstructionSet) {
  Random generator(3);
  Random same(3);
  std::vector<std::uint64_t> bits;
  std::vector<std::pair<double, double>> wanted;
  for (int i = 0; i < 10007; ++i) {
    bits.push_back(generator.next());
    wanted.push_back(same.normal_pair());
  }
  // Both ends of both halves.
  for (const std::uint64_t end : {0x00000000FFFFFFFFULL, 0xFFFFFFFF00000000ULL, 0ULL, ~0ULL}) {
    bits.push_back(end);
  }
  std::vector<float> plain_first(bits.size()), plain_second(bits.size());
  normal_pairs(bits, plain_first, plain_second, Instructions::scalar);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    ASSERT_NEAR(plain_first[i], wanted[i].first, 2e-6);
    ASSERT_NEAR(plain_second[i], wanted[i].second, 2e-6);
  }
  for (std::size_t i = wanted.size(); i < bits.size(); ++i) {
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

}  // namespace
}  // namespace panonav::kernels
