#include "panonav_fleet/internal/sketch_search.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/kernels/dispatch.hpp"
#include "panonav/memory/internal/comparison.hpp"

namespace panonav::fleet {

namespace {

/// A candidate of the search with its present lower bound.
struct SketchedView {
  std::uint32_t bound = 0;
  std::uint32_t segment = 0;  // index of the segment
  std::uint32_t row = 0;
  ViewId view;
};

/// Buffers of a thread, reused for one segment after the other.
struct SegmentScratch {
  SegmentScratch(const SegmentLayout& layout, const SegmentQuery& query_)
      : clamped(layout.shape().size()),
        values(layout.dimensions(2)),
        tables(layout.dimensions(0) * 16),
        bounds(layout.max_rows()),
        indices(layout.max_rows()),
        level_bounds(layout.max_rows()),
        query(query_) {}
  AlignedVector<std::uint8_t> clamped, values, tables, bounds;
  std::vector<std::uint32_t> indices, level_bounds;
  SegmentQuery query;  // as it is compared with the present segment
  std::uint64_t bytes_read = 0;
};

class SketchSearch {
 public:
  SketchSearch(const SegmentLayout& layout, std::span<const LiveSegment> segments,
               const PackedSignature& query, int components, const SearchMask& mask,
               std::size_t top, const ViewSketches::ReadViews& read, Executor& executor)
      : layout_(layout),
        segments_(segments),
        kernels_(kernels::distance_kernels(kernels::chosen_instructions())),
        read_(read),
        executor_(executor),
        top_(top),
        nearest_(top, std::numeric_limits<std::int32_t>::max()),
        query_(layout, query.magnitudes, components, mask.allowed_rows) {
    const auto rows = static_cast<std::size_t>(layout.shape().rows);
    magnitudes_.assign(query.magnitudes.begin(), query.magnitudes.end());
    compared_bytes_ = static_cast<std::size_t>(components) * rows;
    if (!mask.allowed_rows.empty()) {
      for (std::size_t i = 0; i < compared_bytes_; ++i) {
        mask_.push_back(mask.allowed_rows[i % rows] != 0 ? 255 : 0);
      }
    }
    excluded_.assign(mask.excluded_views.begin(), mask.excluded_views.end());
    std::ranges::sort(excluded_);
  }

  SearchResult run() {
    find_limit();
    scan();
    result_.matches = std::move(nearest_).sorted();
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool is_excluded(ViewId view) const {
    return !excluded_.empty() && std::ranges::binary_search(excluded_, view);
  }

  [[nodiscard]] std::uint32_t compute_distance(const std::uint8_t* magnitudes) const {
    return mask_.empty()
               ? kernels_.l1(magnitudes, magnitudes_.data(), compared_bytes_)
               : kernels_.masked_l1(magnitudes, magnitudes_.data(), mask_.data(), compared_bytes_);
  }

  void compare(ViewId view, std::span<const std::uint8_t> magnitudes) {
    require(magnitudes.size() == layout_.shape().size(), "magnitudes of a view that was read",
            static_cast<double>(magnitudes.size()), std::to_string(layout_.shape().size()));
    ++result_.views_in_full;
    result_.bytes_read += compared_bytes_;
    nearest_.insert_if_nearer({view, compute_distance(magnitudes.data())});
  }

  /// Reads and compares candidates in full, except those that were compared before.
  void read(std::span<const SketchedView> candidates) {
    std::vector<ViewId> unread;
    for (const SketchedView& candidate : candidates) {
      if (std::ranges::binary_search(compared_, candidate.view)) continue;
      unread.push_back(candidate.view);
    }
    if (unread.empty()) return;
    std::ranges::sort(unread);
    read_(unread, [this](ViewId view, std::span<const std::uint8_t> magnitudes) {
      compare(view, magnitudes);
    });
    const auto middle = static_cast<std::ptrdiff_t>(compared_.size());
    compared_.insert(compared_.end(), unread.begin(), unread.end());
    std::ranges::inplace_merge(compared_, compared_.begin() + middle);
    choose_limit(nearest_.limit());
  }
  /// Bounds up to `limit` are distinguished from now on.
  void choose_limit(std::uint32_t limit) {
    distinguished_limit_ = limit;
    query_.choose_unit(layout_, limit);
  }

  /// Clamps a query with magnitudes that no view of the segment has, such as noise, to those of
  /// the segment, which makes its bounds much larger.
  void clamp_query_if_needed(const SketchSegment& segment, SegmentScratch& scratch) const {
    if (!clamps_query_) return;
    segment.clamp(magnitudes_, scratch.clamped);
    scratch.query.outside = compute_distance(scratch.clamped.data());
    layout_.sum_blocks(scratch.clamped.data(), scratch.query.sums.data());
    scratch.query.choose_unit(
        layout_, distinguished_limit_ - std::min(distinguished_limit_, scratch.query.outside));
  }
  void prepare_cells(const SketchSegment& segment, SegmentScratch& scratch) const {
    clamp_query_if_needed(segment, scratch);
    segment.make_cell_tables(layout_, kernels_, scratch.query, scratch.tables);
  }
  /// True if the magnitudes of the query lie so far outside those of all of some segments that the
  /// cells distinguish it.
  [[nodiscard]] bool is_clamping_worthwhile() const {
    constexpr std::size_t compared_segments = 16;
    AlignedVector<std::uint8_t> clamped(magnitudes_.size());
    const std::size_t step = (segments_.size() + compared_segments - 1) / compared_segments;
    for (std::size_t i = 0; i < segments_.size(); i += step) {
      segments_[i].sketches->clamp(magnitudes_, clamped);
      if (compute_distance(clamped.data()) < query_.unit) return false;
    }
    return true;
  }

  static bool is_better(const SketchedView& a, const SketchedView& b) {
    return a.bound != b.bound ? a.bound < b.bound : a.view < b.view;
  }
  static void keep_best(std::vector<SketchedView>& candidates, std::size_t count) {
    if (candidates.size() <= count) return;
    std::ranges::nth_element(candidates, candidates.begin() + static_cast<std::ptrdiff_t>(count),
                             is_better);
    candidates.resize(count);
  }

  std::span<const std::uint32_t> compute_cell_bounds(const SketchSegment& segment,
                                                     std::uint32_t limit, std::size_t first,
                                                     std::size_t count,
                                                     SegmentScratch& scratch) const {
    scratch.bytes_read += count * kernels::cell_block * layout_.dimensions(0) / 2;
    return segment.compute_cell_bounds(layout_, kernels_, scratch.query, scratch.tables, limit,
                                       first, count, scratch.bounds, scratch.indices);
  }
  /// Writes the lower bounds of rows at a level to scratch.level_bounds.
  void compute_level_bounds(const SketchSegment& segment, int level,
                            std::span<const std::uint32_t> rows, SegmentScratch& scratch) const {
    scratch.bytes_read += rows.size() * layout_.dimensions(level);
    segment.compute_level_bounds(layout_, kernels_, scratch.query, level, rows, scratch.values,
                                 scratch.level_bounds.data());
  }

  /// Calls body(segment number, index in the order, scratch, chunk number) for the segments `begin`
  /// to `end` of the order on the threads of the executor, in chunks of `chunk` segments.
  template <class Body>
  void for_each_segment(std::size_t begin, std::size_t end, std::size_t chunk, const Body& body) {
    std::vector<std::uint64_t> bytes((end - begin + chunk - 1) / chunk);
    executor_.for_each_chunk(
        end - begin, chunk, [&](std::size_t from, std::size_t to, std::size_t number) {
          SegmentScratch scratch(layout_, query_);
          for (std::size_t i = from; i < to; ++i) {
            if (i + 1 < to) {
              segments_[order_[begin + i + 1].second].sketches->prefetch_tables();
            }
            body(order_[begin + i].second, begin + i, scratch, number);
          }
          bytes[number] = scratch.bytes_read;
        });
    for (const std::uint64_t of_chunk : bytes) result_.bytes_read += of_chunk;
  }

  /// Replaces the bounds of candidates by those of a finer level; sorts the candidates by segment
  /// and row.
  void refine(std::vector<SketchedView>& candidates, int level) {
    std::ranges::sort(candidates, {}, [](const SketchedView& candidate) {
      return std::pair(candidate.segment, candidate.row);
    });
    SegmentScratch scratch(layout_, query_);
    std::vector<std::uint32_t> rows;
    for (std::size_t begin = 0; begin < candidates.size();) {
      const std::uint32_t number = candidates[begin].segment;
      std::size_t end = begin;
      rows.clear();
      for (; end < candidates.size() && candidates[end].segment == number; ++end) {
        rows.push_back(candidates[end].row);
      }
      const SketchSegment& sketches = *segments_[number].sketches;
      clamp_query_if_needed(sketches, scratch);
      compute_level_bounds(sketches, level, rows, scratch);
      for (std::size_t i = begin; i < end; ++i) {
        candidates[i].bound = scratch.level_bounds[i - begin];
      }
      begin = end;
    }
    result_.bytes_read += scratch.bytes_read;
  }

  /// Finds a first limit of the dissimilarity for the `top` views in the segments with the best
  /// samples. Samples suffice because views of nearby places are adjacent in a segment.
  void find_limit() {
    if (segments_.empty()) return;
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      order_.emplace_back(0U, static_cast<std::uint32_t>(i));
    }
    choose_limit(estimate_median_bound(*segments_.front().sketches));
    clamps_query_ = is_clamping_worthwhile();
    if (segments_.size() > first_segments) {
      for_each_segment(0, order_.size(), 64,
                       [this](std::uint32_t number, std::size_t index, SegmentScratch& scratch,
                              std::size_t /*chunk*/) {
                         order_[index].first =
                             find_sample_minimum(*segments_[number].sketches, number, scratch);
                       });
      std::ranges::sort(order_);
    }
    std::vector<SketchedView> best;
    std::size_t begin = 0;
    while (begin < order_.size() && (begin == 0 || best.size() < 2 * top_)) {
      const std::size_t end = std::min(order_.size(), begin + first_segments);
      std::vector<std::vector<SketchedView>> found(end - begin);
      for_each_segment(begin, end, 1,
                       [&](std::uint32_t number, std::size_t /*index*/, SegmentScratch& scratch,
                           std::size_t chunk) { collect_best(number, scratch, found[chunk]); });
      for (const auto& of_segment : found) {
        best.insert(best.end(), of_segment.begin(), of_segment.end());
      }
      begin = end;
    }
    keep_best(best, count_kept_by_cells());
    refine(best, 1);
    keep_best(best, 128 + 4 * top_);
    refine(best, 2);
    keep_best(best, top_ + 6);
    read(best);
  }
  [[nodiscard]] std::size_t count_kept_by_cells() const noexcept { return 1024 + 8 * top_; }

  std::uint32_t find_sample_minimum(const SketchSegment& segment, std::size_t number,
                                    SegmentScratch& scratch) const {
    prepare_cells(segment, scratch);
    std::uint32_t min_bound = 255;
    for (std::size_t block = number % sampled_every; block < segment.blocks();
         block += sampled_every) {
      compute_cell_bounds(segment, 0, block, 1, scratch);
      const std::size_t rows =
          std::min(kernels::cell_block, segment.rows() - block * kernels::cell_block);
      min_bound = std::min<std::uint32_t>(
          min_bound, *std::ranges::min_element(std::span(scratch.bounds).first(rows)));
    }
    return scratch.query.outside + min_bound * scratch.query.unit;
  }

  /// Finds the best views of a segment by the bounds of their cells.
  void collect_best(std::uint32_t number, SegmentScratch& scratch,
                    std::vector<SketchedView>& best) const {
    const LiveSegment& segment = segments_[number];
    const SketchSegment& sketches = *segment.sketches;
    prepare_cells(sketches, scratch);
    compute_cell_bounds(sketches, 0, 0, sketches.blocks(), scratch);
    // Finds the smallest limit that enough of the bounds do not exceed.
    std::array<std::size_t, 256> counts{};
    for (std::size_t row = 0; row < sketches.rows(); ++row) ++counts[scratch.bounds[row]];
    std::size_t limit = 0;
    for (std::size_t within = counts[0]; within < count_kept_by_cells() && limit < 255;) {
      within += counts[++limit];
    }
    for (std::uint32_t row = 0; row < sketches.rows(); ++row) {
      if (scratch.bounds[row] > limit || !segment.has(row)) continue;
      const ViewId view = sketches.views()[row];
      const std::uint32_t bound = scratch.query.outside + scratch.bounds[row] * scratch.query.unit;
      if (!is_excluded(view)) best.push_back({bound, number, row, view});
    }
  }

  /// Returns the median lower bound of the first views of a segment.
  std::uint32_t estimate_median_bound(const SketchSegment& segment) {
    std::vector<std::uint32_t> rows;
    for (std::uint32_t row = 0; row < std::min<std::size_t>(64, segment.rows()); ++row) {
      rows.push_back(row);
    }
    SegmentScratch scratch(layout_, query_);
    compute_level_bounds(segment, 1, rows, scratch);
    const auto bounds = std::span(scratch.level_bounds).first(rows.size());
    const auto middle = bounds.begin() + static_cast<std::ptrdiff_t>(rows.size() / 2);
    std::ranges::nth_element(bounds, middle);
    return *middle;
  }

  /// Searches all segments in rounds of growing size, because the limit may fall after each round.
  void scan() {
    constexpr std::size_t chunk = 16;
    std::vector<SketchedView> waiting;
    std::size_t begin = 0;
    while (begin < order_.size()) {
      const std::size_t end = std::min(order_.size(), begin + std::max(2 * chunk, 3 * begin));
      std::vector<std::vector<SketchedView>> found((end - begin + chunk - 1) / chunk);
      for_each_segment(begin, end, chunk,
                       [&](std::uint32_t number, std::size_t /*index*/, SegmentScratch& scratch,
                           std::size_t of_chunk) {
                         collect_within(number, nearest_.limit(), scratch, found[of_chunk]);
                       });
      for (const auto& of_chunk : found) {
        waiting.insert(waiting.end(), of_chunk.begin(), of_chunk.end());
      }
      if (waiting.size() >= max_waiting) read_batch(waiting);
      begin = end;
    }
    while (!waiting.empty()) read_batch(waiting);
  }

  /// Collects the views of a segment whose bounds do not exceed the limit, level by level.
  void collect_within(std::uint32_t number, std::uint32_t limit, SegmentScratch& scratch,
                      std::vector<SketchedView>& found) const {
    const LiveSegment& segment = segments_[number];
    const SketchSegment& sketches = *segment.sketches;
    prepare_cells(sketches, scratch);
    if (scratch.query.outside > limit) return;
    const auto passed = compute_cell_bounds(sketches, limit, 0, sketches.blocks(), scratch);
    // Filters in place: kept entries are written before the current one.
    const std::span<std::uint32_t> rows(scratch.indices.data(), passed.size());
    std::size_t kept = 0;
    for (const std::uint32_t row : rows) {
      rows[kept] = row;
      kept += segment.has(row) ? 1 : 0;
    }
    for (int level = 1; level <= 2 && kept > 0; ++level) {
      const auto compared = rows.first(kept);
      compute_level_bounds(sketches, level, compared, scratch);
      kept = 0;
      for (std::size_t i = 0; i < compared.size(); ++i) {
        if (scratch.level_bounds[i] > limit) continue;
        scratch.level_bounds[kept] = scratch.level_bounds[i];
        rows[kept++] = rows[i];
      }
    }
    for (std::size_t i = 0; i < kept; ++i) {
      const ViewId view = sketches.views()[rows[i]];
      if (!is_excluded(view)) found.push_back({scratch.level_bounds[i], number, rows[i], view});
    }
  }

  /// Reads the best candidates in batches that grow, and drops those that can no longer be among
  /// the nearest.
  void read_batch(std::vector<SketchedView>& waiting) {
    const auto drop = [&] {
      std::erase_if(waiting, [this](const SketchedView& candidate) {
        return nearest_.can_exclude(candidate.bound, candidate.view) ||
               std::ranges::binary_search(compared_, candidate.view);
      });
    };
    drop();
    std::vector<SketchedView> best(waiting);
    keep_best(best, batch_size_);
    batch_size_ = std::min<std::size_t>(2 * batch_size_, 4096);
    read(best);
    drop();
  }

  static constexpr std::size_t first_segments = 16;  // searched for the first limit
  static constexpr std::size_t sampled_every = 16;   // one block in 16 is sampled
  static constexpr std::size_t max_waiting = 256;    // candidates until a batch is read in full

  const SegmentLayout& layout_;
  std::span<const LiveSegment> segments_;
  const kernels::DistanceKernels& kernels_;
  const ViewSketches::ReadViews& read_;
  Executor& executor_;
  std::size_t top_;
  NearestMatches nearest_;
  SegmentQuery query_;
  std::uint32_t distinguished_limit_ = 0;
  bool clamps_query_ = false;
  AlignedVector<std::uint8_t> magnitudes_, mask_;  // empty mask: all rows are compared
  std::size_t compared_bytes_ = 0;
  std::vector<ViewId> excluded_;                                // ascending
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order_;  // smallest sampled bound, segment
  std::vector<ViewId> compared_;                                // views read in full, ascending
  std::size_t batch_size_ = 128;
  SearchResult result_;
};

}  // namespace

SearchResult search_segments(const SegmentLayout& layout, std::span<const LiveSegment> segments,
                             const PackedSignature& query, int components, const SearchMask& mask,
                             std::size_t top, const ViewSketches::ReadViews& read,
                             Executor& executor) {
  return SketchSearch(layout, segments, query, components, mask, top, read, executor).run();
}

}  // namespace panonav::fleet
