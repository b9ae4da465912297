#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

// The C headers must stay before jpeglib.h, and jpeglib.h before jerror.h.
#include <jpeglib.h>

#include <jerror.h>

#include "panonav/core/error.hpp"
#include "panonav/io/internal/image_codecs.hpp"

namespace panonav::detail {

namespace {

// libjpeg would exit the program on an error; here it leaves the failed call by longjmp instead.
// Functions that call libjpeg (`*_steps`) must not hold objects with a destructor.

struct Reader {
  jpeg_decompress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  std::jmp_buf on_failure{};
  char message[JMSG_LENGTH_MAX] = {};
  std::int64_t max_scans = 0;
  bool created = false;
  ~Reader() {
    if (created) jpeg_destroy_decompress(&jpeg);
  }
};

[[noreturn]] void on_error(j_common_ptr jpeg) {
  auto* reader = static_cast<Reader*>(jpeg->client_data);
  reader->errors.format_message(jpeg, reader->message);
  std::longjmp(reader->on_failure, 1);
}

// libjpeg fills lost pixels with grey and only warns. An image with invented pixels must not be
// used as a view, so warnings of lost pixels are errors; warnings of irregular headers are ignored.
void on_message(j_common_ptr jpeg, int level) {
  if (level >= 0) return;
  switch (jpeg->err->msg_code) {
    case JWRN_JPEG_EOF:
    case JWRN_HIT_MARKER:
    case JWRN_HUFF_BAD_CODE:
    case JWRN_ARITH_BAD_CODE:
    case JWRN_MUST_RESYNC:
    case JWRN_NOT_SEQUENTIAL:
      on_error(jpeg);
    default:
      ++jpeg->err->num_warnings;
  }
}

void on_output(j_common_ptr /*jpeg*/) {}

void on_progress(j_common_ptr jpeg) {
  auto* reader = static_cast<Reader*>(jpeg->client_data);
  if (reader->jpeg.input_scan_number <= reader->max_scans) return;
  std::snprintf(reader->message, sizeof reader->message, "more than %lld scans for %u x %u px",
                static_cast<long long>(reader->max_scans), reader->jpeg.image_width,
                reader->jpeg.image_height);
  std::longjmp(reader->on_failure, 1);
}

bool try_open(Reader& reader, const std::uint8_t* data, std::size_t size) {
  if (setjmp(reader.on_failure)) return false;
  jpeg_create_decompress(&reader.jpeg);
  reader.created = true;
  // Must come after creating, which clears the struct.
  reader.jpeg.progress = &reader.progress;
  reader.jpeg.mem->max_memory_to_use = 1L << 30U;
  jpeg_mem_src(&reader.jpeg, data, static_cast<unsigned long>(size));
  jpeg_read_header(&reader.jpeg, TRUE);
  return true;
}

bool start_steps(Reader& reader, JpegColours colours) {
  if (setjmp(reader.on_failure)) return false;
  const bool has_luma = reader.jpeg.jpeg_color_space == JCS_GRAYSCALE ||
                        (colours == JpegColours::luma && reader.jpeg.jpeg_color_space == JCS_YCbCr);
  reader.jpeg.out_color_space = has_luma ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_start_decompress(&reader.jpeg);
  return true;
}

bool read_pixels(Reader& reader, std::uint8_t* pixels, std::size_t stride) {
  if (setjmp(reader.on_failure)) return false;
  while (reader.jpeg.output_scanline < reader.jpeg.output_height) {
    JSAMPROW row = pixels + reader.jpeg.output_scanline * stride;
    jpeg_read_scanlines(&reader.jpeg, &row, 1);
  }
  jpeg_finish_decompress(&reader.jpeg);
  return true;
}

[[noreturn]] void fail(const Reader& reader, std::string_view name) {
  throw FileError(name, std::string("damaged JPEG: ") + reader.message);
}

// Returns the EXIF block, which is in an APP1 segment before the first scan, after its name.
std::span<const std::uint8_t> find_exif(std::span<const std::uint8_t> bytes) {
  constexpr std::uint8_t app1 = 0xE1;
  constexpr std::uint8_t start_of_scan = 0xDA;
  constexpr std::array<std::uint8_t, 6> exif{'E', 'x', 'i', 'f', 0, 0};
  std::size_t at = 2;
  while (at + 4 <= bytes.size() && bytes[at] == 0xFF) {
    const std::uint8_t marker = bytes[at + 1];
    if (marker == 0xFF) {  // padding
      ++at;
      continue;
    }
    const std::size_t size = bytes[at + 2] << 8U | bytes[at + 3];
    if (marker == start_of_scan || size < 2 || size > bytes.size() - at - 2) break;
    const auto content = bytes.subspan(at + 4, size - 2);
    if (marker == app1 && content.size() > exif.size() &&
        std::equal(exif.begin(), exif.end(), content.begin())) {
      return content.subspan(exif.size());
    }
    at += 2 + size;
  }
  return {};
}

ImageSize open(Reader& reader, std::span<const std::uint8_t> bytes, std::string_view name,
               const ImageLimits& limits) {
  reader.jpeg.err = jpeg_std_error(&reader.errors);
  reader.errors.error_exit = on_error;
  reader.errors.emit_message = on_message;
  reader.errors.output_message = on_output;
  reader.progress.progress_monitor = on_progress;
  reader.jpeg.client_data = &reader;
  if (!try_open(reader, bytes.data(), bytes.size())) fail(reader, name);
  const ImageSize size{static_cast<int>(reader.jpeg.image_width),
                       static_cast<int>(reader.jpeg.image_height)};
  check_image_size(size, name, limits);
  constexpr std::int64_t scan_overhead_px = 65536;
  reader.max_scans =
      limits.scanned_px / (std::int64_t{size.width} * size.height + scan_overhead_px);
  return size;
}

struct Writer {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  std::jmp_buf on_failure{};
  char message[JMSG_LENGTH_MAX] = {};
  unsigned char* bytes = nullptr;  // by malloc
  unsigned long size = 0;
  ~Writer() {
    jpeg_destroy_compress(&jpeg);
    std::free(bytes);
  }
};

[[noreturn]] void on_write_error(j_common_ptr jpeg) {
  auto* writer = static_cast<Writer*>(jpeg->client_data);
  writer->errors.format_message(jpeg, writer->message);
  std::longjmp(writer->on_failure, 1);
}

bool try_write(Writer& writer, const ImageView& image, int quality) {
  if (setjmp(writer.on_failure)) return false;
  jpeg_create_compress(&writer.jpeg);
  jpeg_mem_dest(&writer.jpeg, &writer.bytes, &writer.size);
  writer.jpeg.image_width = static_cast<JDIMENSION>(image.width);
  writer.jpeg.image_height = static_cast<JDIMENSION>(image.height);
  writer.jpeg.input_components = image.channels;
  writer.jpeg.in_color_space = image.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&writer.jpeg);
  jpeg_set_quality(&writer.jpeg, quality, TRUE);
  jpeg_start_compress(&writer.jpeg, TRUE);
  while (writer.jpeg.next_scanline < writer.jpeg.image_height) {
    // libjpeg does not write to the rows of its input.
    JSAMPROW row = const_cast<JSAMPROW>(
        image.data + static_cast<std::ptrdiff_t>(writer.jpeg.next_scanline) * image.stride);
    jpeg_write_scanlines(&writer.jpeg, &row, 1);
  }
  jpeg_finish_compress(&writer.jpeg);
  return true;
}

}  // namespace

std::vector<std::uint8_t> encode_jpeg(ImageView image, int quality) {
  const auto side_fits = [](int side) { return side >= 1 && side <= JPEG_MAX_DIMENSION; };
  require(side_fits(image.width), "image width in pixels", image.width, "1 .. 65500");
  require(side_fits(image.height), "image height in pixels", image.height, "1 .. 65500");
  require(image.channels == 1 || image.channels == 3, "image channels", image.channels, "1 or 3");
  require(quality >= 1 && quality <= 100, "quality", quality, "1 .. 100");
  Writer writer;
  writer.jpeg.err = jpeg_std_error(&writer.errors);
  writer.errors.error_exit = on_write_error;
  writer.errors.output_message = on_output;
  writer.jpeg.client_data = &writer;
  if (!try_write(writer, image, quality)) {
    throw Error(std::string("cannot make a JPEG: ") + writer.message);
  }
  return {writer.bytes, writer.bytes + writer.size};
}

ImageSize jpeg_size(std::span<const std::uint8_t> bytes, std::string_view name,
                    const ImageLimits& limits) {
  Reader reader;
  const ImageSize stored = open(reader, bytes, name, limits);
  return upright_size(stored, read_exif_orientation(find_exif(bytes)));
}

namespace {

void reject_printing_colours(const Reader& reader, std::string_view name) {
  if (reader.jpeg.jpeg_color_space == JCS_CMYK || reader.jpeg.jpeg_color_space == JCS_YCCK) {
    throw FileError(name, "is a JPEG in printing colours (CMYK); allowed: grey, RGB");
  }
}

}  // namespace

ImageSize check_jpeg(std::span<const std::uint8_t> bytes, std::string_view name,
                     const ImageLimits& limits) {
  Reader reader;
  const ImageSize stored = open(reader, bytes, name, limits);
  reject_printing_colours(reader, name);
  reader.jpeg.scale_num = 1;
  reader.jpeg.scale_denom = 8;
  if (!start_steps(reader, JpegColours::all)) fail(reader, name);
  const std::size_t stride =
      static_cast<std::size_t>(reader.jpeg.output_width) * reader.jpeg.output_components;
  std::vector<std::uint8_t> pixels(stride * reader.jpeg.output_height);
  if (!read_pixels(reader, pixels.data(), stride)) fail(reader, name);
  return upright_size(stored, read_exif_orientation(find_exif(bytes)));
}

Image decode_jpeg(std::span<const std::uint8_t> bytes, std::string_view name,
                  const ImageLimits& limits, JpegColours colours) {
  Reader reader;
  const ImageSize size = open(reader, bytes, name, limits);
  reject_printing_colours(reader, name);
  if (!start_steps(reader, colours)) fail(reader, name);
  const int channels = reader.jpeg.output_components;
  if (static_cast<int>(reader.jpeg.output_width) != size.width ||
      static_cast<int>(reader.jpeg.output_height) != size.height ||
      (channels != 1 && channels != 3)) {
    throw FileError(name, "damaged JPEG: unknown colour type");
  }
  Image image(size.width, size.height, channels);
  if (!read_pixels(reader, image.pixels().data(),
                   static_cast<std::size_t>(size.width) * channels)) {
    fail(reader, name);
  }
  return apply_exif_orientation(std::move(image), read_exif_orientation(find_exif(bytes)));
}

}  // namespace panonav::detail
