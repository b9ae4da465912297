#include "panonav_recordings/recorded_dataset.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <unordered_set>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/internal/recorded_messages.hpp"
#include "panonav_recordings/internal/recorded_topics.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

namespace fs = std::filesystem;
using MessageBytes = std::span<const std::uint8_t>;

constexpr std::int64_t second_ns = 1'000'000'000;

std::string make_name_from_stamp(std::int64_t ns) {
  const std::string fraction =
      std::to_string(second_ns + ((ns % second_ns) + second_ns) % second_ns);
  const std::int64_t seconds = ns / second_ns - (ns % second_ns < 0 ? 1 : 0);
  return std::to_string(seconds) + "_" + fraction.substr(1);
}

/// Converts whole seconds and the rest separately, so that a stamp in seconds survives a round
/// trip.
double to_seconds(std::int64_t ns) {
  return static_cast<double>(ns / second_ns) +
         static_cast<double>(ns % second_ns) / static_cast<double>(second_ns);
}

/// The pictures of one topic, read and decoded on demand.
class RecordedPictures : public PictureStore {
 public:
  /// `locations` are the locations of messages of the types sensor_msgs/Image and CompressedImage.
  RecordedPictures(fs::path path, std::shared_ptr<const Recording> recording,
                   std::vector<MessageLocation> locations);
  [[nodiscard]] Image read(std::size_t index) const override;
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> encoded(std::size_t index) const override;

 private:
  fs::path path_;
  std::shared_ptr<const Recording> recording_;
  std::vector<MessageLocation> locations_;
};

RecordedPictures::RecordedPictures(fs::path path, std::shared_ptr<const Recording> recording,
                                   std::vector<MessageLocation> locations)
    : path_(std::move(path)), recording_(std::move(recording)), locations_(std::move(locations)) {}

Image RecordedPictures::read(std::size_t index) const {
  const MessageLocation& location = locations_.at(index);
  const RecordedTopic& topic = recording_->topics()[location.topic];
  const auto bytes = recording_->read(location);
  const std::string name =
      path_.string() + ": image at " + to_text(to_seconds(location.time_ns)) + " s";
  try {
    if (topic.type == ros::Image::type) {
      return ros::to_image(ros::read_message<ros::Image>(bytes, topic.encoding));
    }
    return ros::to_image(ros::read_message<ros::CompressedImage>(bytes, topic.encoding), name);
  } catch (const ContractError& error) {
    throw FileError(name, error.what());
  }
}

std::optional<std::vector<std::uint8_t>> RecordedPictures::encoded(std::size_t index) const {
  const MessageLocation& location = locations_.at(index);
  const RecordedTopic& topic = recording_->topics()[location.topic];
  if (topic.type == ros::Image::type) return std::nullopt;
  const auto bytes = recording_->read(location);
  try {
    const auto message = ros::read_message<ros::CompressedImage>(bytes, topic.encoding);
    return std::vector<std::uint8_t>(message.data.begin(), message.data.end());
  } catch (const ContractError& error) {
    throw FileError(path_.string(), error.what());
  }
}

/// Makes the entry of each image, in order, and counts missing fields.
class EntryMaker {
 public:
  EntryMaker(const RecordedMessages& messages, bool use_log_times)
      : messages_(messages), use_log_times_(use_log_times) {}

  [[nodiscard]] DatasetEntry make(const RecordedPicture& picture) {
    const std::int64_t ns = use_log_times_ ? picture.location.time_ns : picture.stamp_ns;
    if (ns < previous_ns_) ++backward_;
    previous_ns_ = ns;
    DatasetEntry entry;
    entry.file = make_unique_name(ns);
    entry.stamp_s = to_seconds(ns);
    set_odometry(entry, ns);
    set_tilt(entry, ns);
    set_truth(entry, ns);
    return entry;
  }

  void append_warnings(std::vector<std::string>& warnings) const {
    const std::string of_all = " of " + std::to_string(messages_.pictures.size()) + " images";
    const auto warn_if_any = [&](std::size_t count, const std::string& what) {
      if (count > 0) warnings.push_back(std::to_string(count) + what);
    };
    const auto& [width, height] = messages_.first_size;
    if (backward_ > 0)
      warnings.push_back("stamps run back at " + std::to_string(backward_) + of_all);
    warn_if_any(messages_.differing_size_count, of_all + " are not of the size of the first, " +
                                                    std::to_string(width) + " x " +
                                                    std::to_string(height) + " px");
    if (messages_.chain || messages_.odometry.size() > 0) {
      warn_if_any(without_odometry_,
                  of_all +
                      " have no odometry: it begins later, ends before or pauses for more than a "
                      "second");
    }
    if (messages_.orientation.size() > 0) {
      warn_if_any(without_tilt_, of_all + " have no orientation near their stamps");
    }
    warn_if_any(too_tilted_,
                of_all +
                    " would be tilted by more than 30 degrees and are treated as level; the axes "
                    "of the inertial sensor must be x forward and z up");
    warn_if_any(messages_.imu_without_orientation_count,
                " messages of the inertial sensor state no orientation; roll and pitch are not "
                "guessed from accelerations");
  }

 private:
  [[nodiscard]] std::string make_unique_name(std::int64_t ns) {
    std::string name = make_name_from_stamp(ns);
    for (int copy = 2; !names_.insert(name).second; ++copy) {
      name = make_name_from_stamp(ns) + "_" + std::to_string(copy);
    }
    return name;
  }

  void set_odometry(DatasetEntry& entry, std::int64_t ns) {
    const auto pose = messages_.chain ? messages_.chain->at(ns) : messages_.odometry.at(ns);
    if (!pose) {
      ++without_odometry_;
      return;
    }
    entry.odometry = ros::to_pose2(*pose);
  }

  void set_tilt(DatasetEntry& entry, std::int64_t ns) {
    const auto pose = messages_.orientation.at(ns);
    if (!pose) {
      ++without_tilt_;
      return;
    }
    const Tilt tilt = ros::to_tilt(pose->orientation);
    if (std::abs(tilt.roll_rad) <= max_tilt_rad && std::abs(tilt.pitch_rad) <= max_tilt_rad) {
      entry.tilt = tilt;
    } else {
      ++too_tilted_;
    }
  }

  void set_truth(DatasetEntry& entry, std::int64_t ns) const {
    const auto pose = messages_.truth.at(ns);
    if (!pose) return;
    const Pose2 plane = ros::to_pose2(*pose);
    entry.pose = ReferencePose{plane.x_m, plane.y_m, std::nullopt};
    if (messages_.truth_has_headings) entry.pose->heading_rad = plane.heading_rad;
  }

  const RecordedMessages& messages_;
  bool use_log_times_;
  std::unordered_set<std::string> names_;
  std::int64_t previous_ns_ = std::numeric_limits<std::int64_t>::min();
  std::size_t backward_ = 0;  ///< pictures with a stamp before the previous one's
  std::size_t without_odometry_ = 0;
  std::size_t without_tilt_ = 0;
  std::size_t too_tilted_ = 0;
};

/// Describes a picture message: size and encoding, or the format of a compressed one.
std::string describe_picture(MessageBytes bytes, const RecordedTopic& topic) {
  if (topic.type == ros::CompressedImage::type) {
    return ros::read_message<ros::CompressedImage>(bytes, topic.encoding).format;
  }
  const auto message = ros::read_message<ros::Image>(bytes, topic.encoding);
  return std::to_string(message.width) + " x " + std::to_string(message.height) + " " +
         message.encoding;
}

}  // namespace

Dataset read_recording(const fs::path& path, PictureSource source,
                       const InputOptions::Topics& topics) {
  return read_recording(Recording::open(path), path, std::move(source), topics);
}

Dataset read_recording(std::shared_ptr<const Recording> recording, const fs::path& path,
                       PictureSource source, const InputOptions::Topics& topics) {
  RecordedMessages messages =
      collect_messages(path, *recording, choose_topics(*recording, path, topics, source));
  const bool use_log_times = messages.sort();
  std::vector<MessageLocation> locations;
  for (const RecordedPicture& picture : messages.pictures) locations.push_back(picture.location);
  const auto store =
      std::make_shared<const RecordedPictures>(path, recording, std::move(locations));

  Dataset opened;
  opened.folder = path;
  opened.source = std::move(source);
  EntryMaker maker(messages, use_log_times);
  for (const RecordedPicture& picture : messages.pictures) {
    DatasetEntry& entry = opened.entries.emplace_back(maker.make(picture));
    entry.path = path;
    entry.store = store;
    entry.store_index = opened.entries.size() - 1;
  }
  opened.warnings = recording->warnings();
  opened.warnings.insert(opened.warnings.end(), messages.warnings.begin(), messages.warnings.end());
  maker.append_warnings(opened.warnings);
  return opened;
}

RecordingSummary describe_recording(const fs::path& path) {
  const auto recording = Recording::open(path);
  RecordingSummary summary;
  const auto& topics = recording->topics();
  for (std::uint32_t i = 0; i < topics.size(); ++i) {
    TopicSummary& each = summary.topics.emplace_back();
    each.topic = topics[i];
    const auto locations = recording->locations(std::span(&i, 1));
    if (locations.empty()) continue;
    each.time = TimeSpan{locations.front().time_ns, locations.back().time_ns};
    const double span_s = to_seconds(each.time->end_ns - each.time->begin_ns);
    if (span_s > 0.0) each.rate_hz = static_cast<double>(locations.size() - 1) / span_s;
    if (!is_readable_picture_topic(topics[i])) continue;
    try {
      each.shows =
          to_readable_line(describe_picture(recording->read(locations.front()), topics[i]));
    } catch (const Error& error) {
      each.shows = to_readable_line(error.what());
    }
  }
  std::ranges::stable_sort(summary.topics, {},
                           [](const TopicSummary& each) { return each.topic.name; });
  summary.time = recording->time();
  summary.warnings = recording->warnings();
  return summary;
}

}  // namespace panonav::recordings
