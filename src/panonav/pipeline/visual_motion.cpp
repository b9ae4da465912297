#include "panonav/pipeline/visual_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/topological_mapper.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/motion/trajectory.hpp"
#include "panonav/pipeline/observation_source.hpp"

namespace panonav {

namespace {

/// A view with its position.
struct PosedOnFloor {
  ViewId view;
  FloorPosition position;
};

/// Returns the view nearest to a position at another position of the same floor; null if there is
/// none.
const PosedOnFloor* find_nearest(std::span<const PosedOnFloor> posed, const FloorPosition& from) {
  constexpr double rounding = 1e-9;  // relative error of squares
  const PosedOnFloor* nearest = nullptr;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const PosedOnFloor& other : posed) {
    const double x_m = other.position.point.x_m - from.point.x_m;
    const double y_m = other.position.point.y_m - from.point.y_m;
    if (x_m * x_m + y_m * y_m > nearest_m * nearest_m * (1.0 + rounding)) continue;
    const double off_m = distance(other.position, from);
    if (!(off_m > 0.0 && off_m < nearest_m)) continue;
    nearest = &other;
    nearest_m = off_m;
  }
  return nearest;
}

/// Estimates the scale in metres per unit of visual displacement, from nearest pairs of views with
/// positions.
double compute_scale(const VisualMemory& memory) {
  // Views of a memory are farther apart than images of a drive, and one iteration shortens such
  // displacements: the scale is 1.2 to 1.5 times too large in six scenes with a view every 0.5 m,
  // with eight iterations 1.06 to 1.25 times. More iterations change nothing.
  const VisualOdometryOptions options{.iterations = 8};
  std::vector<PosedOnFloor> posed;
  for (const ViewId view : memory.views()) {
    if (const auto position = find_position(memory.info(view))) posed.push_back({view, *position});
  }
  constexpr std::size_t sampled = 64;
  const std::size_t every = std::max<std::size_t>(1, posed.size() / sampled);
  std::vector<KnownLength> known;
  for (std::size_t i = 0; i < posed.size(); i += every) {
    const PosedOnFloor* const nearest = find_nearest(posed, posed[i].position);
    if (nearest == nullptr) continue;
    const auto step = visual_step(OdometryView(memory.signature(posed[i].view)),
                                  OdometryView(memory.signature(nearest->view)), options);
    if (step) {
      known.push_back({step->length_in_views, distance(posed[i].position, nearest->position)});
    }
  }
  return length_scale_m(known).value_or(options.scale_m);
}

/// True if an entry near this one has no odometry, so that its image gives motion or scale.
bool is_near_gap(std::span<const DatasetEntry> entries, std::size_t index) {
  const std::size_t first = index - std::min(index, gap_scale_images);
  const std::size_t count = std::min(index + gap_scale_images + 1, entries.size()) - first;
  return std::ranges::any_of(entries.subspan(first, count),
                             [](const DatasetEntry& entry) { return !entry.odometry; });
}

/// Motion read from the images of a run.
struct MotionByImages {
  std::vector<Pose2> poses;  ///< by the scale of the memory; changes only near gaps of odometry
  double scale_m = 1.0;      ///< that scale
  /// Steps to an entry from the one before it whose length is known by odometry.
  std::vector<std::optional<KnownLength>> known;

  /// Factor by which lengths in the gap of odometry `begin` .. `end` - 1 differ from `poses`.
  [[nodiscard]] double compute_length_factor(std::size_t begin, std::size_t end) const {
    std::vector<KnownLength> steps;
    const std::size_t last = std::min(end + gap_scale_images + 1, known.size());
    for (std::size_t i = begin - std::min(begin, gap_scale_images); i < last; ++i)
      if (known[i]) steps.push_back(*known[i]);
    return steps.size() < min_gap_scale_steps ? 1.0
                                              : length_scale_m(steps).value_or(scale_m) / scale_m;
  }
};

/// Sets the odometry of the entries that have none.
void fill_missing_odometry(std::span<DatasetEntry> entries, const MotionByImages& motion) {
  const std::vector<Pose2>& visual = motion.poses;
  const auto move_from = [&](std::size_t known, std::size_t i, double length_factor) {
    Pose2 moved = inverse(visual[known]) * visual[i];
    moved.x_m *= length_factor;
    moved.y_m *= length_factor;
    return *entries[known].odometry * moved;
  };
  const std::size_t none = entries.size();
  std::size_t before = none;
  for (std::size_t begin = 0; begin < entries.size(); ++begin) {
    if (entries[begin].odometry) {
      before = begin;
      continue;
    }
    std::size_t end = begin;
    while (end < entries.size() && !entries[end].odometry) ++end;
    const bool is_pause = before != none && end != none;
    const double factor = motion.compute_length_factor(begin, end);
    std::vector<Pose2> filled;
    for (std::size_t i = begin; i < end; ++i) {
      const double share =
          static_cast<double>(i + 1 - begin) / static_cast<double>(end + 1 - begin);
      if (before == none && end == none) {
        filled.push_back(visual[i]);
      } else if (!is_pause) {
        filled.push_back(move_from(std::min(before, end), i, factor));
      } else {
        filled.push_back(
            interpolate(move_from(before, i, factor), move_from(end, i, factor), share));
      }
    }
    for (std::size_t i = begin; i < end; ++i) entries[i].odometry = filled[i - begin];
    begin = end - 1;
  }
}

/// Sets the odometry of the entries that have none by their images. An image that cannot be read
/// gives no step, if `skip_unreadable`; else throws FileError.
void add_motion_by_images(std::span<DatasetEntry> entries, VisualOdometry& odometry,
                          const ViewEncoder& encoder, bool skip_unreadable, Executor& executor) {
  MotionByImages motion{std::vector<Pose2>(entries.size()), odometry.scale_m(), {}};
  motion.known.resize(entries.size());
  std::optional<OdometryView> before;
  process_in_order(
      entries.size(), executor,
      [&](std::size_t i) -> std::optional<OdometryView> {
        if (!is_near_gap(entries, i)) return std::nullopt;
        return OdometryView(encoder.signature(read_observation(entries[i])));
      },
      [&](std::size_t i, std::optional<OdometryView>&& view) {
        if (i > 0 && entries[i - 1].odometry && entries[i].odometry) {
          odometry.restart(view);
          const auto step = before && view ? visual_step(*before, *view) : std::nullopt;
          if (step) {
            motion.known[i] = {step->length_in_views, distance(entries[i - 1].odometry->position(),
                                                               entries[i].odometry->position())};
          }
        } else if (view) {
          odometry.add(*view);
        }
        before = std::move(view);
        motion.poses[i] = odometry.pose();
      },
      [&](std::size_t i, const std::exception_ptr& failure) {
        if (!skip_unreadable) std::rethrow_exception(failure);
        before.reset();
        motion.poses[i] = odometry.pose();
      });
  fill_missing_odometry(entries, motion);
}

}  // namespace

OdometryNoise visual_odometry_noise() {
  // After 1 m a path is too long or too short by a quarter, as the distance of things around
  // changes slowly: two of three lengths are within a quarter of the median (2,970 steps of 30
  // drives in six scenes).
  constexpr double length_deviation_m = 0.25;
  return {.drive = DriveKind::holonomic,
          .translation_from_translation = length_deviation_m,
          .rotation_from_translation = MappingOptions{}.turn_deviation};
}

VisualOdometry visual_odometry(const VisualMemory& memory) {
  VisualOdometryOptions options;
  options.scale_m = compute_scale(memory);
  options.steady_speed = false;  // the memory knows the lengths
  return VisualOdometry(options);
}

std::string describe_visual_motion(const VisualOdometry& odometry) {
  std::string text = "the images show " +
                     std::to_string(odometry.tried_steps() - odometry.breaks()) + " of " +
                     format_count(odometry.tried_steps(), "step");
  // At the others, the position is known from the views alone.
  if (2 * odometry.breaks() > odometry.tried_steps()) {
    text += "; they are too far apart or in no order: take one every 20 to 50 cm";
  }
  return text;
}

std::string add_visual_odometry(Dataset& run, const VisualMemory& memory,
                                const ViewEncoder& encoder, Executor& executor) {
  VisualOdometry odometry = visual_odometry(memory);
  add_motion_by_images(run.entries, odometry, encoder, false, executor);
  return describe_visual_motion(odometry);
}

std::span<DatasetEntry> find_odometry_part(Dataset& run) {
  const auto has_odometry = [](const DatasetEntry& entry) { return entry.odometry.has_value(); };
  const auto first = std::ranges::find_if(run.entries, has_odometry);
  const auto last = std::find_if(run.entries.rbegin(), run.entries.rend(), has_odometry).base();
  return first == run.entries.end() ? std::span<DatasetEntry>() : std::span(first, last);
}

void bridge_odometry_pauses(std::span<DatasetEntry> entries, VisualOdometry odometry,
                            const ViewEncoder& encoder, Executor& executor) {
  add_motion_by_images(entries, odometry, encoder, true, executor);
}

}  // namespace panonav
