#include "panonav/memory/internal/view_store.hpp"

#include <cstring>

namespace panonav {

ViewStore::ViewStore(SignatureShape shape)
    : shape_(shape), stride_((shape.size() + 63) / 64 * 64) {}

ViewStore::Row ViewStore::add(const PackedSignature& signature) {
  Row row = rows_end_;
  if (!free_rows_.empty()) {
    row = free_rows_.back();
    free_rows_.pop_back();
  } else {
    if (row % rows_per_chunk == 0) {
      chunks_.emplace_back(rows_per_chunk * (stride_ + shape_.size()));
    }
    ++rows_end_;
  }
  std::uint8_t* const chunk = chunks_[row / rows_per_chunk].data();
  const std::size_t place = row % rows_per_chunk;
  std::memcpy(chunk + place * stride_, signature.magnitudes.data(), shape_.size());
  std::memcpy(chunk + rows_per_chunk * stride_ + place * shape_.size(), signature.phases.data(),
              shape_.size());
  return row;
}

void ViewStore::free(Row row) {
  free_rows_.push_back(row);
}

}  // namespace panonav
