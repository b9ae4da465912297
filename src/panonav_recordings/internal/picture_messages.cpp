#include "panonav_recordings/internal/picture_messages.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav_recordings/internal/recording_file.hpp"

namespace panonav::recordings {

namespace {

using MessageBytes = std::span<const std::uint8_t>;

enum class PictureForm {
  raw,         ///< sensor_msgs/Image
  compressed,  ///< sensor_msgs/CompressedImage
  foxglove_raw,
  foxglove_compressed,  ///< a picture or a packet of a video
  packet                ///< of ffmpeg_image_transport
};

struct PictureType {
  std::string_view name;
  PictureForm form;
  bool is_protobuf = false;
};
constexpr std::array<PictureType, 9> known_picture_types{{
    {ros::Image::type, PictureForm::raw},
    {ros::CompressedImage::type, PictureForm::compressed},
    {"foxglove_msgs/RawImage", PictureForm::foxglove_raw},
    {"foxglove_msgs/CompressedImage", PictureForm::foxglove_compressed},
    {"foxglove_msgs/CompressedVideo", PictureForm::foxglove_compressed},
    {"ffmpeg_image_transport_msgs/FFMPEGPacket", PictureForm::packet},
    {"foxglove.RawImage", PictureForm::foxglove_raw, true},
    {"foxglove.CompressedImage", PictureForm::foxglove_compressed, true},
    {"foxglove.CompressedVideo", PictureForm::foxglove_compressed, true},
}};

const PictureType* find_type(const RecordedTopic& topic) {
  if (topic.encoding == MessageEncoding::other) return nullptr;
  const bool is_protobuf = topic.encoding == MessageEncoding::protobuf;
  const auto* const found = std::ranges::find_if(known_picture_types, [&](const PictureType& each) {
    return each.name == topic.type && each.is_protobuf == is_protobuf;
  });
  return found == known_picture_types.end() ? nullptr : found;
}

/// One field of a protobuf message: a number, or bytes.
struct ProtobufField {
  std::uint64_t number = 0;
  std::uint64_t value = 0;
  MessageBytes bytes;
};

/// Reads the fields of a protobuf message one after the other, in the wire format of
/// protobuf.dev/programming-guides/encoding.
class ProtobufFields {
 public:
  ProtobufFields(MessageBytes message, std::string_view type) : fields_(message), type_(type) {}

  /// Returns the next field; nullopt at the end. Throws ContractError if the message is cut off or
  /// has a wire type that does not exist.
  std::optional<ProtobufField> next() {
    if (fields_.left() == 0) return std::nullopt;
    const std::uint64_t key = read_varint();
    ProtobufField field{key >> 3U, 0, {}};
    switch (key & 7U) {
      case 0:
        field.value = read_varint();
        break;
      case 1:
        field.value = fields_.number<std::uint64_t>();
        break;
      case 2:
        field.bytes = fields_.bytes(read_varint());
        break;
      case 5:
        field.value = fields_.number<std::uint32_t>();
        break;
      default:
        fail();
    }
    if (!fields_.good()) fail();
    return field;
  }

 private:
  [[noreturn]] void fail() const {
    throw ContractError(std::string(type_) + " message", "cut off or damaged",
                        "whole fields of protobuf");
  }
  std::uint64_t read_varint() {
    constexpr unsigned max_bits = 64;
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < max_bits; shift += 7) {
      const auto byte = fields_.number<std::uint8_t>();
      if (!fields_.good()) fail();
      value |= std::uint64_t{byte & 0x7FU} << shift;
      if ((byte & 0x80U) == 0) return value;
    }
    fail();
  }
  Fields fields_;
  std::string_view type_;
};

std::string make_string(MessageBytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Reads a google.protobuf.Timestamp.
std::int64_t read_timestamp(MessageBytes bytes, std::string_view type) {
  constexpr std::int64_t second_ns = 1'000'000'000;
  constexpr std::int64_t max_s = 4'000'000'000;
  std::int64_t seconds = 0;
  std::int64_t nanoseconds = 0;
  ProtobufFields fields(bytes, type);
  while (const auto field = fields.next()) {
    if (field->number == 1) seconds = static_cast<std::int64_t>(field->value);
    if (field->number == 2) nanoseconds = static_cast<std::int32_t>(field->value);
  }
  if (seconds < -max_s || seconds > max_s || nanoseconds < 0 || nanoseconds >= second_ns) {
    throw ContractError(std::string(type) + " message: stamp", std::to_string(seconds) + " s",
                        "-4000000000 .. 4000000000 s");
  }
  return seconds * second_ns + nanoseconds;
}

PictureMessage read_protobuf(MessageBytes bytes, const PictureType& type) {
  PictureMessage message;
  const bool is_raw = type.form == PictureForm::foxglove_raw;
  if (is_raw) message.raw.emplace();
  // The fields of data and format of the compressed types.
  const bool is_video = type.name.ends_with("Video");
  const std::uint64_t data = is_raw ? 6 : is_video ? 3 : 2;
  const std::uint64_t format = is_video ? 4 : 3;
  ProtobufFields fields(bytes, type.name);
  while (const auto field = fields.next()) {
    if (field->number == 1) {
      message.stamp_ns = read_timestamp(field->bytes, type.name);
    } else if (is_raw) {
      ros::Image& raw = *message.raw;
      const auto number = static_cast<std::uint32_t>(field->value);
      if (field->number == 2) raw.width = number;
      if (field->number == 3) raw.height = number;
      if (field->number == 4) raw.encoding = make_string(field->bytes);
      if (field->number == 5) raw.step = number;
      if (field->number == data) raw.data = field->bytes;
    } else if (field->number == data) {
      message.file.data = field->bytes;
    } else if (field->number == format) {
      message.file.format = make_string(field->bytes);
    }
  }
  return message;
}

}  // namespace

bool is_picture_topic(const RecordedTopic& topic) {
  return find_type(topic) != nullptr;
}

bool is_raw_picture_topic(const RecordedTopic& topic) {
  const PictureType* const type = find_type(topic);
  return type != nullptr &&
         (type->form == PictureForm::raw || type->form == PictureForm::foxglove_raw);
}

PictureMessage read_picture_message(MessageBytes bytes, const RecordedTopic& topic) {
  const PictureType* const type = find_type(topic);
  if (type == nullptr) throw ContractError("type of a picture", topic.type, picture_types);
  if (type->is_protobuf) return read_protobuf(bytes, *type);
  PictureMessage message;
  switch (type->form) {
    case PictureForm::raw:
      message.raw = ros::read_message<ros::Image>(bytes, topic.encoding);
      message.stamp_ns = message.raw->header.stamp_ns;
      break;
    case PictureForm::compressed:
      message.file = ros::read_message<ros::CompressedImage>(bytes, topic.encoding);
      message.stamp_ns = message.file.header.stamp_ns;
      break;
    case PictureForm::foxglove_raw: {
      auto read = ros::read_message<ros::FoxgloveRawImage>(bytes, topic.encoding);
      ros::Image& raw = message.raw.emplace();
      raw.height = read.height;
      raw.width = read.width;
      raw.encoding = std::move(read.encoding);
      raw.step = read.step;
      raw.data = read.data;
      message.stamp_ns = read.stamp_ns;
      break;
    }
    case PictureForm::foxglove_compressed: {
      auto read = ros::read_message<ros::FoxgloveCompressedImage>(bytes, topic.encoding);
      message.file.format = std::move(read.format);
      message.file.data = read.data;
      message.stamp_ns = read.stamp_ns;
      break;
    }
    case PictureForm::packet: {
      auto read = ros::read_message<ros::FfmpegPacket>(bytes, topic.encoding);
      message.file.format = std::move(read.encoding);
      message.file.data = read.data;
      message.stamp_ns = read.header.stamp_ns;
      break;
    }
  }
  return message;
}

Image to_image(const PictureMessage& message, std::string_view name) {
  return message.raw ? ros::to_image(*message.raw) : ros::to_image(message.file, name);
}

std::string describe_picture(const PictureMessage& message) {
  if (!message.raw) return message.file.format;
  return std::to_string(message.raw->width) + " x " + std::to_string(message.raw->height) + " " +
         message.raw->encoding;
}

}  // namespace panonav::recordings
