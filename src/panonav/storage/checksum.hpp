#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace panonav {

/// Computes the XXH64 of bytes: a fast 64-bit hash that detects accidental damage, but not forgery.
/// The result is the same on every platform.
[[nodiscard]] std::uint64_t checksum(std::span<const std::uint8_t> bytes, std::uint64_t seed = 0);

/// Collects the fields of a record for its checksum. Each field is preceded by its type, and texts
/// and blobs also by their length, so that different records never give the same bytes.
class RecordBytes {
 public:
  void add_null();                  ///< Adds a field without a value.
  void add(std::int64_t value);     ///< Adds a whole number.
  void add(double value);           ///< Adds the bits of a real number; -0 is added as 0.
  void add(std::string_view text);  ///< Adds a text and its length.
  void add(std::span<const std::uint8_t> blob);  ///< Adds bytes.
  /// Adds the value, or a field without one.
  template <class Value>
  void add(const std::optional<Value>& value) {
    if (value) {
      add(*value);
    } else {
      add_null();
    }
  }
  /// Returns all that was added since the last `clear`; valid until the next `add` or `clear`.
  [[nodiscard]] std::span<const std::uint8_t> bytes() const& noexcept { return bytes_; }
  std::span<const std::uint8_t> bytes() const&& = delete;  // would dangle on a temporary
  /// Forgets all fields; the memory is kept for the next record.
  void clear() noexcept { bytes_.clear(); }

 private:
  std::vector<std::uint8_t> bytes_;
};

}  // namespace panonav
