#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/memory/internal/aligned_vector.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// Stores packed signatures in rows that do not move while they are in use, so that a memory grows
/// without copying. Magnitudes start at 64-byte boundaries and are padded with zeros up to the next
/// boundary. Freed rows are reused. Row numbers are below `rows_end()`.
class ViewStore {
 public:
  using Row = std::uint32_t;

  explicit ViewStore(SignatureShape shape);

  /// Copies the magnitudes and phases of one signature of the store's shape.
  Row add(std::span<const std::uint8_t> magnitudes, std::span<const std::uint8_t> phases);
  void free(Row row);

  [[nodiscard]] Row rows_end() const noexcept { return rows_end_; }
  /// Bytes from one view's magnitudes to the next, padding included.
  [[nodiscard]] std::size_t stride() const noexcept { return stride_; }
  [[nodiscard]] const std::uint8_t* magnitudes(Row row) const noexcept {
    return chunks_[row / rows_per_chunk].data() + (row % rows_per_chunk) * stride_;
  }
  [[nodiscard]] const std::uint8_t* phases(Row row) const noexcept {
    return chunks_[row / rows_per_chunk].data() + rows_per_chunk * stride_ +
           (row % rows_per_chunk) * shape_.size();
  }

 private:
  static constexpr std::size_t rows_per_chunk = 256;
  using UnsetVector = std::vector<std::uint8_t, UnsetAllocator<std::uint8_t>>;

  SignatureShape shape_;
  std::size_t stride_;
  std::vector<UnsetVector> chunks_;  // magnitudes of all rows, then their phases; set by `add`
  std::vector<Row> free_rows_;
  Row rows_end_ = 0;
};

}  // namespace panonav
