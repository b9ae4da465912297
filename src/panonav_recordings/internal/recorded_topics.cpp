#include "panonav_recordings/internal/recorded_topics.hpp"

#include <algorithm>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/internal/picture_messages.hpp"
#include "panonav_recordings/internal/recorded_video.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

using IsTopic = bool (*)(const RecordedTopic&);
using TopicNumbers = std::vector<std::uint32_t>;

bool is_ros(const RecordedTopic& topic) {
  return topic.encoding == MessageEncoding::ros1 || topic.encoding == MessageEncoding::cdr;
}
bool is_odometry(const RecordedTopic& topic) {
  return is_ros(topic) && topic.type == ros::Odometry::type;
}
bool is_imu(const RecordedTopic& topic) {
  return is_ros(topic) && topic.type == ros::Imu::type;
}
bool is_transforms(const RecordedTopic& topic) {
  return is_ros(topic) && (topic.type == ros::TFMessage::type || topic.type == "tf/tfMessage");
}
bool is_pose(const RecordedTopic& topic) {
  return is_ros(topic) &&
         (topic.type == ros::PoseStamped::type || topic.type == ros::PointStamped::type);
}

/// True if our run recorder computes the pictures of this topic from those of the camera.
bool is_derived_from_images(std::string_view topic) {
  return topic == "/panorama/compressed" || topic == "/best_match/compressed";
}

std::string list_topics(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : to_readable_line(shorten_middle(text, 400));
}

/// Describes all topics with their types and serialisations.
std::string describe_topics(const Recording& recording) {
  std::vector<std::string> lines;
  for (const RecordedTopic& topic : recording.topics()) {
    const std::string name =
        topic.encoding == MessageEncoding::protobuf ? "protobuf" : topic.encoding_name;
    const std::string encoding = is_ros(topic) || name.empty() ? "" : " as " + name;
    lines.push_back(topic.name + " (" + (topic.type.empty() ? "no type" : topic.type) + encoding +
                    (topic.messages == 0 ? ", no message" : "") + ")");
  }
  std::ranges::sort(lines);
  return list_topics(lines);
}

/// Properties by which one of several topics of images is chosen.
struct ImageTopic {
  std::string name;
  bool is_decodable = false;  ///< the first image can be decoded, and is no depth
  bool is_raw = false;        ///< without losses by compression
  std::uint64_t messages = 0;
  std::uint64_t area_px = 0;
};

/// True if topic `a` gives the better images: decodable ones, then the more complete topic (with a
/// tolerance of a tenth), the larger images, raw pixels, the earlier name.
bool is_better(const ImageTopic& a, const ImageTopic& b) {
  if (a.is_decodable != b.is_decodable) return a.is_decodable;
  if (10 * a.messages < 9 * b.messages || 10 * b.messages < 9 * a.messages)
    return a.messages > b.messages;
  if (a.area_px != b.area_px) return a.area_px > b.area_px;
  if (a.is_raw != b.is_raw) return a.is_raw;
  return a.name < b.name;
}

/// Chooses the topics of one recording, one role after the other.
class TopicChooser {
 public:
  TopicChooser(const Recording& recording, const std::filesystem::path& path)
      : recording_(recording), path_(path) {
    choice_.roles.resize(recording.topics().size());
  }

  void choose_pictures(const std::optional<std::string>& name) {
    if (name)
      return assign_role(find_named_topics(*name, is_picture_topic, picture_types),
                         TopicRole::picture);
    auto names = find_topic_names(is_picture_topic);
    if (names.size() > 1) std::erase_if(names, is_derived_from_images);
    if (names.empty()) {
      throw FileError(path_.string(), "has no images that can be read (" +
                                          std::string(picture_types) +
                                          "); its topics: " + describe_topics(recording_));
    }
    std::string best = names[0];
    if (names.size() > 1) {
      std::vector<ImageTopic> topics;
      for (const std::string& each : names) topics.push_back(inspect_images(each));
      best = std::ranges::min_element(topics, is_better)->name;
      choice_.warnings.push_back("images of several topics: " + list_topics(names) +
                                 "; used: " + to_readable_line(best) +
                                 "; choose another with the option image_topic");
    }
    assign_role(find_topic_numbers(best, is_picture_topic), TopicRole::picture);
  }

  void choose_odometry(const InputOptions::Topics& requested) {
    if (requested.odometry && requested.odometry_frames) {
      throw ContractError("odometry", "a topic and frames", "one of the two");
    }
    if (requested.odometry) {
      return assign_role(find_named_topics(*requested.odometry, is_odometry, ros::Odometry::type),
                         TopicRole::odometry);
    }
    const auto names = find_topic_names(is_odometry);
    if (!requested.odometry_frames && names.size() == 1) {
      return assign_role(find_topic_numbers(names[0], is_odometry), TopicRole::odometry);
    }
    if (!requested.odometry_frames && !names.empty()) {
      choice_.warnings.push_back(
          "odometry of several topics, of which none is used: " + list_topics(names) +
          "; choose one with the option odometry_topic");
      return;
    }
    choice_.frames_are_named = requested.odometry_frames.has_value();
    choice_.frames = requested.odometry_frames.value_or(
        std::pair<std::string, std::string>{"odom", "base_link"});
    for (const auto& name : find_topic_names(is_transforms)) {
      assign_role(find_topic_numbers(name, is_transforms), TopicRole::transforms);
    }
  }

  void choose_tilt(const std::optional<std::string>& name, const PictureSource& source) {
    if (name) return assign_role(find_named_topics(*name, is_imu, ros::Imu::type), TopicRole::tilt);
    const auto names = find_topic_names(is_imu);
    if (names.empty()) return;
    if (names.size() > 1) {
      choice_.warnings.push_back("inertial sensors of several topics, of which none is used: " +
                                 list_topics(names) + "; choose one with the option imu_topic");
    } else if (source.kind == PictureKind::panorama && !source.layout.elevations) {
      choice_.warnings.push_back(
          "roll and pitch of " + to_readable_line(names[0]) +
          " are not used: panoramas of unknown elevations cannot be levelled");
    } else {
      assign_role(find_topic_numbers(names[0], is_imu), TopicRole::tilt);
    }
  }

  void choose_truth() {
    assign_role(find_topic_numbers("/ground_truth", is_pose), TopicRole::truth);
  }

  [[nodiscard]] TopicChoice take() { return std::move(choice_); }

 private:
  /// Returns the numbers of the topics with a name and type; several if they differ in encoding or
  /// in type.
  [[nodiscard]] TopicNumbers find_topic_numbers(std::string_view name, IsTopic is_type) const {
    TopicNumbers found;
    const auto& topics = recording_.topics();
    for (std::uint32_t i = 0; i < topics.size(); ++i) {
      if (topics[i].name == name && topics[i].messages > 0 && is_type(topics[i]))
        found.push_back(i);
    }
    return found;
  }

  /// Reads the first image of a topic.
  [[nodiscard]] ImageTopic inspect_images(const std::string& name) const {
    ImageTopic found{.name = name};
    const TopicNumbers numbers = find_topic_numbers(name, is_picture_topic);
    const RecordedTopic& topic = recording_.topics()[numbers[0]];
    for (const std::uint32_t number : numbers)
      found.messages += recording_.topics()[number].messages;
    found.is_raw = is_raw_picture_topic(topic);
    try {
      const auto locations = recording_.locations(std::span(numbers).first(1));
      if (locations.empty()) return found;
      const auto bytes = recording_.read(locations.front());
      const PictureMessage message = read_picture_message(bytes, topic);
      const bool is_depth =
          message.raw && (message.raw->encoding == "16UC1" || message.raw->encoding == "32FC1");
      if (!message.raw && find_video_codec(message.file.format)) {
        found.is_decodable = true;  // its size is only known after decoding
        return found;
      }
      const Image image = to_image(message, name);
      found.area_px = image.pixels().size() / static_cast<std::size_t>(image.channels());
      found.is_decodable = !is_depth;
    } catch (const Error&) {  // stays undecodable
    }
    return found;
  }

  [[nodiscard]] std::vector<std::string> find_topic_names(IsTopic is_type) const {
    std::vector<std::string> names;
    for (const auto& topic : recording_.topics()) {
      if (topic.messages > 0 && is_type(topic)) names.push_back(topic.name);
    }
    std::ranges::sort(names);
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
  }

  /// Returns the numbers of the topics that the caller named. Throws FileError if there are none.
  [[nodiscard]] TopicNumbers find_named_topics(const std::string& name, IsTopic is_type,
                                               std::string_view types) const {
    TopicNumbers found = find_topic_numbers(name, is_type);
    if (found.empty()) {
      throw FileError(path_.string(), "has no topic " + to_readable_line(name) + " of " +
                                          std::string(types) +
                                          "; it has: " + describe_topics(recording_));
    }
    return found;
  }

  void assign_role(const TopicNumbers& topics, TopicRole role) {
    for (const auto topic : topics) {
      choice_.roles[topic] = role;
      choice_.topics.push_back(topic);
    }
  }

  const Recording& recording_;
  const std::filesystem::path& path_;
  TopicChoice choice_;
};

}  // namespace

TopicChoice choose_topics(const Recording& recording, const std::filesystem::path& path,
                          const InputOptions::Topics& names, const PictureSource& source) {
  TopicChooser chooser(recording, path);
  chooser.choose_pictures(names.image);
  chooser.choose_odometry(names);
  chooser.choose_tilt(names.imu, source);
  chooser.choose_truth();
  return chooser.take();
}

}  // namespace panonav::recordings
