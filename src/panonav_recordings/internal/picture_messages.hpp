#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "panonav_recordings/recording.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

/// Types of picture messages that can be read, for messages.
inline constexpr std::string_view picture_types =
    "sensor_msgs/Image, sensor_msgs/CompressedImage, foxglove RawImage, CompressedImage or "
    "CompressedVideo (protobuf or ROS), FFMPEGPacket";

/// True if messages of this type and serialisation can be read as pictures.
[[nodiscard]] bool is_picture_topic(const RecordedTopic& topic);
/// True if messages of this type are raw pixels, without compression.
[[nodiscard]] bool is_raw_picture_topic(const RecordedTopic& topic);

/// A message with a picture, or with a packet of a video. Bulk data points into the message.
struct PictureMessage {
  std::int64_t stamp_ns = 0;      ///< of the header; 0: none
  std::optional<ros::Image> raw;  ///< pixels; nullopt: `file`
  ros::CompressedImage file;      ///< JPEG, PNG or packet, and its format
};

/// Reads a message of a topic of pictures. Throws ContractError of one line if it is damaged.
[[nodiscard]] PictureMessage read_picture_message(std::span<const std::uint8_t> bytes,
                                                  const RecordedTopic& topic);

/// Decodes pixels or a picture file as `ros::to_image`; errors name `name`.
[[nodiscard]] Image to_image(const PictureMessage& message, std::string_view name);

/// Describes a picture: its size and encoding, or its format.
[[nodiscard]] std::string describe_picture(const PictureMessage& message);

}  // namespace panonav::recordings
