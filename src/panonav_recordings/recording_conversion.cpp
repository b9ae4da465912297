#include "panonav_recordings/recording_conversion.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/temporary_file.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/unfinished_folder.hpp"
#include "panonav_recordings/internal/topic_writer.hpp"
#include "panonav_recordings/mcap_writer.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

namespace fs = std::filesystem;

}  // namespace

Dataset::Fields convert_to_recording(const Dataset& dataset, const fs::path& file,
                                     const std::function<void()>& advance) {
  const Dataset::Fields known = find_known_fields(dataset);
  const bool has_all_headings = std::ranges::all_of(
      dataset.entries, [](const DatasetEntry& e) { return !e.pose || e.pose->heading_rad; });
  TemporaryFile unfinished(file);
  // JPEG and PNG data is compressed already.
  McapWriter writer(unfinished.path(), {.compression = McapCompression::none});
  TopicWriter<ros::CompressedImage> pictures(writer, "/camera/image/compressed");
  RobotTopics robot(writer, "world");
  std::int64_t log_ns = 0;
  for (std::size_t i = 0; i < dataset.entries.size(); ++i) {
    const DatasetEntry& entry = dataset.entries[i];
    const std::int64_t ns = to_nanoseconds(known.stamps ? *entry.stamp_s : static_cast<double>(i));
    log_ns = std::max(log_ns, ns);  // never decreases: readers sort by it
    std::optional<ReferencePose> truth = entry.pose;
    if (truth && !has_all_headings) truth->heading_rad.reset();
    robot.write(log_ns, ns, entry.odometry, entry.tilt, truth);
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
  return known;
}

Dataset::Fields convert_to_dataset(const Dataset& recording, const fs::path& folder,
                                   const std::function<void()>& advance) {
  UnfinishedFolder unfinished(folder);
  Dataset dataset = recording;
  dataset.folder = unfinished.path();
  for (DatasetEntry& entry : dataset.entries) {
    const auto bytes = read_encoded_picture(entry);
    entry.file += image_format(bytes, entry.file) == ImageFormat::png ? ".png" : ".jpg";
    unfinished.append(unescape_name(entry.file), bytes);
    if (advance) advance();
  }
  write_dataset(dataset);
  unfinished.finish();
  return find_known_fields(dataset);
}

}  // namespace panonav::recordings
