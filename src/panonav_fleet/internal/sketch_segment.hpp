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

/// Layout of the sketches of views that are not held: sums of packed magnitudes over blocks of
/// neighbouring rows at three levels, each finer than the one before. A block of a level
/// consists of blocks of the next one. docs/search.md explains why their differences bound the
/// dissimilarity.
class SegmentLayout {
 public:
  static constexpr int levels = 3;  ///< cells of 4 bits, then two levels of a byte a sum
  explicit SegmentLayout(SignatureShape shape);

  [[nodiscard]] SignatureShape shape() const noexcept { return shape_; }
  /// Returns the number of sums of a level, padded to pairs (cells) or to groups of 64 (other
  /// levels).
  [[nodiscard]] std::size_t dimensions(int level) const noexcept { return dimensions_[level]; }
  /// Number over all levels.
  [[nodiscard]] std::size_t total() const noexcept {
    return dimensions_[0] + dimensions_[1] + dimensions_[2];
  }
  /// Bytes of a view's sketch.
  [[nodiscard]] std::size_t bytes() const noexcept {
    return dimensions_[0] / 2 + dimensions_[1] + dimensions_[2];
  }
  /// Views of a segment, a multiple of `kernels::cell_block`; with their ids they fill a large
  /// page.
  [[nodiscard]] std::size_t max_rows() const noexcept { return max_rows_; }

  /// The sums of all levels, one level after the other; those that pad are 0.
  void sum_blocks(const std::uint8_t* magnitudes, std::int32_t* sums) const;
  /// 1 for each sum of the first `components` whose rows all count, else 0.
  [[nodiscard]] std::vector<std::int32_t> counted(int components,
                                                  std::span<const std::uint8_t> allowed_rows) const;

 private:
  [[nodiscard]] int first_row(int block, int blocks) const noexcept {
    return static_cast<int>(static_cast<std::int64_t>(block) * shape_.rows / blocks);
  }

  SignatureShape shape_;
  std::array<std::vector<int>, levels> blocks_;  // of each component
  std::array<std::size_t, levels> dimensions_{};
  std::size_t max_rows_ = 0;
};

/// The query of a search in the form that segments are compared with.
struct SegmentQuery {
  std::vector<std::int32_t> sums;     ///< of the query, as `SegmentLayout::sum_blocks` gives them
  std::vector<std::int32_t> counted;  ///< 1 or 0 each
  std::vector<float> factors;         ///< of the cells: `counted` over `unit`
  std::uint32_t unit = 1;             ///< of bounds by cells

  /// Bounds up to `largest` are distinguished.
  void choose_unit(const SegmentLayout& layout, std::uint32_t largest);
};

/// Sketches of up to `SegmentLayout::max_rows` views. Nothing changes once it is made.
class SketchSegment {
 public:
  /// `magnitudes` of one view after the other.
  SketchSegment(const SegmentLayout& layout, std::span<const ViewId> views,
                std::span<const std::uint8_t> magnitudes);

  [[nodiscard]] std::size_t rows() const noexcept { return views_.size(); }
  /// Ids in the order of the rows.
  [[nodiscard]] std::span<const ViewId> views() const noexcept { return views_; }
  [[nodiscard]] ViewId smallest_id() const noexcept { return smallest_id_; }
  [[nodiscard]] ViewId largest() const noexcept { return largest_; }
  [[nodiscard]] std::size_t blocks() const noexcept;
  /// Bytes of the sketches, with room for rows that do not exist yet.
  [[nodiscard]] std::uint64_t bytes() const noexcept;

  /// Contribution of each code to the bounds, in whole units, rounded down.
  void make_tables(const SegmentLayout& layout, const kernels::DistanceKernels& kernels,
                   const SegmentQuery& query, std::span<std::uint8_t> tables) const;
  /// Bounds in units, 255 for all beyond, of the rows of blocks first .. first + count - 1; indices
  /// of those that may be at most `limit`, counted from the first block on, are returned.
  std::span<const std::uint32_t> compute_cell_bounds(
      const SegmentLayout& layout, const kernels::DistanceKernels& kernels,
      const SegmentQuery& query, std::span<const std::uint8_t> tables, std::uint32_t limit,
      std::size_t first, std::size_t count, std::span<std::uint8_t> bounds,
      std::span<std::uint32_t> indices) const;

  /// Room for a query in the codes of a segment.
  struct Encoded {
    explicit Encoded(const SegmentLayout& layout);
    AlignedVector<std::uint8_t> values, mask;
  };
  /// Lower bounds of rows, of level 1 or 2.
  void bounds_at(const SegmentLayout& layout, const kernels::DistanceKernels& kernels,
                 const SegmentQuery& query, int level, std::span<const std::uint32_t> rows,
                 Encoded& scratch, std::uint32_t* bounds) const;

 private:
  /// A sum s is kept as the code nearest to (s - offset) / step; all sums of the segment are within
  /// offset .. highest.
  struct Scale {
    std::vector<std::int32_t> offsets, highest;  // one a sum
    std::vector<std::uint64_t> steps;            // one a group of 8
    std::vector<float> inverse_steps;
    std::vector<std::int32_t> max_missed;  // of each group: what codes miss of a view at most
    std::int32_t max_slack = 0;            // of all groups together
  };
  void make_cells(const SegmentLayout& layout, const std::vector<std::int32_t>& sums);
  void make_level(const SegmentLayout& layout, int level, const std::vector<std::int32_t>& sums);

  std::vector<ViewId> views_;
  ViewId smallest_id_, largest_;
  LargePageVector<std::uint8_t> codes_;  // cells, then the two other levels
  std::array<std::size_t, SegmentLayout::levels> begins_{};
  std::vector<std::int32_t> cell_low_, cell_high_;  // smallest and largest sum of each code
  std::array<Scale, 2> scales_;
};

}  // namespace panonav::fleet
