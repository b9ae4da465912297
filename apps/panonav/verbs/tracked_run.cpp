#include "verbs/tracked_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/observation_source.hpp"

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

TrackSummary summarise_track(const std::vector<TrackedImage>& images) {
  TrackSummary summary;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const TrackedImage& image = images[i];
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
    if (!is_localised(image)) continue;
    if (!summary.first_localised) summary.first_localised = i + 1;
    if (const auto error = position_error_m(image)) summary.errors_m.push_back(*error);
    if (const auto error = heading_error_rad(image)) summary.heading_errors_rad.push_back(*error);
  }
  return summary;
}

std::vector<Point2> even_sample(const Particles& particles, std::size_t count) {
  std::vector<Point2> sample;
  if (particles.size() <= count) {
    for (std::size_t i = 0; i < particles.size(); ++i) sample.push_back(particles.position(i));
    return sample;
  }
  double total = 0.0;
  for (const double weight : particles.weight) total += weight;
  double passed = 0.0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    passed += particles.weight[i];
    while (sample.size() < count && (static_cast<double>(sample.size()) + 0.5) * total <
                                        passed * static_cast<double>(count)) {
      sample.push_back(particles.position(i));
    }
  }
  return sample;
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
    for_each_entry(executor, count, [&](std::size_t i) {
      signatures[i] = tracker.encoder().packed(read_observation(entries[(begin + i) * every]));
    });
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t index = (begin + i) * every;
      for (std::size_t e = index - std::min(index, every - 1); e <= index; ++e) {
        tracker.move_to(*entries[e].odometry);
      }
      const DatasetEntry& entry = entries[index];
      TrackedImage image{
          index, entry.file, entry.stamp_s, entry.pose, tracker.observe(*signatures[i]), {}};
      image.particles = even_sample(tracker.localiser().particles(), settings.particles_kept);
      report(std::move(image));
    }
  }
}

}  // namespace panonav::command
