#include "panonav/storage/checksum.hpp"

#include <bit>

#include "panonav/storage/internal/little_endian.hpp"

namespace panonav {

namespace {

constexpr std::uint64_t prime_1 = 0x9E3779B185EBCA87ULL;
constexpr std::uint64_t prime_2 = 0xC2B2AE3D27D4EB4FULL;
constexpr std::uint64_t prime_3 = 0x165667B19E3779F9ULL;
constexpr std::uint64_t prime_4 = 0x85EBCA77C2B2AE63ULL;
constexpr std::uint64_t prime_5 = 0x27D4EB2F165667C5ULL;

std::uint64_t round(std::uint64_t lane, std::uint64_t input) {
  return std::rotl(lane + input * prime_2, 31) * prime_1;
}

}  // namespace

std::uint64_t checksum(std::span<const std::uint8_t> bytes, std::uint64_t seed) {
  const std::uint8_t* at = bytes.data();
  std::size_t left = bytes.size();
  std::uint64_t hash = seed + prime_5;
  if (left >= 32) {
    std::uint64_t lanes[4] = {seed + prime_1 + prime_2, seed + prime_2, seed, seed - prime_1};
    for (; left >= 32; left -= 32) {
      for (auto& lane : lanes) {
        lane = round(lane, read_little_endian<std::uint64_t>(at));
        at += 8;
      }
    }
    hash = std::rotl(lanes[0], 1) + std::rotl(lanes[1], 7) + std::rotl(lanes[2], 12) +
           std::rotl(lanes[3], 18);
    for (const auto lane : lanes) hash = (hash ^ round(0, lane)) * prime_1 + prime_4;
  }
  hash += bytes.size();
  for (; left >= 8; left -= 8, at += 8) {
    hash =
        std::rotl(hash ^ round(0, read_little_endian<std::uint64_t>(at)), 27) * prime_1 + prime_4;
  }
  if (left >= 4) {
    const std::uint64_t word = read_little_endian<std::uint32_t>(at);
    hash = std::rotl(hash ^ (word * prime_1), 23) * prime_2 + prime_3;
    at += 4;
    left -= 4;
  }
  for (; left > 0; --left, ++at) hash = std::rotl(hash ^ (*at * prime_5), 11) * prime_1;
  hash = (hash ^ (hash >> 33U)) * prime_2;
  hash = (hash ^ (hash >> 29U)) * prime_3;
  return hash ^ (hash >> 32U);
}

void RecordBytes::add_null() {
  bytes_.push_back('n');
}

void RecordBytes::add(std::int64_t value) {
  bytes_.push_back('i');
  append_little_endian(bytes_, static_cast<std::uint64_t>(value));
}

void RecordBytes::add(double value) {
  bytes_.push_back('r');
  // The database does not keep the sign of zero.
  append_little_endian(bytes_, std::bit_cast<std::uint64_t>(value == 0.0 ? 0.0 : value));
}

void RecordBytes::add(std::string_view text) {
  bytes_.push_back('t');
  append_little_endian(bytes_, std::uint64_t{text.size()});
  bytes_.insert(bytes_.end(), text.begin(), text.end());
}

void RecordBytes::add(std::span<const std::uint8_t> blob) {
  bytes_.push_back('b');
  append_little_endian(bytes_, std::uint64_t{blob.size()});
  bytes_.insert(bytes_.end(), blob.begin(), blob.end());
}

}  // namespace panonav
