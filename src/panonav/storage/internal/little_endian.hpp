#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace panonav {

/// Appends a whole number, with the least significant byte first.
template <class Word>
void append_little_endian(std::vector<std::uint8_t>& bytes, Word word) {
  for (std::size_t shift = 0; shift < 8 * sizeof(Word); shift += 8) {
    bytes.push_back(static_cast<std::uint8_t>((word >> shift) & 255U));
  }
}

/// Reads a word as `append_little_endian` writes it.
template <class Word>
[[nodiscard]] Word read_little_endian(const std::uint8_t* from) {
  Word word = 0;
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(&word, from, sizeof(Word));
  } else {
    for (std::size_t i = 0; i < sizeof(Word); ++i) word |= Word{from[i]} << (8 * i);
  }
  return word;
}

}  // namespace panonav
