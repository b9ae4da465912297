#include "panonav/storage/checksum.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string_view>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

std::uint64_t checksum_of(std::string_view text) {
  return checksum(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

// Published values of XXH64 with seed 0.
TEST(Checksum, PublishedValues) {
  EXPECT_EQ(checksum_of(""), 0xEF46DB3751D8E999ULL);
  EXPECT_EQ(checksum_of("a"), 0xD24EC4F1A98C6E5BULL);
  EXPECT_EQ(checksum_of("abc"), 0x44BC2CF5AD770999ULL);
  EXPECT_EQ(checksum_of("Nobody inspects the spammish repetition"), 0xFBCEA83C8A378BF1ULL);
}

TEST(Checksum, EveryBitCounts) {
  Random random(1);
  for (const std::size_t size : {1U, 3U, 8U, 31U, 32U, 77U}) {
    std::vector<std::uint8_t> bytes(size);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.index(256));
    std::set<std::uint64_t> seen{checksum(bytes)};
    for (std::size_t bit = 0; bit < 8 * size; ++bit) {
      bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
      EXPECT_TRUE(seen.insert(checksum(bytes)).second);
      bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    }
  }
}

TEST(RecordBytes, DifferentRecordsGiveDifferentBytes) {
  RecordBytes a;
  a.add(std::string_view("ab"));
  a.add(std::string_view("c"));
  RecordBytes b;
  b.add(std::string_view("a"));
  b.add(std::string_view("bc"));
  EXPECT_NE(checksum(a.bytes()), checksum(b.bytes()));
  RecordBytes integer;
  integer.add(std::int64_t{0});
  RecordBytes real;
  real.add(0.0);
  EXPECT_NE(checksum(integer.bytes()), checksum(real.bytes()));
}

}  // namespace
}  // namespace panonav
