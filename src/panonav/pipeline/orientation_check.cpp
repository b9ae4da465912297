#include "panonav/pipeline/orientation_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <variant>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/motion/trajectory_error.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "panonav/pipeline/view_encoder.hpp"

namespace panonav {

namespace {

/// A view or an image with its place.
struct PosedImage {
  Pose2 pose;              // of the robot
  std::string_view floor;  // with its own frame of poses
  std::size_t index = 0;   // number by which the view is read
};

constexpr std::size_t max_compared = 60;
constexpr std::size_t max_next = 100;
constexpr double min_step_m = 0.1;
constexpr double min_turn_rad = radians(10.0);
constexpr double max_turn_step_m = 2.0;
/// Difference between the directions of two images that show more than one of them.
constexpr double min_other_direction_rad = radians(45.0);

/// Returns the number of the first of the next images on the same floor whose pose, seen from image
/// `at`, `is_wanted`; the number of images if there is none.
template <class Wanted>
std::size_t find_next(std::span<const PosedImage> images, std::size_t at, const Wanted& is_wanted) {
  for (std::size_t i = at + 1; i < images.size() && i <= at + max_next; ++i) {
    if (images[i].floor != images[at].floor) break;
    if (is_wanted(inverse(images[at].pose) * images[i].pose)) return i;
  }
  return images.size();
}

bool is_move(const Pose2& step) {
  return std::hypot(step.x_m, step.y_m) >= min_step_m;
}

bool is_turn(const Pose2& step) {
  return std::abs(step.heading_rad) >= min_turn_rad &&
         std::hypot(step.x_m, step.y_m) <= max_turn_step_m;
}

/// Returns the number of the nearest image a step away in another direction than that of `next`;
/// the number of images if there is none.
std::size_t find_sideways(std::span<const PosedImage> images, std::size_t at, std::size_t next) {
  const Point2 here = images[at].pose.position();
  const auto direction_of = [&](std::size_t i) {
    return std::atan2(images[i].pose.y_m - here.y_m, images[i].pose.x_m - here.x_m);
  };
  std::size_t best = images.size();
  double best_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < images.size(); ++i) {
    const double off_m = distance(here, images[i].pose.position());
    if (off_m < min_step_m || off_m >= best_m || images[i].floor != images[at].floor) continue;
    if (next < images.size() &&
        std::abs(angle_difference(direction_of(i), direction_of(next))) < min_other_direction_rad) {
      continue;
    }
    best = i;
    best_m = off_m;
  }
  return best;
}

ColumnDirection opposite(ColumnDirection direction) {
  return direction == ColumnDirection::clockwise ? ColumnDirection::counter_clockwise
                                                 : ColumnDirection::clockwise;
}

/// Moves a fraction of the circle into [0, 1).
double wrap_fraction(double turns) {
  return turns - std::floor(turns);
}

/// Corrects a direction and a forward column.
void correct_columns(const OrientationFault& fault, ColumnDirection& direction,
                     double& forward_column) {
  if (fault.is_mirrored) direction = opposite(direction);
  forward_column = wrap_fraction(forward_column - azimuth_sign(direction) * fault.turn_rad /
                                                      (2.0 * std::numbers::pi));
}

/// Posed images of a recording.
struct PosedRecording {
  std::vector<PosedImage> images;
  bool has_headings_of_path = false;
};

/// Returns the images with a pose and a heading, or else those with odometry, if half of the images
/// have one; or else all with headings along their path, if all have positions.
PosedRecording list_posed_images(const Dataset& recording) {
  std::vector<PosedImage> posed;
  std::vector<PosedImage> with_odometry;
  for (std::size_t i = 0; i < recording.entries.size(); ++i) {
    const DatasetEntry& entry = recording.entries[i];
    const std::string_view floor = floor_of(entry.file);
    if (entry.pose && entry.pose->heading_rad) {
      posed.push_back({{entry.pose->x_m, entry.pose->y_m, *entry.pose->heading_rad}, floor, i});
    }
    if (entry.odometry) with_odometry.push_back({*entry.odometry, floor, i});
  }
  for (const auto& images : {posed, with_odometry}) {
    if (2 * images.size() >= recording.entries.size()) return {images, false};
  }
  PosedRecording along_path{{}, true};
  const std::vector<Pose2> poses = dataset_poses(recording);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    along_path.images.push_back({poses[i], floor_of(recording.entries[i].file), i});
  }
  return along_path;
}

using ImagePair = std::pair<std::size_t, std::size_t>;

std::vector<ImagePair> choose_pairs(std::span<const PosedImage> images) {
  std::vector<ImagePair> pairs;
  const std::size_t compared = std::min(images.size(), max_compared);
  for (std::size_t k = 0; k < compared; ++k) {
    const std::size_t at = k * images.size() / compared;
    const std::size_t moved = find_next(images, at, is_move);
    std::set<std::size_t> others{moved, find_next(images, at, is_turn),
                                 find_sideways(images, at, moved)};
    others.erase(images.size());
    for (const std::size_t other : others) pairs.emplace_back(at, other);
  }
  return pairs;
}

/// Views of images by their number; without those that cannot be read.
using ViewsByImage = std::map<std::size_t, HomingView>;

OrientationEvidence compare_pairs(std::span<const PosedImage> images,
                                  std::span<const ImagePair> pairs, const ViewsByImage& views) {
  OrientationEvidence evidence;
  for (const auto& [at, other] : pairs) {
    const auto home = views.find(at);
    const auto current = views.find(other);
    if (home == views.end() || current == views.end()) continue;
    evidence.add(home->second, current->second, inverse(images[at].pose) * images[other].pose);
  }
  return evidence;
}

std::vector<std::size_t> list_images(std::span<const ImagePair> pairs) {
  std::set<std::size_t> images;
  for (const auto& [at, other] : pairs) images.insert({at, other});
  return {images.begin(), images.end()};
}

/// Loads the views of a memory; `view_of`: id of the view of an image, nullopt if there is none.
template <class ViewOf>
OrientationEvidence compare_views(const MemoryFile& memory, std::span<const PosedImage> images,
                                  const ViewOf& view_of) {
  const std::vector<ImagePair> pairs = choose_pairs(images);
  std::map<ViewId, std::vector<std::size_t>> images_by_view;
  for (const std::size_t image : list_images(pairs)) {
    if (const std::optional<ViewId> view = view_of(images[image])) {
      images_by_view[*view].push_back(image);
    }
  }
  std::vector<ViewId> ids;
  for (const auto& [view, shown] : images_by_view) ids.push_back(view);
  const VisualMemory loaded = memory.load(ids);
  ViewsByImage views;
  for (const auto& [view, shown] : images_by_view) {
    if (!loaded.contains(view)) continue;  // on a server, another program may have removed it
    for (const std::size_t image : shown) views.emplace(image, homing_view(loaded, view));
  }
  return compare_pairs(images, pairs, views);
}

/// Makes the encoder for signatures of the default size from the first image that has structure.
std::optional<ViewEncoder> make_encoder(const Dataset& recording,
                                        std::span<const std::size_t> images, Executor& executor) {
  for (const std::size_t image : images) {
    try {
      const Observation first = read_observation(recording.entries[image], PictureColours::grey);
      return ViewEncoder(
          make_memory_header(std::span(&first, 1), recording.source, {}, {}, executor),
          recording.source);
    } catch (const Error&) {
      continue;
    }
  }
  return std::nullopt;
}

OrientationEvidence compare_images(const Dataset& recording, std::span<const PosedImage> images,
                                   Executor& executor) {
  const std::vector<ImagePair> pairs = choose_pairs(images);
  const std::vector<std::size_t> read = list_images(pairs);
  std::vector<std::size_t> entries;
  for (const std::size_t image : read) entries.push_back(images[image].index);
  const auto encoder = make_encoder(recording, entries, executor);
  if (!encoder) return {};
  ViewsByImage views;
  process_in_order(
      read.size(), executor,
      [&](std::size_t i) {
        return homing_view(encoder->signature(
            read_observation(recording.entries[entries[i]], PictureColours::grey)));
      },
      [&](std::size_t i, HomingView&& view) { views.emplace(read[i], std::move(view)); },
      [](std::size_t, const std::exception_ptr&) {});
  return compare_pairs(images, pairs, views);
}

/// Returns the settings that correct a source.
std::vector<OrientationSetting> list_settings(const OrientationFault& fault,
                                              const PictureSource& corrected) {
  std::vector<OrientationSetting> settings;
  const auto& camera = corrected.camera;
  if (fault.is_mirrored) {
    const auto direction = camera ? camera->direction : corrected.layout.direction;
    settings.push_back({camera ? "direction" : "columns", std::string(to_string(direction))});
  }
  if (fault.turn_rad == 0.0) return settings;
  if (camera && !std::holds_alternative<EquirectangularModel>(camera->model)) {
    settings.push_back({"forward_angle_deg", format_fixed(degrees(camera->forward_angle_rad), 0)});
  } else {
    settings.push_back(
        {"forward_column",
         format_fixed(camera ? camera->forward_column : corrected.layout.forward_column, 3)});
  }
  return settings;
}

ColumnDirection stated_direction(const PictureSource& source) {
  return source.camera ? source.camera->direction : source.layout.direction;
}

/// Says on which evidence the direction of columns is known.
std::string describe_direction(const OrientationCheck& check, const PictureSource& source) {
  const bool is_right = *check.columns_right;
  const ColumnDirection stated = stated_direction(source);
  const OrientationEvidence& evidence = check.evidence;
  const std::size_t agreeing =
      is_right ? evidence.turns() - evidence.opposite_turns() : evidence.opposite_turns();
  return "columns run " + std::string(to_string(is_right ? stated : opposite(stated))) +
         (is_right ? "" : ", not " + std::string(to_string(stated))) + ", by " +
         (agreeing > 0 ? std::to_string(agreeing) + " of " + format_count(evidence.turns(), "turn")
                       : "motions in several directions");
}

std::string describe_forward(const OrientationCheck& check) {
  const double turn_rad = check.fault ? check.fault->turn_rad : 0.0;
  return (turn_rad == 0.0
              ? "forward is where it is stated"
              : "forward is " + format_fixed(degrees(std::abs(turn_rad)), 0) + " degrees to the " +
                    (turn_rad < 0.0 ? "left" : "right") + " of the stated direction") +
         ", by " + std::to_string(check.evidence.agreeing_moves()) + " of " +
         format_count(check.evidence.moves(), "motion") +
         (check.has_headings_of_path ? " (if the robot faces where it drives)" : "");
}

OrientationCheck judge(const OrientationEvidence& evidence, const PictureSource& source,
                       bool has_headings_of_path) {
  OrientationCheck check{.evidence = evidence,
                         .columns_right = evidence.runs_as_stated(),
                         .forward_right = {},
                         .fault = evidence.find_fault(),
                         .has_headings_of_path = has_headings_of_path,
                         .corrected = {},
                         .settings = {},
                         .explanation = {}};
  if (const auto turn_rad = evidence.find_turn_rad()) check.forward_right = *turn_rad == 0.0;
  if (check.fault) check.corrected = correct_orientation(source, *check.fault);
  if (check.corrected) check.settings = list_settings(*check.fault, *check.corrected);
  if (check.columns_right) check.explanation = describe_direction(check, source);
  if (check.forward_right) {
    check.explanation += (check.columns_right ? "; " : "") + describe_forward(check);
  }
  return check;
}

}  // namespace

OrientationCheck check_orientation(const Dataset& recording, Executor& executor) {
  const auto [images, has_headings_of_path] = list_posed_images(recording);
  return judge(compare_images(recording, images, executor), recording.source, has_headings_of_path);
}

OrientationCheck check_orientation(const Dataset& recording, const MemoryFile& memory) {
  const auto [images, has_headings_of_path] = list_posed_images(recording);
  return judge(compare_views(memory, images,
                             [&](const PosedImage& image) {
                               return memory.find(recording.entries[image.index].file);
                             }),
               recording.source, has_headings_of_path);
}

OrientationCheck check_orientation(const MemoryFile& memory) {
  if (has_positions_from_map(memory)) return {};
  const std::vector<MemoryFile::ViewPlace> places = memory.places();
  std::vector<PosedImage> images;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& pose = places[i].pose;
    if (!pose || !pose->heading_rad) continue;
    images.push_back({{pose->x_m, pose->y_m, *pose->heading_rad}, places[i].floor, i});
  }
  return judge(compare_views(memory, images,
                             [&](const PosedImage& image) {
                               return std::optional(places[image.index].view);
                             }),
               memory.header().source, false);
}

OrientationCheck check_orientation(const MemoryFile& memory, const TrajectoryFile& truth,
                                   double max_stamp_difference_s) {
  if (!truth.has_rotations) return {};
  const VisualMemory loaded = memory.load();
  std::vector<std::pair<double, ViewId>> stamps;
  for (const ViewId view : loaded.views()) {
    if (const auto& stamp_s = loaded.info(view).stamp_s) stamps.emplace_back(*stamp_s, view);
  }
  std::ranges::sort(stamps);
  std::vector<StampedPose3> stamped;
  for (const auto& [stamp_s, view] : stamps) stamped.push_back({stamp_s, {}});
  std::vector<PosedImage> images;
  for (const PosePair& pair : pair_by_stamp(stamped, truth.poses, max_stamp_difference_s)) {
    const std::string_view floor = floor_of(loaded.info(stamps[pair.estimate].second).name);
    images.push_back({to_pose2(truth.poses[pair.truth].pose), floor, pair.estimate});
  }
  return judge(compare_views(memory, images,
                             [&](const PosedImage& image) {
                               return std::optional(stamps[image.index].second);
                             }),
               memory.header().source, false);
}

std::optional<PictureSource> correct_orientation(PictureSource source,
                                                 const OrientationFault& fault) {
  if (!source.camera) {
    correct_columns(fault, source.layout.direction, source.layout.forward_column);
    return source;
  }
  Camera& camera = *source.camera;
  if (std::holds_alternative<EquirectangularModel>(camera.model)) {
    correct_columns(fault, camera.direction, camera.forward_column);
    return source;
  }
  if (!has_vertical_axis(camera)) return std::nullopt;
  if (fault.is_mirrored) camera.direction = opposite(camera.direction);
  camera.forward_angle_rad =
      wrap_angle(camera.forward_angle_rad - azimuth_sign(camera.direction) * fault.turn_rad);
  return source;
}

std::string to_toml(const OrientationSetting& setting) {
  const bool is_number = setting.value.find_first_not_of("-0123456789.") == std::string::npos;
  return setting.field + (is_number ? " = " + setting.value : " = \"" + setting.value + "\"");
}

std::optional<std::string> replace_orientation(std::string_view dataset_toml,
                                               std::span<const OrientationSetting> settings) {
  std::string text;
  bool is_in_images = false;
  bool has_images = false;
  while (!dataset_toml.empty()) {
    const std::size_t end = std::min(dataset_toml.find('\n'), dataset_toml.size());
    const std::string_view line = dataset_toml.substr(0, end);
    dataset_toml.remove_prefix(std::min(end + 1, dataset_toml.size()));
    const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
    const std::string_view content = line.substr(begin);
    const std::string_view key = content.substr(0, content.find_first_of(" \t=\r"));
    const bool is_replaced =
        is_in_images &&
        std::ranges::find(settings, key, &OrientationSetting::field) != settings.end();
    if (!is_replaced) text.append(line).append("\n");
    if (!content.starts_with('[')) continue;
    is_in_images = content.starts_with("[images]");
    if (!is_in_images) continue;
    has_images = true;
    for (const OrientationSetting& setting : settings) text.append(to_toml(setting)).append("\n");
  }
  if (!has_images) return std::nullopt;
  return text;
}

void write_orientation(const std::filesystem::path& path, const Dataset& recording,
                       const OrientationCheck& check) {
  if (!check.corrected) throw ContractError("check", "without a correction", "one with");
  if (check.corrected->camera) {
    return write_camera(path, {*check.corrected->camera, check.corrected->mask, {}});
  }
  const auto file = recording.folder / "dataset.toml";
  std::string settings;
  for (const OrientationSetting& setting : check.settings) {
    settings += (settings.empty() ? "" : ", ") + to_toml(setting);
  }
  if (!has_dataset_file(recording.folder)) {
    throw FileError(recording.folder.string(),
                    "has no dataset.toml to correct; right are " + settings);
  }
  const auto bytes = read_file(file, std::size_t{1} << 20U);
  const auto text = replace_orientation({reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                                        check.settings);
  if (!text) throw FileError(file.string(), "has no line [images]; right are " + settings);
  write_file(path, std::string_view(*text));
}

}  // namespace panonav
