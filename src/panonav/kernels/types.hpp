#pragma once

// Types shared by the callers and the bodies of the kernels. Must not include C++ standard headers:
// see CMakeLists.txt.

#include <stddef.h>
#include <stdint.h>

namespace panonav::kernels {

/// Instruction sets for which kernels have bodies. `avx2` means AVX2 and FMA; `avx512` means F, BW,
/// DQ and VL.
enum class Instructions {
  scalar,  ///< plain C++, for every processor
  avx2,    ///< x86-64 of 2013 and later
  avx512,  ///< x86-64 servers and newer desktops
  neon,    ///< ARM of 64 bit
  simd128  ///< WebAssembly with vectors of 128 bits
};

/// Scale by which sums become bytes, in groups of 8 sums.
struct SumScale {
  const int32_t *offsets,      ///< sum with code 0, one for each sum
      *highest;                ///< largest sum within the scale, one for each sum
  const uint64_t* steps;       ///< difference of two codes, one for each group, at least 1
  const float* inverse_steps;  ///< 1 / step, one for each group
  size_t groups;               ///< number of groups
};

/// Integer kernels of the search in a visual memory, for one instruction set. All sets give
/// identical results. The kernels neither allocate nor throw.
struct DistanceKernels {
  /// Query of `sketch_bounds` and `sketch_bounds_at`. A sketch is a short description of a view, in
  /// groups of 8 bytes.
  struct SketchQuery {
    const uint8_t* values;  ///< 8 bytes per group, 0 where the mask is 0
    const uint8_t* mask;    ///< 8 bytes per group: 255 for compared bytes, else 0
    const uint64_t* steps;  ///< one weight per group, below 2^22
    size_t groups;          ///< compared groups; a multiple of 8 for `sketch_bounds_at`
    size_t stored_groups;   ///< stored groups of each view, >= groups
    int32_t constant;       ///< added to every bound
    int32_t max_slack;      ///< upper limit of the slack used for a view
  };

  /// Query of `cell_bounds`. A view is described by one code of 4 bits per dimension.
  struct CellQuery {
    const uint8_t* tables;  ///< 16 bytes per dimension: contribution of each code to the bound
    size_t pairs;           ///< half the number of dimensions
    uint8_t limit;          ///< largest bound of the views to report
  };

  /// Sum of |a - b| over `count` bytes; any count below 2^22, any alignment.
  uint32_t (*l1)(const uint8_t* a, const uint8_t* b, size_t count);

  /// Sum of |(a & mask) - (b & mask)| over `count` bytes; any count below 2^22, any alignment.
  uint32_t (*masked_l1)(const uint8_t* a, const uint8_t* b, const uint8_t* mask, size_t count);

  /// Computes, for each of 8 * octets views v, bounds[v] = max(0, constant + sum_g steps[g] *
  /// L1(sketch of v & mask, values)[group g] - min(slacks[v], max_slack)); returns the smallest
  /// bound. The sketches of 8 views are interleaved: first group of views 0 .. 7, second group of
  /// views 0 .. 7, .. The caller guarantees that each bound stays below 2^31 and octets >= 1.
  uint32_t (*sketch_bounds)(const uint8_t* sketches, const int32_t* slacks, size_t octets,
                            const SketchQuery& query, uint32_t* bounds);

  /// Computes the same for the views indices[0 .. count - 1] of sketches that are stored
  /// consecutively, not interleaved: bounds[i] belongs to view indices[i]. query.groups is a
  /// multiple of 8. If `slacks` is null, query.max_slack is used for every view.
  void (*sketch_bounds_at)(const uint8_t* sketches, const int32_t* slacks, const uint32_t* indices,
                           size_t count, const SketchQuery& query, uint32_t* bounds);

  /// Computes the tables of `CellQuery`. Code c of dimension d represents sums in the interval
  /// low[16 * d + c] .. high[16 * d + c]; tables[16 * d + c] = distance of sums[d] from this
  /// interval, times factors[d], rounded down, at most 255.
  void (*cell_tables)(const int32_t* low, const int32_t* high, const int32_t* sums,
                      const float* factors, size_t dimensions, uint8_t* tables);

  /// Encodes the sums of a query for `SketchQuery`: clamps each to the scale and writes its nearest
  /// code, or 0 where its flag is 0, to `values`. Returns the sum, over the sums with flag 1, of
  /// the distance from the scale minus the rounding error of the code: its share of
  /// `SketchQuery::constant`.
  int32_t (*encode_query)(const int32_t* sums, const int32_t* flags, const SumScale& scale,
                          uint8_t* values);

  /// Computes, for each view v of `blocks` blocks of `cell_block` views, bounds[v] = sum over its
  /// dimensions d of tables[16 * d + code], at most 255. Writes the indices of the views with
  /// bounds <= query.limit, ascending, to `indices`, which has room for all views, and returns
  /// their number. A block consists of `pairs` rows of `cell_block` bytes. Byte v of each row
  /// belongs to view v: its lower four bits are the code of an even dimension, its upper four bits
  /// that of the next dimension.
  size_t (*cell_bounds)(const uint8_t* codes, size_t blocks, const CellQuery& query,
                        uint8_t* bounds, uint32_t* indices);

  /// Writes the positions of the values <= limit, ascending, and returns their number. `indices`
  /// has room for `count` entries and 16 more.
  size_t (*collect_at_most)(const uint32_t* values, size_t count, uint32_t limit,
                            uint32_t* indices);
};

/// Result of encoding sums.
struct EncodedSums {
  int32_t missed;  ///< sum of all |sum - offset - step * code|
  bool is_within;  ///< every sum lies within the scale
};

/// Number of views in a block of `cell_bounds`.
inline constexpr size_t cell_block = 64;

/// Number of columns of the query of `match_columns`.
inline constexpr int matched_query_columns = 32;
/// Number of columns of the reference; also the number of rotations.
inline constexpr int matched_reference_columns = 128;
inline constexpr int matched_bands = 16;  ///< Bytes of a column: bands of elevation.

/// Floats from one component of `BandWaves` to the next: azimuths of a quarter turn, both ends
/// included, padded to whole vectors.
inline constexpr int profile_wave_stride = 48;
/// Floats from one row of a reconstructed view to the next: 128 columns, and one that repeats the
/// first, padded to whole vectors.
inline constexpr int profile_view_stride = 144;

/// Fourier components of the bands of a view, and the waves that they are the amplitudes of.
struct BandWaves {
  const float *real,     ///< of each component 16 values, one for each band
      *imaginary;        ///< the same
  const float *cosines,  ///< of each component `profile_wave_stride` values; first 33 used
      *sines;            ///< the same
  int components,        ///< number of them
      bands;             ///< at most 16
};

/// Contrast by which `quantise_columns` divides: the root mean square of a column's values plus
/// `mean_share` times that of all columns, or the latter alone.
struct ColumnContrast {
  bool is_of_each_column;  ///< false: all columns are divided by the contrast of all
  float mean_share,        ///< >= 0; keeps the noise of columns without contrast from growing
      steps;               ///< bytes for a deviation of one contrast
};

/// Largest number of descriptors (of 256 bits) per view in `nearest_descriptors`.
inline constexpr int max_descriptors = 256;

/// Values of a histogram in `nearest_histograms`, each 0 .. 15.
inline constexpr int histogram_dimensions = 128;
/// Largest number of histograms per view in `nearest_histograms`.
inline constexpr int max_histograms = 1024;

/// Bearings of matched features of two views, as a structure of arrays. Tangents belong to the
/// elevations; `sine` and `cosine` to the azimuth in the query minus that in the reference.
struct MatchedBearings {
  /// Sine and cosine of a rotation between two views, and of half of it.
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

/// Directions of one elevation above the horizon of a level robot, and the panorama of a tilted
/// one.
struct TiltedDirections {
  double cos_roll,      ///< cosine of the robot's roll (`Tilt`)
      sin_roll,         ///< its sine
      cos_pitch,        ///< cosine of the robot's pitch
      sin_pitch,        ///< its sine
      flat,             ///< cosine of the elevation
      z;                ///< its sine
  double top_rad,       ///< upper edge of the tilted panorama
      rows_per_rad,     ///< rows of the tilted panorama per radian
      columns_per_rad;  ///< the same
};

/// Number of axes of motion, each tested in both directions.
inline constexpr int motion_axes = 16;
/// Candidate axes of motion, and the condition under which one explains a matched bearing.
struct MotionHypotheses {
  float cosine[motion_axes],  ///< of each axis, along x, forward at angle 0
      sine[motion_axes];      ///< of each axis, along y
  float tolerance_sine,       ///< of the largest error of a bearing, below a right angle
      tolerance_cosine,       ///< of the same
      max_ratio;              ///< largest ratio of view distance to landmark distance
};

/// Number of references around a place; unused lanes have similarity 0.
inline constexpr int similarity_lanes = 12;

/// Reference views around a place and their similarities to a view, one per lane. An unused lane
/// has similarity 0 (logarithm minus infinity) and a distant position.
struct SimilarityLanes {
  /// Decrease of similarity with distance: exp(-sqrt(distance^2 + blur_square_m2) * per_metre).
  struct Decay {
    float per_metre;  ///< > 0, decrease of the logarithm per metre
    /// Added to the square of each distance, which makes the decrease flat near a reference.
    float blur_square_m2;
  };

  float x_m[similarity_lanes];                   ///< position of each reference
  float y_m[similarity_lanes];                   ///< the same, along y
  float log_similarity[similarity_lanes];        ///< to the view
  float heading_rad[similarity_lanes];           ///< heading of the view implied by the reference
  float other_log_similarity[similarity_lanes];  ///< to the view, at the second-best heading
  /// Second-best heading of the view, to which `other_log_similarity` belongs.
  float other_heading_rad[similarity_lanes];
  float per_square_turn[similarity_lanes];  ///< <= 0; 0 ignores the heading
};

}  // namespace panonav::kernels
