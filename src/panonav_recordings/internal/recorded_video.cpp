#include "panonav_recordings/internal/recorded_video.hpp"

#include <unistd.h>

#include <array>
#include <cstdlib>
#include <system_error>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/internal/video_store.hpp"

namespace panonav::recordings {

namespace {

namespace fs = std::filesystem;
using PacketBytes = std::span<const std::uint8_t>;

/// Content of a packet, by the types of its units.
struct PacketContent {
  bool has_parameters = false;  ///< of a sequence: decoding can begin here
  bool has_key = false;         ///< a picture that needs no other one
  bool has_picture = false;
};

/// Finds the units behind start codes (0 0 1) in a packet.
PacketContent inspect_packet(PacketBytes packet, VideoCodec codec) {
  PacketContent content;
  for (std::size_t i = 0; i + 3 < packet.size(); ++i) {
    if (packet[i] != 0 || packet[i + 1] != 0 || packet[i + 2] != 1) continue;
    const std::uint8_t head = packet[i + 3];
    if (codec == VideoCodec::h264) {  // ITU-T H.264, table 7-1
      const int type = head & 0x1F;
      content.has_picture = content.has_picture || (type >= 1 && type <= 5);
      content.has_key = content.has_key || type == 5;
      content.has_parameters = content.has_parameters || type == 7;
    } else {  // ITU-T H.265, table 7-1
      const int type = head >> 1U & 0x3F;
      content.has_picture = content.has_picture || type < 32;
      content.has_key = content.has_key || (type >= 16 && type <= 23);
      content.has_parameters = content.has_parameters || type == 33;
    }
    i += 2;
  }
  return content;
}

/// Elements of Matroska (RFC 8794, RFC 9559): an id, a length of eight bytes, and the content.
std::string make_element(std::string_view id, std::string_view content) {
  std::string element(id);
  element += '\x01';
  for (int shift = 48; shift >= 0; shift -= 8)
    element += static_cast<char>(content.size() >> static_cast<unsigned>(shift) & 0xFFU);
  return element.append(content);
}

std::string make_number_element(std::string_view id, std::uint64_t value) {
  std::string content;
  for (int shift = 56; shift >= 0; shift -= 8)
    content += static_cast<char>(value >> static_cast<unsigned>(shift) & 0xFFU);
  return make_element(id, content);
}

/// The beginning of a file with one track: the head, and a segment of unknown length.
std::string make_file_head(VideoCodec codec) {
  constexpr std::uint64_t millisecond_ns = 1'000'000;
  constexpr std::uint64_t any_side_px = 16;  // the packets have the true size
  const std::string video =
      make_number_element("\xB0", any_side_px) + make_number_element("\xBA", any_side_px);
  const std::string track =
      make_number_element("\xD7", 1) + make_number_element("\x73\xC5", 1) +
      make_number_element("\x83", 1) +
      make_element("\x86", codec == VideoCodec::h264 ? "V_MPEG4/ISO/AVC" : "V_MPEGH/ISO/HEVC") +
      make_element("\xE0", video);
  return make_element("\x1A\x45\xDF\xA3", make_element("\x42\x82", "matroska") +
                                              make_number_element("\x42\x87", 4) +
                                              make_number_element("\x42\x85", 2)) +
         "\x18\x53\x80\x67\x01\xFF\xFF\xFF\xFF\xFF\xFF\xFF" +
         make_element("\x15\x49\xA9\x66", make_number_element("\x2A\xD7\xB1", millisecond_ns)) +
         make_element("\x16\x54\xAE\x6B", make_element("\xAE", track));
}

/// Pictures of a video; errors name the recording.
class RecordedVideoPictures final : public PictureStore {
 public:
  RecordedVideoPictures(const std::string& file, std::string recording, VideoIndex index)
      : recording_(std::move(recording)), store_(file, std::move(index), std::nullopt, {}) {}
  [[nodiscard]] Image read(std::size_t index) const override {
    try {
      return store_.read(index);
    } catch (const FileError& error) {
      const std::string what = error.what();
      const auto reason = what.find(" s cannot be decoded");
      throw FileError(recording_, "image " + std::to_string(index + 1) + " of the video " +
                                      (reason == std::string::npos ? "cannot be decoded: " + what
                                                                   : what.substr(reason + 3)));
    }
  }

 private:
  std::string recording_;
  VideoStore store_;
};

}  // namespace

std::optional<VideoCodec> find_video_codec(std::string_view format) {
  const std::string name = to_lower_case(format);
  const auto has = [&](std::string_view word) { return name.find(word) != std::string::npos; };
  if (has("h264") || has("h.264") || has("x264")) return VideoCodec::h264;
  if (has("h265") || has("h.265") || has("x265") || has("hevc")) return VideoCodec::h265;
  return std::nullopt;
}

RecordedVideo::RecordedVideo(VideoCodec codec, std::string recording)
    : codec_(codec), recording_(std::move(recording)) {
  std::error_code error;
  std::string name = (fs::temp_directory_path(error) / "panonav_XXXXXX").string();
  const int descriptor = error ? -1 : mkstemp(name.data());
  if (descriptor < 0) throw FileError(recording_, "its video cannot be decoded: no temporary file");
  close(descriptor);
  path_ = name;
  file_.open(path_, std::ios::binary);
  const std::string head = make_file_head(codec);
  write({reinterpret_cast<const std::uint8_t*>(head.data()), head.size()});
}

RecordedVideo::~RecordedVideo() {
  std::error_code ignored;
  fs::remove(path_, ignored);
}

void RecordedVideo::write(PacketBytes bytes) {
  file_.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
  if (!file_) {
    throw FileError(recording_,
                    "its video cannot be kept in the temporary folder (TMPDIR); is the disk full?");
  }
}

bool RecordedVideo::add(PacketBytes packet) {
  const PacketContent content = inspect_packet(packet, codec_);
  const bool can_begin = content.has_parameters || content.has_key;
  if (packets_ == 0 && !can_begin) return false;
  constexpr std::uint8_t key_flag = 0x80;
  const std::string block_head{'\x81', '\0', '\0', static_cast<char>(can_begin ? key_flag : 0)};
  const std::string time = make_number_element("\xE7", static_cast<std::uint64_t>(packets_));
  const std::string_view bytes(reinterpret_cast<const char*>(packet.data()), packet.size());
  const std::string cluster = make_element(
      "\x1F\x43\xB6\x75", time + make_element("\xA3", block_head + std::string(bytes)));
  write({reinterpret_cast<const std::uint8_t*>(cluster.data()), cluster.size()});
  if (content.has_picture) picture_numbers_.push_back(packets_);
  ++packets_;
  return content.has_picture;
}

std::shared_ptr<const PictureStore> RecordedVideo::pictures() {
  file_.flush();
  if (!file_) write({});
  constexpr double millisecond_s = 1e-3;
  return std::make_shared<const RecordedVideoPictures>(
      path_.string(), recording_,
      VideoIndex{.unit_s = millisecond_s, .unit = "1/1000", .stamps = picture_numbers_});
}

}  // namespace panonav::recordings
