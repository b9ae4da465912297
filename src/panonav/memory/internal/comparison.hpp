#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "panonav/kernels/distance.hpp"
#include "panonav/memory/internal/aligned_vector.hpp"
#include "panonav/memory/internal/exact_search.hpp"

namespace panonav {

/// Throws ContractError unless the signature has this shape and holds that many bytes.
void require_signature(const PackedSignature& signature, SignatureShape shape);

/// `components`, or all for 0. Throws ContractError when out of range.
[[nodiscard]] int checked_components(int components, SignatureShape shape);

/// A query against full signatures: the first `components` components of the rows that count.
class Comparison {
 public:
  /// Throws ContractError.
  Comparison(const SearchedViews& searched, const PackedSignature& query, int components,
             const SearchMask& mask, const kernels::DistanceKernels& kernels);

  [[nodiscard]] std::uint32_t full(ViewStore::Row row) const { return part(row, 0, components_); }
  /// Over components begin .. end - 1.
  [[nodiscard]] std::uint32_t part(ViewStore::Row row, int begin, int end) const {
    const std::size_t first = begin * component_bytes_;
    const std::size_t count = (end - begin) * component_bytes_;
    const std::uint8_t* const view = store_.magnitudes(row) + first;
    return mask_.empty()
               ? kernels_.l1(view, query_.data() + first, count)
               : kernels_.masked_l1(view, query_.data() + first, mask_.data() + first, count);
  }
  void prefetch(ViewStore::Row row) const noexcept {
    const std::uint8_t* const magnitudes = store_.magnitudes(row);
    for (std::size_t i = 0; i < bytes(); i += 64) __builtin_prefetch(magnitudes + i);
  }

  [[nodiscard]] const std::uint8_t* query() const noexcept { return query_.data(); }
  [[nodiscard]] int components() const noexcept { return components_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return components_ * component_bytes_; }
  [[nodiscard]] std::size_t component_bytes() const noexcept { return component_bytes_; }
  /// Rows of the views that must not be found, ascending.
  [[nodiscard]] const std::vector<ViewStore::Row>& excluded_rows() const noexcept {
    return excluded_rows_;
  }
  [[nodiscard]] bool excludes(ViewStore::Row row) const {
    return !excluded_rows_.empty() && std::ranges::binary_search(excluded_rows_, row);
  }

 private:
  const ViewStore& store_;
  const kernels::DistanceKernels& kernels_;
  int components_;
  std::size_t component_bytes_;
  AlignedVector<std::uint8_t> query_, mask_;  // the mask is empty when all rows count
  std::vector<ViewStore::Row> excluded_rows_;
};

/// Ascending (dissimilarity, view).
[[nodiscard]] inline bool is_nearer(const Match& a, const Match& b) noexcept {
  return a.dissimilarity != b.dissimilarity ? a.dissimilarity < b.dissimilarity : a.view < b.view;
}

}  // namespace panonav
