#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// Packed signatures in rows that never move while they are in use, so that a memory grows without
/// copying what it holds. Magnitudes start on 64-byte borders and are padded with zeros to the next
/// one. A freed row is given out again. Row numbers are below `rows_end()`.
class ViewStore {
 public:
  using Row = std::uint32_t;

  explicit ViewStore(SignatureShape shape);
  ViewStore(const ViewStore& other);
  ViewStore(ViewStore&&) noexcept = default;
  ViewStore& operator=(const ViewStore&) = delete;
  ViewStore& operator=(ViewStore&&) noexcept = default;
  ~ViewStore() = default;

  /// Copies one signature of the store's shape. The lowest free row is not promised.
  Row add(const PackedSignature& signature);
  void free(Row row);

  [[nodiscard]] Row rows_end() const noexcept { return rows_end_; }
  /// Bytes from one view's magnitudes to the next, padding included.
  [[nodiscard]] std::size_t stride() const noexcept { return stride_; }
  [[nodiscard]] const std::uint8_t* magnitudes(Row row) const noexcept {
    return chunks_[row / rows_per_chunk].get() + (row % rows_per_chunk) * stride_;
  }
  [[nodiscard]] const std::uint8_t* phases(Row row) const noexcept {
    return chunks_[row / rows_per_chunk].get() + rows_per_chunk * stride_ +
           (row % rows_per_chunk) * shape_.size();
  }

 private:
  struct FreeAligned {
    void operator()(std::uint8_t* bytes) const noexcept;
  };
  using Chunk = std::unique_ptr<std::uint8_t[], FreeAligned>;
  static constexpr std::size_t rows_per_chunk = 256;

  [[nodiscard]] std::size_t chunk_bytes() const noexcept {
    return rows_per_chunk * (stride_ + shape_.size());
  }
  [[nodiscard]] Chunk make_chunk() const;

  SignatureShape shape_;
  std::size_t stride_;
  std::vector<Chunk> chunks_;
  std::vector<Row> free_rows_;
  Row rows_end_ = 0;
};

}  // namespace panonav
