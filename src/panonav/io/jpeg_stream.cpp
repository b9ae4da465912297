#include "panonav/io/jpeg_stream.hpp"

#include <algorithm>
#include <array>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

constexpr std::uint8_t marker = 0xff;
constexpr std::uint8_t start_of_image = 0xd8;
constexpr std::uint8_t end_of_image = 0xd9;

/// Stand alone, without a length: fill bytes, stuffed zeros, TEM and restart markers.
bool has_no_length(std::uint8_t kind) {
  return kind == 0x00 || kind == 0x01 || (kind >= 0xd0 && kind <= 0xd7);
}

}  // namespace

void JpegStream::add(std::span<const std::uint8_t> bytes, const std::string& name) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  if (buffer_.size() > max_bytes + bytes.size()) {
    throw FileError(name, "a picture of the stream has more than " + std::to_string(max_bytes) +
                              " bytes; allowed: a stream of JPEG pictures");
  }
}

std::optional<std::vector<std::uint8_t>> JpegStream::next() {
  constexpr std::array<std::uint8_t, 3> beginning{marker, start_of_image, marker};
  while (true) {
    if (walked_ == 0) {
      auto found = std::ranges::search(buffer_, beginning).begin();
      // The last two bytes may begin the next picture.
      if (found == buffer_.end()) found -= std::min<std::ptrdiff_t>(2, found - buffer_.begin());
      buffer_.erase(buffer_.begin(), found);
      if (buffer_.size() < beginning.size()) return std::nullopt;
      walked_ = 2;
    }
    // Entropy-coded data lies between segments: on to the next marker.
    const auto at =
        std::find(buffer_.begin() + static_cast<std::ptrdiff_t>(walked_), buffer_.end(), marker) -
        buffer_.begin();
    walked_ = static_cast<std::size_t>(at);
    if (walked_ + 2 > buffer_.size()) return std::nullopt;
    const std::uint8_t kind = buffer_[walked_ + 1];
    if (kind == marker) {
      ++walked_;
    } else if (has_no_length(kind)) {
      walked_ += 2;
    } else if (kind == end_of_image) {
      const auto end = buffer_.begin() + static_cast<std::ptrdiff_t>(walked_ + 2);
      std::vector<std::uint8_t> picture(buffer_.begin(), end);
      buffer_.erase(buffer_.begin(), end);
      walked_ = 0;
      return picture;
    } else if (kind == start_of_image) {  // the picture before was cut off
      buffer_.erase(buffer_.begin(), buffer_.begin() + at);
      walked_ = 2;
    } else {
      if (walked_ + 4 > buffer_.size()) return std::nullopt;
      const std::size_t length = buffer_[walked_ + 2] * std::size_t{256} + buffer_[walked_ + 3];
      if (walked_ + 2 + length > buffer_.size()) return std::nullopt;
      walked_ += 2 + std::max<std::size_t>(length, 2);
    }
  }
}

}  // namespace panonav
