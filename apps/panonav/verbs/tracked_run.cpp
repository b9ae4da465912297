#include "verbs/tracked_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "verbs/recording.hpp"

namespace panonav::command {

bool is_localised(const TrackedImage& image) {
  return image.estimate.state == LocalisationState::localised && image.estimate.pose;
}

std::optional<double> position_error_m(const TrackedImage& image) {
  if (!image.truth || !image.estimate.pose) return std::nullopt;
  return distance(image.estimate.pose->position(), image.truth->position());
}

std::optional<double> heading_error_rad(const TrackedImage& image) {
  if (!image.truth || !image.truth->heading_rad || !image.estimate.pose) return std::nullopt;
  return std::abs(angle_difference(image.estimate.pose->heading_rad, *image.truth->heading_rad));
}

void add(TrackSummary& summary, const TrackedImage& image) {
  const std::size_t before = summary.localised + summary.ambiguous + summary.lost;
  switch (image.estimate.state) {
    case LocalisationState::localised:
      ++summary.localised;
      break;
    case LocalisationState::ambiguous:
      ++summary.ambiguous;
      break;
    case LocalisationState::lost:
      ++summary.lost;
      break;
  }
  if (!is_localised(image)) return;
  if (!summary.first_localised) summary.first_localised = before + 1;
  if (const auto error = position_error_m(image)) summary.errors_m.push_back(*error);
  if (const auto error = heading_error_rad(image)) summary.heading_errors_rad.push_back(*error);
}

TrackSummary summarise_track(const std::vector<TrackedImage>& images) {
  TrackSummary summary;
  for (const TrackedImage& image : images) add(summary, image);
  return summary;
}

namespace {

/// From pairs of neighbours whose positions the memory knows.
double scale_of(const VisualMemory& memory, const VisualOdometryOptions& options) {
  std::vector<ViewId> posed;
  for (const ViewId view : memory.views()) {
    if (memory.info(view).pose) posed.push_back(view);
  }
  const auto distance_m = [&](ViewId a, ViewId b) {
    return distance(memory.info(a).pose->position(), memory.info(b).pose->position());
  };
  constexpr std::size_t sampled = 64;
  const std::size_t every = std::max<std::size_t>(1, posed.size() / sampled);
  std::vector<KnownLength> known;
  for (std::size_t i = 0; i < posed.size(); i += every) {
    std::optional<ViewId> nearest;
    for (const ViewId other : posed) {
      const double off_m = distance_m(posed[i], other);
      if (off_m > 0.0 && (!nearest || off_m < distance_m(posed[i], *nearest))) nearest = other;
    }
    if (!nearest) continue;
    const auto step = visual_step(OdometryView(memory.signature(posed[i])),
                                  OdometryView(memory.signature(*nearest)), options);
    if (step) known.push_back({step->length_in_views, distance_m(posed[i], *nearest)});
  }
  return length_scale_m(known).value_or(options.scale_m);
}

}  // namespace

OdometryNoise visual_odometry_noise() {
  const MappingOptions mapping;
  return {.drive = DriveKind::holonomic,
          .translation_from_translation = mapping.step_deviation,
          .rotation_from_translation = mapping.turn_deviation};
}

VisualOdometry visual_odometry(const VisualMemory& memory) {
  VisualOdometryOptions options;
  options.scale_m = scale_of(memory, options);
  return VisualOdometry(options);
}

std::string add_visual_odometry(Dataset& run, const Tracker& tracker, Executor& executor) {
  VisualOdometry odometry = visual_odometry(tracker.memory());
  make_in_order(
      run.entries.size(), executor,
      [&](std::size_t i) {
        return OdometryView(tracker.encoder().signature(read_observation(run.entries[i])));
      },
      [&](std::size_t i, OdometryView&& view) {
        odometry.add(std::move(view));
        run.entries[i].odometry = odometry.pose();
      });
  return std::to_string(odometry.breaks()) + " of " + std::to_string(run.entries.size() - 1) +
         " steps unread; one unit of the views is " + short_number(odometry.scale_m()) +
         " m, as in the memory";
}

TrackedImage track_image(Tracker& tracker, const PackedSignature& view,
                         const TrackSettings& settings, std::optional<RunMoment> moment) {
  TrackedImage image;
  image.estimate = tracker.observe(view);
  image.particles = even_sample(tracker.localiser().particles(), settings.particles_kept);
  if (moment) {
    describe(*moment, image.estimate);
    moment->particles = even_sample(tracker.localiser().particles(), 500);
    const auto found = tracker.memory().search(view, {.top = 1});
    moment->best_match = settings.recorded->thumbnail(found.matches.front().view)
                             .value_or(std::vector<std::uint8_t>{});
    image.moment = std::move(moment);
  }
  return image;
}

void track(Tracker& tracker, const Dataset& run, const TrackSettings& settings, Executor& executor,
           const std::function<void(TrackedImage&&)>& report) {
  const auto& entries = run.entries;
  const auto every = static_cast<std::size_t>(settings.every);
  const std::size_t looked_at = (entries.size() + every - 1) / every;
  constexpr std::size_t batch = 32;
  for (std::size_t begin = 0; begin < looked_at; begin += batch) {
    const std::size_t count = std::min(batch, looked_at - begin);
    std::vector<std::optional<PackedSignature>> signatures(count);
    std::vector<std::optional<RunMoment>> moments(count);
    for_each_entry(executor, count, [&](std::size_t i) {
      const std::size_t index = (begin + i) * every;
      Observation seen = read_observation(entries[index]);
      if (settings.recorded == nullptr) {
        signatures[i] = tracker.encoder().packed(seen);
        return;
      }
      RunMoment& moment = moments[i].emplace(moment_of(seen, index));
      moment.panorama = tracker.encoder().panorama(seen);
      signatures[i] = tracker.encoder().packed(*moment.panorama);
      if (index == 0) moment.references = reference_positions(tracker.memory());
    });
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t index = (begin + i) * every;
      for (std::size_t e = index - std::min(index, every - 1); e <= index; ++e) {
        tracker.move_to(*entries[e].odometry);
      }
      const DatasetEntry& entry = entries[index];
      TrackedImage image = track_image(tracker, *signatures[i], settings, std::move(moments[i]));
      image.index = index;
      image.file = entry.file;
      image.stamp_s = entry.stamp_s;
      image.truth = entry.pose;
      report(std::move(image));
    }
  }
}

}  // namespace panonav::command
