#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstring>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/io/internal/image_codecs.hpp"

namespace panonav::detail {

namespace {

// libpng leaves a failed call by longjmp. Functions that call it (`*_steps`) must not hold objects
// with a destructor; the structs below, in the calling function, free everything.

constexpr std::size_t message_size = 160;

void copy_message(char* message, const char* text) {
  std::strncpy(message, text, message_size - 1);
}

struct Reader {
  png_structp png = nullptr;
  png_infop info = nullptr;
  const std::uint8_t* next = nullptr;
  std::size_t left = 0;
  std::span<const std::uint8_t> exif;  // memory of libpng; empty: none
  char message[message_size] = {};
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
};

[[noreturn]] void on_read_error(png_structp png, png_const_charp text) {
  copy_message(static_cast<Reader*>(png_get_error_ptr(png))->message, text);
  png_longjmp(png, 1);
}

void on_warning(png_structp /*png*/, png_const_charp /*text*/) {}

void on_read(png_structp png, png_bytep to, png_size_t count) {
  auto* reader = static_cast<Reader*>(png_get_io_ptr(png));
  if (count > reader->left) png_error(png, "the file ends too early");
  std::memcpy(to, reader->next, count);
  reader->next += count;
  reader->left -= count;
}

bool try_open(Reader& reader, ImageSize& size) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  // Sizes are checked by the caller, which has a clearer message. Ancillary chunks must not take
  // much memory.
  png_set_user_limits(reader.png, 0x7FFFFFFF, 0x7FFFFFFF);
  png_set_chunk_malloc_max(reader.png, 8U << 20U);
  png_set_chunk_cache_max(reader.png, 64);
  png_set_read_fn(reader.png, &reader, on_read);
  png_read_info(reader.png, reader.info);
  size = {static_cast<int>(png_get_image_width(reader.png, reader.info)),
          static_cast<int>(png_get_image_height(reader.png, reader.info))};
#ifdef PNG_eXIf_SUPPORTED
  png_uint_32 exif_bytes = 0;
  png_bytep exif = nullptr;
  if (png_get_eXIf_1(reader.png, reader.info, &exif_bytes, &exif) != 0) {
    reader.exif = {exif, exif_bytes};
  }
#endif
  return true;
}

// Requests 8-bit grey or RGB, and sets `channels` to their number.
bool set_transforms(Reader& reader, int& channels) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_set_scale_16(reader.png);
  png_set_expand(reader.png);
  png_set_strip_alpha(reader.png);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  channels = png_get_channels(reader.png, reader.info);
  return true;
}

// Requests the stored 16 bits of a grey image, in the byte order of this machine.
bool set_transforms_of_16_bits(Reader& reader) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_set_strip_alpha(reader.png);
  if constexpr (std::endian::native == std::endian::little) png_set_swap(reader.png);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

bool read_pixels(Reader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows);
  // Reads the end of the file, too, because without it the image was cut short.
  png_read_end(reader.png, nullptr);
  return true;
}

[[noreturn]] void fail(const Reader& reader, std::string_view name) {
  throw FileError(name, std::string("damaged PNG: ") + reader.message);
}

// True if no chunk is longer than the file. libpng allocates memory for some chunks before it reads
// them, up to 2 GB whatever its limits are.
bool has_complete_chunks(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t chunk_overhead_bytes = 12;  // length, name and checksum
  std::size_t at = 8;
  while (at + chunk_overhead_bytes <= bytes.size()) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8U | bytes[at + i];
    if (length > bytes.size() - at - chunk_overhead_bytes) return false;
    if (std::memcmp(&bytes[at + 4], "IEND", 4) == 0) return true;
    at += chunk_overhead_bytes + length;
  }
  return false;
}

ImageSize open(Reader& reader, std::span<const std::uint8_t> bytes, std::string_view name,
               const ImageLimits& limits) {
  if (!has_complete_chunks(bytes)) throw FileError(name, "damaged PNG: the file ends too early");
  reader.next = bytes.data();
  reader.left = bytes.size();
  reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader, on_read_error, on_warning);
  reader.info = reader.png == nullptr ? nullptr : png_create_info_struct(reader.png);
  if (reader.info == nullptr) throw FileError(name, "cannot be read: out of memory");
  ImageSize size;
  if (!try_open(reader, size)) fail(reader, name);
  check_image_size(size, name, limits);
  return size;
}

// Deflate packs at most 1032 to 1, so a larger picture cannot be in this file; no memory is
// allocated for it.
void require_plausible_size(ImageSize size, std::span<const std::uint8_t> bytes,
                            std::string_view name) {
  const auto min_bits = static_cast<std::int64_t>(size.width) * size.height;
  if (min_bits / 8 / 1032 > static_cast<std::int64_t>(bytes.size())) {
    throw FileError(name, "damaged PNG: the file ends too early");
  }
}

struct Writer {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::vector<std::uint8_t> bytes;
  char message[message_size] = {};
  ~Writer() { png_destroy_write_struct(&png, &info); }
};

[[noreturn]] void on_write_error(png_structp png, png_const_charp text) {
  copy_message(static_cast<Writer*>(png_get_error_ptr(png))->message, text);
  png_longjmp(png, 1);
}

// Returns false if memory ran out, because no exception may pass through libpng.
bool append_bytes(Writer& writer, const std::uint8_t* from, std::size_t count) noexcept {
  try {
    writer.bytes.insert(writer.bytes.end(), from, from + count);
    return true;
  } catch (...) {
    return false;
  }
}

void on_write(png_structp png, png_bytep from, png_size_t count) {
  if (!append_bytes(*static_cast<Writer*>(png_get_io_ptr(png)), from, count)) {
    png_error(png, "out of memory");
  }
}

void on_flush(png_structp /*png*/) {}

bool try_write(Writer& writer, const ImageView& image) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_set_write_fn(writer.png, &writer, on_write, on_flush);
  // Pixels of cameras hardly ever repeat. Codes for rows minus their neighbours, with runs alone,
  // take a third of the time of matches, are read in three quarters of it and are no larger.
  png_set_compression_level(writer.png, 1);
  png_set_compression_strategy(writer.png, Z_RLE);
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB | PNG_FILTER_UP);
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), 8,
               image.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png, writer.info);
  for (int v = 0; v < image.height; ++v) png_write_row(writer.png, image.data + v * image.stride);
  png_write_end(writer.png, nullptr);
  return true;
}

}  // namespace

ImageSize png_size(std::span<const std::uint8_t> bytes, std::string_view name,
                   const ImageLimits& limits) {
  Reader reader;
  const ImageSize stored = open(reader, bytes, name, limits);
  return upright_size(stored, read_exif_orientation(reader.exif));
}

Image decode_png(std::span<const std::uint8_t> bytes, std::string_view name,
                 const ImageLimits& limits) {
  Reader reader;
  const ImageSize size = open(reader, bytes, name, limits);
  require_plausible_size(size, bytes, name);
  int channels = 0;
  if (!set_transforms(reader, channels)) fail(reader, name);
  if (channels != 1 && channels != 3) throw FileError(name, "damaged PNG: unknown colour type");

  Image image(size.width, size.height, channels);
  std::vector<png_bytep> rows(static_cast<std::size_t>(size.height));
  for (int v = 0; v < size.height; ++v) rows[v] = &image.at(0, v);
  if (!read_pixels(reader, rows.data())) fail(reader, name);
  return apply_exif_orientation(std::move(image), read_exif_orientation(reader.exif));
}

std::optional<GreyLevels> decode_png_of_16_bits(std::span<const std::uint8_t> bytes,
                                                std::string_view name, const ImageLimits& limits) {
  Reader reader;
  const ImageSize size = open(reader, bytes, name, limits);
  constexpr int bits = 16;
  if (png_get_bit_depth(reader.png, reader.info) != bits ||
      (png_get_color_type(reader.png, reader.info) & PNG_COLOR_MASK_COLOR) != 0)
    return std::nullopt;
  require_plausible_size(size, bytes, name);
  if (!set_transforms_of_16_bits(reader)) fail(reader, name);
  const auto width = static_cast<std::size_t>(size.width);
  GreyLevels levels{size.width, size.height, {}};
  levels.values.resize(width * static_cast<std::size_t>(size.height));
  std::vector<png_bytep> rows(static_cast<std::size_t>(size.height));
  for (std::size_t v = 0; v < rows.size(); ++v)
    rows[v] = reinterpret_cast<png_bytep>(&levels.values[v * width]);
  if (!read_pixels(reader, rows.data())) fail(reader, name);
  return levels;
}

std::vector<std::uint8_t> encode_png(ImageView image) {
  require(image.width >= 1 && image.height >= 1, "image size in pixels",
          static_cast<double>(image.width) * image.height, ">= 1");
  require(image.channels == 1 || image.channels == 3, "image channels", image.channels, "1 or 3");
  Writer writer;
  writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &writer, on_write_error, on_warning);
  writer.info = writer.png == nullptr ? nullptr : png_create_info_struct(writer.png);
  if (writer.info == nullptr || !try_write(writer, image)) {
    throw Error(std::string("cannot make a PNG: ") +
                (writer.info == nullptr ? "out of memory" : writer.message));
  }
  return std::move(writer.bytes);
}

}  // namespace panonav::detail
