#include "panonav/memory/internal/view_store.hpp"

#include <cstdint>
#include <cstring>
#include <span>
#ifdef __linux__
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace panonav {

namespace {

/// Lets the system provide all pages of a chunk in one call, which takes less time than a fault for
/// each. Where this fails, it provides them when they are written.
void populate([[maybe_unused]] std::span<std::uint8_t> chunk) {
#ifdef MADV_POPULATE_WRITE
  static const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const std::size_t before = reinterpret_cast<std::uintptr_t>(chunk.data()) % page;
  madvise(chunk.data() - before, before + chunk.size(), MADV_POPULATE_WRITE);
#endif
}

}  // namespace

ViewStore::ViewStore(SignatureShape shape)
    : shape_(shape), stride_((shape.size() + 63) / 64 * 64) {}

ViewStore::Row ViewStore::add(std::span<const std::uint8_t> magnitudes,
                              std::span<const std::uint8_t> phases) {
  Row row = rows_end_;
  if (!free_rows_.empty()) {
    row = free_rows_.back();
    free_rows_.pop_back();
  } else {
    if (row % rows_per_chunk == 0) {
      chunks_.emplace_back(rows_per_chunk * (stride_ + shape_.size()));
      if (chunks_.size() > 1) populate(chunks_.back());
    }
    ++rows_end_;
  }
  std::uint8_t* const chunk = chunks_[row / rows_per_chunk].data();
  const std::size_t place = row % rows_per_chunk;
  std::uint8_t* const row_magnitudes = chunk + place * stride_;
  std::memcpy(row_magnitudes, magnitudes.data(), shape_.size());
  std::memset(row_magnitudes + shape_.size(), 0, stride_ - shape_.size());
  std::memcpy(chunk + rows_per_chunk * stride_ + place * shape_.size(), phases.data(),
              shape_.size());
  return row;
}

void ViewStore::free(Row row) {
  free_rows_.push_back(row);
}

}  // namespace panonav
