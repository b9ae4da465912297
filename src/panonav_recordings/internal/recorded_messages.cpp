#include "panonav_recordings/internal/recorded_messages.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/internal/picture_messages.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

using MessageBytes = std::span<const std::uint8_t>;

/// Limits of memory against hostile recordings: 80 bytes for each message and 400 for each picture.
constexpr std::size_t max_samples = 10'000'000;
constexpr std::size_t max_pictures = 1'000'000;  // nine hours at 30 Hz
/// Frame of the robot on the ground [REP 105, REP 120].
constexpr std::string_view other_base = "base_footprint";

/// Sorts the messages of one pass into tracks.
class MessageCollector {
 public:
  MessageCollector(const std::filesystem::path& path, const Recording& recording,
                   const TopicChoice& choice)
      : path_(path), recording_(recording), choice_(choice) {
    if (choice.frames) {
      made_.chain.emplace(choice.frames->first, choice.frames->second);
      if (!choice.frames_are_named) chain_without_link_.emplace(choice.frames->first, other_base);
    }
    made_.warnings = choice.warnings;
  }

  /// Adds a message; one that cannot be read is counted.
  void add(const MessageLocation& location, MessageBytes bytes) {
    try {
      add_by_role(location, bytes);
    } catch (const ContractError& error) {
      if (unreadable_++ == 0) first_error_ = error.what();
      return;
    }
    if (made_.pictures.size() > max_pictures) {
      throw FileError(path_.string(), "has more than " + std::to_string(max_pictures) +
                                          " images; allowed: as many");
    }
    if (samples_ > max_samples) {
      throw FileError(path_.string(), "has more than " + std::to_string(max_samples) +
                                          " messages of odometry, transforms and inertial sensors");
    }
  }

  [[nodiscard]] RecordedMessages finish() {
    if (unreadable_ > 0) {
      warn("left out: " + format_count(unreadable_, "message") +
           " that cannot be read; the first: " + first_error_);
    }
    drop_chain_unless_connected();
    if (packets_without_picture_ > 0) {
      warn(std::to_string(packets_without_picture_) +
           " packets of the video come before its first key frame, or have no image, and are left "
           "out");
    }
    if (made_.pictures.empty()) {
      throw FileError(path_.string(), "none of its images can be read: " + first_error_);
    }
    return std::move(made_);
  }

 private:
  void warn(std::string line) { made_.warnings.push_back(std::move(line)); }

  void drop_chain_unless_connected() {
    auto& chain = made_.chain;
    if (!chain) return;
    if (!chain->is_connected() && chain_without_link_ && chain_without_link_->is_connected())
      chain = std::move(chain_without_link_);
    if (chain->ignored_transform_count() > 0) {
      warn(std::to_string(chain->ignored_transform_count()) +
           " transforms give a frame another parent than before and are left out");
    }
    if (chain->is_connected()) return;
    if (choice_.frames_are_named) {
      const auto& [top, bottom] = *choice_.frames;
      throw FileError(path_.string(), "no transforms lead from " + to_readable_line(top) + " to " +
                                          to_readable_line(bottom) +
                                          "; it has: " + chain->list_transforms());
    }
    if (!chain->moving_tracks().empty()) {
      warn("no odometry: no transforms lead from " + choice_.frames->first + " to " +
           choice_.frames->second + " or " + std::string(other_base) + "; it has: " +
           chain->list_transforms() + "; choose two frames with the option odometry_frames");
    }
    chain.reset();
  }

  void add_by_role(const MessageLocation& location, MessageBytes bytes) {
    switch (choice_.roles[location.topic]) {
      case TopicRole::none:
        break;
      case TopicRole::picture:
        add_picture(location, bytes);
        break;
      case TopicRole::odometry:
        add_odometry(location, bytes);
        break;
      case TopicRole::transforms:
        add_transforms(location, bytes);
        break;
      case TopicRole::tilt:
        add_orientation(location, bytes);
        break;
      case TopicRole::truth:
        add_truth(location, bytes);
        break;
    }
  }

  [[nodiscard]] const RecordedTopic& topic_of(const MessageLocation& location) const {
    return recording_.topics()[location.topic];
  }
  [[nodiscard]] static RecordedTimes times(const MessageLocation& location,
                                           const ros::Header& header) {
    return {location.time_ns, header.stamp_ns, storage_order(location)};
  }
  template <class Message>
  [[nodiscard]] Message read(const MessageLocation& location, MessageBytes bytes) const {
    return ros::read_message<Message>(bytes, topic_of(location).encoding);
  }

  void add_picture(const MessageLocation& location, MessageBytes bytes) {
    const PictureMessage message = read_picture_message(bytes, topic_of(location));
    if (!message.raw) return add_picture_file(location, message);
    const auto size = std::pair{message.raw->width, message.raw->height};
    if (made_.pictures.empty()) made_.first_size = size;
    if (made_.first_size != size) ++made_.differing_size_count;
    made_.pictures.push_back({location, message.stamp_ns});
  }

  /// Adds a JPEG or PNG file, or a packet of a video. All messages must be of the first one's kind.
  void add_picture_file(const MessageLocation& location, const PictureMessage& message) {
    const auto codec = find_video_codec(message.file.format);
    if (made_.pictures.empty() && !made_.video && codec)
      made_.video = std::make_unique<RecordedVideo>(*codec, path_.string());
    if (codec.has_value() != (made_.video != nullptr)) {
      throw ContractError("format of a picture", to_readable_line(message.file.format),
                          "packets of a video, or pictures, not both");
    }
    if (made_.video && !made_.video->add(message.file.data)) {
      ++packets_without_picture_;
      return;
    }
    made_.pictures.push_back({location, message.stamp_ns, video_pictures_++});
  }

  void add_odometry(const MessageLocation& location, MessageBytes bytes) {
    const auto message = read<ros::Odometry>(location, bytes);
    made_.odometry.add(times(location, message.header), message.pose.pose);
    ++samples_;
  }

  void add_transforms(const MessageLocation& location, MessageBytes bytes) {
    const bool is_static = topic_of(location).name.ends_with("tf_static");
    for (const auto& each : read<ros::TFMessage>(location, bytes).transforms) {
      made_.chain->add(each, times(location, each.header), is_static);
      if (made_.chain->is_connected()) chain_without_link_.reset();
      if (chain_without_link_)
        chain_without_link_->add(each, times(location, each.header), is_static);
      ++samples_;
    }
  }

  void add_orientation(const MessageLocation& location, MessageBytes bytes) {
    const auto message = read<ros::Imu>(location, bytes);
    const auto& [x, y, z, w] = message.orientation;
    const double length = std::sqrt(x * x + y * y + z * z + w * w);
    const bool is_stated = message.orientation_covariance[0] != -1.0 &&
                           std::abs(length - 1.0) <= ros::quaternion_tolerance;
    if (!is_stated) {
      ++made_.imu_without_orientation_count;
      return;
    }
    made_.orientation.add(times(location, message.header), {{}, message.orientation});
    ++samples_;
  }

  void add_truth(const MessageLocation& location, MessageBytes bytes) {
    if (topic_of(location).type == ros::PoseStamped::type) {
      const auto message = read<ros::PoseStamped>(location, bytes);
      made_.truth.add(times(location, message.header), message.pose);
    } else {
      const auto message = read<ros::PointStamped>(location, bytes);
      made_.truth_has_headings = false;
      made_.truth.add(times(location, message.header), {message.point, {}});
    }
    ++samples_;
  }

  const std::filesystem::path& path_;
  const Recording& recording_;
  const TopicChoice& choice_;
  RecordedMessages made_;
  /// The chain to `other_base`, for robots without the default frame of the robot.
  std::optional<TransformChain> chain_without_link_;
  std::size_t samples_ = 0;  ///< stored poses and transforms; pictures are not included
  std::size_t unreadable_ = 0;
  std::size_t video_pictures_ = 0;
  std::size_t packets_without_picture_ = 0;
  std::string first_error_;
};

}  // namespace

void RecordedMessages::sort() {
  const bool has_stamps =
      std::ranges::any_of(pictures, [](const RecordedPicture& each) { return each.stamp_ns != 0; });
  const bool use_log_times = !has_stamps || !odometry.has_stamps() || !orientation.has_stamps() ||
                             !truth.has_stamps() || (chain && !chain->has_stamps());
  if (use_log_times)
    warnings.emplace_back("headers without stamps: the times of recording are used instead");
  std::vector<std::pair<std::string, RecordedTrack*>> tracks{
      {"odometry", &odometry}, {"inertial sensor", &orientation}, {"true poses", &truth}};
  if (chain) std::ranges::move(chain->moving_tracks(), std::back_inserter(tracks));
  std::vector<TimedStream> streams(1);
  for (const RecordedPicture& each : pictures) {
    streams[0].times.push_back(
        {each.location.time_ns, each.stamp_ns, storage_order(each.location)});
  }
  for (const auto& [name, track] : tracks) streams.push_back(track->times(name));
  std::ranges::move(unify_clocks(streams, use_log_times), std::back_inserter(warnings));
  for (std::size_t i = 0; i < tracks.size(); ++i) tracks[i].second->sort(streams[i + 1].times);
  std::ranges::stable_sort(
      pictures, {}, [](const RecordedPicture& each) { return storage_order(each.location); });
  for (std::size_t i = 0; i < pictures.size(); ++i)
    pictures[i].stamp_ns = streams[0].times[i].stamp_ns;
  order_pictures_by_stamps();
}

void RecordedMessages::order_pictures_by_stamps() {
  const std::string of_all = " of " + format_count(pictures.size(), "image") + " ";
  std::size_t late = 0;
  std::int64_t latest_ns = std::numeric_limits<std::int64_t>::min();
  for (const RecordedPicture& each : pictures) {
    if (each.stamp_ns < latest_ns) ++late;
    latest_ns = std::max(latest_ns, each.stamp_ns);
  }
  if (late > 0) {
    warnings.push_back(std::to_string(late) + of_all +
                       "were recorded late; all are used in the order of their stamps");
  }
  std::ranges::stable_sort(pictures, {}, &RecordedPicture::stamp_ns);
  const auto repeated = std::unique(
      pictures.begin(), pictures.end(),
      [](const RecordedPicture& a, const RecordedPicture& b) { return a.stamp_ns == b.stamp_ns; });
  if (repeated == pictures.end()) return;
  warnings.push_back(std::to_string(std::distance(repeated, pictures.end())) + of_all +
                     "have the stamp of another image; the first image of each stamp is used");
  pictures.erase(repeated, pictures.end());
}

std::optional<ros::Pose> RecordedMessages::odometry_at(std::int64_t ns) const {
  return chain ? chain->at(ns) : odometry.at(ns);
}

std::optional<TimeSpan> RecordedMessages::odometry_span() const {
  return chain ? chain->span() : odometry.span();
}

RecordedMessages collect_messages(const std::filesystem::path& path, const Recording& recording,
                                  const TopicChoice& choice) {
  MessageCollector collector(path, recording, choice);
  recording.for_each(choice.topics, {}, [&](const MessageLocation& location, MessageBytes bytes) {
    collector.add(location, bytes);
  });
  return collector.finish();
}

}  // namespace panonav::recordings
