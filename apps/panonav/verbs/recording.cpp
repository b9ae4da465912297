#include "verbs/recording.hpp"

#include <unistd.h>

#include <charconv>
#include <cmath>
#include <filesystem>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_recordings/jpeg_stream.hpp"
#include "panonav_recordings/live_pictures.hpp"
#include "panonav_recordings/video_file.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

/// The first ones, and how many more there are.
std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t shown = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(shown, names.size()); ++i) {
    text += (i > 0 ? ", " : "") + readable_line(names[i]);
  }
  if (names.size() > shown) text += " and " + std::to_string(names.size() - shown) + " more";
  return text;
}

void note_left_out(const Dataset& recording, Session& session) {
  std::vector<std::string> files;
  std::vector<std::string> folders;
  for (const std::string& name : recording.left_out) {
    (name.ends_with('/') ? folders : files).push_back(name);
  }
  if (!files.empty()) session.note("left out, no PNG or JPEG by name: " + listed(files));
  if (!folders.empty()) session.note("left out, folders within: " + listed(folders));
}

/// Pictures are higher than this, but radians that stand for degrees look like it. A data set may
/// be of single lines, as a route's is.
constexpr double min_band_deg = 5.0;

void note_low_band(const Dataset& recording, Session& session) {
  const PictureLayout& layout = recording.source.layout;
  const auto& band = layout.kept_elevations ? layout.kept_elevations : layout.elevations;
  if (!band) return;
  const double low = degrees(band->bottom_rad);
  const double high = degrees(band->top_rad);
  if (high - low >= min_band_deg) return;
  session.note("hint: the elevation band of " + readable_line(recording.folder.string()) + " is " +
               short_number(low) + " to " + short_number(high) +
               " degrees; are these radians? elevation_deg is in degrees");
}

/// A picture twice as wide as high that is said to be a panorama shows the whole sphere in all
/// likelihood; a panorama of square pixels that high would reach from pole to pole.
void note_other_kind(const Dataset& recording, Session& session) {
  if (recording.source.kind != PictureKind::panorama) return;
  const auto& band = recording.source.layout.elevations;
  if (band && band->top_rad - band->bottom_rad < radians(170.0)) return;
  const DatasetEntry& first = recording.entries.front();
  ImageSize size;
  try {
    size = first.store ? read_picture(first).size() : read_image_size(first.path);
  } catch (const Error&) {
    return;  // who reads its pixels says what is wrong
  }
  if (size.width != 2 * size.height) return;
  session.note("hint: " + readable_line(first.path.string()) + " is " + std::to_string(size.width) +
               " x " + std::to_string(size.height) +
               " px; a picture of the whole sphere is of the kind equirectangular, a panorama has "
               "an elevation band");
}

}  // namespace

void declare_layout(Arguments& arguments, PictureArguments& pictures) {
  arguments.choice("--kind", pictures.kind, {"panorama", "equirectangular", "mirror"},
                   "What the pictures show, where no dataset.toml says it");
  arguments.option("--camera FILE", pictures.camera,
                   "Calibration of a mirror camera (panonav calibrate)");
  arguments.choice("--columns-run", pictures.columns, {"clockwise", "counter-clockwise"},
                   "How columns run, seen from above; default clockwise");
  arguments.option("--forward-column", pictures.forward_column,
                   "Fraction of the width that looks along the heading; default 0.5");
  arguments.option("--elevation-deg", pictures.elevation_deg,
                   "Lower and upper edge of a panorama, or the band to keep of other pictures");
  arguments.uncommon({"--columns-run", "--forward-column"});
}

void declare_topics(Arguments& arguments, recordings::RecordingTopics& topics) {
  arguments.option(
      "--image-topic NAME", topics.image,
      "Pictures of a recording (MCAP, rosbag2, ROS 1 bag) with several topics of them");
  arguments.option("--odometry-topic NAME", topics.odometry,
                   "Its odometry (nav_msgs/Odometry) where there are several");
  arguments.option("--odometry-frames", "ODOM BASE", topics.odometry_frames,
                   "Odometry from its transforms (TF) instead; without a topic odom base_link");
  arguments.option("--imu-topic NAME", topics.imu,
                   "Its inertial sensor (roll and pitch) where there are several");
  arguments.uncommon({"--image-topic", "--odometry-topic", "--odometry-frames", "--imu-topic"});
}

void declare_part(Arguments& arguments, PartArguments& part, bool every) {
  arguments.option("--from SECONDS", part.from_s,
                   "Begin this long after the first picture of a recording with stamps");
  arguments.option("--to SECONDS", part.to_s, "End this long after its first picture");
  if (every) {
    arguments.option("--every N|TIME", part.every,
                     "Take every N-th picture only, or one in this time, such as 0.5s");
  }
  arguments.uncommon({"--from", "--to"});
  if (every) arguments.uncommon({"--every"});
}

void declare_pictures(Arguments& arguments, PictureArguments& pictures) {
  declare_layout(arguments, pictures);
  declare_topics(arguments, pictures.topics);
  declare_part(arguments, pictures.part, true);
}

std::vector<std::string> recording_options() {
  return {"--image-topic", "--odometry-topic", "--odometry-frames", "--imu-topic", "--from",
          "--to",          "--every"};
}

bool is_one_picture(const std::string& input) {
  std::error_code ignored;
  return !fs::is_directory(input, ignored) && !recordings::is_recording(input) &&
         !recordings::is_video(input) && !recordings::is_live(input);
}

PictureSelection selection_of(const PartArguments& part) {
  PictureSelection selection{.from_s = part.from_s, .to_s = part.to_s};
  for (const auto& [flag, value] : {std::pair{"--from", part.from_s}, {"--to", part.to_s}}) {
    if (value && *value < 0.0) {
      throw UsageError(std::string(flag) + " is " + to_text(*value) + "; allowed: 0 or more");
    }
  }
  if (part.from_s && part.to_s && *part.from_s > *part.to_s) {
    throw UsageError("--from is " + to_text(*part.from_s) + "; allowed: at most --to, which is " +
                     to_text(*part.to_s));
  }
  if (!part.every) return selection;
  std::string text = *part.every;
  const bool is_time = text.ends_with('s');
  if (is_time) text.pop_back();
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool number = error == std::errc() && end == text.data() + text.size();
  constexpr double most = 1e9;
  const bool fits = number && value > 0.0 && value <= most &&
                    (is_time || (value >= 1.0 && value == std::floor(value)));
  if (!fits) {
    throw UsageError("--every is " + readable_line(*part.every) +
                     "; allowed: a whole number from 1 on, or seconds such as 0.5s");
  }
  if (is_time) {
    selection.every_s = value;
  } else {
    selection.every = static_cast<int>(value);
  }
  return selection;
}

std::optional<PictureSource> picture_source(const PictureArguments& pictures) {
  const bool nothing = !pictures.kind && !pictures.camera && !pictures.columns &&
                       !pictures.forward_column && !pictures.elevation_deg;
  if (nothing) return std::nullopt;
  const std::string kind = pictures.kind.value_or(pictures.camera ? "mirror" : "");
  if (kind.empty()) throw UsageError("--kind is missing: panorama, equirectangular or mirror");

  PictureSource source;
  std::optional<ElevationBand> band;
  if (pictures.elevation_deg) {
    const auto [low, high] = *pictures.elevation_deg;
    if (low < -90.0 || high > 90.0 || high - low < min_band_deg) {
      throw UsageError("--elevation-deg is " + to_text(low) + " " + to_text(high) +
                       "; allowed: LOW HIGH in degrees, -90 <= LOW < HIGH <= 90, 5 degrees apart "
                       "or more");
    }
    band = ElevationBand{radians(low), radians(high)};
  }
  if (kind == "mirror") {
    if (!pictures.camera) {
      throw UsageError(
          "--camera is missing: pictures of a mirror need the file that panonav "
          "calibrate writes");
    }
    if (pictures.columns || pictures.forward_column) {
      throw UsageError(
          "--columns-run and --forward-column do not go with a mirror; the camera "
          "file says where forward is");
    }
    source.kind = PictureKind::mirror;
    auto camera = read_camera(*pictures.camera);
    source.camera = std::move(camera.camera);
    source.mask = std::move(camera.mask);
    source.layout.kept_elevations = band;
    return source;
  }
  if (pictures.camera) throw UsageError("--camera goes only with --kind mirror");
  if (pictures.columns == "counter-clockwise") {
    source.layout.direction = ColumnDirection::counter_clockwise;
  }
  if (pictures.forward_column) {
    if (*pictures.forward_column < 0.0 || *pictures.forward_column > 1.0) {
      throw UsageError("--forward-column is " + to_text(*pictures.forward_column) +
                       "; allowed: 0 to 1");
    }
    source.layout.forward_column = *pictures.forward_column;
  }
  if (kind == "equirectangular") {
    source.kind = PictureKind::equirectangular;
    source.layout.elevations = ElevationBand{radians(-90.0), radians(90.0)};
    source.layout.kept_elevations = band;
  } else {
    source.layout.elevations = band;
  }
  return source;
}

namespace {

void refuse_topics(const std::string& input, const recordings::RecordingTopics& topics) {
  for (const auto& [typed, flag] : {std::pair{topics.image.has_value(), "--image-topic"},
                                    {topics.odometry.has_value(), "--odometry-topic"},
                                    {topics.odometry_frames.has_value(), "--odometry-frames"},
                                    {topics.imu.has_value(), "--imu-topic"}}) {
    if (typed) throw UsageError(input + " has no topics; leave out " + flag);
  }
}

Dataset open_topics(const std::string& input, const recordings::RecordingTopics& topics,
                    const PictureSource& source, Session& session) {
  if (topics.odometry && topics.odometry_frames) {
    throw UsageError("--odometry-topic and --odometry-frames do not go together");
  }
  recordings::RecordedDataset recorded = recordings::read_recording(input, source, topics);
  for (const std::string& warning : recorded.warnings) session.note(input + ": " + warning);
  return std::move(recorded.dataset);
}

}  // namespace

namespace {

/// All pictures; of a video those that are selected, as the others need not be decoded then.
Dataset open_whole(const std::string& input, const PictureArguments& pictures,
                   const PictureSelection& selection,
                   const std::optional<PictureSource>& remembered, Session& session) {
  const auto stated = picture_source(pictures);
  std::error_code ignored;
  if (input == "-") {
    const auto& source = stated ? stated : remembered;
    if (!source) throw UsageError("say what the pictures on standard input show with --kind");
    if (pictures.recursive) throw UsageError("--recursive goes with a folder");
    refuse_topics("standard input", pictures.topics);
    return recordings::read_jpeg_stream(STDIN_FILENO, "standard input", *source);
  }
  if (recordings::is_live(input)) {
    throw UsageError(input + " is a live source; allowed with run, localise, memorise and track");
  }
  if (!fs::exists(input, ignored)) throw FileError(input, "there is no such file or folder");
  if (recordings::is_recording(input)) {
    const auto& source = stated ? stated : remembered;
    if (!source) {
      throw UsageError(input +
                       " does not say how its pictures lie; say what they show with --kind");
    }
    if (pictures.recursive) throw UsageError(input + " is a recording; leave out --recursive");
    Dataset recording = open_topics(input, pictures.topics, *source, session);
    if (stated) note_other_kind(recording, session);
    return recording;
  }
  refuse_topics(input, pictures.topics);
  if (recordings::is_video(input) && fs::is_regular_file(input, ignored)) {
    const auto& source = stated ? stated : remembered;
    if (!source) {
      throw UsageError(input + " is a video; say what its pictures show with --kind");
    }
    if (pictures.recursive) throw UsageError(input + " is a video; leave out --recursive");
    Dataset recording = recordings::read_video(input, *source, selection);
    if (stated) note_other_kind(recording, session);
    return recording;
  }
  if (fs::is_directory(input, ignored) && fs::exists(fs::path(input) / "dataset.toml", ignored)) {
    if (stated) {
      throw UsageError(input +
                       " has a dataset.toml, which says how its pictures lie; leave out "
                       "--kind and its companions");
    }
    if (pictures.recursive) {
      throw UsageError(input +
                       " has a dataset.toml, which names its pictures; leave out "
                       "--recursive");
    }
    Dataset recording = read_dataset(input);
    note_low_band(recording, session);
    note_other_kind(recording, session);
    return recording;
  }
  const auto& source = stated ? stated : remembered;
  if (!source) {
    throw UsageError(input + " has no dataset.toml; say what the pictures show with --kind");
  }
  const bool is_folder = fs::is_directory(input, ignored);
  if (pictures.recursive && !is_folder) {
    throw UsageError(input + " is one picture; --recursive goes with a folder");
  }
  if (!is_folder && (pictures.part.from_s || pictures.part.to_s || pictures.part.every)) {
    throw UsageError(input + " is one picture; --from, --to and --every go with a recording");
  }
  Dataset recording = is_folder
                          ? read_picture_folder(input, *source, {.recursive = pictures.recursive})
                          : single_picture(input, *source);
  note_left_out(recording, session);
  if (stated) note_other_kind(recording, session);
  return recording;
}

void select_part(Dataset& recording, const PictureSelection& selection, const std::string& input) {
  if (selection.by_time() || selection.every > 1) {
    if (!recordings::is_video(input)) select_pictures(recording, selection);
  }
}

}  // namespace

Dataset open_recording(const std::string& input, const PictureArguments& pictures,
                       const std::optional<PictureSource>& remembered, Session& session) {
  const PictureSelection selection = selection_of(pictures.part);
  Dataset recording = open_whole(input, pictures, selection, remembered, session);
  select_part(recording, selection, input);
  return recording;
}

const PictureArguments& checked_beside(const PictureArguments& pictures, const MemoryFile& memory) {
  const MemoryHeader& header = memory.header();
  if (!pictures.elevation_deg) return pictures;
  const auto [low, high] = *pictures.elevation_deg;
  const std::string typed =
      "--elevation-deg is " + short_number(low) + " " + short_number(high) + "; allowed: ";
  if (!header.elevations) {
    throw UsageError(typed + "none, as " + memory.path().string() +
                     " does not know the elevations of its views; leave it out or start a new "
                     "memory");
  }
  const double kept_low = degrees(header.elevations->bottom_rad);
  const double kept_high = degrees(header.elevations->top_rad);
  constexpr double rounding_deg = 1e-4;
  if (std::abs(low - kept_low) > rounding_deg || std::abs(high - kept_high) > rounding_deg) {
    throw UsageError(typed + short_number(kept_low) + " " + short_number(kept_high) +
                     ", the band of " + memory.path().string() +
                     "; leave it out or start a new memory");
  }
  return pictures;
}

Dataset open_recording(const std::string& input, const PictureArguments& pictures,
                       const MemoryFile& memory, Session& session) {
  Dataset recording = open_recording(input, pictures, memory.header().source, session);
  (void)checked_beside(pictures, memory);
  return recording;
}

Dataset read_run(const std::string& input, const recordings::RecordingTopics& topics,
                 const PartArguments& part, const MemoryFile& memory, Session& session) {
  std::error_code ignored;
  if (fs::exists(fs::path(input) / "dataset.toml", ignored)) {
    refuse_topics(input, topics);
    Dataset run = read_dataset(input);
    select_part(run, selection_of(part), input);
    return run;
  }
  PictureArguments pictures;
  pictures.topics = topics;
  pictures.part = part;
  return open_recording(input, pictures, memory, session);
}

std::string how_to_add(const std::string& folder, const std::string& columns,
                       const std::string& values) {
  if (recordings::is_recording(folder)) {
    return "; of a recording odometry is nav_msgs/Odometry or TF, poses are those of /ground_truth";
  }
  std::error_code ignored;
  const bool described = fs::exists(fs::path(folder) / "dataset.toml", ignored);
  const Dataset recording = described ? read_dataset(folder) : read_picture_folder(folder, {});
  const std::string table = "the columns file," + columns +
                            " and a line for each picture, such as " +
                            readable_line(recording.entries.front().file) + "," + values;
  if (described) return "; its table needs " + table;
  return "; write " + (fs::path(folder) / "dataset.toml").string() +
         " with [images] kind = \"panorama\" (or equirectangular, mirror) and [poses] file = "
         "\"poses.csv\", and poses.csv with " +
         table;
}

Dataset read_described(const std::string& folder, const PictureArguments& pictures,
                       const std::optional<PictureSource>& remembered, const std::string& columns,
                       const std::string& values, Session& session) {
  if (recordings::is_recording(folder) || recordings::is_video(folder) ||
      picture_source(pictures)) {
    return open_recording(folder, pictures, remembered, session);
  }
  refuse_topics(folder, pictures.topics);
  std::error_code ignored;
  if (fs::is_directory(folder, ignored) &&
      !fs::exists(fs::path(folder) / "dataset.toml", ignored)) {
    throw FileError(folder, "has no dataset.toml, so nothing tells where its pictures were taken" +
                                how_to_add(folder, columns, values));
  }
  Dataset recording = read_dataset(folder);
  select_part(recording, selection_of(pictures.part), folder);
  return recording;
}

}  // namespace panonav::command
