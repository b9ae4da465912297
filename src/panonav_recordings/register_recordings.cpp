#include "panonav_recordings/register_recordings.hpp"

#include <unistd.h>

#include "panonav/io/dataset_readers.hpp"
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

bool is_video_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return is_video(path) && std::filesystem::is_regular_file(path, ignored);
}

/// Reads only the selected pictures of a video, because decoding the others would cost time.
Dataset open_video(const std::filesystem::path& path, const PictureSource& source,
                   const InputOptions& options) {
  return read_video(path, source, options.selection);
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
  register_dataset_reader({"video", false, is_video_file, open_video});
  register_dataset_reader({"stream", false, is_standard_input, open_standard_input});
}

}  // namespace panonav::recordings
