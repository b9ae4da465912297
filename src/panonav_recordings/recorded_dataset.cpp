#include "panonav_recordings/recorded_dataset.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <unordered_set>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/internal/recorded_track.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

namespace fs = std::filesystem;
using MessageBytes = std::span<const std::uint8_t>;

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::size_t max_samples = 10'000'000;
constexpr std::size_t max_pictures = 1'000'000;  // nine hours of 30 a second
constexpr std::string_view ground_truth = "/ground_truth";

bool is_picture_type(std::string_view type) {
  return type == ros::Image::type || type == ros::CompressedImage::type;
}
/// What a record of a run makes of the pictures of its camera.
bool is_made_of_pictures(std::string_view topic) {
  return topic == "/panorama/compressed" || topic == "/best_match/compressed";
}
bool is_odometry_type(std::string_view type) {
  return type == ros::Odometry::type;
}
bool is_imu_type(std::string_view type) {
  return type == ros::Imu::type;
}
bool is_transform_type(std::string_view type) {
  return type == ros::TFMessage::type || type == "tf/tfMessage";
}
bool is_pose_type(std::string_view type) {
  return type == ros::PoseStamped::type || type == ros::PointStamped::type;
}

using IsType = bool (*)(std::string_view);
using Topics = std::vector<std::uint32_t>;

bool readable(const RecordedTopic& topic, IsType is_type) {
  return topic.encoding != MessageEncoding::other && topic.messages > 0 && is_type(topic.type);
}

/// Those of one name and type; a topic may change its type on the way.
Topics topics_named(const Recording& recording, std::string_view name, IsType is_type) {
  Topics found;
  const auto& topics = recording.topics();
  for (std::uint32_t i = 0; i < topics.size(); ++i) {
    if (topics[i].name == name && readable(topics[i], is_type)) found.push_back(i);
  }
  return found;
}

std::vector<std::string> names_of(const Recording& recording, IsType is_type) {
  std::vector<std::string> names;
  for (const auto& topic : recording.topics()) {
    if (readable(topic, is_type)) names.push_back(topic.name);
  }
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : readable_line(shortened(text, 400));
}

/// The topic that the caller named, which must be there.
Topics wanted_topic(const Recording& recording, const fs::path& path, const std::string& name,
                    IsType is_type, std::string_view types) {
  Topics found = topics_named(recording, name, is_type);
  if (found.empty()) {
    const auto known = names_of(recording, is_type);
    throw FileError(path.string(), "has no topic " + readable_line(name) + " of " +
                                       std::string(types) + "; it has: " + listed(known));
  }
  return found;
}

std::string named_by_stamp(std::int64_t ns) {
  const std::string fraction =
      std::to_string(second_ns + ((ns % second_ns) + second_ns) % second_ns);
  const std::int64_t seconds = ns / second_ns - (ns % second_ns < 0 ? 1 : 0);
  return std::to_string(seconds) + "_" + fraction.substr(1);
}

/// Both parts are exact, so that a stamp in seconds survives the way there and back.
double seconds_of(std::int64_t ns) {
  return static_cast<double>(ns / second_ns) +
         static_cast<double>(ns % second_ns) / static_cast<double>(second_ns);
}

/// The pictures of one topic, read and decoded on demand.
class RecordedPictures : public PictureStore {
 public:
  /// `places` are those of messages of the types sensor_msgs/Image and CompressedImage.
  RecordedPictures(fs::path path, std::shared_ptr<const Recording> recording,
                   std::vector<MessagePlace> places);
  [[nodiscard]] Image read(std::size_t index) const override;
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> encoded(std::size_t index) const override;

 private:
  fs::path path_;
  std::shared_ptr<const Recording> recording_;
  std::vector<MessagePlace> places_;
};

RecordedPictures::RecordedPictures(fs::path path, std::shared_ptr<const Recording> recording,
                                   std::vector<MessagePlace> places)
    : path_(std::move(path)), recording_(std::move(recording)), places_(std::move(places)) {}

Image RecordedPictures::read(std::size_t index) const {
  const MessagePlace& place = places_.at(index);
  const RecordedTopic& topic = recording_->topics()[place.topic];
  const auto bytes = recording_->read(place);
  const std::string name =
      path_.string() + ": picture at " + to_text(seconds_of(place.time_ns)) + " s";
  try {
    if (topic.type == ros::Image::type) {
      return ros::picture_of(ros::read_message<ros::Image>(bytes, topic.encoding));
    }
    return ros::picture_of(ros::read_message<ros::CompressedImage>(bytes, topic.encoding), name);
  } catch (const ContractError& error) {
    throw FileError(name, error.what());
  }
}

std::optional<std::vector<std::uint8_t>> RecordedPictures::encoded(std::size_t index) const {
  const MessagePlace& place = places_.at(index);
  const RecordedTopic& topic = recording_->topics()[place.topic];
  if (topic.type == ros::Image::type) return std::nullopt;
  const auto bytes = recording_->read(place);
  try {
    const auto message = ros::read_message<ros::CompressedImage>(bytes, topic.encoding);
    return std::vector<std::uint8_t>(message.data.begin(), message.data.end());
  } catch (const ContractError& error) {
    throw FileError(path_.string(), error.what());
  }
}

struct Picture {
  MessagePlace place;
  std::int64_t stamp_ns = 0;
};

/// Everything that one pass over the messages collects.
class Collector {
 public:
  Collector(const fs::path& path, const Recording& recording, const PictureSource& source,
            const RecordingTopics& wanted)
      : path_(path), recording_(recording), jobs_(recording.topics().size()) {
    choose_pictures(wanted);
    choose_odometry(wanted);
    choose_tilt(wanted, source);
    use(topics_named(recording, std::string(ground_truth), is_pose_type), Job::truth);
  }

  void run() {
    recording_.for_each(topics_, {}, [&](const MessagePlace& place, MessageBytes bytes) {
      try {
        take(place, bytes);
      } catch (const ContractError& error) {
        if (unreadable_++ == 0) first_error_ = error.what();
        return;
      }
      if (pictures_.size() > max_pictures) {
        throw FileError(path_.string(), "has more than " + std::to_string(max_pictures) +
                                            " pictures; allowed: as many");
      }
      if (samples_ > max_samples) {
        throw FileError(path_.string(),
                        "has more than " + std::to_string(max_samples) +
                            " messages of odometry, transforms and inertial sensors");
      }
    });
    if (unreadable_ > 0) {
      warn(std::to_string(unreadable_) +
           " messages cannot be read and are left out; the first: " + first_error_);
    }
    if (chain_ && chain_->other_parents() > 0) {
      warn(std::to_string(chain_->other_parents()) +
           " transforms give a frame another parent than before and are left out");
    }
    if (chain_ && !chain_->connected()) {
      if (frames_named_) {
        throw FileError(path_.string(),
                        "no transforms lead from " + frames_text_ + "; it has: " + chain_->known());
      }
      chain_.reset();
    }
    if (pictures_.empty()) {
      throw FileError(path_.string(), "none of its pictures can be read: " + first_error_);
    }
  }

  RecordedDataset dataset(PictureSource source, std::shared_ptr<const Recording> recording) {
    const bool has_stamps =
        std::ranges::any_of(pictures_, [](const Picture& each) { return each.stamp_ns != 0; });
    const bool by_log = !has_stamps || !odometry_.has_stamps() || !orientation_.has_stamps() ||
                        !truth_.has_stamps() || (chain_ && !chain_->has_stamps());
    if (by_log) warn("headers without stamps: the times of recording serve instead");
    for (RecordedTrack* track : {&odometry_, &orientation_, &truth_}) track->sort(by_log);
    if (chain_) chain_->sort(by_log);

    RecordedDataset made;
    std::vector<MessagePlace> places;
    for (const Picture& picture : pictures_) places.push_back(picture.place);
    const auto pictures =
        std::make_shared<const RecordedPictures>(path_, std::move(recording), std::move(places));
    made.dataset.folder = path_;
    made.dataset.source = std::move(source);
    std::unordered_set<std::string> names;
    std::size_t back = 0;
    std::size_t without_odometry = 0;
    std::size_t without_tilt = 0;
    std::size_t tilted = 0;
    std::int64_t before_ns = std::numeric_limits<std::int64_t>::min();
    for (std::size_t i = 0; i < pictures_.size(); ++i) {
      const std::int64_t ns = by_log ? pictures_[i].place.time_ns : pictures_[i].stamp_ns;
      if (ns < before_ns) ++back;
      before_ns = ns;
      DatasetEntry entry;
      entry.file = named_by_stamp(ns);
      for (int copy = 2; !names.insert(entry.file).second; ++copy) {
        entry.file = named_by_stamp(ns) + "_" + std::to_string(copy);
      }
      entry.path = path_;
      entry.store = pictures;
      entry.store_index = i;
      entry.stamp_s = seconds_of(ns);
      if (const auto pose = chain_ ? chain_->at(ns) : odometry_.at(ns)) {
        entry.odometry = ros::planar(*pose);
      } else {
        ++without_odometry;
      }
      if (const auto pose = orientation_.at(ns)) {
        const Tilt tilt = ros::tilt_of(pose->orientation);
        if (std::abs(tilt.roll_rad) <= max_tilt_rad && std::abs(tilt.pitch_rad) <= max_tilt_rad) {
          entry.tilt = tilt;
        } else {
          ++tilted;
        }
      } else {
        ++without_tilt;
      }
      if (const auto pose = truth_.at(ns)) {
        const Pose2 plane = ros::planar(*pose);
        entry.pose = ReferencePose{plane.x_m, plane.y_m, std::nullopt};
        if (truth_has_headings_) entry.pose->heading_rad = plane.heading_rad;
      }
      made.dataset.entries.push_back(std::move(entry));
    }
    const std::string of_all = " of " + std::to_string(pictures_.size()) + " pictures";
    if (back > 0) warn("stamps run back at " + std::to_string(back) + of_all);
    if (other_sizes_ > 0) {
      warn(std::to_string(other_sizes_) + of_all + " are not of the size of the first, " +
           std::to_string(first_size_.first) + " x " + std::to_string(first_size_.second) + " px");
    }
    if (without_odometry > 0 && (chain_ || odometry_.size() > 0)) {
      warn(std::to_string(without_odometry) + of_all +
           " have no odometry: it begins later, ends before or pauses for more than a second");
    }
    if (without_tilt > 0 && orientation_.size() > 0) {
      warn(std::to_string(without_tilt) + of_all + " have no orientation near their stamps");
    }
    if (tilted > 0) {
      warn(
          std::to_string(tilted) + of_all +
          " would be tilted by more than 30 degrees and count as level; an inertial sensor that is "
          "not mounted x forward, z up cannot serve");
    }
    if (no_orientation_ > 0) {
      warn(std::to_string(no_orientation_) +
           " messages of the inertial sensor state no orientation; roll and pitch are not guessed "
           "from accelerations");
    }
    made.warnings = recording_.warnings();
    made.warnings.insert(made.warnings.end(), warnings_.begin(), warnings_.end());
    return made;
  }

 private:
  enum class Job { none, picture, odometry, transforms, tilt, truth };

  void warn(std::string line) { warnings_.push_back(std::move(line)); }
  void use(const Topics& topics, Job job) {
    for (const auto topic : topics) {
      jobs_[topic] = job;
      topics_.push_back(topic);
    }
  }

  void choose_pictures(const RecordingTopics& wanted) {
    constexpr std::string_view types = "sensor_msgs/Image or sensor_msgs/CompressedImage";
    if (!wanted.image) {
      auto names = names_of(recording_, is_picture_type);
      if (names.size() > 1) std::erase_if(names, is_made_of_pictures);
      if (names.size() == 1) {
        use(topics_named(recording_, names[0], is_picture_type), Job::picture);
        return;
      }
      if (names.empty()) {
        throw FileError(path_.string(),
                        "has no pictures of " + std::string(types) + "; its topics: " +
                            listed(names_of(recording_, [](std::string_view) { return true; })));
      }
      throw FileError(path_.string(), "has pictures of several topics: " + listed(names) +
                                          "; name one with the option image_topic");
    }
    use(wanted_topic(recording_, path_, *wanted.image, is_picture_type, types), Job::picture);
  }

  void choose_odometry(const RecordingTopics& wanted) {
    if (wanted.odometry && wanted.odometry_frames) {
      throw ContractError("odometry", "a topic and frames", "one of the two");
    }
    if (wanted.odometry) {
      use(wanted_topic(recording_, path_, *wanted.odometry, is_odometry_type, ros::Odometry::type),
          Job::odometry);
      return;
    }
    const auto names = names_of(recording_, is_odometry_type);
    if (!wanted.odometry_frames && names.size() == 1) {
      use(topics_named(recording_, names[0], is_odometry_type), Job::odometry);
      return;
    }
    if (!wanted.odometry_frames && !names.empty()) {
      warn("odometry of several topics, of which none is used: " + listed(names) +
           "; name one with the option odometry_topic");
      return;
    }
    frames_named_ = wanted.odometry_frames.has_value();
    const auto [top, bottom] =
        wanted.odometry_frames.value_or(std::pair<std::string, std::string>{"odom", "base_link"});
    frames_text_ = readable_line(top) + " to " + readable_line(bottom);
    chain_.emplace(top, bottom);
    for (const auto& name : names_of(recording_, is_transform_type)) {
      use(topics_named(recording_, name, is_transform_type), Job::transforms);
    }
  }

  void choose_tilt(const RecordingTopics& wanted, const PictureSource& source) {
    if (wanted.imu) {
      use(wanted_topic(recording_, path_, *wanted.imu, is_imu_type, ros::Imu::type), Job::tilt);
      return;
    }
    const auto names = names_of(recording_, is_imu_type);
    if (names.empty()) return;
    if (names.size() > 1) {
      warn("inertial sensors of several topics, of which none is used: " + listed(names) +
           "; name one with the option imu_topic");
    } else if (source.kind == PictureKind::panorama && !source.layout.elevations) {
      warn("roll and pitch of " + readable_line(names[0]) +
           " are not used: panoramas of unknown elevations cannot be levelled");
    } else {
      use(topics_named(recording_, names[0], is_imu_type), Job::tilt);
    }
  }

  template <class Message>
  [[nodiscard]] Message read(const MessagePlace& place, MessageBytes bytes) const {
    return ros::read_message<Message>(bytes, recording_.topics()[place.topic].encoding);
  }

  std::int64_t picture_stamp_ns(const MessagePlace& place, MessageBytes bytes) {
    if (recording_.topics()[place.topic].type == ros::CompressedImage::type) {
      return read<ros::CompressedImage>(place, bytes).header.stamp_ns;
    }
    const auto message = read<ros::Image>(place, bytes);
    const auto size = std::pair{message.width, message.height};
    if (pictures_.empty()) first_size_ = size;
    if (first_size_ != size) ++other_sizes_;
    return message.header.stamp_ns;
  }

  void take(const MessagePlace& place, MessageBytes bytes) {
    const RecordedTopic& topic = recording_.topics()[place.topic];
    switch (jobs_[place.topic]) {
      case Job::none:
        break;
      case Job::picture:
        pictures_.push_back({place, picture_stamp_ns(place, bytes)});
        break;
      case Job::odometry: {
        const auto message = read<ros::Odometry>(place, bytes);
        odometry_.add({place.time_ns, message.header.stamp_ns}, message.pose.pose);
        ++samples_;
        break;
      }
      case Job::transforms:
        for (const auto& each : read<ros::TFMessage>(place, bytes).transforms) {
          chain_->add(each, place.time_ns, topic.name.ends_with("tf_static"));
          ++samples_;
        }
        break;
      case Job::tilt: {
        const auto message = read<ros::Imu>(place, bytes);
        const auto& [x, y, z, w] = message.orientation;
        const double length = std::sqrt(x * x + y * y + z * z + w * w);
        const bool stated = message.orientation_covariance[0] != -1.0 &&
                            std::abs(length - 1.0) <= ros::quaternion_tolerance;
        if (stated) {
          orientation_.add({place.time_ns, message.header.stamp_ns}, {{}, message.orientation});
          ++samples_;
        } else {
          ++no_orientation_;
        }
        break;
      }
      case Job::truth: {
        const bool has_heading = topic.type == ros::PoseStamped::type;
        const auto [header, pose] = has_heading ? read<ros::PoseStamped>(place, bytes) : [&] {
          const auto point = read<ros::PointStamped>(place, bytes);
          return ros::PoseStamped{point.header, {point.point, {}}};
        }();
        truth_has_headings_ = truth_has_headings_ && has_heading;
        truth_.add({place.time_ns, header.stamp_ns}, pose);
        ++samples_;
        break;
      }
    }
  }

  const fs::path& path_;
  const Recording& recording_;
  std::vector<Job> jobs_;  // of each topic
  Topics topics_;
  std::vector<Picture> pictures_;
  RecordedTrack odometry_, orientation_, truth_;
  std::optional<TransformChain> chain_;
  bool frames_named_ = false;
  std::string frames_text_;
  bool truth_has_headings_ = true;
  std::pair<std::uint32_t, std::uint32_t> first_size_;
  std::size_t other_sizes_ = 0;
  std::size_t samples_ = 0;
  std::size_t unreadable_ = 0;
  std::string first_error_;
  std::size_t no_orientation_ = 0;
  std::vector<std::string> warnings_;
};

/// What a picture's message says of itself.
std::string shown(MessageBytes bytes, const RecordedTopic& topic) {
  if (topic.type == ros::CompressedImage::type) {
    return ros::read_message<ros::CompressedImage>(bytes, topic.encoding).format;
  }
  const auto message = ros::read_message<ros::Image>(bytes, topic.encoding);
  return std::to_string(message.width) + " x " + std::to_string(message.height) + " " +
         message.encoding;
}

}  // namespace

RecordedDataset read_recording(const fs::path& path, PictureSource source,
                               const RecordingTopics& topics) {
  return read_recording(Recording::open(path), path, std::move(source), topics);
}

RecordedDataset read_recording(std::shared_ptr<const Recording> recording, const fs::path& path,
                               PictureSource source, const RecordingTopics& topics) {
  Collector collector(path, *recording, source, topics);
  collector.run();
  return collector.dataset(std::move(source), std::move(recording));
}

RecordingSummary describe_recording(const fs::path& path) {
  const auto recording = Recording::open(path);
  RecordingSummary summary;
  const auto& topics = recording->topics();
  for (std::uint32_t i = 0; i < topics.size(); ++i) {
    TopicSummary& each = summary.topics.emplace_back();
    each.topic = topics[i];
    const auto places = recording->places(std::span(&i, 1));
    if (places.empty()) continue;
    each.time = TimeSpan{places.front().time_ns, places.back().time_ns};
    const double span_s = seconds_of(each.time->end_ns - each.time->begin_ns);
    if (span_s > 0.0) each.rate_hz = static_cast<double>(places.size() - 1) / span_s;
    if (!readable(topics[i], is_picture_type)) continue;
    try {
      each.shows = readable_line(shown(recording->read(places.front()), topics[i]));
    } catch (const Error& error) {
      each.shows = readable_line(error.what());
    }
  }
  std::ranges::stable_sort(summary.topics, {},
                           [](const TopicSummary& each) { return each.topic.name; });
  summary.time = recording->time();
  summary.warnings = recording->warnings();
  return summary;
}

}  // namespace panonav::recordings
