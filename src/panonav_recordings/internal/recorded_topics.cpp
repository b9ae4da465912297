#include "panonav_recordings/internal/recorded_topics.hpp"

#include <algorithm>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

using IsType = bool (*)(std::string_view);
using TopicNumbers = std::vector<std::uint32_t>;

bool is_any_type(std::string_view /*type*/) {
  return true;
}
bool is_picture_type(std::string_view type) {
  return type == ros::Image::type || type == ros::CompressedImage::type;
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

/// True if our run recorder computes the pictures of this topic from those of the camera.
bool is_derived_from_images(std::string_view topic) {
  return topic == "/panorama/compressed" || topic == "/best_match/compressed";
}

bool is_readable(const RecordedTopic& topic, IsType is_type) {
  return topic.encoding != MessageEncoding::other && topic.messages > 0 && is_type(topic.type);
}

std::string list_topics(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : to_readable_line(shorten_middle(text, 400));
}

/// Chooses the topics of one recording, one role after the other.
class TopicChooser {
 public:
  TopicChooser(const Recording& recording, const std::filesystem::path& path)
      : recording_(recording), path_(path) {
    choice_.roles.resize(recording.topics().size());
  }

  void choose_pictures(const std::optional<std::string>& name) {
    constexpr std::string_view types = "sensor_msgs/Image or sensor_msgs/CompressedImage";
    if (name)
      return assign_role(find_named_topics(*name, is_picture_type, types), TopicRole::picture);
    auto names = find_topic_names(is_picture_type);
    if (names.size() > 1) std::erase_if(names, is_derived_from_images);
    if (names.size() == 1)
      return assign_role(find_topic_numbers(names[0], is_picture_type), TopicRole::picture);
    if (names.empty()) {
      throw FileError(path_.string(), "has no images of " + std::string(types) + "; its topics: " +
                                          list_topics(find_topic_names(is_any_type)));
    }
    throw FileError(path_.string(), "has images of several topics: " + list_topics(names) +
                                        "; choose one with the option image_topic");
  }

  void choose_odometry(const InputOptions::Topics& requested) {
    if (requested.odometry && requested.odometry_frames) {
      throw ContractError("odometry", "a topic and frames", "one of the two");
    }
    if (requested.odometry) {
      return assign_role(
          find_named_topics(*requested.odometry, is_odometry_type, ros::Odometry::type),
          TopicRole::odometry);
    }
    const auto names = find_topic_names(is_odometry_type);
    if (!requested.odometry_frames && names.size() == 1) {
      return assign_role(find_topic_numbers(names[0], is_odometry_type), TopicRole::odometry);
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
    for (const auto& name : find_topic_names(is_transform_type)) {
      assign_role(find_topic_numbers(name, is_transform_type), TopicRole::transforms);
    }
  }

  void choose_tilt(const std::optional<std::string>& name, const PictureSource& source) {
    if (name)
      return assign_role(find_named_topics(*name, is_imu_type, ros::Imu::type), TopicRole::tilt);
    const auto names = find_topic_names(is_imu_type);
    if (names.empty()) return;
    if (names.size() > 1) {
      choice_.warnings.push_back("inertial sensors of several topics, of which none is used: " +
                                 list_topics(names) + "; choose one with the option imu_topic");
    } else if (source.kind == PictureKind::panorama && !source.layout.elevations) {
      choice_.warnings.push_back(
          "roll and pitch of " + to_readable_line(names[0]) +
          " are not used: panoramas of unknown elevations cannot be levelled");
    } else {
      assign_role(find_topic_numbers(names[0], is_imu_type), TopicRole::tilt);
    }
  }

  void choose_truth() {
    assign_role(find_topic_numbers("/ground_truth", is_pose_type), TopicRole::truth);
  }

  [[nodiscard]] TopicChoice take() { return std::move(choice_); }

 private:
  /// Returns the numbers of the topics with a name and type; several if they differ in encoding or
  /// in type.
  [[nodiscard]] TopicNumbers find_topic_numbers(std::string_view name, IsType is_type) const {
    TopicNumbers found;
    const auto& topics = recording_.topics();
    for (std::uint32_t i = 0; i < topics.size(); ++i) {
      if (topics[i].name == name && is_readable(topics[i], is_type)) found.push_back(i);
    }
    return found;
  }

  [[nodiscard]] std::vector<std::string> find_topic_names(IsType is_type) const {
    std::vector<std::string> names;
    for (const auto& topic : recording_.topics()) {
      if (is_readable(topic, is_type)) names.push_back(topic.name);
    }
    std::ranges::sort(names);
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
  }

  /// Returns the numbers of the topics that the caller named. Throws FileError if there are none.
  [[nodiscard]] TopicNumbers find_named_topics(const std::string& name, IsType is_type,
                                               std::string_view types) const {
    TopicNumbers found = find_topic_numbers(name, is_type);
    if (found.empty()) {
      throw FileError(path_.string(), "has no topic " + to_readable_line(name) + " of " +
                                          std::string(types) +
                                          "; it has: " + list_topics(find_topic_names(is_type)));
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

bool is_readable_picture_topic(const RecordedTopic& topic) {
  return is_readable(topic, is_picture_type);
}

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
