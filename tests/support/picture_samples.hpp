#pragma once

#include <png.h>
#include <zlib.h>

#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <jpeglib.h>

#include "panonav/core/image.hpp"
#include "panonav/core/random.hpp"

namespace panonav::testing {

inline Image random_image(Random& random, int width, int height, int channels) {
  Image image(width, height, channels);
  for (auto& value : image.pixels()) value = static_cast<std::uint8_t>(random.index(256));
  return image;
}

/// A smooth picture: JPEG keeps it nearly as it is.
inline Image smooth_image(int width, int height, int channels) {
  Image image(width, height, channels);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      for (int c = 0; c < channels; ++c) {
        image.at(u, v, c) =
            static_cast<std::uint8_t>(60 + (100 * u) / width + (60 * v) / height + 10 * c);
      }
    }
  }
  return image;
}

inline void append_png_bytes(png_structp png, png_bytep data, png_size_t count) {
  auto* bytes = static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(png));
  bytes->insert(bytes->end(), data, data + count);
}

/// A PNG of any colour type and bit depth; `rows` holds packed rows as libpng takes them.
inline std::vector<std::uint8_t> make_png(int width, int height, int colour_type, int bit_depth,
                                          const std::vector<std::vector<std::uint8_t>>& rows,
                                          const std::vector<png_color>& palette = {},
                                          int interlace = PNG_INTERLACE_NONE) {
  std::vector<std::uint8_t> bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &bytes, append_png_bytes, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height),
               bit_depth, colour_type, interlace, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  if (!palette.empty()) png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  std::vector<png_bytep> pointers;
  for (const auto& row : rows) pointers.push_back(const_cast<png_bytep>(row.data()));
  png_set_rows(png, info, pointers.data());
  png_write_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

inline std::vector<std::uint8_t> make_jpeg(const Image& image, int quality, bool progressive,
                                           const std::vector<jpeg_scan_info>& scans = {}) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &buffer, &size);
  jpeg.image_width = static_cast<JDIMENSION>(image.width());
  jpeg.image_height = static_cast<JDIMENSION>(image.height());
  jpeg.input_components = image.channels();
  jpeg.in_color_space = image.channels() == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, quality, TRUE);
  if (progressive) jpeg_simple_progression(&jpeg);
  if (!scans.empty()) {
    jpeg.scan_info = scans.data();
    jpeg.num_scans = static_cast<int>(scans.size());
  }
  jpeg_start_compress(&jpeg, TRUE);
  const auto stride = static_cast<std::size_t>(image.width()) * image.channels();
  while (jpeg.next_scanline < jpeg.image_height) {
    JSAMPROW row = const_cast<JSAMPROW>(image.pixels().data() + jpeg.next_scanline * stride);
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  std::vector<std::uint8_t> bytes(buffer, buffer + size);
  jpeg_destroy_compress(&jpeg);
  std::free(buffer);
  return bytes;
}

/// A progressive JPEG of one grey in 190 scans: the average, and each of the 63 other coefficients
/// three times, bit by bit.
inline std::vector<std::uint8_t> make_scan_bomb(int width, int height) {
  std::vector<jpeg_scan_info> scans;
  const auto add = [&scans](int coefficient, int above, int bit) {
    jpeg_scan_info scan{};
    scan.comps_in_scan = 1;
    scan.Ss = scan.Se = coefficient;
    scan.Ah = above;
    scan.Al = bit;
    scans.push_back(scan);
  };
  add(0, 0, 0);
  for (int coefficient = 1; coefficient < 64; ++coefficient) {
    add(coefficient, 0, 2);
    add(coefficient, 2, 1);
    add(coefficient, 1, 0);
  }
  return make_jpeg(Image(width, height), 90, false, scans);
}

/// The PNG or JPEG with an EXIF block that says how the camera was turned (1 .. 8).
inline std::vector<std::uint8_t> with_exif(std::vector<std::uint8_t> file, int orientation,
                                           bool big_endian = false) {
  const auto high = static_cast<std::uint8_t>(orientation >> 8);
  const auto low = static_cast<std::uint8_t>(orientation);
  std::vector<std::uint8_t> exif{'I', 'I', 42, 0, 8, 0,   0,    0, 1, 0, 0x12, 1, 3,
                                 0,   1,   0,  0, 0, low, high, 0, 0, 0, 0,    0, 0};
  if (big_endian) {
    exif = {'M', 'M', 0, 42, 0, 0,    0,   8, 0, 1, 1, 0x12, 0,
            3,   0,   0, 0,  1, high, low, 0, 0, 0, 0, 0,    0};
  }
  if (file[0] == 0xFF) {
    std::vector<std::uint8_t> segment{
        0xFF, 0xE1, 0, static_cast<std::uint8_t>(exif.size() + 8), 'E', 'x', 'i', 'f', 0, 0};
    segment.insert(segment.end(), exif.begin(), exif.end());
    file.insert(file.begin() + 2, segment.begin(), segment.end());
    return file;
  }
  std::vector<std::uint8_t> chunk{'e', 'X', 'I', 'f'};
  chunk.insert(chunk.end(), exif.begin(), exif.end());
  const auto checksum =
      static_cast<std::uint32_t>(crc32(0, chunk.data(), static_cast<unsigned>(chunk.size())));
  chunk.insert(chunk.begin(), {0, 0, 0, static_cast<std::uint8_t>(exif.size())});
  for (int shift = 24; shift >= 0; shift -= 8) {
    chunk.push_back(static_cast<std::uint8_t>(checksum >> static_cast<unsigned>(shift)));
  }
  constexpr std::ptrdiff_t signature_and_header = 8 + 25;
  file.insert(file.begin() + signature_and_header, chunk.begin(), chunk.end());
  return file;
}

}  // namespace panonav::testing
