#include "panonav_recordings/recorded_dataset.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/internal/picture_messages.hpp"
#include "panonav_recordings/internal/recorded_messages.hpp"
#include "panonav_recordings/internal/recorded_topics.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

namespace fs = std::filesystem;
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
  /// `locations` are those of messages of topics of pictures.
  RecordedPictures(fs::path path, std::shared_ptr<const Recording> recording,
                   std::vector<MessageLocation> locations)
      : path_(std::move(path)),
        recording_(std::move(recording)),
        locations_(std::move(locations)) {}
  [[nodiscard]] Image read(std::size_t index) const override;
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> encoded(std::size_t index) const override;

 private:
  [[nodiscard]] const RecordedTopic& topic_of(std::size_t index) const {
    return recording_->topics()[locations_.at(index).topic];
  }
  fs::path path_;
  std::shared_ptr<const Recording> recording_;
  std::vector<MessageLocation> locations_;
};

Image RecordedPictures::read(std::size_t index) const {
  const MessageLocation& location = locations_.at(index);
  const auto bytes = recording_->read(location);
  const std::string name =
      path_.string() + ": image at " + to_text(to_seconds(location.time_ns)) + " s";
  try {
    return to_image(read_picture_message(bytes, topic_of(index)), name);
  } catch (const ContractError& error) {
    throw FileError(name, error.what());
  }
}

std::optional<std::vector<std::uint8_t>> RecordedPictures::encoded(std::size_t index) const {
  if (is_raw_picture_topic(topic_of(index))) return std::nullopt;
  const auto bytes = recording_->read(locations_.at(index));
  try {
    const auto data = read_picture_message(bytes, topic_of(index)).file.data;
    return std::vector<std::uint8_t>(data.begin(), data.end());
  } catch (const ContractError& error) {
    throw FileError(path_.string(), error.what());
  }
}

/// The pictures of a video whose packets are messages.
class PicturesOfVideo : public PictureStore {
 public:
  explicit PicturesOfVideo(std::unique_ptr<RecordedVideo> video)
      : video_(std::move(video)), pictures_(video_->pictures()) {}
  [[nodiscard]] Image read(std::size_t index) const override { return pictures_->read(index); }

 private:
  std::unique_ptr<RecordedVideo> video_;  // outlives its pictures
  std::shared_ptr<const PictureStore> pictures_;
};

/// Makes the entry of each image, in order, and counts missing fields.
class EntryMaker {
 public:
  explicit EntryMaker(const RecordedMessages& messages)
      : messages_(messages), odometry_span_(messages.odometry_span()) {}

  [[nodiscard]] DatasetEntry make(const RecordedPicture& picture) {
    const std::int64_t ns = picture.stamp_ns;
    DatasetEntry entry;
    entry.file = make_name_from_stamp(ns);
    entry.stamp_s = to_seconds(ns);
    set_odometry(entry, ns);
    set_tilt(entry, ns);
    set_truth(entry, ns);
    return entry;
  }

  void append_warnings(std::vector<std::string>& warnings) const {
    const std::string of_all = " of " + format_count(messages_.pictures.size(), "image");
    const auto warn_if_any = [&](std::size_t count, const std::string& what) {
      if (count > 0) warnings.push_back(std::to_string(count) + what);
    };
    const auto& [width, height] = messages_.first_size;
    warn_if_any(messages_.differing_size_count, of_all + " are not of the size of the first, " +
                                                    std::to_string(width) + " x " +
                                                    std::to_string(height) + " px");
    if (odometry_span_) {
      std::string where;
      for (const auto& [count, what] : {std::pair{before_odometry_, "before its first message"},
                                        {in_pauses_, "in pauses of more than a second"},
                                        {after_odometry_, "after its last message"}}) {
        if (count == 0) continue;
        where += (where.empty() ? ": " : ", ") + std::to_string(count) + " " + what;
      }
      warn_if_any(before_odometry_ + in_pauses_ + after_odometry_,
                  of_all + " have no odometry" + where);
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
  void set_odometry(DatasetEntry& entry, std::int64_t ns) {
    if (const auto pose = messages_.odometry_at(ns)) {
      entry.odometry = ros::to_pose2(*pose);
    } else if (odometry_span_) {
      const bool is_before = ns < odometry_span_->begin_ns;
      ++(is_before ? before_odometry_ : ns > odometry_span_->end_ns ? after_odometry_ : in_pauses_);
    }
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
  std::optional<TimeSpan> odometry_span_;
  std::size_t before_odometry_ = 0;
  std::size_t in_pauses_ = 0;
  std::size_t after_odometry_ = 0;
  std::size_t without_tilt_ = 0;
  std::size_t too_tilted_ = 0;
};

}  // namespace

Dataset read_recording(const fs::path& path, PictureSource source,
                       const InputOptions::Topics& topics) {
  return read_recording(Recording::open(path), path, std::move(source), topics);
}

Dataset read_recording(std::shared_ptr<const Recording> recording, const fs::path& path,
                       PictureSource source, const InputOptions::Topics& topics) {
  RecordedMessages messages =
      collect_messages(path, *recording, choose_topics(*recording, path, topics, source));
  messages.sort();
  std::vector<MessageLocation> locations;
  for (const RecordedPicture& picture : messages.pictures) locations.push_back(picture.location);
  const bool is_video = messages.video != nullptr;
  std::shared_ptr<const PictureStore> store;
  if (is_video) {
    store = std::make_shared<const PicturesOfVideo>(std::move(messages.video));
  } else {
    store = std::make_shared<const RecordedPictures>(path, recording, std::move(locations));
  }

  Dataset opened;
  opened.folder = path;
  opened.source = std::move(source);
  EntryMaker maker(messages);
  for (const RecordedPicture& picture : messages.pictures) {
    DatasetEntry& entry = opened.entries.emplace_back(maker.make(picture));
    entry.path = path;
    entry.store = store;
    entry.store_index = is_video ? picture.video_index : opened.entries.size() - 1;
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
    if (!is_picture_topic(topics[i])) continue;
    try {
      const auto bytes = recording->read(locations.front());
      const PictureMessage message = read_picture_message(bytes, topics[i]);
      each.shows = to_readable_line(describe_picture(message));
      if (message.raw || !find_video_codec(message.file.format))
        each.size = to_image(message, topics[i].name).size();
    } catch (const Error& error) {
      if (!each.shows) each.shows = to_readable_line(error.what());
    }
  }
  std::ranges::stable_sort(summary.topics, {},
                           [](const TopicSummary& each) { return each.topic.name; });
  summary.time = recording->time();
  summary.warnings = recording->warnings();
  return summary;
}

}  // namespace panonav::recordings
