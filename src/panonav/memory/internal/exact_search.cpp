#include "panonav/memory/internal/exact_search.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/memory/internal/comparison.hpp"

namespace panonav {

namespace {

using Row = ViewStore::Row;

/// A row and a lower bound of its distance.
using Bounded = std::pair<std::uint32_t, Row>;

/// Tracks whether the fine bounds of the last views saved more bytes than they read.
class FineBenefit {
 public:
  FineBenefit(std::size_t fine_bytes, std::size_t full_bytes)
      : fine_bytes_(fine_bytes), full_bytes_(full_bytes) {}
  void count(std::size_t tested, std::size_t passed) {
    tested_ = tested_ / 2 + tested;
    passed_ = passed_ / 2 + passed;
  }
  [[nodiscard]] bool is_worthwhile() const noexcept {
    return tested_ < 256 || (tested_ - passed_) * full_bytes_ > tested_ * fine_bytes_;
  }

 private:
  std::size_t fine_bytes_, full_bytes_;
  std::size_t tested_ = 0, passed_ = 0;
};

class Search {
 public:
  Search(const SearchedViews& searched, const Comparison& comparison,
         const SketchIndex::Query& query, const kernels::DistanceKernels& kernels, std::size_t top,
         SearchResult& result)
      : searched_(searched),
        comparison_(comparison),
        query_(query),
        kernels_(kernels),
        top_(top),
        fine_(searched.index, kernels, query),
        has_fine_(searched.index.layout().fine_blocks > 0 && fine_.bytes() < comparison.bytes()),
        result_(result) {}

  std::vector<Match> run() {
    const std::size_t blocks = searched_.index.blocks();
    const std::size_t rows = blocks * SketchIndex::rows_per_block;
    const auto bounds = std::make_unique_for_overwrite<std::uint32_t[]>(rows);
    const auto smallest = std::make_unique_for_overwrite<std::uint32_t[]>(blocks);
    bounds_ = {bounds.get(), rows};
    smallest_ = {smallest.get(), blocks};
    searched_.index.compute_coarse_bounds(kernels_, query_, bounds_, smallest_);
    result_.bytes_read += std::uint64_t{rows} * searched_.index.coarse_bytes_per_row(query_);
    for (const Row row : comparison_.excluded_rows()) bounds_[row] = SketchIndex::no_view;

    NearestMatches nearest(top_, find_first_limit());
    scan(nearest);
    return std::move(nearest).sorted();
  }

 private:
  std::uint32_t compare_in_full(Row row) {
    result_.bytes_read += comparison_.bytes();
    ++result_.views_in_full;
    return comparison_.distance(row);
  }

  /// Computes the fine bounds of rows first + places[i], all in one segment.
  void compute_fine_bounds(Row first, std::span<const std::uint32_t> places,
                           std::uint32_t* bounds) {
    result_.bytes_read += places.size() * fine_.bytes();
    fine_(first, places, bounds);
  }

  /// Returns a distance within which at least `top` views are, by comparing the views with the
  /// smallest bounds in full. A small distance is worth the bytes read, as it decides how many
  /// views the bounds exclude.
  std::uint32_t find_first_limit() {
    std::vector<Bounded> best_blocks(smallest_.size());
    for (std::size_t i = 0; i < best_blocks.size(); ++i) {
      best_blocks[i] = {smallest_[i], static_cast<Row>(i)};
    }
    std::vector<Bounded> best;
    for (std::size_t blocks = 16 + top_; best.size() < top_; blocks *= 2) {
      best.clear();
      blocks = std::min(blocks, best_blocks.size());
      std::ranges::nth_element(best_blocks,
                               best_blocks.begin() + static_cast<std::ptrdiff_t>(blocks - 1));
      for (std::size_t i = 0; i < blocks; ++i) {
        const Row first = best_blocks[i].second * static_cast<Row>(SketchIndex::rows_per_block);
        for (Row row = first; row < first + SketchIndex::rows_per_block; ++row) {
          if (bounds_[row] < SketchIndex::no_view) best.emplace_back(bounds_[row], row);
        }
      }
    }
    if (has_fine_) {
      keep_smallest(best, 64 + 8 * top_);
      // Goes through the rows in order, so that the query is encoded once for each segment.
      std::ranges::sort(best, {}, &Bounded::second);
      constexpr std::uint32_t here = 0;
      for (Bounded& candidate : best)
        compute_fine_bounds(candidate.second, {&here, 1}, &candidate.first);
    }
    keep_smallest(best, 2 * top_);
    for (Bounded& candidate : best) candidate.first = compare_in_full(candidate.second);
    keep_smallest(best, top_);
    return std::ranges::max(best).first;
  }

  static void keep_smallest(std::vector<Bounded>& values, std::size_t count) {
    if (values.size() <= count) return;
    std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(count));
    values.resize(count);
  }

  void scan(NearestMatches& nearest) {
    constexpr std::size_t chunk = 1024;
    static_assert(SketchIndex::rows_per_segment % chunk == 0);
    // Tries fine bounds again from time to time, as the limit falls during the scan.
    constexpr std::size_t retry = 16;
    constexpr std::size_t max_waiting = 2048;
    std::array<std::uint32_t, chunk + 16> found{};
    std::array<std::uint32_t, chunk> fine_bounds{};
    std::vector<Bounded> waiting;
    FineBenefit benefit(fine_.bytes(), comparison_.bytes());
    for (std::size_t begin = 0; begin < bounds_.size(); begin += chunk) {
      const std::size_t count = std::min(chunk, bounds_.size() - begin);
      const std::size_t passed =
          kernels_.collect_at_most(bounds_.data() + begin, count, nearest.limit(), found.data());
      const bool test_fine = has_fine_ && (benefit.is_worthwhile() || begin / chunk % retry == 0);
      if (test_fine) {
        const std::size_t before = waiting.size();
        compute_fine_bounds(static_cast<Row>(begin), {found.data(), passed}, fine_bounds.data());
        for (std::size_t i = 0; i < passed; ++i) {
          if (fine_bounds[i] <= nearest.limit()) {
            waiting.emplace_back(fine_bounds[i], static_cast<Row>(begin + found[i]));
          }
        }
        benefit.count(passed, waiting.size() - before);
        if (waiting.size() >= max_waiting || !benefit.is_worthwhile())
          compare_waiting_rows(waiting, nearest);
      } else {
        for (std::size_t i = 0; i < passed; ++i) {
          // Prefetches only after a gap, as the processor itself prefetches successive rows.
          if (i + 1 < passed && found[i + 1] != found[i] + 1) {
            comparison_.prefetch(static_cast<Row>(begin + found[i + 1]));
          }
          const auto row = static_cast<Row>(begin + found[i]);
          if (nearest.can_exclude(bounds_[row], searched_.view_of_row[row])) continue;
          nearest.insert_if_nearer({searched_.view_of_row[row], compare_in_full(row)});
        }
      }
    }
    compare_waiting_rows(waiting, nearest);
  }

  /// Compares the waiting rows in full, smallest bound first, until a bound exceeds the limit.
  void compare_waiting_rows(std::vector<Bounded>& waiting, NearestMatches& nearest) {
    std::ranges::sort(waiting);
    for (std::size_t i = 0; i < waiting.size(); ++i) {
      const auto [bound, row] = waiting[i];
      if (bound > nearest.limit()) break;
      if (i + 1 < waiting.size()) comparison_.prefetch(waiting[i + 1].second);
      if (nearest.can_exclude(bound, searched_.view_of_row[row])) continue;
      nearest.insert_if_nearer({searched_.view_of_row[row], compare_in_full(row)});
    }
    waiting.clear();
  }

  const SearchedViews& searched_;
  const Comparison& comparison_;
  const SketchIndex::Query& query_;
  const kernels::DistanceKernels& kernels_;
  std::size_t top_;
  SketchIndex::FineBounds fine_;
  bool has_fine_;
  SearchResult& result_;
  std::span<std::uint32_t> bounds_, smallest_;
};

}  // namespace

SearchResult exact_search(const SearchedViews& searched, const PackedSignature& query,
                          const SearchOptions& options, const SearchMask& mask,
                          kernels::Instructions instructions) {
  require(options.top >= 1, "top", options.top, ">= 1");
  const kernels::DistanceKernels& kernels = kernels::distance_kernels(instructions);
  const Comparison comparison(searched, query, options.components, mask, kernels);
  SearchResult result;
  const std::size_t views = searched.views.size() - comparison.excluded_rows().size();
  result.bytes_in_full = std::uint64_t{views} * comparison.bytes();
  const std::size_t top = std::min(static_cast<std::size_t>(options.top), views);
  if (top == 0) return result;

  // Bounds save time only if few of the views are requested.
  constexpr std::size_t min_views_per_match = 8;
  if (searched.index.layout().has_sketches() && views / min_views_per_match >= top) {
    const SketchIndex::Query sketch =
        searched.index.make_query(comparison.query(), comparison.components(), mask.allowed_rows);
    result.matches = Search(searched, comparison, sketch, kernels, top, result).run();
    return result;
  }
  NearestMatches nearest(top, SketchIndex::no_view);
  for (std::size_t i = 0; i < searched.views.size(); ++i) {
    const Row row = searched.rows[i];
    if (comparison.is_excluded(row)) continue;
    nearest.insert_if_nearer({searched.views[i], comparison.distance(row)});
  }
  result.views_in_full = views;
  result.bytes_read = result.bytes_in_full;
  result.matches = std::move(nearest).sorted();
  return result;
}

}  // namespace panonav
