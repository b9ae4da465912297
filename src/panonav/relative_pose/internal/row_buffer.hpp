#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>

namespace panonav {

/// Numbers in memory of the object itself, or on the heap if there are more than `Capacity`. They
/// are not initialised.
template <class Number, std::size_t Capacity>
class RowBuffer {
 public:
  explicit RowBuffer(std::size_t size) : size_(size) {
    if (size > Capacity) on_heap_.reset(new Number[size]);
  }
  /// All numbers.
  [[nodiscard]] std::span<Number> numbers() noexcept {
    return {size_ > Capacity ? on_heap_.get() : own_.data(), size_};
  }

 private:
  std::size_t size_;
  std::array<Number, Capacity> own_;
  std::unique_ptr<Number[]> on_heap_;
};

/// Rows of a view whose numbers need no heap memory; more than any snapshot of a chain has.
inline constexpr std::size_t max_rows_without_heap = 64;

}  // namespace panonav
