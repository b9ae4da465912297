#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav_recordings/internal/recorded_topics.hpp"
#include "panonav_recordings/internal/recorded_track.hpp"
#include "panonav_recordings/internal/recorded_video.hpp"
#include "panonav_recordings/recording.hpp"

namespace panonav::recordings {

/// A picture of a recording that is not decoded yet.
struct RecordedPicture {
  MessageLocation location;
  std::int64_t stamp_ns = 0;    ///< of the message header, 0: none; sorted: on the common clock
  std::size_t video_index = 0;  ///< number among the pictures of `RecordedMessages::video`
};

/// Collects the messages of the chosen topics of a recording.
struct RecordedMessages {
  std::vector<RecordedPicture> pictures;  ///< one or more; sorted: by ascending stamps
  RecordedTrack odometry;                 ///< empty if `chain` gives the odometry
  RecordedTrack orientation;              ///< of the IMU; its positions are unused
  RecordedTrack truth;
  std::optional<TransformChain> chain;  ///< connected transforms that give the odometry
  bool truth_has_headings = true;
  std::unique_ptr<RecordedVideo> video;  ///< of pictures that are packets of a video; else null
  std::pair<std::uint32_t, std::uint32_t> first_size;  ///< width and height of the first picture
  std::size_t differing_size_count = 0;                ///< pictures of another size
  std::size_t imu_without_orientation_count = 0;       ///< IMU messages without orientation
  std::vector<std::string> warnings;  ///< of the topic choice, then of messages left out

  /// Sorts pictures and poses by their stamps on one clock (`unify_clocks`), or by log times if a
  /// topic has no stamps. Drops pictures with the stamp of an earlier one. Adds warnings.
  void sort();
  /// Returns the pose of the odometry at a time; nullopt if it is not known. Must be sorted.
  [[nodiscard]] std::optional<ros::Pose> odometry_at(std::int64_t ns) const;
  /// Returns the stamps between which there is odometry; nullopt if there is none.
  [[nodiscard]] std::optional<TimeSpan> odometry_span() const;

 private:
  void order_pictures_by_stamps();
};

/// Reads all messages of the chosen topics in one pass. Throws FileError that names `path` if there
/// are too many messages or no readable picture, or no transforms connect the frames that the
/// caller named.
[[nodiscard]] RecordedMessages collect_messages(const std::filesystem::path& path,
                                                const Recording& recording,
                                                const TopicChoice& choice);

}  // namespace panonav::recordings
