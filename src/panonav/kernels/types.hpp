#pragma once

// Types that callers and bodies of the kernels share. No C++ standard header here: see
// CMakeLists.txt.

#include <stddef.h>
#include <stdint.h>

namespace panonav::kernels {

/// Instruction sets for which kernels have bodies. `avx2` means AVX2 and FMA; `avx512` means F, BW,
/// DQ and VL.
enum class Instructions {
  scalar,  ///< C++ alone, on every processor; the others give what their headers promise
  avx2,    ///< x86-64 of 2013 and later
  avx512,  ///< x86-64 servers and newer desktops
  neon     ///< ARM of 64 bit
};

/// The integer loops of the search in a visual memory, for one instruction set. All sets give the
/// same numbers. None of them allocates or throws.
struct DistanceKernels {
  /// A query as `sketch_bounds` and `sketch_bounds_at` compare it. Sketches consist of groups of 8
  /// bytes.
  struct SketchQuery {
    const uint8_t* values;  ///< 8 bytes per group, 0 where the mask is 0
    const uint8_t* mask;    ///< 8 bytes per group: 255 where a byte counts, else 0
    const uint64_t* steps;  ///< one weight per group, below 2^22
    size_t groups;          ///< compared; a multiple of 8 for `sketch_bounds_at`
    size_t stored_groups;   ///< of each view, >= groups
    int32_t constant;       ///< added to every bound
    int32_t max_slack;      ///< slacks above are taken as this
  };

  /// A query as `cell_bounds` compares it. Sketches consist of codes of 4 bits, one a dimension.
  struct CellQuery {
    const uint8_t* tables;  ///< 16 bytes a dimension: what each code adds to the bound
    size_t pairs;           ///< half the number of dimensions
    uint8_t limit;          ///< of the bounds that are wanted
  };

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

/// Views that `cell_bounds` compares together.
inline constexpr size_t cell_block = 64;

/// Sizes that `match_columns` compares: columns of the query.
inline constexpr int matched_query_columns = 32;
/// Columns of the reference; also the number of turns.
inline constexpr int matched_reference_columns = 128;
inline constexpr int matched_bands = 16;  ///< Bytes of a column: bands of elevation.

/// Descriptors of 256 bits that `nearest_descriptors` takes of a view.
inline constexpr int max_descriptors = 256;

/// Bearings of features that two views share, an array for each number. Tangents are those of the
/// elevations; `sine` and `cosine` belong to the azimuth in the query minus that in the reference.
struct MatchedBearings {
  /// A turn between two views, and its half.
  struct Turn {
    float sine,       ///< of the turn
        cosine,       ///< of the turn
        half_sine,    ///< of half the turn
        half_cosine;  ///< of half the turn
  };

  const float *query_sine,      ///< of the azimuth in the query
      *query_cosine,            ///< of the same
      *query_tangent;           ///< of the elevation in the query
  const float *reference_sine,  ///< of the azimuth in the reference
      *reference_cosine,        ///< of the same
      *reference_tangent;       ///< of the elevation in the reference
  const float *sine,            ///< of the difference of azimuth
      *cosine;                  ///< of the same
  size_t count;                 ///< matched pairs: values in each array
};

/// Directions of motion of which the opposite ones are tried as well.
inline constexpr int motion_axes = 16;
/// Candidate axes of motion, and the condition under which one explains a matched bearing.
struct MotionHypotheses {
  float cosine[motion_axes],  ///< of each axis, along x, forward at angle 0
      sine[motion_axes];      ///< of each axis, along y
  float tolerance_sine,       ///< of the largest error of a bearing, below a right angle
      tolerance_cosine,       ///< of the same
      max_ratio;              ///< largest distance of the views over that of a landmark
};

/// References around a place that the kernel compares at a time; unused lanes have similarity 0.
inline constexpr int similarity_lanes = 12;

/// Reference views around a place and their similarity to a view, side by side. A lane without a
/// reference has similarity 0, the logarithm of which is minus infinity, and lies far away.
struct SimilarityLanes {
  /// Fall of similarity with distance: exp(-sqrt(distance^2 + blur) * per_metre).
  struct Fall {
    float per_metre;  ///< above 0, the fall of the logarithm for each metre
    /// Added to the square of each distance, so that similarity falls little near a reference.
    float blur_square_m2;
  };

  float x_m[similarity_lanes];                   ///< position of each reference
  float y_m[similarity_lanes];                   ///< the same, along y
  float log_similarity[similarity_lanes];        ///< to the view
  float heading_rad[similarity_lanes];           ///< of the view, as the reference implies it
  float other_log_similarity[similarity_lanes];  ///< at the other heading that fits
  /// The heading at which `other_log_similarity` holds.
  float other_heading_rad[similarity_lanes];
  float per_square_turn[similarity_lanes];  ///< <= 0; 0: the heading does not count
};

}  // namespace panonav::kernels
