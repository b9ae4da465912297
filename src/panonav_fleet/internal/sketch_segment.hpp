#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/kernels/distance.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav_fleet/internal/large_page_vector.hpp"

namespace panonav::fleet {

/// Layout of the sketches that replace views which are not in memory: sums of packed magnitudes
/// over blocks of neighbouring rows, at three levels, each finer than the one before. A block
/// consists of whole blocks of the next level. docs/search.md explains why differences of these
/// sums are lower bounds of the dissimilarity.
class SegmentLayout {
 public:
  static constexpr int levels = 3;  ///< 4-bit cells, then two levels of one byte a sum
  explicit SegmentLayout(SignatureShape shape);

  [[nodiscard]] SignatureShape shape() const noexcept { return shape_; }
  /// Returns the number of sums of a level, padded to pairs (cells) or to groups of 64 (other
  /// levels).
  [[nodiscard]] std::size_t dimensions(int level) const noexcept { return dimensions_[level]; }
  /// Returns the number of sums over all levels, with padding.
  [[nodiscard]] std::size_t total() const noexcept {
    return dimensions_[0] + dimensions_[1] + dimensions_[2];
  }
  /// Returns the bytes of a view's sketch.
  [[nodiscard]] std::size_t bytes() const noexcept {
    return dimensions_[0] / 2 + dimensions_[1] + dimensions_[2];
  }
  /// Returns the largest number of views in a segment, a multiple of `kernels::cell_block`; with
  /// their ids they fill a large page.
  [[nodiscard]] std::size_t max_rows() const noexcept { return max_rows_; }

  /// Computes the sums of all levels, one level after the other; padding is 0.
  void sum_blocks(const std::uint8_t* magnitudes, std::int32_t* sums) const;
  /// Returns 1 for each sum of the first `components` whose rows are all compared, else 0.
  [[nodiscard]] std::vector<std::int32_t> make_sum_flags(
      int components, std::span<const std::uint8_t> allowed_rows) const;

 private:
  [[nodiscard]] int first_row(int block, int blocks) const noexcept {
    return static_cast<int>(static_cast<std::int64_t>(block) * shape_.rows / blocks);
  }

  SignatureShape shape_;
  std::array<std::vector<int>, levels> blocks_;  // of each component
  std::array<std::size_t, levels> dimensions_{};
  std::size_t max_rows_ = 0;
};

/// A query in the form in which it is compared with segments.
struct SegmentQuery {
  std::vector<std::int32_t> sums;       ///< as `SegmentLayout::sum_blocks` computes them
  std::vector<std::int32_t> sum_flags;  ///< 1: the sum is compared; 0: it is not
  AlignedVector<std::uint8_t> mask;     ///< for each sum of levels 1 and 2: 255 or 0, as its flag
  std::vector<bool> group_flags;        ///< for each group of levels 1 and 2: a sum is compared
  std::vector<float> factors;           ///< for each cell: its flag divided by `unit`
  std::uint32_t unit = 1;               ///< dissimilarity of one step of a cell bound
  std::uint32_t outside = 0;            ///< added to every bound, see `SketchSegment::clamp`

  SegmentQuery(const SegmentLayout& layout, std::span<const std::uint8_t> magnitudes,
               int components, std::span<const std::uint8_t> allowed_rows);
  /// Sets `unit` and `factors` so that bounds up to `largest` are distinguished.
  void choose_unit(const SegmentLayout& layout, std::uint32_t largest);
};

/// Sketches of up to `SegmentLayout::max_rows` views; immutable.
class SketchSegment {
 public:
  /// `magnitudes` has the magnitudes of one view after the other.
  SketchSegment(const SegmentLayout& layout, std::span<const ViewId> views,
                std::span<const std::uint8_t> magnitudes);

  [[nodiscard]] std::size_t rows() const noexcept { return views_.size(); }
  /// Returns the ids in the order of the rows.
  [[nodiscard]] std::span<const ViewId> views() const noexcept { return views_; }
  [[nodiscard]] ViewId smallest_id() const noexcept { return smallest_id_; }
  [[nodiscard]] ViewId largest_id() const noexcept { return largest_id_; }
  [[nodiscard]] std::size_t blocks() const noexcept;
  /// Returns the bytes of the sketches, including the padding of the last block.
  [[nodiscard]] std::uint64_t bytes() const noexcept;

  /// Clamps magnitudes to the smallest and largest of each row and component in this segment. The
  /// distance of the query from the clamped one is part of its distance from every view.
  void clamp(std::span<const std::uint8_t> magnitudes, std::span<std::uint8_t> clamped) const;
  /// Loads the tables of the segment into the cache, because a search reads them soon.
  void prefetch_tables() const noexcept;

  /// Computes what each cell code adds to the bounds, in whole units, rounded down.
  void make_cell_tables(const SegmentLayout& layout, const kernels::DistanceKernels& kernels,
                        const SegmentQuery& query, std::span<std::uint8_t> tables) const;
  /// Computes bounds, less `query.outside`, in units (255: that or more) of the rows of `count`
  /// blocks from block `first` on. Returns indices, from the first of these blocks, of the rows
  /// whose bound may be at most `limit`.
  std::span<const std::uint32_t> compute_cell_bounds(
      const SegmentLayout& layout, const kernels::DistanceKernels& kernels,
      const SegmentQuery& query, std::span<const std::uint8_t> tables, std::uint32_t limit,
      std::size_t first, std::size_t count, std::span<std::uint8_t> bounds,
      std::span<std::uint32_t> indices) const;

  /// Computes lower bounds of the dissimilarity of rows at level 1 or 2. `values` has room for the
  /// codes of a query, one for each sum.
  void compute_level_bounds(const SegmentLayout& layout, const kernels::DistanceKernels& kernels,
                            const SegmentQuery& query, int level,
                            std::span<const std::uint32_t> rows, std::span<std::uint8_t> values,
                            std::uint32_t* bounds) const;

 private:
  /// Codes of a level: a sum s is stored as the code nearest to (s - offset) / step. All sums of
  /// the segment are within offset .. highest.
  struct Scale {
    std::vector<std::int32_t> offsets, highest;  // one for each sum
    std::vector<std::uint64_t> steps;            // one for each group of 8 sums
    std::vector<float> inverse_steps;
    std::vector<std::int32_t> max_missed;  // largest rounding error of a view in each group
    std::int32_t max_slack = 0;            // largest rounding error of a view in total
  };
  void make_cells(const SegmentLayout& layout, const std::vector<std::int32_t>& sums);
  void make_level(const SegmentLayout& layout, int level, const std::vector<std::int32_t>& sums);

  std::vector<ViewId> views_;
  ViewId smallest_id_, largest_id_;
  LargePageVector<std::uint8_t> codes_;  // cells, then the two other levels
  std::array<std::size_t, SegmentLayout::levels> begins_{};
  std::vector<std::int32_t> cell_low_, cell_high_;  // smallest and largest sum of each code
  std::array<Scale, 2> scales_;
  std::vector<std::uint8_t> lowest_, highest_;  // magnitudes of all views
};

}  // namespace panonav::fleet
