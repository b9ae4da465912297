// Pictures of Foxglove, and packets of videos as messages.
#include "panonav_recordings/recorded_dataset.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/image_file.hpp"
#include "support/picture_samples.hpp"
#include "support/recorded_messages.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::recordings {
using namespace testing;
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::int64_t packet_ns = 100'000'000;
constexpr std::int64_t first_packet_ns = 1'700'000'000'000'000'000;
const PictureSource whole_sphere{.kind = PictureKind::equirectangular};

// Fields of protobuf: a key (number and wire type), then a number or a length and bytes.
void add_varint(Bytes& to, std::uint64_t value) {
  for (; value > 127; value >>= 7U) to.push_back(static_cast<std::uint8_t>(value | 128U));
  to.push_back(static_cast<std::uint8_t>(value));
}
void add_number(Bytes& to, std::uint64_t field, std::uint64_t value) {
  add_varint(to, field << 3U);
  add_varint(to, value);
}
void add_fixed32(Bytes& to, std::uint64_t field, std::uint32_t value) {
  add_varint(to, field << 3U | 5U);
  for (unsigned shift = 0; shift < 32; shift += 8)
    to.push_back(static_cast<std::uint8_t>(value >> shift));
}
void add_bytes(Bytes& to, std::uint64_t field, std::span<const std::uint8_t> bytes) {
  add_varint(to, field << 3U | 2U);
  add_varint(to, bytes.size());
  to.insert(to.end(), bytes.begin(), bytes.end());
}
void add_text(Bytes& to, std::uint64_t field, std::string_view text) {
  add_bytes(to, field, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}
Bytes protobuf_head() {
  Bytes time;
  add_number(time, 1, 1'700'000'000);
  add_number(time, 2, 250'000'000);
  Bytes message;
  add_bytes(message, 1, time);
  return message;
}

TEST(RecordedProtobuf, PicturesOfFoxgloveAreRead) {
  Random random(9);
  const Image image = random_image(random, 8, 4, 3);
  Bytes raw = protobuf_head();
  add_fixed32(raw, 2, 8);
  add_fixed32(raw, 3, 4);
  add_text(raw, 4, "rgb8");
  add_fixed32(raw, 5, 24);
  add_bytes(raw, 6, image.pixels());
  add_text(raw, 7, "camera");
  add_number(raw, 99, 1'000'000);  // of a later version
  Bytes compressed = protobuf_head();
  add_bytes(compressed, 2, encode_png(image.view()));
  add_text(compressed, 3, "png");
  for (const auto& [type, bytes] :
       {std::pair{"foxglove.RawImage", raw}, {"foxglove.CompressedImage", compressed}}) {
    SCOPED_TRACE(type);
    const auto recorded = std::make_shared<testing::RecordedMessages>(MessageEncoding::protobuf);
    recorded->add("/camera", type, first_packet_ns, bytes);
    const Dataset dataset = read_recording(recorded, "drive.mcap", whole_sphere);
    ASSERT_EQ(dataset.entries.size(), 1U);
    EXPECT_EQ(dataset.entries[0].file, "1700000000_250000000");
    EXPECT_EQ(read_picture(dataset.entries[0]), image);
    // Whatever a message is cut to, or its bytes are changed to, gives a picture or one line.
    for (std::size_t i = 0; i < 2 * bytes.size(); ++i) {
      Bytes damaged(bytes.begin(),
                    bytes.begin() + static_cast<std::ptrdiff_t>(std::min(i, bytes.size())));
      if (i >= bytes.size())
        damaged[i - bytes.size()] ^= static_cast<std::uint8_t>(1 + random.index(255));
      const auto broken = std::make_shared<testing::RecordedMessages>(MessageEncoding::protobuf);
      broken->add("/camera", type, first_packet_ns, damaged);
      try {
        const Dataset opened = read_recording(broken, "drive.mcap", whole_sphere);
        (void)read_picture(opened.entries.at(0));
      } catch (const FileError& error) {
        EXPECT_EQ(std::string_view(error.what()).find('\n'), std::string_view::npos);
      }
    }
  }
}

TEST(RecordedProtobuf, TopicsThatCannotBeReadAreNamedWithTheirSerialisation) {
  const auto recorded = std::make_shared<testing::RecordedMessages>(MessageEncoding::protobuf);
  recorded->add("/lidar", "foxglove.PointCloud", 0, {});
  const std::string line =
      message_of<FileError>([&] { (void)read_recording(recorded, "drive.mcap", whole_sphere); });
  EXPECT_TRUE(contains(line, "drive.mcap: has no images that can be read (")) << line;
  EXPECT_TRUE(contains(line, "its topics: /lidar (foxglove.PointCloud as protobuf)")) << line;
}

/// Pictures of noise, coded as H.264 without loss and cut into the packets of pictures.
std::vector<Bytes> encode_h264(const TemporaryFolder& folder, const std::vector<Image>& images) {
  for (std::size_t i = 0; i < images.size(); ++i)
    write_png(folder / ("n" + std::to_string(i) + ".png"), images[i].view());
  const std::string command =
      "ffmpeg -nostdin -v error -framerate 10 -i " +
      quote_for_shell((folder / "n%d.png").string()) +
      " -c:v libx264rgb -qp 0 -g 4 -bf 0 -x264-params aud=1:scenecut=0 -f h264 " +
      quote_for_shell((folder / "n.h264").string());
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  const std::string stream = bytes_of(folder / "n.h264");
  std::vector<Bytes> packets;
  const std::string delimiter("\0\0\0\1\x09", 5);
  for (std::size_t begin = 0; begin < stream.size();) {
    const std::size_t end = std::min(stream.find(delimiter, begin + 1), stream.size());
    packets.emplace_back(stream.begin() + static_cast<std::ptrdiff_t>(begin),
                         stream.begin() + static_cast<std::ptrdiff_t>(end));
    begin = end;
  }
  return packets;
}

TEST(RecordedVideoPackets, AreDecodedAsPicturesWithTheStampsOfTheirMessages) {
  const TemporaryFolder folder;
  Random random(4);
  std::vector<Image> images;
  for (int i = 0; i < 10; ++i) images.push_back(random_image(random, 64, 32, 3));
  const auto packets = encode_h264(folder, images);
  ASSERT_EQ(packets.size(), images.size());
  for (const std::string type : {"sensor_msgs/CompressedImage", "foxglove_msgs/CompressedVideo",
                                 "ffmpeg_image_transport_msgs/FFMPEGPacket"}) {
    SCOPED_TRACE(type);
    const auto recorded = std::make_shared<testing::RecordedMessages>(MessageEncoding::cdr);
    // The recording begins within a group of pictures.
    for (std::size_t i = 1; i < packets.size(); ++i) {
      const std::int64_t ns = first_packet_ns + static_cast<std::int64_t>(i) * packet_ns;
      Bytes bytes = ros::write_message(ros::CompressedImage{{ns, ""}, "h264", packets[i]});
      if (type.starts_with("foxglove"))
        bytes = ros::write_message(ros::FoxgloveCompressedImage{ns, "", packets[i], "h264"});
      if (type.starts_with("ffmpeg"))
        bytes = ros::write_message(
            ros::FfmpegPacket{{ns, ""}, 64, 32, "libx264;rgb24", 0, 0, 0, packets[i]});
      recorded->add("/camera", type, ns, bytes);
    }
    const Dataset dataset = read_recording(recorded, "drive.mcap", whole_sphere);
    ASSERT_EQ(dataset.entries.size(), 6U);
    ASSERT_EQ(dataset.warnings.size(), 1U);
    EXPECT_TRUE(contains(dataset.warnings[0], "3 packets of the video come before its first key"));
    for (const std::size_t i : {0U, 1U, 2U, 3U, 4U, 5U, 2U, 5U}) {
      EXPECT_EQ(dataset.entries[i].file, "1700000000_" + std::to_string(i + 4) + "00000000");
      EXPECT_EQ(read_picture(dataset.entries[i]), images[i + 4]) << i;
      EXPECT_EQ(dataset.entries[i].store->encoded(i), std::nullopt);
    }
  }
}

}  // namespace
}  // namespace panonav::recordings
