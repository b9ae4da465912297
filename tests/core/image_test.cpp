#include "panonav/core/image.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav {
namespace {

TEST(Image, IsRowMajorWithInterleavedChannels) {
  std::vector<std::uint8_t> pixels(4 * 3 * 3);
  std::iota(pixels.begin(), pixels.end(), std::uint8_t{0});
  const Image image(4, 3, 3, pixels);
  for (int v = 0; v < 3; ++v) {
    for (int u = 0; u < 4; ++u) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_EQ(image.at(u, v, c), (v * 4 + u) * 3 + c);
        EXPECT_EQ(image.view().at(u, v, c), image.at(u, v, c));
      }
    }
  }
  EXPECT_EQ(image.size(), (ImageSize{4, 3}));
}

TEST(Image, StartsBlack) {
  const Image image(2, 2);
  EXPECT_EQ(image.channels(), 1);
  EXPECT_EQ(image.pixels().size(), 4U);
  for (const auto p : image.pixels()) EXPECT_EQ(p, 0);
}

TEST(Image, RefusesBadSizes) {
  EXPECT_THROW(Image(0, 1), ContractError);
  EXPECT_THROW(Image(1, -1), ContractError);
  EXPECT_THROW(Image(1, 1, 2), ContractError);
  EXPECT_THROW(Image(2, 2, 1, std::vector<std::uint8_t>(3)), ContractError);
}

TEST(Image, GreyWeighsColoursAndKeepsWhiteAndStride) {
  std::vector<std::uint8_t> pixels(2 * 8, 0);  // two rows of two RGB pixels, stride 8
  const std::array<std::uint8_t, 12> values = {255, 255, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0};
  for (int i = 0; i < 12; ++i) pixels[static_cast<std::size_t>(i / 6 * 8 + i % 6)] = values[i];
  const Image grey = to_grey({pixels.data(), 2, 2, 3, 8});
  EXPECT_EQ(grey.at(0, 0), 255);
  EXPECT_EQ(grey.at(1, 0), 0);
  EXPECT_EQ(grey.at(0, 1), 76);   // 0.299 * 255
  EXPECT_EQ(grey.at(1, 1), 150);  // 0.587 * 255
  EXPECT_EQ(to_grey(grey.view()), grey);
}

}  // namespace
}  // namespace panonav
