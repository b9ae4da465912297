#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "panonav/kernels/distance.hpp"
#include "panonav/memory/internal/aligned_vector.hpp"
#include "panonav/memory/internal/view_store.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// Sums of the packed magnitudes of one view over blocks of neighbouring rows, component by
/// component. The sum of |sum over a block of a - the same of b| over all blocks is at most the L1
/// between a and b.
/// Both levels are padded with zeros to whole groups of 8.
struct BlockSums {
  static constexpr int blocks_per_component = 8;
  std::vector<std::int32_t> fine;  ///< 8 blocks a component; empty when rows are too few
  std::vector<std::int32_t>
      coarse;  ///< 2 (few rows: 1) blocks a component, unions of the fine ones
};

/// Refers to the block sums of one view.
struct BlockSumsOf {
  std::span<std::int32_t> fine;    ///< as `BlockSums::fine`
  std::span<std::int32_t> coarse;  ///< as `BlockSums::coarse`
};

/// Layout of the sketches of views of one shape. Both levels are laid out in groups of 8 bytes.
struct SketchLayout {
  explicit SketchLayout(SignatureShape shape_);

  [[nodiscard]] bool has_sketches() const noexcept { return coarse_blocks > 0; }
  /// Blocks of component k in the coarse level.
  [[nodiscard]] int coarse_blocks_of(int k) const noexcept {
    return k < low_components ? 2 * coarse_blocks : coarse_blocks;
  }
  /// Coarse dimensions of the components before k.
  [[nodiscard]] std::size_t coarse_dimensions(int k) const noexcept {
    return static_cast<std::size_t>(coarse_blocks) *
           (k + (k < low_components ? k : low_components));
  }
  /// First row of block `block` of `blocks`.
  [[nodiscard]] int first_row(int block, int blocks) const noexcept {
    return static_cast<int>(static_cast<std::int64_t>(block) * shape.rows / blocks);
  }
  /// Computes the block sums of a view. `magnitudes`: component-major. Resizes the vectors of
  /// `sums`.
  void sum_blocks(const std::uint8_t* magnitudes, BlockSums& sums) const;
  /// Does the same in place; the spans have the sizes of the padded levels, filled with zeros.
  void sum_blocks(const std::uint8_t* magnitudes, const BlockSumsOf& sums) const;

  SignatureShape shape;
  int coarse_blocks = 0;   ///< blocks a component: 2, 1 or 0 (views too small to be sketched)
  int low_components = 0;  ///< number of first components with twice as many coarse blocks
  int fine_blocks = 0;     ///< 8 or 0
  std::size_t coarse_groups = 0;
  std::size_t fine_groups = 0;  ///< a multiple of 8
};

/// One level of a segment's sketches: block sums as bytes. A sum s is kept as the nearest
/// code c in 0 .. 255 to (s - offset) / step; `slack` of a view is its sum of |s - offset - step *
/// c|. With the triangle inequality  sum |s - q| >= sum step |c - c_q| - slack - slack_q  stays a
/// lower bound whatever offset and step are; they only decide how tight it is.
struct SketchScale {
  std::vector<std::int32_t> offsets;  ///< one per dimension
  std::vector<std::int32_t>
      highest;  ///< one per dimension: the largest sum when the scale was learnt
  std::vector<std::uint64_t> steps;  ///< one per group of 8 dimensions, >= 1
  std::vector<float> inverse_steps;
};

/// Block sums of all views of a store as bytes, in segments of 4096 rows with a scale each. Rows
/// are encoded when they are added. The scale of a segment is learnt from its first 64 views, and
/// again when too many views are outside of it, so that appending costs a constant number of
/// encodings per view.
class SketchIndex {
 public:
  using Row = ViewStore::Row;
  static constexpr std::size_t rows_per_segment = 4096;
  static constexpr std::size_t rows_per_block = 64;
  /// Bounds of rows without a view are at least this; distances are smaller.
  static constexpr std::uint32_t no_view = 1U << 30U;

  explicit SketchIndex(SignatureShape shape) : layout_(shape) {}

  [[nodiscard]] const SketchLayout& layout() const noexcept { return layout_; }

  /// Adds the new view in row `row` of the store. Rows beyond the last one must be added in order.
  void insert(const ViewStore& store, Row row);
  /// Inserts many rows at once: each segment's scale is learnt once, from all of its rows.
  void insert(const ViewStore& store, std::span<const Row> rows);
  void erase(Row row);

  /// The part of a query that is the same for all segments: its block sums and the masks of the
  /// compared ones.
  struct Query {
    BlockSums sums;
    std::vector<std::uint8_t> coarse_mask;  ///< per dimension 255 or 0, padded to groups
    std::vector<std::uint8_t> fine_mask;
    std::size_t coarse_groups = 0;  ///< number of groups up to the last compared dimension
    std::size_t fine_groups = 0;    ///< a multiple of 8
  };
  /// Prepares a query. `allowed_rows` empty: all rows. A block is compared only if all its rows are
  /// allowed.
  [[nodiscard]] Query make_query(const std::uint8_t* magnitudes, int components,
                                 std::span<const std::uint8_t> allowed_rows) const;

  /// Computes lower bounds of the distances of all rows, rounded up to a block, and the smallest
  /// bound of each block.
  void compute_coarse_bounds(const kernels::DistanceKernels& kernels, const Query& query,
                             std::span<std::uint32_t> bounds,
                             std::span<std::uint32_t> smallest) const;

  /// Lower bounds of some rows from the fine level.
  class FineBounds {
   public:
    FineBounds(const SketchIndex& index, const kernels::DistanceKernels& kernels,
               const Query& query);
    /// Sets bounds[i] to the lower bound of row `first` + places[i]. All rows must be in one
    /// segment.
    void operator()(Row first, std::span<const std::uint32_t> places, std::uint32_t* bounds);
    /// Bytes that one bound reads.
    [[nodiscard]] std::size_t bytes() const noexcept;

   private:
    const SketchIndex& index_;
    const kernels::DistanceKernels& kernels_;
    const Query& query_;
    std::size_t segment_ = std::numeric_limits<std::size_t>::max();
    AlignedVector<std::uint8_t> values_, mask_;
    kernels::DistanceKernels::SketchQuery encoded_{};
  };

  [[nodiscard]] std::size_t blocks() const noexcept {
    return (rows_end_ + rows_per_block - 1) / rows_per_block;
  }
  /// Bytes that `compute_coarse_bounds` reads for one row.
  [[nodiscard]] std::size_t coarse_bytes_per_row(const Query& query) const noexcept {
    return query.coarse_groups * 8 + sizeof(std::int32_t);
  }

 private:
  struct Level {
    SketchScale scale;
    AlignedVector<std::uint8_t> codes;
    AlignedVector<std::int32_t> slacks;  // of rows without a view: -no_view
    bool covers = true;                  // every sum lies within the scale
  };
  struct Segment {
    Level coarse, fine;
    std::size_t used = 0;
    std::size_t learnt_from = 0;  // views in the segment when the scales were learnt
    std::size_t outside = 0;      // views added since then that are outside the scales
  };

  [[nodiscard]] Segment make_segment() const;
  /// Makes room for the row.
  Segment& get_or_create_segment(Row row);
  /// Encodes a row; true if all its sums lie within the scales.
  bool encode(Segment& segment, std::size_t place, const BlockSumsOf& sums) const;
  void learn_scales(Segment& segment, std::size_t first_row, const ViewStore& store) const;

  SketchLayout layout_;
  std::vector<Segment> segments_;
  std::size_t rows_end_ = 0;
};

}  // namespace panonav
