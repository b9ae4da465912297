#include "runs/tracked_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "runs/recording.hpp"

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

TrackedImage track_image(Tracker& tracker, const PackedSignature& view,
                         const TrackSettings& settings,
                         std::optional<recordings::RunMoment> moment) {
  TrackedImage image;
  StageClock clock;
  image.estimate = tracker.observe(view);
  clock.stage("filter");
  image.particles = recordings::resample_systematically(tracker.localiser().particles(),
                                                        settings.particles_per_image);
  if (moment) {
    set_localisation(*moment, image.estimate);
    moment->particles = recordings::resample_systematically(tracker.localiser().particles(), 500);
    if (moment->panorama) {
      if (settings.shown_references != nullptr)
        settings.shown_references->compare(*moment, tracker.memory(), view);
      const ViewId best = tracker.memory().search(view, {.top = 1}).matches.front().view;
      moment->best_match =
          settings.thumbnail_file->thumbnail(best).value_or(std::vector<std::uint8_t>{});
      const auto& reference = tracker.memory().info(best).pose;
      if (moment->pose && reference && reference->heading_rad) {
        moment->best_match_turn_rad =
            angle_difference(moment->pose->heading_rad, *reference->heading_rad);
      }
    }
    clock.stage("for viewers");
    clock.add_to(*moment);
    image.moment = std::move(moment);
  }
  return image;
}

void record_viewer_pose(recordings::RunMoment& moment) {
  moment.values.emplace_back("event", "a viewer tells where the robot is");
}

void add(viewer::RunPage& page, const TrackedImage& image) {
  recordings::RunMoment moment = *image.moment;
  moment.particles = image.particles;
  constexpr std::size_t max_compared = 50;  // limits the size of the page
  if (moment.comparisons.size() > max_compared) moment.comparisons.resize(max_compared);
  moment.values.insert(moment.values.begin(), {"image", image.file});
  page.add(moment);
}

void track(Tracker& tracker, const Dataset& run, const TrackSettings& settings, Executor& executor,
           const std::function<void(TrackedImage&&)>& report) {
  const auto& entries = run.entries;
  const auto every = static_cast<std::size_t>(settings.every);
  const std::size_t image_count = (entries.size() + every - 1) / every;
  constexpr std::size_t batch_size = 32;
  for (std::size_t begin = 0; begin < image_count; begin += batch_size) {
    const std::size_t count = std::min(batch_size, image_count - begin);
    std::vector<std::optional<PackedSignature>> signatures(count);
    std::vector<std::optional<recordings::RunMoment>> moments(count);
    parallel_for(executor, count, [&](std::size_t i) {
      const std::size_t index = (begin + i) * every;
      StageClock clock;
      Observation observation = read_observation(entries[index]);
      clock.stage("reading");
      if (settings.thumbnail_file == nullptr) {
        signatures[i] = tracker.encoder().packed(observation);
        return;
      }
      recordings::RunMoment& moment =
          moments[i].emplace(recordings::make_moment(observation, index));
      clock.restart();
      moment.panorama = tracker.encoder().panorama(observation);
      clock.stage("unwarping");
      signatures[i] = tracker.encoder().packed(*moment.panorama);
      clock.stage("signature");
      clock.add_to(moment);
      if (index == 0 && settings.shown_references != nullptr)
        settings.shown_references->add_to(moment);
    });
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t index = (begin + i) * every;
      const bool has_viewer_input = settings.has_viewer_input && settings.has_viewer_input();
      for (std::size_t e = index - std::min(index, every - 1); e <= index; ++e) {
        tracker.move_to(*entries[e].odometry);
      }
      const DatasetEntry& entry = entries[index];
      TrackedImage image = track_image(tracker, *signatures[i], settings, std::move(moments[i]));
      if (image.moment && has_viewer_input) record_viewer_pose(*image.moment);
      image.index = index;
      image.file = entry.file;
      image.stamp_s = entry.stamp_s;
      image.truth = entry.pose;
      report(std::move(image));
    }
  }
}

}  // namespace panonav::command
