#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/io/dataset.hpp"

namespace panonav::recordings {

/// Cuts a stream of JPEG pictures that follow each other ("MJPEG") into pictures. It follows the
/// segments of a picture, so that a thumbnail within does not end it; bytes between pictures,
/// such as the heads of a multipart stream, are skipped. Memory: one picture, at most `max_bytes`.
class JpegStream {
 public:
  /// Largest size of a picture; larger ones are refused.
  static constexpr std::size_t max_bytes = std::size_t{64} << 20;

  /// Takes the next bytes of the stream. Throws FileError on `name` when one picture is longer than
  /// `max_bytes`.
  void add(std::span<const std::uint8_t> bytes, const std::string& name);
  /// Returns the next complete picture; empty until more bytes come.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> next();
  /// Returns the number of bytes of an incomplete picture.
  [[nodiscard]] std::size_t unfinished_bytes() const noexcept { return buffer_.size(); }

 private:
  std::vector<std::uint8_t> buffer_;  // from the beginning of the current picture
  std::size_t parsed_bytes_ = 0;      // bytes of `buffer_` parsed so far; 0: no beginning found yet
};

/// Reads a stream of JPEG pictures to its end into a temporary file, which is removed with the
/// returned data set. Names are "000001.jpg" and so on. Throws FileError on `name` if there is no
/// picture, or the temporary folder (TMPDIR) is full.
[[nodiscard]] Dataset read_jpeg_stream(int descriptor, const std::string& name,
                                       PictureSource source);

}  // namespace panonav::recordings
