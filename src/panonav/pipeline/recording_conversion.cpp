#include "panonav/pipeline/recording_conversion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/temporary_file.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/mcap_writer.hpp"
#include "panonav/io/ros_messages.hpp"
#include "panonav/pipeline/internal/unfinished_folder.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

/// What all pictures have.
RecordingConversion common_to_all(const Dataset& dataset) {
  const auto all = [&](const auto& has) { return std::ranges::all_of(dataset.entries, has); };
  RecordingConversion done{.pictures = dataset.entries.size()};
  done.stamps = all([](const auto& e) { return e.stamp_s.has_value(); });
  done.odometry = all([](const auto& e) { return e.odometry.has_value(); });
  done.positions = all([](const auto& e) { return e.pose.has_value(); });
  done.headings =
      done.positions && all([](const auto& e) { return e.pose->heading_rad.has_value(); });
  done.tilts = all([](const auto& e) { return e.tilt.has_value(); });
  return done;
}

/// Messages of one type on one topic of an MCAP file.
template <class Message>
class Topic {
 public:
  Topic(McapWriter& writer, std::string topic) : writer_(&writer), name_(std::move(topic)) {}
  void write(std::int64_t log_ns, std::int64_t stamp_ns, const Message& message) {
    if (!channel_) {
      const std::string_view type = Message::type;
      channel_ = writer_->add_channel(
          name_, "cdr",
          writer_->add_schema(ros::ros2_type_name(type), "ros2msg", ros::ros2_schema(type)));
    }
    writer_->write(*channel_, log_ns, stamp_ns, ros::write_message(message));
  }

 private:
  McapWriter* writer_;
  std::string name_;
  std::optional<std::uint16_t> channel_;
};

/// The stamp comes back as it was: the whole seconds are exact, and of the rest what a double
/// cannot hold is dropped, 1700000003.3 is no 1700000003.299999952.
std::int64_t nanoseconds(double stamp_s) {
  require(stamp_s >= 0.0 && stamp_s < 0x1p31, "stamp_s", stamp_s, "0 <= stamp_s < 2147483648");
  constexpr double second_ns = 1e9;
  const double whole = std::floor(stamp_s);
  const double rest_us = std::round((stamp_s - whole) * 1e6);
  const double rest_ns = std::round((stamp_s - whole) * second_ns);
  const bool is_whole_us = whole + rest_us / 1e6 == stamp_s;
  return std::llround(whole) * std::int64_t{1'000'000'000} +
         std::llround(is_whole_us ? 1e3 * rest_us : rest_ns);
}

}  // namespace

RecordingConversion convert_to_recording(const Dataset& dataset, const fs::path& file,
                                         const std::function<void()>& advance) {
  RecordingConversion done = common_to_all(dataset);
  TemporaryFile unfinished(file);
  // JPEG and PNG are packed already.
  McapWriter writer(unfinished.path(), {.compression = McapCompression::none});
  Topic<ros::CompressedImage> pictures(writer, "/camera/image/compressed");
  Topic<ros::Odometry> odometry(writer, "/odom");
  Topic<ros::Imu> imu(writer, "/imu");
  Topic<ros::PoseStamped> poses(writer, "/ground_truth");
  Topic<ros::PointStamped> positions(writer, "/ground_truth");
  std::int64_t log_ns = 0;
  for (std::size_t i = 0; i < dataset.entries.size(); ++i) {
    const DatasetEntry& entry = dataset.entries[i];
    const std::int64_t ns = nanoseconds(done.stamps ? *entry.stamp_s : static_cast<double>(i));
    log_ns = std::max(log_ns, ns);  // readers go by it, and the order of pictures stays
    if (entry.odometry) {
      ros::Odometry message{{ns, "odom"}, "base_link", {ros::pose_of(*entry.odometry), {}},
                            {},           {},          {}};
      odometry.write(log_ns, ns, message);
    }
    if (entry.tilt) {
      ros::Imu message;
      message.header = {ns, "base_link"};
      message.orientation = ros::pose_of({}, *entry.tilt).orientation;
      message.angular_velocity_covariance[0] = -1.0;
      message.linear_acceleration_covariance[0] = -1.0;
      imu.write(log_ns, ns, message);
    }
    if (entry.pose && done.headings) {
      poses.write(log_ns, ns,
                  {{ns, "world"},
                   ros::pose_of({entry.pose->x_m, entry.pose->y_m, *entry.pose->heading_rad})});
    } else if (entry.pose) {
      positions.write(log_ns, ns, {{ns, "world"}, {entry.pose->x_m, entry.pose->y_m, 0.0}});
    }
    const auto bytes = read_encoded_picture(entry);
    pictures.write(log_ns, ns,
                   {{ns, "camera"},
                    image_format(bytes, entry.file) == ImageFormat::png ? "png" : "jpeg",
                    bytes});
    if (advance) advance();
  }
  writer.close();
  std::error_code error;
  fs::rename(unfinished.path(), file, error);
  if (error) throw FileError(file.string(), "cannot be written: " + error.message());
  unfinished.keep();
  return done;
}

RecordingConversion convert_to_dataset(const Dataset& recording, const fs::path& folder,
                                       const std::function<void()>& advance) {
  const RecordingConversion done = common_to_all(recording);
  UnfinishedFolder unfinished(folder);
  Dataset dataset = recording;
  dataset.folder = unfinished.path();
  for (DatasetEntry& entry : dataset.entries) {
    const auto bytes = read_encoded_picture(entry);
    entry.file += image_format(bytes, entry.file) == ImageFormat::png ? ".png" : ".jpg";
    write_file(dataset.folder / entry.file, bytes);
    if (!done.stamps) entry.stamp_s.reset();
    if (!done.odometry) entry.odometry.reset();
    if (!done.positions) entry.pose.reset();
    if (entry.pose && !done.headings) entry.pose->heading_rad.reset();
    if (!done.tilts) entry.tilt.reset();
    if (advance) advance();
  }
  write_dataset(dataset);
  unfinished.finish();
  return done;
}

}  // namespace panonav
