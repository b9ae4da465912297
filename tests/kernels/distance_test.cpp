#include "panonav/kernels/distance.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

std::vector<std::uint8_t> random_octets(Random& random, std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.next());
  return bytes;
}

std::vector<std::uint8_t> random_mask(Random& random, std::size_t count) {
  std::vector<std::uint8_t> mask(count);
  for (auto& byte : mask) byte = random.index(4) == 0 ? 0 : 255;
  return mask;
}

class Distance : public ::testing::TestWithParam<Instructions> {
 protected:
  const DistanceKernels& kernels = distance_kernels(GetParam());
  const DistanceKernels& scalar = distance_kernels(Instructions::scalar);
};

TEST_P(Distance, MaskedL1IsTheSumOfDifferencesForEveryLengthAndOffset) {
  Random random(11);
  for (std::size_t count = 0; count <= 300; ++count) {
    const std::size_t offset = random.index(64);
    const auto a = random_octets(random, count + offset);
    const auto b = random_octets(random, count + offset);
    const auto mask = random_mask(random, count + offset);
    std::uint32_t expected = 0;
    for (std::size_t i = offset; i < offset + count; ++i) {
      if (mask[i] != 0) expected += static_cast<std::uint32_t>(std::abs(a[i] - b[i]));
    }
    EXPECT_EQ(kernels.masked_l1(a.data() + offset, b.data() + offset, mask.data() + offset, count),
              expected)
        << count << " bytes";
    const std::vector<std::uint8_t> all(count + offset, 255);
    EXPECT_EQ(kernels.l1(a.data() + offset, b.data() + offset, count),
              scalar.masked_l1(a.data() + offset, b.data() + offset, all.data() + offset, count))
        << count << " bytes";
  }
}

TEST_P(Distance, MaskedL1DoesNotOverflow) {
  const std::size_t count = (std::size_t{1} << 22U) - 1;
  const std::vector<std::uint8_t> zeros(count, 0);
  const std::vector<std::uint8_t> full(count, 255);
  EXPECT_EQ(kernels.masked_l1(zeros.data(), full.data(), full.data(), count), 255U * count);
  EXPECT_EQ(kernels.l1(zeros.data(), full.data(), count), 255U * count);
}

struct SketchCase {
  std::vector<std::uint8_t> sketches, values, mask;
  std::vector<std::uint64_t> steps;
  std::vector<std::int32_t> slacks;
  DistanceKernels::SketchQuery query{};
};

SketchCase random_case(Random& random, std::size_t octets, std::size_t groups,
                       std::size_t stored_groups) {
  SketchCase made;
  made.sketches = random_octets(random, octets * stored_groups * 64);
  made.values = random_octets(random, stored_groups * 8);
  made.mask = random_mask(random, stored_groups * 8);
  for (std::size_t i = 0; i < made.values.size(); ++i) made.values[i] &= made.mask[i];
  for (std::size_t i = 0; i < stored_groups; ++i) made.steps.push_back(1 + random.index(200));
  for (std::size_t i = 0; i < octets * 8; ++i) {
    const bool no_view = random.index(10) == 0;
    made.slacks.push_back(no_view ? -(1 << 30) : static_cast<std::int32_t>(random.index(100000)));
  }
  const auto constant = static_cast<std::int32_t>(random.index(200000)) - 100000;
  const auto largest = static_cast<std::int32_t>(random.index(100000));
  made.query = {made.values.data(), made.mask.data(), made.steps.data(), groups, stored_groups,
                constant,           largest};
  return made;
}

TEST_P(Distance, SketchBoundsFollowTheirDefinition) {
  Random random(12);
  int above_zero = 0;
  for (std::size_t groups = 1; groups <= 17; ++groups) {
    const std::size_t octets = 1 + random.index(9);
    const std::size_t stored = groups + random.index(3);
    const SketchCase made = random_case(random, octets, groups, stored);
    std::vector<std::uint32_t> bounds(octets * 8);
    const std::uint32_t smallest = kernels.sketch_bounds(made.sketches.data(), made.slacks.data(),
                                                         octets, made.query, bounds.data());
    EXPECT_EQ(smallest, *std::ranges::min_element(bounds));
    for (std::size_t view = 0; view < bounds.size(); ++view) {
      std::int64_t expected =
          made.query.constant - std::min(made.slacks[view], made.query.max_slack);
      for (std::size_t i = 0; i < groups * 8; ++i) {
        if (made.mask[i] == 0) continue;
        const std::uint8_t code =
            made.sketches[view / 8 * stored * 64 + i / 8 * 64 + view % 8 * 8 + i % 8];
        expected += static_cast<std::int64_t>(made.steps[i / 8]) * std::abs(code - made.values[i]);
      }
      expected = std::max<std::int64_t>(expected, 0);
      EXPECT_EQ(bounds[view], expected) << groups << " groups, view " << view;
      above_zero += expected > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(above_zero, 100);
}

TEST_P(Distance, CellBoundsFollowTheirDefinition) {
  Random random(14);
  for (const std::size_t pairs : {1U, 2U, 7U, 16U, 100U}) {
    const std::size_t blocks = 1 + random.index(5);
    const auto codes = random_octets(random, blocks * pairs * cell_block);
    auto tables = random_octets(random, pairs * 32);
    for (auto& entry : tables) entry = static_cast<std::uint8_t>(entry / (2 * pairs));
    if (pairs == 100) std::ranges::fill(tables, 255);  // more than a byte holds
    std::vector<std::uint8_t> expected;
    for (std::size_t view = 0; view < blocks * cell_block; ++view) {
      int sum = 0;
      for (std::size_t pair = 0; pair < pairs; ++pair) {
        const std::size_t row = (view / cell_block * pairs + pair) * cell_block;
        const std::uint8_t code = codes[row + view % cell_block];
        sum += tables[pair * 32 + code % 16] + tables[pair * 32 + 16 + code / 16];
      }
      expected.push_back(static_cast<std::uint8_t>(std::min(sum, 255)));
    }
    std::vector<std::uint8_t> ascending = expected;
    std::ranges::sort(ascending);
    for (const int limit : {int{ascending[ascending.size() / 3]}, 0, 254, 255}) {
      std::vector<std::uint8_t> bounds(expected.size());
      std::vector<std::uint32_t> indices(expected.size());
      indices.resize(kernels.cell_bounds(codes.data(), blocks,
                                         {tables.data(), pairs, static_cast<std::uint8_t>(limit)},
                                         bounds.data(), indices.data()));
      EXPECT_EQ(bounds, expected) << pairs << " pairs";
      std::vector<std::uint32_t> expected_indices;
      for (std::uint32_t view = 0; view < expected.size(); ++view) {
        if (expected[view] <= limit) expected_indices.push_back(view);
      }
      EXPECT_EQ(indices, expected_indices) << pairs << " pairs, limit " << limit;
    }
  }
}

TEST_P(Distance, CellTablesAreLowerBounds) {
  Random random(15);
  constexpr std::size_t dimensions = 9;
  std::vector<std::int32_t> low, high, sums;
  std::vector<float> factors;
  for (std::size_t d = 0; d < dimensions; ++d) {
    const std::uint32_t unit = 1 + static_cast<std::uint32_t>(random.index(100));
    sums.push_back(static_cast<std::int32_t>(random.index(20000)));
    factors.push_back(d == 3 ? 0.0F : (1.0F - 1e-6F) / static_cast<float>(unit));
    for (int code = 0; code < 16; ++code) {
      low.push_back(static_cast<std::int32_t>(random.index(20000)));
      high.push_back(low.back() + static_cast<std::int32_t>(random.index(300)));
    }
  }
  std::vector<std::uint8_t> tables(16 * dimensions);
  std::vector<std::uint8_t> by_scalar(tables.size());
  kernels.cell_tables(low.data(), high.data(), sums.data(), factors.data(), dimensions,
                      tables.data());
  scalar.cell_tables(low.data(), high.data(), sums.data(), factors.data(), dimensions,
                     by_scalar.data());
  EXPECT_EQ(tables, by_scalar);
  int large = 0;
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const double outside = std::max({low[i] - sums[i / 16], sums[i / 16] - high[i], 0});
    EXPECT_LE(tables[i], outside * static_cast<double>(factors[i / 16]));
    EXPECT_GT(tables[i] + 1.0,
              std::min(255.0, outside * static_cast<double>(factors[i / 16])) - 0.001);
    large += tables[i] == 255 ? 1 : 0;
  }
  EXPECT_GT(large, 10);
}

TEST_P(Distance, ACodeOfAQueryIsTheNearestOnTheScaleAndItsErrorLowersTheConstant) {
  Random random(16);
  constexpr std::size_t groups = 5;
  std::vector<std::int32_t> sums, flags, offsets, highest;
  std::vector<std::uint64_t> steps;
  std::vector<float> inverse_steps;
  std::vector<std::uint8_t> expected;
  std::int32_t expected_constant = 0;
  int outside_scale = 0;
  for (std::size_t i = 0; i < 8 * groups; ++i) {
    if (i % 8 == 0) {
      steps.push_back(1 + random.index(60));
      inverse_steps.push_back(1.0F / static_cast<float>(steps.back()));
    }
    const auto step = static_cast<std::int32_t>(steps.back());
    offsets.push_back(static_cast<std::int32_t>(random.index(3000)));
    highest.push_back(offsets.back() + static_cast<std::int32_t>(random.index(255 * steps.back())));
    sums.push_back(static_cast<std::int32_t>(random.index(12000)));
    flags.push_back(random.index(5) == 0 ? 0 : 1);
    const std::int32_t inside = std::clamp(sums.back(), offsets.back(), highest.back());
    const std::int32_t code = std::min(255, (2 * (inside - offsets.back()) + step) / (2 * step));
    const std::int32_t missed = std::abs(inside - offsets.back() - code * step);
    expected.push_back(static_cast<std::uint8_t>(flags.back() * code));
    expected_constant += flags.back() * (std::abs(sums.back() - inside) - missed);
    outside_scale += sums.back() != inside ? 1 : 0;
  }
  std::vector<std::uint8_t> values(8 * groups);
  EXPECT_EQ(kernels.encode_query(
                sums.data(), flags.data(),
                {offsets.data(), highest.data(), steps.data(), inverse_steps.data(), groups},
                values.data()),
            expected_constant);
  for (std::size_t i = 0; i < values.size(); ++i) {
    // In the middle between two codes, either is the nearest.
    EXPECT_NEAR(values[i], expected[i], (steps[i / 8] % 2 == 0) ? 1 : 0) << i;
  }
  EXPECT_GT(outside_scale, 10);
}

TEST_P(Distance, SketchBoundsOfPickedViewsAreThoseOfTheInterleavedOnes) {
  Random random(13);
  for (std::size_t groups = 8; groups <= 40; groups += 8) {
    const std::size_t octets = 5;
    const std::size_t stored = groups + 8 * random.index(2);
    const SketchCase made = random_case(random, octets, groups, stored);
    std::vector<std::uint32_t> all(octets * 8);
    scalar.sketch_bounds(made.sketches.data(), made.slacks.data(), octets, made.query, all.data());
    std::vector<std::uint8_t> apart;
    for (std::size_t view = 0; view < all.size(); ++view) {
      for (std::size_t group = 0; group < stored; ++group) {
        const std::size_t at = view / 8 * stored * 64 + group * 64 + view % 8 * 8;
        apart.insert(apart.end(), made.sketches.begin() + static_cast<long>(at),
                     made.sketches.begin() + static_cast<long>(at + 8));
      }
    }
    std::vector<std::uint32_t> indices;
    for (std::uint32_t view = 0; view < all.size(); ++view) {
      if (random.index(3) != 0) indices.push_back(view);
    }
    ASSERT_GT(indices.size(), 8U);
    std::vector<std::uint32_t> bounds(indices.size());
    kernels.sketch_bounds_at(apart.data(), made.slacks.data(), indices.data(), indices.size(),
                             made.query, bounds.data());
    for (std::size_t i = 0; i < indices.size(); ++i) EXPECT_EQ(bounds[i], all[indices[i]]);
    // Without slacks each view has the largest one.
    const std::vector<std::int32_t> largest(all.size(), made.query.max_slack);
    scalar.sketch_bounds(made.sketches.data(), largest.data(), octets, made.query, all.data());
    kernels.sketch_bounds_at(apart.data(), nullptr, indices.data(), indices.size(), made.query,
                             bounds.data());
    for (std::size_t i = 0; i < indices.size(); ++i) EXPECT_EQ(bounds[i], all[indices[i]]);
  }
}

TEST_P(Distance, CollectFindsAllValuesUpToTheLimit) {
  Random random(14);
  std::size_t collected = 0;
  for (std::size_t count = 0; count <= 100; ++count) {
    std::vector<std::uint32_t> values(count);
    for (auto& value : values) value = static_cast<std::uint32_t>(random.index(10));
    if (count > 3) values[2] = 0xFFFFFFFFU;
    const auto limit = static_cast<std::uint32_t>(random.index(10));
    std::vector<std::uint32_t> expected;
    for (std::size_t i = 0; i < count; ++i) {
      if (values[i] <= limit) expected.push_back(static_cast<std::uint32_t>(i));
    }
    std::vector<std::uint32_t> found(count + 16);
    found.resize(kernels.collect_at_most(values.data(), count, limit, found.data()));
    EXPECT_EQ(found, expected) << count << " values";
    collected += found.size();
  }
  EXPECT_GT(collected, 500U);
}

INSTANTIATE_TEST_SUITE_P(EachInstructionSet, Distance,
                         ::testing::ValuesIn(available_instructions().begin(),
                                             available_instructions().end()),
                         [](const auto& instance) { return std::string(name(instance.param)); });

}  // namespace
}  // namespace panonav::kernels
