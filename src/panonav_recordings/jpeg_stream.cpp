#include "panonav_recordings/jpeg_stream.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::recordings {

namespace {

constexpr std::uint8_t marker = 0xff;
constexpr std::uint8_t start_of_image = 0xd8;
constexpr std::uint8_t end_of_image = 0xd9;

/// True for markers that no length follows: stuffed zeros, TEM and restart markers.
bool is_marker_without_length(std::uint8_t kind) {
  return kind == 0x00 || kind == 0x01 || (kind >= 0xd0 && kind <= 0xd7);
}

/// Stores pictures one after the other in an unnamed temporary file.
class SpooledPictures final : public PictureStore {
 public:
  explicit SpooledPictures(std::string name)
      : name_(std::move(name)), file_(std::tmpfile(), std::fclose) {
    if (!file_) fail();
  }
  void add(std::span<const std::uint8_t> picture) {
    if (std::fwrite(picture.data(), 1, picture.size(), file_.get()) != picture.size()) fail();
    ends_.push_back(begin(ends_.size()) + picture.size());
  }
  void finish() {
    if (std::fflush(file_.get()) != 0) fail();
  }
  [[nodiscard]] Image read(std::size_t index) const override {
    std::vector<std::uint8_t> bytes(ends_.at(index) - begin(index));
    std::size_t filled = 0;
    while (filled < bytes.size()) {
      const auto got = pread(fileno(file_.get()), bytes.data() + filled, bytes.size() - filled,
                             static_cast<off_t>(begin(index) + filled));
      if (got <= 0) fail();
      filled += static_cast<std::size_t>(got);
    }
    return decode_image(bytes, name_ + ", image " + std::to_string(index + 1));
  }

 private:
  [[nodiscard]] std::size_t begin(std::size_t index) const {
    return index == 0 ? 0 : ends_[index - 1];
  }
  [[noreturn]] void fail() const {
    throw FileError(name_, "cannot be kept in the temporary folder; is the disk full?");
  }
  std::string name_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::vector<std::size_t> ends_;
};

}  // namespace

Dataset read_jpeg_stream(int descriptor, const std::string& name, PictureSource source) {
  const auto pictures = std::make_shared<SpooledPictures>(name);
  Dataset dataset{name, std::move(source), {}, {}};
  JpegStream stream;
  std::vector<std::uint8_t> buffer(std::size_t{1} << 20U);
  for (ssize_t got = 0; (got = read(descriptor, buffer.data(), buffer.size())) > 0;) {
    stream.add(std::span(buffer).first(static_cast<std::size_t>(got)), name);
    while (const auto picture = stream.next()) {
      pictures->add(*picture);
      DatasetEntry entry;
      const std::string number = std::to_string(dataset.entries.size() + 1);
      entry.file = std::string(number.size() < 6 ? 6 - number.size() : 0, '0') + number + ".jpg";
      entry.path = name;
      entry.store = pictures;
      entry.store_index = dataset.entries.size();
      dataset.entries.push_back(std::move(entry));
    }
  }
  if (dataset.entries.empty()) {
    throw FileError(name, "gave no image; allowed: JPEG images one behind the other");
  }
  pictures->finish();
  return dataset;
}

void JpegStream::add(std::span<const std::uint8_t> bytes, const std::string& name) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  if (buffer_.size() > max_bytes + bytes.size()) {
    throw FileError(name, "an image of the stream has more than " + std::to_string(max_bytes) +
                              " bytes; allowed: a stream of JPEG images");
  }
}

std::optional<std::vector<std::uint8_t>> JpegStream::next() {
  constexpr std::array<std::uint8_t, 3> beginning{marker, start_of_image, marker};
  while (true) {
    if (parsed_bytes_ == 0) {
      auto found = std::search(buffer_.begin(), buffer_.end(), beginning.begin(), beginning.end());
      // The last two bytes are kept, as they may begin the next picture.
      if (found == buffer_.end()) found -= std::min<std::ptrdiff_t>(2, found - buffer_.begin());
      buffer_.erase(buffer_.begin(), found);
      if (buffer_.size() < beginning.size()) return std::nullopt;
      parsed_bytes_ = 2;
    }
    // Entropy-coded data follows a segment: skip it to the next marker.
    const auto at = std::find(buffer_.begin() + static_cast<std::ptrdiff_t>(parsed_bytes_),
                              buffer_.end(), marker) -
                    buffer_.begin();
    parsed_bytes_ = static_cast<std::size_t>(at);
    if (parsed_bytes_ + 2 > buffer_.size()) return std::nullopt;
    const std::uint8_t kind = buffer_[parsed_bytes_ + 1];
    if (kind == marker) {
      ++parsed_bytes_;
    } else if (is_marker_without_length(kind)) {
      parsed_bytes_ += 2;
    } else if (kind == end_of_image) {
      const auto end = buffer_.begin() + static_cast<std::ptrdiff_t>(parsed_bytes_ + 2);
      std::vector<std::uint8_t> picture(buffer_.begin(), end);
      buffer_.erase(buffer_.begin(), end);
      parsed_bytes_ = 0;
      return picture;
    } else if (kind == start_of_image) {  // the previous picture was cut off
      buffer_.erase(buffer_.begin(), buffer_.begin() + at);
      parsed_bytes_ = 2;
    } else {
      if (parsed_bytes_ + 4 > buffer_.size()) return std::nullopt;
      const std::size_t length =
          buffer_[parsed_bytes_ + 2] * std::size_t{256} + buffer_[parsed_bytes_ + 3];
      if (parsed_bytes_ + 2 + length > buffer_.size()) return std::nullopt;
      parsed_bytes_ += 2 + std::max<std::size_t>(length, 2);
    }
  }
}

}  // namespace panonav::recordings
