#include "panonav/pipeline/orientation_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <variant>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/observation_source.hpp"

namespace panonav {

namespace {

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

/// Returns the images with a pose and a heading, or else those with odometry, or else all with
/// headings along their path, if all have positions.
std::vector<PosedImage> list_posed_images(const Dataset& recording) {
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
  if (!posed.empty()) return posed;
  if (!with_odometry.empty()) return with_odometry;
  const std::vector<Pose2> along_path = dataset_poses(recording);
  for (std::size_t i = 0; i < along_path.size(); ++i) {
    posed.push_back({along_path[i], floor_of(recording.entries[i].file), i});
  }
  return posed;
}

}  // namespace

OrientationEvidence collect_orientation_evidence(
    std::span<const PosedImage> images,
    const std::function<std::optional<HomingView>(std::size_t)>& view_at) {
  OrientationEvidence evidence;
  const std::size_t compared = std::min(images.size(), max_compared);
  for (std::size_t k = 0; k < compared; ++k) {
    const std::size_t at = k * images.size() / compared;
    const auto home = view_at(images[at].index);
    if (!home) continue;
    const std::size_t moved = find_next(images, at, is_move);
    const std::size_t turned = find_next(images, at, is_turn);
    std::set<std::size_t> others{moved, turned, find_sideways(images, at, moved)};
    others.erase(images.size());
    for (const std::size_t other : others) {
      const auto current = view_at(images[other].index);
      if (!current) continue;
      evidence.add(*home, *current, inverse(images[at].pose) * images[other].pose);
    }
  }
  return evidence;
}

OrientationEvidence collect_orientation_evidence(const Dataset& recording,
                                                 const ViewEncoder& encoder) {
  const auto view_at = [&](std::size_t index) -> std::optional<HomingView> {
    try {
      return homing_view(encoder.signature(encoder.read(recording.entries[index])));
    } catch (const Error&) {
      return std::nullopt;
    }
  };
  return collect_orientation_evidence(list_posed_images(recording), view_at);
}

OrientationEvidence collect_orientation_evidence(const Dataset& recording,
                                                 const MemoryFile& memory) {
  const auto view_at = [&](std::size_t index) -> std::optional<HomingView> {
    const auto view = memory.find(recording.entries[index].file);
    if (!view) return std::nullopt;
    return homing_view(memory.load(std::span(&*view, 1)), *view);
  };
  return collect_orientation_evidence(list_posed_images(recording), view_at);
}

std::optional<PictureSource> correct_orientation(PictureSource source,
                                                 const OrientationFault& fault) {
  if (!source.camera) {
    correct_columns(fault, source.layout.direction, source.layout.forward_column);
    return source;
  }
  Camera& camera = *source.camera;
  if (lens_count(camera) == 2) return std::nullopt;
  if (std::holds_alternative<EquirectangularModel>(camera.model)) {
    correct_columns(fault, camera.direction, camera.forward_column);
    return source;
  }
  if (fault.is_mirrored) camera.direction = opposite(camera.direction);
  camera.forward_angle_rad =
      wrap_angle(camera.forward_angle_rad - azimuth_sign(camera.direction) * fault.turn_rad);
  return source;
}

}  // namespace panonav
