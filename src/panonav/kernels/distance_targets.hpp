#pragma once

// The bodies behind distance.hpp, one set per instruction set. No C++ standard header here: see
// CMakeLists.txt.

#include <stddef.h>
#include <stdint.h>

namespace panonav::kernels {

/// A query as `sketch_bounds` and `sketch_bounds_at` compare it. Sketches consist of groups of 8
/// bytes.
struct SketchQuery {
  const uint8_t* values;  ///< 8 bytes per group, 0 where the mask is 0
  const uint8_t* mask;    ///< 8 bytes per group: 255 where a byte counts, else 0
  const uint64_t* steps;  ///< one weight per group, below 2^22
  size_t groups;          ///< compared; a multiple of 8 for `sketch_bounds_at`
  size_t stored_groups;   ///< of each view, >= groups
  int32_t constant;       ///< added to every bound
  int32_t largest_slack;  ///< slacks above are taken as this
};

#define PANONAV_DECLARE_DISTANCE_BODIES(target)                                                    \
  namespace target {                                                                               \
  uint32_t l1(const uint8_t* a, const uint8_t* b, size_t count);                                   \
  uint32_t masked_l1(const uint8_t* a, const uint8_t* b, const uint8_t* mask, size_t count);       \
  uint32_t sketch_bounds(const uint8_t* sketches, const int32_t* slacks, size_t octets,            \
                         const SketchQuery& query, uint32_t* bounds);                              \
  void sketch_bounds_at(const uint8_t* sketches, const int32_t* slacks, const uint32_t* indices,   \
                        size_t count, const SketchQuery& query, uint32_t* bounds);                 \
  size_t collect_at_most(const uint32_t* values, size_t count, uint32_t limit, uint32_t* indices); \
  }

PANONAV_DECLARE_DISTANCE_BODIES(scalar)
PANONAV_DECLARE_DISTANCE_BODIES(avx2)
PANONAV_DECLARE_DISTANCE_BODIES(avx512)
PANONAV_DECLARE_DISTANCE_BODIES(neon)

#undef PANONAV_DECLARE_DISTANCE_BODIES

}  // namespace panonav::kernels
