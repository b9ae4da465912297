#include "panonav_recordings/recorded_poses.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/position_bound.hpp"
#include "panonav_recordings/internal/picture_messages.hpp"
#include "panonav_recordings/internal/recorded_track.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

constexpr std::array<std::string_view, 5> pose_types{
    ros::Odometry::type, ros::PoseStamped::type, ros::PoseWithCovarianceStamped::type,
    ros::TransformStamped::type, ros::PointStamped::type};
constexpr double pose_second_ns = 1e9;
constexpr std::size_t max_recorded_poses = 10'000'000;  // 80 bytes each, against hostile recordings

/// A pose with its time of recording and the stamp of its header.
struct TimedPose {
  std::int64_t log_ns = 0;
  std::int64_t stamp_ns = 0;
  ros::Pose pose;
};

bool has_poses(const RecordedTopic& topic) {
  return topic.encoding != MessageEncoding::other && topic.messages > 0 &&
         std::ranges::find(pose_types, topic.type) != pose_types.end();
}

bool has_transforms(const RecordedTopic& topic) {
  return topic.encoding != MessageEncoding::other && topic.messages > 0 &&
         (topic.type == ros::TFMessage::type || topic.type == "tf/tfMessage");
}

/// True if a word of the topic's name says that its poses were measured as ground truth.
bool is_named_ground_truth(const RecordedTopic& topic) {
  static const std::set<std::string, std::less<>> words{
      "truth", "groundtruth", "gt", "vicon", "optitrack", "mocap", "qualisys", "vrpn", "leica"};
  std::string word;
  for (const char c : topic.name + "/") {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    } else {
      if (words.contains(word)) return true;
      word.clear();
    }
  }
  return false;
}

/// True if people or planners, not localisation, publish poses on the topic.
bool is_command(const RecordedTopic& topic) {
  constexpr std::array<std::string_view, 4> names{"/clicked_point", "/initialpose", "/goal_pose",
                                                  "/move_base_simple/goal"};
  return std::ranges::find(names, topic.name) != names.end();
}

/// True if the robot computes the poses of the topic.
bool is_estimate(const RecordedTopic& topic) {
  return !is_named_ground_truth(topic) &&
         (topic.type == ros::Odometry::type || topic.type == ros::PoseWithCovarianceStamped::type);
}

std::string list_pose_topics(const std::vector<RecordedTopic>& topics) {
  std::string text;
  for (const RecordedTopic& topic : topics) {
    if (has_poses(topic) || has_transforms(topic))
      text += (text.empty() ? "" : ", ") + to_readable_line(topic.name);
  }
  return text.empty() ? "none" : text;
}

using TopicNumbers = std::vector<std::uint32_t>;

template <class Predicate>
TopicNumbers find_topics(const std::vector<RecordedTopic>& topics, Predicate is_wanted) {
  TopicNumbers found;
  for (std::uint32_t i = 0; i < topics.size(); ++i) {
    if (is_wanted(topics[i])) found.push_back(i);
  }
  return found;
}

/// Chooses the topic of poses; nullopt: the transforms.
std::optional<std::uint32_t> choose_topic(const std::filesystem::path& path,
                                          const std::vector<RecordedTopic>& topics,
                                          const std::optional<std::string>& name, PoseUse use) {
  const auto fail_several = [&] {
    throw FileError(path.string(),
                    "has poses of several topics: " + list_pose_topics(topics) + "; choose one");
  };
  if (name) {
    const auto named = find_topics(topics, [&](const RecordedTopic& each) {
      return each.name == *name && (has_poses(each) || has_transforms(each));
    });
    if (named.size() == 1 && has_transforms(topics[named[0]])) return std::nullopt;
    if (named.size() == 1) return named[0];
    throw FileError(path.string(), "has no poses on topic " + to_readable_line(*name) +
                                       "; its topics with poses: " + list_pose_topics(topics));
  }
  const auto find_poses = [&](bool named_ground_truth) {
    return find_topics(topics, [&](const RecordedTopic& each) {
      return has_poses(each) && !is_command(each) &&
             is_named_ground_truth(each) == named_ground_truth;
    });
  };
  const bool has_any_transforms = !find_topics(topics, has_transforms).empty();
  TopicNumbers found = find_poses(use == PoseUse::ground_truth);
  if (found.empty() && use == PoseUse::estimate && has_any_transforms) return std::nullopt;
  if (found.empty()) found = find_poses(use != PoseUse::ground_truth);
  if (use == PoseUse::ground_truth && !found.empty()) {
    std::erase_if(found, [&](std::uint32_t i) {
      return topics[i].type == ros::Odometry::type && is_estimate(topics[i]);
    });
    if (found.empty() && !has_any_transforms) {
      throw FileError(path.string(),
                      "has no ground truth, but odometry: " + list_pose_topics(topics) +
                          "; to compare with odometry, choose one");
    }
  }
  if (found.size() > 1) fail_several();
  if (found.size() == 1) return found.front();
  if (has_any_transforms) return std::nullopt;
  throw FileError(path.string(),
                  "has no topic with poses; allowed: Odometry, PoseStamped, "
                  "PoseWithCovarianceStamped, TransformStamped, PointStamped or TFMessage");
}

template <class Message>
TimedPose read_pose_as(std::span<const std::uint8_t> bytes, MessageEncoding encoding) {
  const auto message = ros::read_message<Message>(bytes, encoding);
  if constexpr (std::is_same_v<Message, ros::TransformStamped>) {
    return {0, message.header.stamp_ns, message.transform};
  } else if constexpr (std::is_same_v<Message, ros::PoseStamped>) {
    return {0, message.header.stamp_ns, message.pose};
  } else if constexpr (std::is_same_v<Message, ros::PointStamped>) {
    return {0, message.header.stamp_ns, {message.point, {}}};
  } else {
    return {0, message.header.stamp_ns, message.pose.pose};
  }
}

TimedPose read_pose(const RecordedTopic& topic, std::span<const std::uint8_t> bytes) {
  if (topic.type == ros::Odometry::type) return read_pose_as<ros::Odometry>(bytes, topic.encoding);
  if (topic.type == ros::PoseStamped::type) {
    return read_pose_as<ros::PoseStamped>(bytes, topic.encoding);
  }
  if (topic.type == ros::TransformStamped::type) {
    return read_pose_as<ros::TransformStamped>(bytes, topic.encoding);
  }
  if (topic.type == ros::PointStamped::type) {
    return read_pose_as<ros::PointStamped>(bytes, topic.encoding);
  }
  return read_pose_as<ros::PoseWithCovarianceStamped>(bytes, topic.encoding);
}

Pose3 to_pose3(const ros::Pose& pose) {
  const auto& [x, y, z, w] = pose.orientation;
  const double length = std::sqrt(x * x + y * y + z * z + w * w);
  return {{pose.position.x, pose.position.y, pose.position.z},
          {w / length, x / length, y / length, z / length}};
}

/// Throws FileError if the stamps, in the order of the messages, go back, as sorted poses of two
/// runs would be mixed. Messages that overtook others by a second are no second run.
void require_one_run(const std::vector<std::int64_t>& stamps_ns, const std::filesystem::path& path,
                     const std::string& source) {
  constexpr std::int64_t max_step_back_ns = 1'000'000'000;
  for (std::size_t i = 1; i < stamps_ns.size(); ++i) {
    if (stamps_ns[i - 1] - stamps_ns[i] <= max_step_back_ns) continue;
    throw FileError(path.string(),
                    source + ": the clock goes back at message " + std::to_string(i + 1) +
                        "; allowed: one run; panonav convert " + quote_for_shell(path.string()) +
                        " OUT.mcap joins the runs of its images, with their odometry "
                        "on /odom and the true poses of /ground_truth");
  }
}

/// Adds a pose; of equal stamps the first one is kept.
void append(TrajectoryFile& file, const StampedPose3& pose) {
  if (!file.poses.empty() && pose.stamp_s <= file.poses.back().stamp_s) {
    ++file.repeated;
  } else {
    file.poses.push_back(pose);
  }
}

void require_position(const ros::Vector3& position, std::size_t count,
                      const std::filesystem::path& path, const std::string& source) {
  const auto& [x, y, z] = position;
  if (is_position(x) && is_position(y) && is_position(z) && count <= max_recorded_poses) return;
  throw FileError(path.string(), source +
                                     ": a position is out of range, or there are more than "
                                     "10000000 poses; allowed: " +
                                     std::string(position_range));
}

TrajectoryFile read_topic(const Recording& recording, const std::filesystem::path& path,
                          std::uint32_t index) {
  const RecordedTopic& chosen = recording.topics()[index];
  const std::string name = "topic " + to_readable_line(chosen.name);
  std::vector<TimedPose> timed;
  recording.for_each(std::array{index}, {},
                     [&](const MessageLocation& location, std::span<const std::uint8_t> bytes) {
                       try {
                         timed.push_back(read_pose(chosen, bytes));
                       } catch (const ContractError& error) {
                         throw FileError(path.string(), name + ": " + error.what());
                       }
                       require_position(timed.back().pose.position, timed.size(), path, name);
                       timed.back().log_ns = location.time_ns;
                     });
  const bool has_stamps =
      std::ranges::any_of(timed, [](const TimedPose& each) { return each.stamp_ns != 0; });
  const auto time_of = [has_stamps](const TimedPose& each) {
    return has_stamps ? each.stamp_ns : each.log_ns;
  };
  std::vector<std::int64_t> stamps_ns;
  for (const TimedPose& each : timed) stamps_ns.push_back(time_of(each));
  require_one_run(stamps_ns, path, name);
  std::ranges::stable_sort(timed, {}, time_of);
  TrajectoryFile file{.format = name + " (" + chosen.type + ")", .units = {}, .poses = {}};
  file.has_rotations = chosen.type != ros::PointStamped::type;
  file.is_estimate = is_estimate(chosen);
  for (const TimedPose& each : timed) {
    append(file, {static_cast<double>(time_of(each)) / pose_second_ns, to_pose3(each.pose)});
  }
  if (file.poses.empty()) {
    throw FileError(path.string(), name + " contains no pose; allowed: one or more");
  }
  return file;
}

/// Returns the frame of the first image; nullopt if there is none.
std::optional<std::string> find_camera_frame(const Recording& recording) {
  const TopicNumbers numbers = find_topics(recording.topics(), [](const RecordedTopic& topic) {
    return is_picture_topic(topic) && topic.messages > 0;
  });
  if (numbers.empty()) return std::nullopt;
  const auto locations = recording.locations(std::span(numbers).first(1));
  if (locations.empty()) return std::nullopt;
  try {
    const auto bytes = recording.read(locations.front());
    const PictureMessage message =
        read_picture_message(bytes, recording.topics()[locations.front().topic]);
    const std::string frame = normalise_frame_name(message.raw ? message.raw->header.frame_id
                                                               : message.file.header.frame_id);
    return frame.empty() ? std::nullopt : std::optional(frame);
  } catch (const Error&) {  // an image that cannot be read names no frame
    return std::nullopt;
  }
}

/// The transforms of a recording, as the parent of each frame.
class FrameTree {
 public:
  void add(const ros::TransformStamped& transform) {
    constexpr std::size_t max_frames = 10'000;  // against hostile recordings
    if (parents_.size() >= max_frames) return;
    parents_.try_emplace(normalise_frame_name(transform.child_frame_id),
                         normalise_frame_name(transform.header.frame_id));
  }

  /// Returns the fixed frame and the frame of the robot. Throws FileError that names the missing
  /// transform.
  [[nodiscard]] std::pair<std::string, std::string> find_frames(
      const std::filesystem::path& path, const std::optional<std::string>& camera,
      PoseUse use) const {
    std::vector<std::string> fixed{"map", "world"};
    if (use == PoseUse::estimate) fixed.emplace_back("odom");
    std::vector<std::string> bases{"base_link", "base_footprint"};
    if (camera) bases.push_back(*camera);
    std::string failure = "no transform leads to " + bases[0];
    for (std::size_t i = 1; i < bases.size(); ++i) failure += " or " + to_readable_line(bases[i]);
    for (const std::string& base : bases) {
      if (!parents_.contains(base)) continue;
      const std::vector<std::string> ancestors = find_ancestors(base);
      for (const std::string& frame : fixed) {
        if (std::ranges::find(ancestors, frame) != ancestors.end()) return {frame, base};
      }
      failure = "the transforms of " + to_readable_line(base) + " begin at " +
                to_readable_line(ancestors.back()) +
                ", and none leads to it from map or world (missing: map -> " +
                to_readable_line(ancestors.back()) + ")";
    }
    std::string links;
    for (const auto& [child, parent] : parents_) {
      links += (links.empty() ? "" : ", ") + parent + " -> " + child;
    }
    throw FileError(path.string(),
                    failure + "; it has: " +
                        (links.empty() ? "none" : to_readable_line(shorten_middle(links, 400))));
  }

 private:
  /// Returns the frames from the parent of `frame` to the root; a cycle ends where it closes.
  [[nodiscard]] std::vector<std::string> find_ancestors(const std::string& frame) const {
    std::vector<std::string> ancestors;
    for (auto up = parents_.find(frame); up != parents_.end(); up = parents_.find(up->second)) {
      if (std::ranges::find(ancestors, up->second) != ancestors.end()) break;
      ancestors.push_back(up->second);
    }
    return ancestors;
  }

  std::map<std::string, std::string> parents_;  // by the name of the child frame
};

/// Sorts the moving transforms of the chain by their stamps. Returns the stamps of the most
/// frequent one.
std::vector<std::int64_t> sort_transforms(TransformChain& chain,
                                          const std::filesystem::path& path) {
  const bool use_log_times = !chain.has_stamps();
  std::vector<std::int64_t> most_frequent;
  for (const auto& [name, track] : chain.moving_tracks()) {
    std::vector<RecordedTimes> times = track->times(name).times;
    std::vector<std::int64_t> stamps_ns;
    for (RecordedTimes& each : times) {
      if (use_log_times) each.stamp_ns = each.log_ns;
      stamps_ns.push_back(each.stamp_ns);
    }
    require_one_run(stamps_ns, path, name);
    std::ranges::stable_sort(times, {}, &RecordedTimes::order);
    track->sort(times);
    if (track->size() > most_frequent.size()) most_frequent = track->stamps_ns();
  }
  return most_frequent;
}

TrajectoryFile read_transforms(const Recording& recording, const std::filesystem::path& path,
                               PoseUse use) {
  const auto& topics = recording.topics();
  const TopicNumbers numbers = find_topics(topics, has_transforms);
  std::size_t count = 0;
  const auto for_each_transform = [&](const auto& add) {
    recording.for_each(
        numbers, {}, [&](const MessageLocation& location, std::span<const std::uint8_t> bytes) {
          const RecordedTopic& topic = topics[location.topic];
          try {
            for (const auto& each :
                 ros::read_message<ros::TFMessage>(bytes, topic.encoding).transforms)
              add(each, location, topic.name.ends_with("tf_static"));
          } catch (const ContractError& error) {
            throw FileError(path.string(),
                            "topic " + to_readable_line(topic.name) + ": " + error.what());
          }
        });
  };
  FrameTree tree;
  for_each_transform([&](const ros::TransformStamped& each, const MessageLocation&, bool) {
    tree.add(each);
    require_position(each.transform.position, ++count, path, "transforms");
  });
  const auto [fixed, base] = tree.find_frames(path, find_camera_frame(recording), use);
  TransformChain chain(fixed, base);
  for_each_transform([&](const ros::TransformStamped& each, const MessageLocation& location,
                         bool is_static) {
    chain.add(each, {location.time_ns, each.header.stamp_ns, storage_order(location)}, is_static);
  });
  const std::string name = "transforms " + fixed + " -> " + base;
  TrajectoryFile file{.format = name, .units = {}, .poses = {}};
  file.is_estimate = true;
  for (const std::int64_t ns : sort_transforms(chain, path)) {
    const auto pose = chain.at(ns);
    if (!pose) continue;
    require_position(pose->position, 0, path, name);
    append(file, {static_cast<double>(ns) / pose_second_ns, to_pose3(*pose)});
  }
  if (file.poses.empty()) {
    throw FileError(path.string(), name +
                                       " have no common time; allowed: transforms of the chain " +
                                       chain.list_transforms() +
                                       " that come at least every three seconds, one of them not "
                                       "static");
  }
  return file;
}

}  // namespace

TrajectoryFile read_recorded_poses(const std::filesystem::path& path,
                                   const std::optional<std::string>& topic, PoseUse use) {
  return read_recorded_poses(*Recording::open(path), path, topic, use);
}

TrajectoryFile read_recorded_poses(const Recording& recording, const std::filesystem::path& path,
                                   const std::optional<std::string>& topic, PoseUse use) {
  const auto index = choose_topic(path, recording.topics(), topic, use);
  return index ? read_topic(recording, path, *index) : read_transforms(recording, path, use);
}

}  // namespace panonav::recordings
