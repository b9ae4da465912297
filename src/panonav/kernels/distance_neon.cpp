#include <arm_neon.h>

#include "panonav/kernels/distance_targets.hpp"

namespace panonav::kernels::neon {

namespace {

uint32_t group_l1(const uint8_t* sketch, uint8x8_t values, uint8x8_t mask) {
  return vaddlv_u8(vabd_u8(vand_u8(vld1_u8(sketch), mask), values));
}

uint32_t finish(uint64_t sum, int32_t slack, const SketchQuery& query) {
  const int32_t taken = slack < query.largest_slack ? slack : query.largest_slack;
  const int64_t bound = static_cast<int64_t>(sum) + query.constant - taken;
  return bound < 0 ? 0U : static_cast<uint32_t>(bound);
}

}  // namespace

uint32_t l1(const uint8_t* a, const uint8_t* b, size_t count) {
  uint32x4_t sum = vdupq_n_u32(0);
  size_t i = 0;
  for (; i + 16 <= count; i += 16) {
    sum = vpadalq_u16(sum, vpaddlq_u8(vabdq_u8(vld1q_u8(a + i), vld1q_u8(b + i))));
  }
  uint32_t total = vaddvq_u32(sum);
  for (; i < count; ++i) total += static_cast<uint32_t>(a[i] > b[i] ? a[i] - b[i] : b[i] - a[i]);
  return total;
}

uint32_t masked_l1(const uint8_t* a, const uint8_t* b, const uint8_t* mask, size_t count) {
  uint32x4_t sum = vdupq_n_u32(0);
  size_t i = 0;
  for (; i + 16 <= count; i += 16) {
    const uint8x16_t m = vld1q_u8(mask + i);
    const uint8x16_t d = vabdq_u8(vandq_u8(vld1q_u8(a + i), m), vandq_u8(vld1q_u8(b + i), m));
    sum = vpadalq_u16(sum, vpaddlq_u8(d));
  }
  uint32_t total = vaddvq_u32(sum);
  for (; i < count; ++i) {
    const int d = (a[i] & mask[i]) - (b[i] & mask[i]);
    total += static_cast<uint32_t>(d < 0 ? -d : d);
  }
  return total;
}

uint32_t sketch_bounds(const uint8_t* sketches, const int32_t* slacks, size_t octets,
                       const SketchQuery& query, uint32_t* bounds) {
  uint32_t smallest = 0xFFFFFFFFU;
  for (size_t octet = 0; octet < octets; ++octet) {
    uint64_t sums[8] = {};
    for (size_t group = 0; group < query.groups; ++group) {
      const uint8x8_t values = vld1_u8(query.values + group * 8);
      const uint8x8_t mask = vld1_u8(query.mask + group * 8);
      for (size_t view = 0; view < 8; ++view) {
        sums[view] +=
            query.steps[group] * group_l1(sketches + (group * 8 + view) * 8, values, mask);
      }
    }
    sketches += query.stored_groups * 64;
    for (size_t view = 0; view < 8; ++view) {
      const uint32_t bound = finish(sums[view], slacks[octet * 8 + view], query);
      bounds[octet * 8 + view] = bound;
      smallest = bound < smallest ? bound : smallest;
    }
  }
  return smallest;
}

void sketch_bounds_at(const uint8_t* sketches, const int32_t* slacks, const uint32_t* indices,
                      size_t count, const SketchQuery& query, uint32_t* bounds) {
  for (size_t i = 0; i < count; ++i) {
    const uint8_t* const sketch = sketches + indices[i] * query.stored_groups * 8;
    uint64_t sum = 0;
    for (size_t group = 0; group < query.groups; ++group) {
      sum += query.steps[group] * group_l1(sketch + group * 8, vld1_u8(query.values + group * 8),
                                           vld1_u8(query.mask + group * 8));
    }
    bounds[i] = finish(sum, slacks[indices[i]], query);
  }
}

size_t collect_at_most(const uint32_t* values, size_t count, uint32_t limit, uint32_t* indices) {
  const uint32x4_t top = vdupq_n_u32(limit);
  size_t found = 0;
  size_t i = 0;
  for (; i + 4 <= count; i += 4) {
    if (vmaxvq_u32(vcleq_u32(vld1q_u32(values + i), top)) == 0) continue;
    for (size_t j = i; j < i + 4; ++j) {
      indices[found] = static_cast<uint32_t>(j);
      found += values[j] <= limit ? 1 : 0;
    }
  }
  for (; i < count; ++i) {
    indices[found] = static_cast<uint32_t>(i);
    found += values[i] <= limit ? 1 : 0;
  }
  return found;
}

}  // namespace panonav::kernels::neon
