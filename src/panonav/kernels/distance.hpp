#pragma once

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// The integer loops of the search in a visual memory, for one instruction set. All sets give the
/// same numbers. None of them allocates or throws.
struct DistanceKernels {
  /// Sum of |a - b| over `count` bytes; any count below 2^22, any alignment.
  uint32_t (*l1)(const uint8_t* a, const uint8_t* b, size_t count);

  /// Sum of |(a & mask) - (b & mask)| over `count` bytes; any count below 2^22, any alignment.
  uint32_t (*masked_l1)(const uint8_t* a, const uint8_t* b, const uint8_t* mask, size_t count);

  /// For each view v of 8 * octets views: bounds[v] = max(0, constant + sum_g steps[g] *
  /// L1(sketch of v & mask, values)[group g] - min(slacks[v], max_slack)), and the smallest of
  /// them. The sketches of 8 views are interleaved: first group of views 0 .. 7, second group of
  /// views 0 .. 7, .. The caller guarantees that each bound stays below 2^31 and octets >= 1.
  uint32_t (*sketch_bounds)(const uint8_t* sketches, const int32_t* slacks, size_t octets,
                            const SketchQuery& query, uint32_t* bounds);

  /// The same for views indices[0 .. count - 1] out of sketches that lie one after the other, each
  /// with its groups one after the other: bounds[i] belongs to view indices[i]. query.groups is a
  /// multiple of 8. `slacks` null: query.max_slack of every view.
  void (*sketch_bounds_at)(const uint8_t* sketches, const int32_t* slacks, const uint32_t* indices,
                           size_t count, const SketchQuery& query, uint32_t* bounds);

  /// For each of 16 codes of each dimension, which stand for sums of low .. high: tables[16 * d +
  /// code] = what lies between them and sums[d], times factors[d], rounded down, at most 255.
  void (*cell_tables)(const int32_t* low, const int32_t* high, const int32_t* sums,
                      const float* factors, size_t dimensions, uint8_t* tables);

  /// For each view v of `blocks` blocks of `cell_block` views: bounds[v] = the sum over its codes
  /// of tables[16 * d + code], at most 255. Writes the positions of those <= query.limit,
  /// ascending, to `indices`, which has room for all, and returns their number. A block consists of
  /// `pairs` rows of `cell_block` bytes; byte v of each is of view v: the code of an even dimension
  /// in its lower four bits, that of the next one in the upper four.
  size_t (*cell_bounds)(const uint8_t* codes, size_t blocks, const CellQuery& query,
                        uint8_t* bounds, uint32_t* indices);

  /// Writes the positions of the values <= limit, ascending, and returns their number. `indices`
  /// has room for `count` entries and 16 more.
  size_t (*collect_at_most)(const uint32_t* values, size_t count, uint32_t limit,
                            uint32_t* indices);
};

/// The bodies for one of `available_instructions()`; for any other set the scalar ones.
[[nodiscard]] const DistanceKernels& distance_kernels(Instructions instructions);

}  // namespace panonav::kernels
