#include "panonav/io/exif.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/core/random.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::testing {
namespace {

/// Puts EXIF data with this focal length behind the first two bytes of a JPEG.
std::vector<std::uint8_t> add_exif(const std::vector<std::uint8_t>& jpeg, std::uint16_t length_mm,
                                   bool little) {
  std::vector<std::uint8_t> exif{'E', 'x', 'i', 'f', 0, 0};
  const auto put = [&](std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) {
      exif.push_back(static_cast<std::uint8_t>(value >> (8 * (little ? i : bytes - 1 - i))));
    }
  };
  exif.insert(exif.end(), 2, little ? 'I' : 'M');
  put(42, 2);
  put(8, 4);  // first directory: one entry, which points to the EXIF directory
  put(1, 2);
  put(0x8769, 2);
  put(4, 2);
  put(1, 4);
  put(26, 4);
  put(0, 4);
  put(1, 2);  // at 26: one entry of two bytes
  put(0xA405, 2);
  put(3, 2);
  put(1, 4);
  put(length_mm, 2);
  put(0, 2);
  put(0, 4);
  std::vector<std::uint8_t> file(jpeg.begin(), jpeg.begin() + 2);
  const auto size = exif.size() + 2;
  for (const std::size_t byte : {std::size_t{0xFF}, std::size_t{0xE1}, size >> 8U, size & 255U}) {
    file.push_back(static_cast<std::uint8_t>(byte));
  }
  file.insert(file.end(), exif.begin(), exif.end());
  file.insert(file.end(), jpeg.begin() + 2, jpeg.end());
  return file;
}

TEST(Exif, TheFocalLengthIsRead) {
  const Image small(8, 8);
  const std::vector<std::uint8_t> plain = encode_jpeg(small.view());
  EXPECT_FALSE(find_focal_length_35mm(plain));
  for (const bool little : {true, false}) {
    const auto file = add_exif(plain, 26, little);
    EXPECT_EQ(find_focal_length_35mm(file), 26.0);
    EXPECT_FALSE(find_focal_length_35mm(add_exif(plain, 0, little)));  // unknown
    for (std::size_t size = 0; size < 50; ++size) {
      EXPECT_FALSE(find_focal_length_35mm(std::span(file).first(size)));
    }
  }
}

TEST(Exif, DamagedDataGiveNoAnswerAndNoCrash) {
  const Image small(8, 8);
  const auto file = add_exif(encode_jpeg(small.view()), 26, true);
  Random random(3);
  int answers = 0;
  for (int i = 0; i < 3000; ++i) {
    auto damaged = file;
    for (int k = 0; k < 3; ++k) {
      damaged[2 + random.index(60)] = static_cast<std::uint8_t>(random.index(256));
    }
    if (const auto found = find_focal_length_35mm(damaged)) {
      ++answers;
      EXPECT_GT(*found, 0.0);
    }
  }
  EXPECT_LT(answers, 3000);
}

}  // namespace
}  // namespace panonav::testing
