#include "panonav_recordings/register_recordings.hpp"

#include <unistd.h>

#include "panonav/io/dataset_readers.hpp"
#include "panonav_recordings/internal/foreign_pictures.hpp"
#include "panonav_recordings/jpeg_stream.hpp"
#include "panonav_recordings/recorded_dataset.hpp"
#include "panonav_recordings/video_file.hpp"

namespace panonav::recordings {

namespace {

Dataset open_recording(const std::filesystem::path& path, const PictureSource& source,
                       const InputOptions& options) {
  Dataset opened = read_recording(path, source, options.topics);
  select_pictures(opened, options.selection);
  return opened;
}

/// Reads only the selected pictures of a video, because decoding the others would cost time.
Dataset open_video(const std::filesystem::path& path, const PictureSource& source,
                   const InputOptions& options) {
  std::vector<std::filesystem::path> paths{path};
  paths.insert(paths.end(), options.further_videos.begin(), options.further_videos.end());
  return read_videos(paths, source, options.selection);
}

Dataset open_foreign_picture(const std::filesystem::path& path, const PictureSource& source,
                             const InputOptions& options) {
  Dataset opened = read_foreign_picture(path, source);
  select_pictures(opened, options.selection);
  return opened;
}

bool is_standard_input(const std::filesystem::path& path) {
  return path == "-";
}

Dataset open_standard_input(const std::filesystem::path& /*path*/, const PictureSource& source,
                            const InputOptions& options) {
  Dataset opened = read_jpeg_stream(STDIN_FILENO, "standard input", source);
  select_pictures(opened, options.selection);
  return opened;
}

}  // namespace

void register_recordings() {
  register_dataset_reader({"recording", true, is_recording, open_recording});
  register_dataset_reader({"video", false, is_video, open_video});
  register_dataset_reader(
      {"WebP, HEIC or AVIF image", false, is_foreign_picture, open_foreign_picture});
  register_foreign_picture_store(make_foreign_picture_store);
  register_dataset_reader({"stream", false, is_standard_input, open_standard_input});
}

}  // namespace panonav::recordings
