#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "panonav/kernels/distance.hpp"
#include "panonav/memory/internal/aligned_vector.hpp"
#include "panonav/memory/internal/exact_search.hpp"
#include "panonav/memory/internal/sketch_index.hpp"

namespace panonav {

/// Throws ContractError unless the signature has this shape and the number of bytes that the shape
/// requires.
void require_signature(const PackedSignature& signature, SignatureShape shape);
/// Throws ContractError if the bytes are not those of a signature of that shape.
void require_signature(std::span<const std::uint8_t> magnitudes,
                       std::span<const std::uint8_t> phases, SignatureShape shape);

/// Returns `components`, or the number of all components for 0. Throws ContractError if out of
/// range.
[[nodiscard]] int resolve_components(int components, SignatureShape shape);

/// Throws ContractError unless the mask has one entry for each row, or none.
void require_mask(const SearchMask& mask, SignatureShape shape);

/// Compares a query with stored signatures over the first `components` components of the allowed
/// rows.
class Comparison {
 public:
  /// Throws ContractError.
  Comparison(const SearchedViews& searched, const PackedSignature& query, int components,
             const SearchMask& mask, const kernels::DistanceKernels& kernels);

  [[nodiscard]] std::uint32_t distance(ViewStore::Row row) const {
    return partial_distance(row, 0, components_);
  }
  /// Returns the distance over components begin .. end - 1.
  [[nodiscard]] std::uint32_t partial_distance(ViewStore::Row row, int begin, int end) const {
    const std::size_t first = begin * component_bytes_;
    const std::size_t count = (end - begin) * component_bytes_;
    const std::uint8_t* const view = store_.magnitudes(row) + first;
    return mask_.empty()
               ? kernels_.l1(view, query_.data() + first, count)
               : kernels_.masked_l1(view, query_.data() + first, mask_.data() + first, count);
  }
  void prefetch(ViewStore::Row row) const noexcept { prefetch(row, 0, components_); }
  /// Prefetches components begin .. end - 1.
  void prefetch(ViewStore::Row row, int begin, int end) const noexcept {
    const std::uint8_t* const magnitudes = store_.magnitudes(row);
    for (std::size_t i = begin * component_bytes_; i < end * component_bytes_; i += 64)
      __builtin_prefetch(magnitudes + i);
  }

  [[nodiscard]] const std::uint8_t* query() const noexcept { return query_.data(); }
  [[nodiscard]] int components() const noexcept { return components_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return components_ * component_bytes_; }
  [[nodiscard]] std::size_t component_bytes() const noexcept { return component_bytes_; }
  /// Rows of the excluded views, ascending.
  [[nodiscard]] const std::vector<ViewStore::Row>& excluded_rows() const noexcept {
    return excluded_rows_;
  }
  [[nodiscard]] bool is_excluded(ViewStore::Row row) const {
    return !excluded_rows_.empty() && std::ranges::binary_search(excluded_rows_, row);
  }

 private:
  const ViewStore& store_;
  const kernels::DistanceKernels& kernels_;
  int components_;
  std::size_t component_bytes_;
  AlignedVector<std::uint8_t> query_, mask_;  // the mask is empty if all rows are compared
  std::vector<ViewStore::Row> excluded_rows_;
};

/// Ascending (dissimilarity, view).
[[nodiscard]] inline bool is_nearer(const Match& a, const Match& b) noexcept {
  return a.dissimilarity != b.dissimilarity ? a.dissimilarity < b.dissimilarity : a.view < b.view;
}

/// The nearest views so far, at most `top`.
class NearestMatches {
 public:
  /// Keeps views up to the distance `limit`.
  NearestMatches(std::size_t top, std::uint32_t limit) : top_(top), limit_(limit) {}

  void insert_if_nearer(const Match& match) {
    if (heap_.size() == top_) {
      if (!is_nearer(match, heap_.front())) return;
      std::ranges::pop_heap(heap_, is_nearer);
      heap_.back() = match;
    } else {
      heap_.push_back(match);
    }
    std::ranges::push_heap(heap_, is_nearer);
    if (heap_.size() == top_) limit_ = std::min(limit_, heap_.front().dissimilarity);
  }
  /// Largest distance at which a view can still be among the nearest.
  [[nodiscard]] std::uint32_t limit() const noexcept { return limit_; }
  /// True if `view` cannot be among the nearest when its distance is `bound` or more.
  [[nodiscard]] bool can_exclude(std::uint32_t bound, ViewId view) const noexcept {
    return bound > limit_ || (heap_.size() == top_ && bound == heap_.front().dissimilarity &&
                              heap_.front().view < view);
  }
  [[nodiscard]] std::vector<Match> sorted() && {
    std::ranges::sort_heap(heap_, is_nearer);
    return std::move(heap_);
  }

 private:
  std::size_t top_;
  std::uint32_t limit_;
  std::vector<Match> heap_;  // the furthest in front
};

/// The nearest views of many, at most `top`: the same as `NearestMatches` in a list that is cut
/// when it has twice as many, so that each view costs a constant number of steps.
class NearestMatchList {
 public:
  explicit NearestMatchList(std::size_t top) : top_(top) { matches_.reserve(2 * top); }

  void insert_if_nearer(const Match& match) {
    if (match.dissimilarity > limit_) return;
    matches_.push_back(match);
    if (matches_.size() == 2 * top_) keep_nearest();
  }
  /// Ignores views beyond `limit`, within which there are at least `top`.
  void lower_limit(std::uint32_t limit) noexcept { limit_ = std::min(limit_, limit); }
  /// Drops all but the `top` nearest views.
  void keep_nearest() {
    if (matches_.size() < top_) return;
    const auto last = matches_.begin() + static_cast<std::ptrdiff_t>(top_ - 1);
    std::ranges::nth_element(matches_, last, is_nearer);
    limit_ = last->dissimilarity;
    matches_.erase(last + 1, matches_.end());
  }
  /// Largest distance at which a view can still be among the nearest.
  [[nodiscard]] std::uint32_t limit() const noexcept { return limit_; }
  [[nodiscard]] std::vector<Match> sorted() && {
    keep_nearest();
    std::ranges::sort(matches_, is_nearer);
    return std::move(matches_);
  }

 private:
  std::size_t top_;
  std::uint32_t limit_ = SketchIndex::no_view;
  std::vector<Match> matches_;
};

}  // namespace panonav
