#pragma once

// Declarations of the kernels' bodies for all instruction sets. `internal/NAME_body.cpp` defines
// NAMEBody and is compiled once per set. Must not include C++ standard headers: see CMakeLists.txt.

#include "panonav/kernels/types.hpp"

namespace panonav::kernels {

template <Instructions set>
struct ColumnMatchBody {
  static int match_columns(const uint8_t* query, const uint8_t* reference, uint16_t* costs);
  static void column_sums_near_turn(const uint8_t* query, const uint8_t* reference, int turn,
                                    uint16_t* sums);
};

struct BandsJob {
  const uint8_t* magnitudes;     ///< index k * rows + row
  const uint8_t* phases;         ///< the same
  const uint32_t* used_rows;     ///< `used_count` of them
  const float* magnitude_pairs;  ///< each byte twice
  const float* directions;       ///< cosine and sine of each phase
  size_t rows, used_count;
  int components, bands;
};

template <Instructions set>
struct ColumnProfilesBody {
  static void average_bands(const BandsJob& job, float* real, float* imaginary);
  static void blur_bands(const BandsJob& job, const float* weights, const float* damping,
                         float* real, float* imaginary);
  static void reconstruct_bands(const BandWaves& waves, float* view);
  static void subtract_column_means(float* view, int bands);
  static bool quantise_columns(const float* view, int bands, const ColumnContrast& contrast,
                               uint8_t* values);
};

/// The functions of DistanceKernels.
template <Instructions set>
struct DistanceBody {
  static uint32_t l1(const uint8_t* a, const uint8_t* b, size_t count);
  static uint32_t masked_l1(const uint8_t* a, const uint8_t* b, const uint8_t* mask, size_t count);
  static uint32_t sketch_bounds(const uint8_t* sketches, const int32_t* slacks, size_t octets,
                                const DistanceKernels::SketchQuery& query, uint32_t* bounds);
  static void sketch_bounds_at(const uint8_t* sketches, const int32_t* slacks,
                               const uint32_t* indices, size_t count,
                               const DistanceKernels::SketchQuery& query, uint32_t* bounds);
  static void cell_tables(const int32_t* low, const int32_t* high, const int32_t* sums,
                          const float* factors, size_t dimensions, uint8_t* tables);
  static int32_t encode_query(const int32_t* sums, const int32_t* flags, const SumScale& scale,
                              uint8_t* values);
  static size_t cell_bounds(const uint8_t* codes, size_t blocks,
                            const DistanceKernels::CellQuery& query, uint8_t* bounds,
                            uint32_t* indices);
  static size_t collect_at_most(const uint32_t* values, size_t count, uint32_t limit,
                                uint32_t* indices);
};

template <Instructions set>
struct FeatureMatchBody {
  static void nearest_descriptors(const uint64_t* a, size_t a_count, const uint64_t* b,
                                  size_t b_count, uint16_t* nearest_of_a, uint16_t* nearest_of_b);
  static void nearest_histograms(const uint8_t* a, size_t a_count, const uint8_t* b, size_t b_count,
                                 uint16_t* nearest_of_a, int32_t* distances_of_a,
                                 uint16_t* nearest_of_b);
  static void count_explained(const MatchedBearings& matched, const MatchedBearings::Turn& turn,
                              const MotionHypotheses& hypotheses, int32_t* counts);
};

template <Instructions set>
struct LevellingBody {
  static void tilted_positions(const TiltedDirections& directions, const double* cosines,
                               const double* sines, float* rows, float* columns, int count);
  static void sample_tilted_row(const float* seen, int seen_rows, const float* rows,
                                const float* shifts, float* values, int columns);
};

template <Instructions set>
struct MotionBody {
  static void normal_pairs(const uint64_t* bits, float* first, float* second, int count);
  static void move_poses(double* x_m, double* y_m, double* heading_rad, const double* forward_m,
                         const double* left_m, const double* turn_error_rad, double turn_rad,
                         double turn_share_before_travel, int count);
};

template <Instructions set>
struct PolarBody {
  static void to_polar(const float* real, const float* imaginary, float* magnitudes,
                       float* phases_rad, int count);
};

struct RemapJob {
  const uint16_t* pairs;
  const uint32_t* positions;
  const uint32_t* weights;
  int taps, count;
  float scale;
  float* values;
};

/// Width and height are those of the result.
template <Instructions set>
struct RemapBody {
  static void halve(const uint8_t* pixels, ptrdiff_t stride, int width, int height,
                    uint8_t* halved);
  static void pair_rows(const uint8_t* pixels, ptrdiff_t stride, int width, int height,
                        uint16_t* pairs);
  static void remap(const RemapJob& job);
};

/// Number of components in a block; tables are padded to whole blocks.
inline constexpr int row_transform_block = 16;

struct RowTransformJob {
  const float* values;  ///< rows * columns
  int rows, columns, components, folded;
  const float* cosines;  ///< [block][folded][row_transform_block]
  const float* sines;
  float* scratch;  ///< row_transform_scratch(folded) floats
  float* real;     ///< index k * stride + row
  float* imaginary;
  size_t stride;
};

/// Returns the number of scratch floats: for each of four rows folded at a time, pairs (even k, odd
/// k) for the cosines and for the sines.
constexpr size_t row_transform_scratch(int folded) {
  return 4 * 4 * static_cast<size_t>(folded);
}

template <Instructions set>
struct RowTransformBody {
  static void row_transform(const RowTransformJob& job);
};

template <Instructions set>
struct SketchBody {
  static EncodedSums encode_sums(const int32_t* sums, const SumScale& scale, uint8_t* codes,
                                 size_t stride);
};

template <Instructions set>
struct SimilarityBody {
  static void explain_similarity(const SimilarityLanes& lanes, const SimilarityLanes::Decay& decay,
                                 const float* x_m, const float* y_m, const float* heading_rad,
                                 float* explained, int count);
  static void exponentials(const float* logarithms, float scale, float* values, int count);
};

/// Calls `run` with the body for an instruction set, or with the scalar body if this build lacks
/// the set.
template <template <Instructions> class Body, class Run>
decltype(auto) with_body(Instructions set, Run run) {
  switch (set) {
#ifdef PANONAV_HAS_AVX2
    case Instructions::avx2:
      return run(Body<Instructions::avx2>{});
#endif
#ifdef PANONAV_HAS_AVX512
    case Instructions::avx512:
      return run(Body<Instructions::avx512>{});
#endif
#ifdef PANONAV_HAS_NEON
    case Instructions::neon:
      return run(Body<Instructions::neon>{});
#endif
#ifdef PANONAV_HAS_SIMD128
    case Instructions::simd128:
      return run(Body<Instructions::simd128>{});
#endif
    default:
      return run(Body<Instructions::scalar>{});
  }
}

}  // namespace panonav::kernels
