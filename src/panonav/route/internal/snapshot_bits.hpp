#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace panonav {

/// Bits of the ratio of a component's deviation to the largest one.
inline constexpr int ratio_bits = 4;

/// Number of bytes before the codes of a snapshot.
[[nodiscard]] constexpr std::size_t scale_bytes(int components) noexcept {
  return 1 + (static_cast<std::size_t>(components) * ratio_bits + 7) / 8;
}

/// Sets `bits` bits from a position on, the lowest first, and advances the position.
inline void write_bits(std::span<std::uint8_t> bytes, std::size_t& position, int bits,
                       unsigned value) noexcept {
  for (int i = 0; i < bits; ++i, ++position) {
    const unsigned bit = value >> static_cast<unsigned>(i) & 1U;
    bytes[position / 8] = static_cast<std::uint8_t>(bytes[position / 8] | bit << (position % 8));
  }
}

/// Reads `bits` bits from a position on, and advances the position.
[[nodiscard]] inline unsigned read_bits(std::span<const std::uint8_t> bytes, std::size_t& position,
                                        int bits) noexcept {
  unsigned value = 0;
  for (int i = 0; i < bits; ++i, ++position) {
    const unsigned bit = static_cast<unsigned>(bytes[position / 8]) >> (position % 8) & 1U;
    value |= bit << static_cast<unsigned>(i);
  }
  return value;
}

}  // namespace panonav
