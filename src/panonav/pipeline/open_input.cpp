#include "panonav/pipeline/open_input.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/gpano.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/media_kind.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

/// Returns the first eight names, separated by commas, and the number of further ones.
std::string join_names(const std::vector<std::string>& names) {
  constexpr std::size_t max_listed = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(max_listed, names.size()); ++i) {
    text += (i > 0 ? ", " : "") + to_readable_line(names[i]);
  }
  if (names.size() > max_listed) {
    text += " and " + std::to_string(names.size() - max_listed) + " more";
  }
  return text;
}

void add_warning_of_skipped_files(Dataset& opened) {
  std::vector<std::string> files;
  std::vector<std::string> hidden;
  std::vector<std::string> folders;
  std::vector<std::string> foreign;
  for (const std::string& name : opened.left_out) {
    const bool is_foreign = identify_media_file(opened.folder / name) == MediaKind::foreign_picture;
    (name.ends_with('/') ? folders
     : is_hidden(name)   ? hidden
     : is_foreign        ? foreign
                         : files)
        .push_back(name);
  }
  const auto warn = [&](const std::vector<std::string>& names, const std::string& why) {
    if (names.empty()) return;
    const std::string count = names.size() > 1 ? " (" + std::to_string(names.size()) + ")" : "";
    opened.warnings.push_back("left out, " + why + count + ": " + join_names(names));
  };
  warn(files, "no image");
  warn(foreign, "WebP, HEIC or AVIF (convert them to PNG or JPEG)");
  warn(hidden, "hidden");
  warn(folders, "folders within");
}

/// Returns the size of the first image; nullopt if it cannot be read. The error is reported later,
/// when the image is read.
std::optional<ImageSize> read_first_picture_size(const Dataset& dataset) {
  const DatasetEntry& first = dataset.entries.front();
  try {
    return first.store ? read_picture(first).size() : read_image_size(first.path);
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// Warns of an elevation band that is far too narrow for the number of rows: probably given in
/// radians instead of degrees. A data set with few rows, such as a route's, may have a narrow band.
void add_warning_of_low_band(Dataset& opened) {
  constexpr double min_band_deg = 5.0;  // pi radians, taken for degrees, are less
  constexpr double max_stretch = 8.0;   // of pixels vertically; radians give 57
  const PictureLayout& layout = opened.source.layout;
  const auto& band = layout.kept_elevations ? layout.kept_elevations : layout.elevations;
  if (!band) return;
  const double low_deg = degrees(band->bottom_rad);
  const double high_deg = degrees(band->top_rad);
  if (high_deg - low_deg >= min_band_deg) return;
  const auto size = read_first_picture_size(opened);
  if (!size || 360.0 * size->height < max_stretch * (high_deg - low_deg) * size->width) return;
  opened.warnings.push_back("hint: the elevation band of " +
                            to_readable_line(opened.folder.string()) + " is " +
                            format_number(low_deg) + " to " + format_number(high_deg) +
                            " degrees; are these radians? elevation_deg is in degrees");
}

/// Warns of panoramas twice as wide as high: such an image most probably shows the whole sphere,
/// since as a panorama of square pixels it would reach from pole to pole.
void add_warning_of_wrong_kind(Dataset& opened) {
  constexpr double max_band_deg = 170.0;  // from here on the band is nearly the whole sphere
  if (opened.source.kind != PictureKind::panorama) return;
  const auto& band = opened.source.layout.elevations;
  if (band && band->top_rad - band->bottom_rad < radians(max_band_deg)) return;
  const auto size = read_first_picture_size(opened);
  if (!size || size->width != 2 * size->height) return;
  opened.warnings.push_back("hint: " + to_readable_line(opened.entries.front().path.string()) +
                            " is " + std::to_string(size->width) + " x " +
                            std::to_string(size->height) +
                            " px; an image of the whole sphere is of the kind equirectangular, a "
                            "panorama has an elevation band");
}

void reject_topics(const fs::path& path, const InputOptions::Topics& topics) {
  for (const auto& [is_set, option] :
       {std::pair{topics.image.has_value(), "the option image_topic"},
        {topics.odometry.has_value(), "the option odometry_topic"},
        {topics.odometry_frames.has_value(), "the option odometry_frames"},
        {topics.imu.has_value(), "the option imu_topic"}}) {
    if (is_set) throw OptionError(path.string() + " has no topics; leave out " + option);
  }
}

/// Throws FileError on a recording or video for which this program has no reader, or that its
/// reader does not recognise.
void reject_unregistered_kind(const fs::path& path) {
  constexpr std::array<std::string_view, 3> recordings{".mcap", ".bag", ".db3"};
  std::error_code ignored;
  const std::string extension = to_lower_case(path.extension().string());
  std::string name;
  if (fs::exists(path / "metadata.yaml", ignored) ||
      std::ranges::find(recordings, extension) != recordings.end()) {
    name = "recording";
  } else if (identify_media_file(path) == MediaKind::video) {
    name = "video";
  }
  if (name.empty()) return;
  if (has_dataset_reader(name)) {
    if (name != "recording" || fs::is_directory(path, ignored)) return;
    const bool is_empty = fs::is_regular_file(path, ignored) && fs::file_size(path, ignored) == 0;
    throw FileError(path.string(), is_empty ? "is empty (0 bytes); it was probably not written or "
                                              "copied completely"
                                            : "is no recording, although its name says so");
  }
  throw FileError(path.string(), "is a " + name + ", and this program reads no " + name +
                                     "s: no reader of that kind is registered");
}

const PictureSource& choose_source(const fs::path& path, const InputOptions& options,
                                   std::string_view why) {
  if (options.source) return *options.source;
  if (options.default_source) return *options.default_source;
  throw FileError(path.string(), std::string(why) + " with 'source' (a PictureSource)");
}

void reject_further_videos(const fs::path& path, const InputOptions& options) {
  if (options.further_videos.empty()) return;
  throw OptionError(path.string() + " is no video, so " + options.further_videos.front().string() +
                    " cannot continue it; allowed: one input, or several videos");
}

Dataset open_with_reader(const fs::path& path, const DatasetReader& reader,
                         const InputOptions& options) {
  if (!reader.has_topics) reject_topics(path, options.topics);
  if (reader.name != "video") reject_further_videos(path, options);
  if (options.topics.odometry && options.topics.odometry_frames) {
    throw OptionError(
        "the option odometry_topic and the option odometry_frames cannot be combined");
  }
  const PictureSource& source =
      choose_source(path, options, "does not give the type of its images; set the type");
  if (options.recursive) {
    throw OptionError(path.string() + " is a " + reader.name + "; leave out the option recursive");
  }
  Dataset opened = reader.read(path, source, options);
  const std::string of_input = path.string() + ": ";
  for (std::string& warning : opened.warnings)
    if (!warning.starts_with(of_input)) warning = of_input + warning;
  if (options.source) add_warning_of_wrong_kind(opened);
  return opened;
}

Dataset open_dataset_folder(const fs::path& folder, const InputOptions& options) {
  if (options.source) {
    throw OptionError(
        folder.string() +
        " has a dataset.toml, which gives the type of its images; leave out 'source'");
  }
  if (options.recursive) {
    throw OptionError(
        folder.string() +
        " has a dataset.toml, which names its images; leave out the option recursive");
  }
  Dataset opened = read_dataset(folder);
  add_warning_of_low_band(opened);
  add_warning_of_wrong_kind(opened);
  return opened;
}

Dataset open_pictures(const fs::path& path, const InputOptions& options) {
  reject_unregistered_kind(path);
  const PictureSource& source =
      choose_source(path, options, "has no dataset.toml; set the type of the images");
  std::error_code ignored;
  Dataset opened;
  if (fs::is_directory(path, ignored)) {
    opened =
        options.recursive ? read_picture_tree(path, source) : read_picture_folder(path, source);
  } else if (options.recursive) {
    throw OptionError(path.string() +
                      " is one image; the option recursive can only be used with a folder");
  } else if (options.selection.has_time_selection() || options.selection.every > 1) {
    throw OptionError(
        path.string() +
        " is one image; 'from_s', 'to_s' and the option every can only be used with a recording");
  } else {
    opened = read_single_picture(path, source);
  }
  add_warning_of_skipped_files(opened);
  if (options.source) add_warning_of_wrong_kind(opened);
  return opened;
}

}  // namespace

bool has_dataset_file(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / "dataset.toml", ignored);
}

Dataset open_input(const fs::path& path, const InputOptions& options) {
  if (const auto reader = find_dataset_reader(path))
    return open_with_reader(path, *reader, options);
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    throw FileError(path.string(), "there is no such file or folder");
  }
  reject_topics(path, options.topics);
  reject_further_videos(path, options);
  Dataset opened =
      has_dataset_file(path) ? open_dataset_folder(path, options) : open_pictures(path, options);
  select_pictures(opened, options.selection);
  if (!options.ignore_gpano) apply_gpano(opened);
  return opened;
}

}  // namespace panonav
