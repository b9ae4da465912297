#include "panonav/io/image_file.hpp"
#include "support/skips.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/io/atomic_file.hpp"
#include "support/picture_samples.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

using Bytes = std::vector<std::uint8_t>;

using ImageFile = InTemporaryFolder;

TEST_F(ImageFile, PngComesBackAsItWasWritten) {
  Random random(1);
  for (const int channels : {1, 3}) {
    for (const ImageSize size : {ImageSize{1, 1}, ImageSize{7, 3}, ImageSize{640, 48}}) {
      const Image image = random_image(random, size.width, size.height, channels);
      const auto path = folder / "picture.png";
      write_png(path, image.view());
      EXPECT_EQ(read_image(path), image);
    }
  }
}

TEST_F(ImageFile, StrideOfAViewIsRespected) {
  Random random(2);
  const Image image = random_image(random, 20, 10, 3);
  const ImageView part{image.view().data + 3 * 3, 5, 10, 3, image.view().stride};
  const Image back = decode_image(encode_png(part), "part");
  ASSERT_EQ(back.size(), (ImageSize{5, 10}));
  for (int v = 0; v < 10; ++v) {
    for (int u = 0; u < 5; ++u) {
      for (int c = 0; c < 3; ++c) ASSERT_EQ(back.at(u, v, c), image.at(u + 3, v, c));
    }
  }
}

TEST_F(ImageFile, PngOfAnyDepthAndColourType) {
  // 10 pixels 1010001101, one bit each.
  const Image bits =
      decode_image(make_png(10, 1, PNG_COLOR_TYPE_GRAY, 1, {{0b10100011, 0b01000000}}), "1");
  EXPECT_EQ(bits, Image(10, 1, 1, Bytes{255, 0, 255, 0, 0, 0, 255, 255, 0, 255}));
  const Image nibbles = decode_image(make_png(2, 1, PNG_COLOR_TYPE_GRAY, 4, {{0x0F}}), "4");
  EXPECT_EQ(nibbles, Image(2, 1, 1, Bytes{0, 255}));
  // 0x0000, 0x7FFF, 0xFFFF scale to 0, 127 or 128, 255.
  const Image deep = decode_image(
      make_png(3, 1, PNG_COLOR_TYPE_GRAY, 16, {{0x00, 0x00, 0x7F, 0xFF, 0xFF, 0xFF}}), "16");
  EXPECT_EQ(deep.at(0, 0), 0);
  EXPECT_NEAR(deep.at(1, 0), 127.5, 0.6);
  EXPECT_EQ(deep.at(2, 0), 255);
  const Image palette = decode_image(
      make_png(3, 1, PNG_COLOR_TYPE_PALETTE, 2, {{0b00011000}}, {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}),
      "palette");
  EXPECT_EQ(palette, Image(3, 1, 3, Bytes{1, 2, 3, 4, 5, 6, 7, 8, 9}));
  // The colour under a transparent pixel stays.
  const Image alpha = decode_image(
      make_png(2, 1, PNG_COLOR_TYPE_RGB_ALPHA, 8, {{9, 8, 7, 0, 6, 5, 4, 255}}), "alpha");
  EXPECT_EQ(alpha, Image(2, 1, 3, Bytes{9, 8, 7, 6, 5, 4}));
  const Image grey_alpha =
      decode_image(make_png(2, 1, PNG_COLOR_TYPE_GRAY_ALPHA, 8, {{9, 0, 6, 255}}), "grey alpha");
  EXPECT_EQ(grey_alpha, Image(2, 1, 1, Bytes{9, 6}));
}

TEST_F(ImageFile, InterlacedPngIsTheSamePicture) {
  Random random(3);
  const Image image = random_image(random, 33, 17, 1);
  std::vector<Bytes> rows;
  for (int v = 0; v < 17; ++v) {
    const auto row = image.pixels().subspan(static_cast<std::size_t>(v) * 33, 33);
    rows.emplace_back(row.begin(), row.end());
  }
  EXPECT_EQ(decode_image(make_png(33, 17, PNG_COLOR_TYPE_GRAY, 8, rows, {}, PNG_INTERLACE_ADAM7),
                         "adam7"),
            image);
}

TEST_F(ImageFile, JpegIsNearTheSource) {
  for (const int channels : {1, 3}) {
    for (const bool progressive : {false, true}) {
      const Image image = smooth_image(61, 35, channels);
      const Bytes bytes = make_jpeg(image, 95, progressive);
      const Image back = decode_image(bytes, "smooth");
      ASSERT_EQ(back.size(), image.size());
      ASSERT_EQ(back.channels(), channels);
      double difference = 0.0;
      for (std::size_t i = 0; i < image.pixels().size(); ++i) {
        difference += std::abs(image.pixels()[i] - back.pixels()[i]);
      }
      EXPECT_LT(difference / static_cast<double>(image.pixels().size()), 2.0);
    }
  }
}

TEST_F(ImageFile, GreyIsThatOfTheColoursUpToRounding) {
  Random random(3);
  const auto path = folder / "picture";
  const Image noise = random_image(random, 37, 20, 3);
  write_png(path, noise.view());
  EXPECT_EQ(read_grey_image(path), to_grey(noise.view()));
  for (const int channels : {1, 3}) {
    for (const bool progressive : {false, true}) {
      write_file(path, make_jpeg(smooth_image(61, 35, channels), 95, progressive));
      const Image colours = read_image(path);
      ASSERT_EQ(colours.channels(), channels);
      const Image expected = to_grey(colours.view());
      const Image grey = read_grey_image(path);
      ASSERT_EQ(grey.size(), expected.size());
      ASSERT_EQ(grey.channels(), 1);
      for (std::size_t i = 0; i < expected.pixels().size(); ++i) {
        ASSERT_NEAR(grey.pixels()[i], expected.pixels()[i], 1) << i;
      }
      EXPECT_GT(std::ranges::max(grey.pixels()), 200) << "a flat image would prove nothing";
    }
  }
  write_file(path, std::string_view("no image"));
  EXPECT_THROW((void)read_grey_image(path), FileError);
}

std::vector<Bytes> sample_files(Random& random) {
  const Image noise = random_image(random, 40, 30, 1);
  const Image smooth = smooth_image(40, 30, 3);
  return {encode_png(noise.view()), encode_png(smooth.view()), make_jpeg(smooth, 90, false),
          make_jpeg(smooth_image(40, 30, 1), 90, true)};
}

// Whatever the bytes: a picture or one FileError of one line, never anything else.
std::size_t decode_and_count_errors(const Bytes& bytes) {
  try {
    const Image image = decode_image(bytes, "fuzz");
    EXPECT_GE(image.width(), 1);
    return 0;
  } catch (const FileError& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.rfind("fuzz: ", 0), 0U) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return 1;
  }
}

TEST_F(ImageFile, CutFilesAreRefused) {
  Random random(4);
  const std::vector<Bytes> files = sample_files(random);
  for (const Bytes& file : files) {
    ASSERT_EQ(decode_and_count_errors(file), 0U);
    // The last two bytes of a JPEG are its end marker, which readers may do without.
    for (std::size_t size = 0; size + 2 < file.size(); size += 1 + size / 64) {
      EXPECT_EQ(
          decode_and_count_errors({file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size)}),
          1U)
          << size << " of " << file.size();
    }
  }
}

TEST_F(ImageFile, DamagedBytesNeverCrash) {
  Random random(5);
  const std::vector<Bytes> files = sample_files(random);
  std::size_t refused = 0;
  for (const Bytes& file : files) {
    for (int trial = 0; trial < 500; ++trial) {
      Bytes damaged = file;
      const auto changes = 1 + random.index(8);
      for (std::uint64_t i = 0; i < changes; ++i) {
        damaged[random.index(damaged.size())] = static_cast<std::uint8_t>(random.index(256));
      }
      refused += decode_and_count_errors(damaged);
    }
  }
  EXPECT_GT(refused, 100U);
  for (int trial = 0; trial < 300; ++trial) {
    Bytes noise = trial % 2 == 0 ? Bytes{0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A}
                                 : Bytes{0xFF, 0xD8, 0xFF};
    const auto size = random.index(300);
    for (std::uint64_t i = 0; i < size; ++i)
      noise.push_back(static_cast<std::uint8_t>(random.index(256)));
    EXPECT_EQ(decode_and_count_errors(noise), 1U);
  }
}

TEST_F(ImageFile, SizesAreBounded) {
  // Only the head is changed: a small file that promises an enormous picture.
  Bytes file = make_jpeg(smooth_image(16, 16, 1), 90, false);
  const Bytes start_of_frame{0xFF, 0xC0};
  const auto at =
      std::search(file.begin(), file.end(), start_of_frame.begin(), start_of_frame.end());
  ASSERT_NE(at, file.end());
  for (int i = 5; i < 9; ++i) *(at + i) = 0xFD;
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)decode_image(file, "huge.jpg"); }),
                       "huge.jpg: image is 65021 x 65021 px; allowed:"));
}

TEST_F(ImageFile, LimitsAreTheCallers) {
  const Image image = smooth_image(20, 10, 1);
  const Bytes bytes = encode_png(image.view());
  const auto message = [&](const ImageLimits& limits) {
    return message_of<FileError>([&] { (void)decode_image(bytes, "a.png", limits); });
  };
  EXPECT_EQ(message({.side_px = 20, .area_px = 200}), "no error");
  EXPECT_TRUE(contains(message({.side_px = 19}), "20 x 10 px; allowed: 1 .. 19 px a side"));
  EXPECT_TRUE(contains(message({.area_px = 199}), "at most 199 px in all"));
}

TEST_F(ImageFile, TheScansOfAJpegAreBoundedByItsSize) {
  const Bytes bomb = make_scan_bomb(64, 48);
  const Image image = decode_image(bomb, "bomb");
  EXPECT_EQ(image.size(), (ImageSize{64, 48})) << "a small image may have them";
  constexpr std::int64_t scan_px = 64 * 48 + 65536;
  EXPECT_EQ(decode_image(bomb, "bomb", {.scanned_px = 190 * scan_px}), image);
  EXPECT_EQ(message_of<FileError>(
                [&] { (void)decode_image(bomb, "bomb", {.scanned_px = 189 * scan_px}); }),
            "bomb: damaged JPEG: more than 189 scans for 64 x 48 px");
  // At its largest a picture may have the scans of every common encoder and few more.
  const ImageLimits limits;
  EXPECT_GE(limits.scanned_px / (limits.area_px + 65536), 12);
  EXPECT_LE(limits.scanned_px / (limits.area_px + 65536), 16);
}

// The picture as it lies in the file when a camera that was turned calls it upright.
Image turned_for(int orientation, const Image& upright) {
  const int w = upright.width();
  const int h = upright.height();
  const bool is_turned = orientation >= 5;
  // Row 0 and column 0 of the stored picture lie at other sides of the upright one [EXIF 2.32].
  const bool mirrors_u =
      orientation == 2 || orientation == 3 || orientation == 6 || orientation == 7;
  const bool mirrors_v =
      orientation == 3 || orientation == 4 || orientation == 7 || orientation == 8;
  Image stored(is_turned ? h : w, is_turned ? w : h, upright.channels());
  for (int v = 0; v < h; ++v) {
    for (int u = 0; u < w; ++u) {
      for (int c = 0; c < upright.channels(); ++c) {
        const int across = mirrors_u ? w - 1 - u : u;
        const int down = mirrors_v ? h - 1 - v : v;
        stored.at(is_turned ? down : across, is_turned ? across : down, c) = upright.at(u, v, c);
      }
    }
  }
  return stored;
}

TEST_F(ImageFile, ExifOrientationIsApplied) {
  Random random(6);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const Image picture = random_image(random, 9, 4, orientation % 2 == 0 ? 1 : 3);
    const Image stored = turned_for(orientation, picture);
    const Bytes png = with_exif(encode_png(stored.view()), orientation);
    EXPECT_EQ(decode_image(png, "png"), picture) << orientation;
    const Image smooth = smooth_image(64, 32, 1);
    const Bytes plain = make_jpeg(turned_for(orientation, smooth), 95, false);
    for (const bool big_endian : {false, true}) {
      const Bytes jpeg = with_exif(plain, orientation, big_endian);
      const Image back = decode_image(jpeg, "jpeg");
      ASSERT_EQ(back.size(), smooth.size()) << orientation;
      int worst = 0;
      for (std::size_t i = 0; i < smooth.pixels().size(); ++i) {
        worst = std::max(worst, std::abs(smooth.pixels()[i] - back.pixels()[i]));
      }
      EXPECT_LE(worst, 4) << orientation;
      const std::string_view text(reinterpret_cast<const char*>(jpeg.data()), jpeg.size());
      EXPECT_EQ(read_image_size(folder.write("a.jpg", text)), smooth.size());
    }
  }
}

TEST_F(ImageFile, ExifThatCannotBeReadChangesNothing) {
  const Bytes plain = make_jpeg(smooth_image(16, 8, 1), 95, false);
  const Image picture = decode_image(plain, "plain");
  for (const int wrong : {0, 9, 65535}) {
    EXPECT_EQ(decode_image(with_exif(plain, wrong), "jpeg"), picture);
  }
  // The block is cut, or says that it begins beyond its end.
  const Bytes whole = with_exif(plain, 3);
  for (std::size_t byte = 0; byte < 26; ++byte) {
    for (const int value : {0x00, 0x7F, 0xFF}) {
      Bytes damaged = whole;
      damaged[12 + byte] = static_cast<std::uint8_t>(value);
      EXPECT_EQ(decode_image(damaged, "jpeg").size(), picture.size());
    }
  }
}

TEST_F(ImageFile, ClearLinesForWhatIsNoPicture) {
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)read_image(folder / "none.png"); }),
                       "none.png: cannot be read: No such file"));
  EXPECT_TRUE(
      contains(message_of<FileError>([&] { (void)read_image(folder.path()); }), "is a folder"));
  EXPECT_TRUE(contains(
      message_of<FileError>([&] { (void)read_image(folder.write("empty.png", "")); }), "is empty"));
  EXPECT_TRUE(
      contains(message_of<FileError>([&] { (void)read_image(folder.write("text.png", "hello")); }),
               "allowed: PNG, JPEG"));
}

using AtomicFile = InTemporaryFolder;

TEST_F(AtomicFile, ReplacesWholeAndLeavesNothingBehind) {
  const auto path = folder / "a.txt";
  write_file(path, "first");
  write_file(path, "second, longer");
  const auto bytes = read_file(path, 100);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "second, longer");
  EXPECT_THROW((void)read_file(path, 3), FileError);
  std::filesystem::create_symlink("a.txt", folder / "link");
  write_file(folder / "link", "third");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(read_file(path, 100).size(), 5U);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);
}

TEST_F(AtomicFile, AFailureLeavesTheOldFile) {
  EXPECT_THROW(write_file(folder / "no" / "a.txt", "x"), FileError);
  EXPECT_THROW(write_file(folder.path(), "x"), FileError);
  write_file("/dev/null", "x");
  EXPECT_FALSE(std::filesystem::is_regular_file("/dev/null"));
}

TEST_F(ImageFile, RealPictures) {
  const auto mirrors = real_data("mirror_raw");
  PANONAV_REQUIRE_DATA(mirrors, "mirror_raw");
  EXPECT_EQ(read_image(*mirrors / "KaidanOmni1.jpg").size(), (ImageSize{640, 480}));
  const auto gantry = real_data("gantry_plants");
  PANONAV_REQUIRE_DATA(gantry, "gantry_plants");
  const Image plants = read_image(*gantry / "im_001_001_001.png");
  EXPECT_EQ(plants.size(), (ImageSize{90, 7}));
  for (const std::uint8_t value : plants.pixels()) ASSERT_TRUE(value == 0 || value == 255);
}

}  // namespace
}  // namespace panonav::testing
