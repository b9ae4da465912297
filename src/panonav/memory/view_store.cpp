#include "panonav/memory/view_store.hpp"

#include <algorithm>
#include <cstring>
#include <new>

namespace panonav {

namespace {
constexpr std::size_t alignment = 64;
}  // namespace

void ViewStore::FreeAligned::operator()(std::uint8_t* bytes) const noexcept {
  ::operator delete[](bytes, std::align_val_t{alignment});
}

ViewStore::ViewStore(SignatureShape shape)
    : shape_(shape), stride_((shape.size() + alignment - 1) / alignment * alignment) {}

ViewStore::ViewStore(const ViewStore& other)
    : shape_(other.shape_),
      stride_(other.stride_),
      free_rows_(other.free_rows_),
      rows_end_(other.rows_end_) {
  chunks_.reserve(other.chunks_.size());
  for (const Chunk& chunk : other.chunks_) {
    chunks_.push_back(make_chunk());
    std::memcpy(chunks_.back().get(), chunk.get(), chunk_bytes());
  }
}

ViewStore::Chunk ViewStore::make_chunk() const {
  Chunk chunk(
      static_cast<std::uint8_t*>(::operator new[](chunk_bytes(), std::align_val_t{alignment})));
  std::memset(chunk.get(), 0, chunk_bytes());
  return chunk;
}

ViewStore::Row ViewStore::add(const PackedSignature& signature) {
  Row row = rows_end_;
  if (!free_rows_.empty()) {
    row = free_rows_.back();
    free_rows_.pop_back();
  } else {
    if (row % rows_per_chunk == 0) chunks_.push_back(make_chunk());
    ++rows_end_;
  }
  std::uint8_t* const chunk = chunks_[row / rows_per_chunk].get();
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
