#include "panonav/kernels/distance_targets.hpp"

namespace panonav::kernels::scalar {

namespace {

uint32_t difference(uint8_t a, uint8_t b, uint8_t mask) {
  const int d = (a & mask) - (b & mask);
  return static_cast<uint32_t>(d < 0 ? -d : d);
}

uint32_t finish(uint64_t sum, int32_t slack, const SketchQuery& query) {
  const int32_t taken = slack < query.largest_slack ? slack : query.largest_slack;
  const int64_t bound = static_cast<int64_t>(sum) + query.constant - taken;
  return bound < 0 ? 0U : static_cast<uint32_t>(bound);
}

}  // namespace

uint32_t l1(const uint8_t* a, const uint8_t* b, size_t count) {
  uint32_t sum = 0;
  for (size_t i = 0; i < count; ++i) sum += difference(a[i], b[i], 255);
  return sum;
}

uint32_t masked_l1(const uint8_t* a, const uint8_t* b, const uint8_t* mask, size_t count) {
  uint32_t sum = 0;
  for (size_t i = 0; i < count; ++i) sum += difference(a[i], b[i], mask[i]);
  return sum;
}

uint32_t sketch_bounds(const uint8_t* sketches, const int32_t* slacks, size_t octets,
                       const SketchQuery& query, uint32_t* bounds) {
  uint32_t smallest = 0xFFFFFFFFU;
  for (size_t octet = 0; octet < octets; ++octet) {
    for (size_t view = 0; view < 8; ++view) {
      uint64_t sum = 0;
      for (size_t group = 0; group < query.groups; ++group) {
        sum += query.steps[group] * masked_l1(sketches + (group * 8 + view) * 8,
                                              query.values + group * 8, query.mask + group * 8, 8);
      }
      const uint32_t bound = finish(sum, slacks[octet * 8 + view], query);
      bounds[octet * 8 + view] = bound;
      smallest = bound < smallest ? bound : smallest;
    }
    sketches += query.stored_groups * 64;
  }
  return smallest;
}

void sketch_bounds_at(const uint8_t* sketches, const int32_t* slacks, const uint32_t* indices,
                      size_t count, const SketchQuery& query, uint32_t* bounds) {
  for (size_t i = 0; i < count; ++i) {
    const uint8_t* const sketch = sketches + indices[i] * query.stored_groups * 8;
    uint64_t sum = 0;
    for (size_t group = 0; group < query.groups; ++group) {
      sum += query.steps[group] *
             masked_l1(sketch + group * 8, query.values + group * 8, query.mask + group * 8, 8);
    }
    bounds[i] = finish(sum, slacks[indices[i]], query);
  }
}

size_t collect_at_most(const uint32_t* values, size_t count, uint32_t limit, uint32_t* indices) {
  size_t found = 0;
  for (size_t i = 0; i < count; ++i) {
    indices[found] = static_cast<uint32_t>(i);
    found += values[i] <= limit ? 1 : 0;
  }
  return found;
}

}  // namespace panonav::kernels::scalar
