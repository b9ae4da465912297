#include "panonav/memory/internal/exact_search.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <numeric>
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

/// A search whose limit is beyond the bounds of many views, as that for many views, or for a query
/// that resembles none: then the views themselves are most of what is read. They are compared in
/// thirds of their components, the strongest first, with bounds for the rest.
class WideSearch {
 public:
  WideSearch(const SearchedViews& searched, const Comparison& comparison,
             const SketchIndex::Query& query, const kernels::DistanceKernels& kernels,
             std::size_t top, SearchResult& result)
      : searched_(searched),
        comparison_(comparison),
        kernels_(kernels),
        top_(top),
        result_(result) {
    for (std::size_t part = 0; part < parts; ++part) {
      const int first = comparison.components() * static_cast<int>(part) / int{parts};
      first_component_[part] = first;
      queries_[part] = query;
      const std::size_t done = static_cast<std::size_t>(first) * BlockSums::blocks_per_component;
      std::fill_n(queries_[part].fine_mask.begin(), done, std::uint8_t{0});
    }
    first_component_[parts] = comparison.components();
    bounds_of_rest_.reserve(parts);
    for (const SketchIndex::Query& rest : queries_)
      bounds_of_rest_.emplace_back(searched.index, kernels, rest);
  }

  /// True if there are bounds for parts of the components.
  [[nodiscard]] static bool is_possible(const SearchedViews& searched,
                                        const Comparison& comparison) {
    return searched.index.layout().fine_blocks > 0 && comparison.components() >= int{parts};
  }

  /// Returns the nearest views, all within `limit`.
  std::vector<Match> run(std::uint32_t limit) {
    nearest_.lower_limit(limit);
    const std::size_t rows = searched_.index.blocks() * SketchIndex::rows_per_block;
    bounds_.resize(rows);
    std::vector<std::uint32_t> all(std::min(rows, chunk));
    std::iota(all.begin(), all.end(), 0U);
    for (std::size_t first = 0; first < rows; first += chunk) {
      const std::span here = std::span(all).first(std::min(chunk, rows - first));
      compute_bounds_of_rest(0, static_cast<Row>(first), here, bounds_.data() + first);
    }
    for (const Row row : comparison_.excluded_rows()) bounds_[row] = SketchIndex::no_view;

    // The views with the smallest bounds show the limit; the others are compared with it.
    constexpr std::size_t min_likely = 512;  // for a small limit
    const std::uint32_t likely = find_bound_of(std::max(2 * top_, min_likely));
    for (std::size_t first = 0; first < rows; first += chunk) compare_up_to(likely, first);
    nearest_.keep_nearest();
    for (std::size_t first = 0; first < rows; first += chunk) compare_beyond(likely, first);
    return std::move(nearest_).sorted();
  }

 private:
  static constexpr std::size_t parts = 3;
  static constexpr std::size_t chunk = 1024;
  static_assert(SketchIndex::rows_per_segment % chunk == 0);
  /// Distances are below 2^28, bounds of rows without a view `no_view` less the query's rounding.
  static constexpr std::uint32_t min_bound_without_view = SketchIndex::no_view / 2;

  /// Sets bounds[i] to a lower bound of the distance of row `first` + places[i] over the components
  /// from part `part` on.
  void compute_bounds_of_rest(std::size_t part, Row first, std::span<const std::uint32_t> places,
                              std::uint32_t* bounds) {
    result_.bytes_read += places.size() * bounds_of_rest_[part].bytes();
    bounds_of_rest_[part](first, places, bounds);
  }

  /// Returns a bound that at least `count` rows do not exceed, and not many more.
  [[nodiscard]] std::uint32_t find_bound_of(std::size_t count) const {
    std::uint32_t largest = 0;
    for (const std::uint32_t bound : bounds_) {
      if (bound < min_bound_without_view) largest = std::max(largest, bound);
    }
    constexpr int counted_bits = 12;
    const int shift = std::max(0, static_cast<int>(std::bit_width(largest)) - counted_bits);
    std::vector<std::size_t> counts((largest >> shift) + 1);
    for (const std::uint32_t bound : bounds_) {
      if (bound < min_bound_without_view) ++counts[bound >> shift];
    }
    std::size_t found = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      found += counts[i];
      if (found >= count) return static_cast<std::uint32_t>(((i + 1) << shift) - 1);
    }
    return largest;
  }

  void insert(Row row, std::uint32_t distance) {
    ++result_.views_in_full;
    nearest_.insert_if_nearer({searched_.view_of_row[row], distance});
  }

  /// Compares the rows of a chunk with bounds of at most `likely`.
  void compare_up_to(std::uint32_t likely, std::size_t first) {
    const std::size_t count = std::min(chunk, bounds_.size() - first);
    const std::size_t found =
        kernels_.collect_at_most(bounds_.data() + first, count, likely, places_.data());
    for (std::size_t i = 0; i < found; ++i) {
      if (i + 1 < found) comparison_.prefetch(static_cast<Row>(first + places_[i + 1]));
      const Row row = static_cast<Row>(first + places_[i]);
      result_.bytes_read += comparison_.bytes();
      insert(row, comparison_.distance(row));
    }
  }

  /// Compares the rows of a chunk with bounds above `likely` and within the limit.
  void compare_beyond(std::uint32_t likely, std::size_t first) {
    const std::size_t count = std::min(chunk, bounds_.size() - first);
    std::size_t found =
        kernels_.collect_at_most(bounds_.data() + first, count, nearest_.limit(), places_.data());
    std::size_t left = 0;
    for (std::size_t i = 0; i < found; ++i) {
      if (bounds_[first + places_[i]] > likely) places_[left++] = places_[i];
    }
    std::fill_n(distances_.begin(), left, 0U);
    for (std::size_t part = 0; part < parts && left > 0; ++part)
      left = compare_part(part, first, left);
    for (std::size_t i = 0; i < left; ++i) {
      insert(static_cast<Row>(first + places_[i]), distances_[i]);
    }
  }

  /// Adds the distances over a part of the components to the first `count` rows, and keeps those
  /// that may be within the limit; returns their number.
  std::size_t compare_part(std::size_t part, std::size_t first, std::size_t count) {
    const int begin = first_component_[part];
    const int end = first_component_[part + 1];
    result_.bytes_read +=
        count * static_cast<std::size_t>(end - begin) * comparison_.component_bytes();
    std::fill_n(rest_.begin(), count, 0U);
    // Tries bounds again from time to time, as the limit falls.
    constexpr std::size_t retry = 16;
    const bool has_rest = part + 1 < parts && (is_worthwhile_[part] || first / chunk % retry == 0);
    if (has_rest) {
      compute_bounds_of_rest(part + 1, static_cast<Row>(first), std::span(places_).first(count),
                             rest_.data());
    }
    std::size_t left = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (i + 1 < count) comparison_.prefetch(static_cast<Row>(first + places_[i + 1]), begin, end);
      const std::uint32_t distance =
          distances_[i] +
          comparison_.partial_distance(static_cast<Row>(first + places_[i]), begin, end);
      if (distance + rest_[i] > nearest_.limit()) continue;
      places_[left] = places_[i];
      distances_[left++] = distance;
    }
    if (has_rest) is_worthwhile_[part] = 8 * left <= 7 * count;
    return left;
  }

  const SearchedViews& searched_;
  const Comparison& comparison_;
  const kernels::DistanceKernels& kernels_;
  std::size_t top_;
  SearchResult& result_;
  std::array<int, parts + 1> first_component_{};
  std::array<SketchIndex::Query, parts> queries_;  // one for the components from each part on
  std::vector<SketchIndex::FineBounds> bounds_of_rest_;
  std::vector<std::uint32_t> bounds_;  // one for each row
  NearestMatchList nearest_{top_};
  std::array<std::uint32_t, chunk + 16> places_{};  // positions of rows in a chunk
  std::array<std::uint32_t, chunk> distances_{}, rest_{};
  std::array<bool, parts> is_worthwhile_{};  // bounds after a part saved an eighth of the views
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

    const std::uint32_t limit = find_first_limit();
    if (WideSearch::is_possible(searched_, comparison_) && is_beyond_coarse_bounds(limit) &&
        can_exclude_by_fine_bounds(limit)) {
      return WideSearch(searched_, comparison_, query_, kernels_, top_, result_).run(limit);
    }
    NearestMatches nearest(top_, limit);
    scan(nearest);
    return std::move(nearest).sorted();
  }

 private:
  std::uint32_t compare_in_full(Row row) {
    result_.bytes_read += comparison_.bytes();
    ++result_.views_in_full;
    return comparison_.distance(row);
  }

  /// True if more than an eighth (chosen) of all coarse bounds are within the limit.
  [[nodiscard]] bool is_beyond_coarse_bounds(std::uint32_t limit) const {
    const auto within =
        std::ranges::count_if(bounds_, [limit](std::uint32_t bound) { return bound <= limit; });
    return 8 * static_cast<std::size_t>(within) > bounds_.size();
  }

  /// True if fine bounds exclude any of the rows in the middle that coarse ones do not. Those of
  /// random numbers exclude none, and thirds of the components then save nothing either.
  [[nodiscard]] bool can_exclude_by_fine_bounds(std::uint32_t limit) {
    constexpr std::size_t tested = 256;
    const std::size_t first = bounds_.size() / 2 / tested * tested;
    std::array<std::uint32_t, tested + 16> places{};
    std::array<std::uint32_t, tested> bounds{};
    const std::size_t found = kernels_.collect_at_most(
        bounds_.data() + first, std::min(tested, bounds_.size() - first), limit, places.data());
    compute_fine_bounds(static_cast<Row>(first), std::span(places).first(found), bounds.data());
    const auto within = std::ranges::count_if(
        std::span(bounds).first(found), [limit](std::uint32_t bound) { return bound <= limit; });
    return static_cast<std::size_t>(within) < found;
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
    // With this many matches the limit exceeds most bounds (chosen).
    constexpr std::size_t min_wide_top = 64;
    result.matches = top >= min_wide_top && WideSearch::is_possible(searched, comparison)
                         ? WideSearch(searched, comparison, sketch, kernels, top, result)
                               .run(SketchIndex::no_view)
                         : Search(searched, comparison, sketch, kernels, top, result).run();
    return result;
  }
  NearestMatchList nearest(top);
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
