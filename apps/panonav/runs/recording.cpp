#include "runs/recording.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string_view>

#include "panonav/camera/model_parameters.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/dataset_readers.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/media_kind.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "panonav_recordings/live_pictures.hpp"
#include "panonav_recordings/recording.hpp"
#include "runs/picture_layout.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

/// Replaces names of library options by flags whose names differ; `replace_options_by_flags`
/// handles the other options.
std::string replace_option_names(std::string text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> flags{{
      {"'source' (a PictureSource)", "--kind"},
      {"'source'", "--kind and its companions"},
      {"'from_s'", "--from"},
      {"'to_s'", "--to"},
  }};
  for (const auto& [name, flag] : flags) {
    for (auto at = text.find(name); at != text.npos; at = text.find(name, at + flag.size())) {
      text.replace(at, name.size(), flag);
    }
  }
  return text;
}

}  // namespace

void declare_topics(Arguments& arguments, InputOptions::Topics& topics) {
  arguments.option("--image-topic NAME", topics.image,
                   "Topic of the images in a recording (MCAP, rosbag2, ROS 1 bag); by default, a "
                   "line names the one that is used of several");
  arguments.option(
      "--odometry-topic NAME", topics.odometry,
      "Topic of the odometry (nav_msgs/Odometry); needed if there are several such topics");
  arguments.option("--odometry-frames", "ODOM BASE", topics.odometry_frames,
                   "Read the odometry from the transforms (TF) between these two frames; if there "
                   "is no odometry topic, the default is odom base_link, or odom base_footprint");
  arguments.option(
      "--imu-topic NAME", topics.imu,
      "Topic of the inertial sensor (roll and pitch); needed if there are several such topics");
  arguments.hide_from_help(
      {"--image-topic", "--odometry-topic", "--odometry-frames", "--imu-topic"});
}

void declare_part(Arguments& arguments, PartArguments& part, bool every) {
  arguments.option("--from SECONDS", part.from_s,
                   "Skip the first SECONDS of the recording; the images must have time stamps");
  arguments.option("--to SECONDS", part.to_s,
                   "Stop SECONDS after the first image of the recording");
  if (every) {
    arguments.option("--every N|TIME", part.every,
                     "Use only every N-th image, or only one image per TIME, for example 0.5s");
  }
  arguments.hide_from_help({"--from", "--to"});
  if (every) arguments.hide_from_help({"--every"});
}

void declare_pictures(Arguments& arguments, PictureArguments& pictures) {
  declare_picture_layout(arguments, pictures);
  declare_topics(arguments, pictures.topics);
  declare_part(arguments, pictures.part, true);
}

std::vector<std::string> recording_flags() {
  return {"--image-topic", "--odometry-topic", "--odometry-frames", "--imu-topic", "--from",
          "--to",          "--every"};
}

bool is_one_picture(const std::string& input) {
  std::error_code ignored;
  return !fs::is_directory(input, ignored) && !find_dataset_reader(input) &&
         !recordings::is_live(input);
}

Dataset::Selection to_selection(const PartArguments& part) {
  Dataset::Selection selection{.from_s = part.from_s, .to_s = part.to_s};
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
  constexpr double max_value = 1e9;
  const bool fits = read_number(text, value) && value > 0.0 && value <= max_value &&
                    (is_time || (value >= 1.0 && value == std::floor(value)));
  if (!fits) {
    throw UsageError("--every is " + to_readable_line(*part.every) +
                     "; allowed: a whole number from 1 on, or seconds such as 0.5s");
  }
  if (is_time) {
    selection.every_s = value;
  } else {
    selection.every = static_cast<int>(value);
  }
  return selection;
}

namespace {

/// Returns the elevations of the rows of panoramas; nullopt if they are not known.
std::optional<ElevationBand> find_used_band(const PictureSource& source) {
  if (source.kind == PictureKind::panorama) return source.layout.elevations;
  if (source.layout.kept_elevations) return source.layout.kept_elevations;
  if (source.camera) return visible_elevations(*source.camera);
  return default_equirectangular_band;
}

/// True if the first picture is a file that cannot be read or does not fit the layout, so that an
/// error will be the only line.
bool is_refused_later(const Dataset& opened) {
  const DatasetEntry& first = opened.entries.front();
  if (first.store) return false;
  try {
    require_picture_size(opened.source, read_image_size(first.path));
    return false;
  } catch (const Error&) {
    return true;
  }
}

}  // namespace

void note_unusable(const Dataset& recording, Session& session) {
  const auto& unusable = recording.unusable;
  if (unusable.empty()) return;
  constexpr std::size_t max_named = 3;
  std::string text = std::to_string(unusable.size()) + " of " +
                     format_count(unusable.size() + recording.entries.size(), "image") +
                     " cannot be used and are skipped: ";
  for (std::size_t i = 0; i < std::min(max_named, unusable.size()); ++i) {
    text += (i > 0 ? "; " : "") + to_readable_line(unusable[i].describe());
  }
  if (unusable.size() > max_named) {
    text += "; and " + std::to_string(unusable.size() - max_named) + " more";
  }
  session.note(text);
}

namespace {

/// True if the error is about a picture file that cannot be decoded. Other errors, such as a size
/// that does not fit a memory, would be those of all images.
bool is_about_damaged_picture(std::string_view message) {
  for (auto at = message.find(": "); at != message.npos; at = message.find(": ", at + 1)) {
    const fs::path file(message.substr(0, at));
    const MediaKind kind = identify_media_file(file);
    if (kind != MediaKind::picture && kind != MediaKind::foreign_picture) continue;
    try {
      std::vector<DatasetEntry> entries = read_single_picture(file, {}).entries;
      set_foreign_picture_stores(entries);
      static_cast<void>(read_picture(entries.front()));
    } catch (const FileError&) {
      return true;
    }
    return false;
  }
  return false;
}

}  // namespace

void SkippedImages::add(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const FileError& error) {
    if (!is_about_damaged_picture(error.what()) || ++skipped_count_ == image_count_) throw;
    session_.note("skipped: " + to_readable_line(error.what()));
  }
}

void note_other_camera(const PictureSource& images, const PictureSource& reference,
                       const std::string& input, Session& session) {
  if (!images.camera || images.kind == PictureKind::pinhole) return;
  const bool has_reference_camera = reference.camera.has_value();
  if (has_reference_camera && reference.camera->model == images.camera->model) return;
  const auto used = find_used_band(reference);
  if (!used) return;  // refused when the first image is compared
  const ElevationBand seen = visible_elevations(*images.camera);
  const double low_rad = std::max(used->bottom_rad, seen.bottom_rad);
  const double high_rad = std::min(used->top_rad, seen.top_rad);
  constexpr double tolerance_rad = 1e-3;
  const bool has_all =
      low_rad < used->bottom_rad + tolerance_rad && high_rad > used->top_rad - tolerance_rad;
  const auto in_degrees = [](double a_rad, double b_rad) {
    return format_number(degrees(a_rad), "deg") + " to " + format_number(degrees(b_rad), "deg") +
           " degrees";
  };
  session.note(
      "the camera of " + to_readable_line(input) + " (" +
      std::string(model_name(images.camera->model)) + ") is not that of the reference images (" +
      (has_reference_camera ? std::string(model_name(reference.camera->model)) : "panoramas") +
      "); " +
      (has_all ? "it shows all their elevations, " + in_degrees(low_rad, high_rad)
               : "of their elevations, " + in_degrees(used->bottom_rad, used->top_rad) +
                     ", both show " + in_degrees(low_rad, high_rad) +
                     "; the other rows are filled with the nearest visible row"));
}

void note_default_band(const PictureSource& source, const std::string& way, Session& session) {
  if (source.kind != PictureKind::equirectangular || source.layout.kept_elevations) return;
  const auto& [bottom_rad, top_rad] = default_equirectangular_band;
  session.note("Of the 360 degree images, the elevations from " +
               format_number(degrees(bottom_rad)) + " to " + format_number(degrees(top_rad)) +
               " degrees are used; to use another part: " + way);
}

Dataset open_recording(const std::string& input, const PictureArguments& pictures,
                       const std::optional<PictureSource>& remembered, Session& session) {
  const bool is_described = !find_dataset_reader(input) && has_dataset_file(input);
  const std::string band_in_file = "elevation_deg = [LOW, HIGH] below [images] in " +
                                   to_readable_line((fs::path(input) / "dataset.toml").string());
  if (is_described && pictures.elevation_deg) {
    throw UsageError(
        "--elevation-deg cannot be used where a dataset.toml describes the images; "
        "leave it out, or write " +
        band_in_file);
  }
  const InputOptions options{
      .source = make_picture_source(pictures, session),
      .default_source = remembered,
      .topics = pictures.topics,
      .selection = to_selection(pictures.part),
      .recursive = pictures.recursive,
      .further_videos = {pictures.further_videos.begin(), pictures.further_videos.end()},
      .ignore_gpano = pictures.ignore_gpano};
  if (recordings::is_live(input) && input != "-") {
    throw UsageError(input + " is a live source; allowed with localise, memorise and track");
  }
  try {
    Dataset opened = open_input(input, options);
    for (const std::string& warning : opened.warnings) session.note(replace_option_names(warning));
    if (pictures.check != PictureArguments::Check::none && can_have_table(input)) {
      leave_out_unusable_pictures(opened, session.executor(),
                                  pictures.check == PictureArguments::Check::heads);
    }
    note_unusable(opened, session);
    const std::string way = is_described ? band_in_file : elevation_flag;
    if (!remembered && !is_refused_later(opened)) note_default_band(opened.source, way, session);
    if (remembered) note_other_camera(opened.source, *remembered, input, session);
    return opened;
  } catch (const OptionError& error) {
    throw UsageError(replace_option_names(error.what()));
  } catch (const FileError& error) {
    const std::string reason = replace_option_names(error.what());
    if (std::string(error.what()).find("'source'") == std::string::npos) throw Error(reason);
    throw UsageError(reason + "; to find it out: panonav try " + quote_for_shell(input));
  }
}

void require_stored_band(const PictureArguments& pictures, const MemoryFile& memory) {
  const MemoryHeader& header = memory.header();
  if (!pictures.elevation_deg) return;
  const auto [low, high] = *pictures.elevation_deg;
  const std::string typed =
      "--elevation-deg is " + format_number(low) + " " + format_number(high) + "; allowed: ";
  if (!header.elevations) {
    throw UsageError(
        typed + "none, as " + memory.path().string() +
        " does not contain the elevations of its views; leave it out or start a new memory");
  }
  const double kept_low = degrees(header.elevations->bottom_rad);
  const double kept_high = degrees(header.elevations->top_rad);
  constexpr double rounding_deg = 1e-4;
  if (std::abs(low - kept_low) > rounding_deg || std::abs(high - kept_high) > rounding_deg) {
    throw UsageError(typed + format_number(kept_low) + " " + format_number(kept_high) +
                     ", the band of " + memory.path().string() +
                     "; leave it out or start a new memory");
  }
}

Dataset open_recording(const std::string& input, const PictureArguments& pictures,
                       const MemoryFile& memory, Session& session) {
  Dataset recording = open_recording(input, pictures, memory.header().source, session);
  require_stored_band(pictures, memory);
  return recording;
}

Dataset open_run(const std::string& input, const RunArguments& run, const MemoryFile& memory,
                 Session& session) {
  PictureArguments pictures;
  pictures.topics = run.topics;
  pictures.part = run.part;
  pictures.ignore_gpano = run.ignore_gpano;
  pictures.check = PictureArguments::Check::heads;
  pictures.further_videos = run.further_videos;
  return open_recording(input, pictures, memory, session);
}

bool has_incomparable_truth(const Dataset& run, const std::string& input, const MemoryFile& memory,
                            Session& session) {
  if (!has_positions_from_map(memory)) return false;
  if (std::ranges::any_of(run.entries,
                          [](const DatasetEntry& entry) { return entry.pose.has_value(); })) {
    session.note("the true positions of " + to_readable_line(input) +
                 " are not compared, as those of " + memory.path().string() +
                 " are of its map and have another frame; panonav evaluate aligns such paths");
  }
  return true;
}

void append_pose(std::vector<StampedPose>& trajectory, const StampedPose& pose,
                 const std::string& dataset, const std::string& file) {
  if (!trajectory.empty()) {
    const double previous_s = trajectory.back().stamp_s;
    if (pose.stamp_s == previous_s) return;
    if (pose.stamp_s < previous_s) {
      throw FileError(dataset, "stamp_s of " + file + " is " + to_text(pose.stamp_s) +
                                   "; allowed for --tum: " + to_text(previous_s) +
                                   ", the stamp before it, or more");
    }
  }
  trajectory.push_back(pose);
}

std::vector<double> trajectory_stamps(const Dataset& run, const std::string& verb,
                                      const std::string& dataset, const std::string& tum,
                                      Session& session) {
  std::vector<double> seconds;
  std::vector<StampedPose> trajectory;
  const bool has_stamps = find_known_fields(run).stamps;
  for (std::size_t i = 0; i < run.entries.size(); ++i) {
    seconds.push_back(has_stamps ? *run.entries[i].stamp_s : static_cast<double>(i));
    append_pose(trajectory, {seconds[i], {}}, dataset, run.entries[i].file);
  }
  if (trajectory.size() < seconds.size()) {
    session.note("panonav " + verb + ": " + std::to_string(seconds.size() - trajectory.size()) +
                 " of " + format_count(seconds.size(), "image") +
                 " have the stamp of the image before; " + tum + " gets one of each stamp");
  }
  if (!has_stamps) {
    session.note("panonav " + verb + ": " + dataset +
                 " has no column 'stamp_s'; instead of stamps, " + tum +
                 " has image numbers from 0");
  }
  return seconds;
}

TrajectoryUnits find_trajectory_units(const Dataset& run, LengthUnit lengths) {
  using Times = TrajectoryUnits::Times;
  return {.times = find_known_fields(run).stamps ? Times::stamps : Times::image_numbers,
          .is_metric = lengths == LengthUnit::metres};
}

bool can_have_table(const std::string& input) {
  std::error_code ignored;
  return fs::is_directory(input, ignored) && !recordings::is_recording(input);
}

std::string explain_columns(const std::string& folder, const std::string& columns,
                            const std::string& values) {
  const bool described = has_dataset_file(folder);
  const Dataset recording = described ? read_dataset(folder) : read_picture_folder(folder, {});
  const std::string table = "the columns file," + columns + " and a line for each image, such as " +
                            to_readable_line(recording.entries.front().file) + "," + values;
  if (described) return "; its table needs " + table;
  return "; write " + (fs::path(folder) / "dataset.toml").string() +
         " with [images] kind = \"panorama\" (or equirectangular, mirror) and [poses] file = "
         "\"poses.csv\", and poses.csv with " +
         table;
}

Dataset read_dataset_with_columns(const std::string& folder, const PictureArguments& pictures,
                                  const std::optional<PictureSource>& remembered,
                                  const std::string& columns, const std::string& values,
                                  Session& session) {
  if (can_have_table(folder) && !has_dataset_file(folder) && !states_layout(pictures)) {
    throw FileError(folder, "has no dataset.toml, so the positions of its images are unknown" +
                                explain_columns(folder, columns, values));
  }
  return open_recording(folder, pictures, remembered, session);
}

}  // namespace panonav::command
