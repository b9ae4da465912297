#include <algorithm>
#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <string>

// jpeglib.h needs the C types above it, jerror.h the settings of jpeglib.h.
#include <jpeglib.h>

#include <jerror.h>

#include "panonav/core/error.hpp"
#include "panonav/io/internal/image_codecs.hpp"

namespace panonav::detail {

namespace {

// libjpeg would exit the program on an error; here it leaves the failed call by longjmp instead.
// The functions that call it (`*_steps`) hold no object with a destructor.

struct Reader {
  jpeg_decompress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  std::jmp_buf on_failure{};
  char message[JMSG_LENGTH_MAX] = {};
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

// libjpeg fills what is lost with grey and only warns. A view that is partly made up must not pass
// for one that was seen, so warnings of lost pixels count as damage; those of untidy headers do
// not.
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

// A small file can ask for millions of passes over the picture; real ones have a dozen.
void on_progress(j_common_ptr jpeg) {
  constexpr int scan_limit = 200;
  if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number > scan_limit) {
    jpeg->err->msg_code = JERR_BAD_PROGRESSION;
    on_error(jpeg);
  }
}

bool open_steps(Reader& reader, const std::uint8_t* data, std::size_t size) {
  if (setjmp(reader.on_failure)) return false;
  jpeg_create_decompress(&reader.jpeg);
  reader.created = true;
  // Not before: creating clears the struct.
  reader.jpeg.progress = &reader.progress;
  reader.jpeg.mem->max_memory_to_use = 1L << 30U;
  jpeg_mem_src(&reader.jpeg, data, static_cast<unsigned long>(size));
  jpeg_read_header(&reader.jpeg, TRUE);
  return true;
}

bool start_steps(Reader& reader) {
  if (setjmp(reader.on_failure)) return false;
  reader.jpeg.out_color_space =
      reader.jpeg.jpeg_color_space == JCS_GRAYSCALE ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_start_decompress(&reader.jpeg);
  return true;
}

bool pixel_steps(Reader& reader, std::uint8_t* pixels, std::size_t stride) {
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

ImageSize open(Reader& reader, std::span<const std::uint8_t> bytes, std::string_view name) {
  reader.jpeg.err = jpeg_std_error(&reader.errors);
  reader.errors.error_exit = on_error;
  reader.errors.emit_message = on_message;
  reader.errors.output_message = on_output;
  reader.progress.progress_monitor = on_progress;
  reader.jpeg.client_data = &reader;
  if (!open_steps(reader, bytes.data(), bytes.size())) fail(reader, name);
  check_image_size(reader.jpeg.image_width, reader.jpeg.image_height, name);
  return {static_cast<int>(reader.jpeg.image_width), static_cast<int>(reader.jpeg.image_height)};
}

}  // namespace

Image decode_jpeg(std::span<const std::uint8_t> bytes, std::string_view name) {
  Reader reader;
  const ImageSize size = open(reader, bytes, name);
  if (reader.jpeg.jpeg_color_space == JCS_CMYK || reader.jpeg.jpeg_color_space == JCS_YCCK) {
    throw FileError(name, "is a JPEG in printing colours (CMYK); allowed: grey, RGB");
  }
  if (!start_steps(reader)) fail(reader, name);
  const int channels = reader.jpeg.output_components;
  if (static_cast<int>(reader.jpeg.output_width) != size.width ||
      static_cast<int>(reader.jpeg.output_height) != size.height ||
      (channels != 1 && channels != 3)) {
    throw FileError(name, "damaged JPEG: unknown colour type");
  }
  Image image(size.width, size.height, channels);
  if (!pixel_steps(reader, image.pixels().data(),
                   static_cast<std::size_t>(size.width) * static_cast<std::size_t>(channels))) {
    fail(reader, name);
  }
  return image;
}

}  // namespace panonav::detail
