#include "verbs/followed_run.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/view_encoder.hpp"

namespace panonav::command {

void follow(RouteTracker& tracker, const LineReader& reader, const Dataset& run,
            const std::vector<Pose2>& truth, const FollowSettings& settings, Executor& executor,
            const std::function<void(FollowedImage&&)>& report) {
  const auto odometry = settings.use_odometry ? odometry_poses(run) : std::vector<Pose2>{};
  const auto every = static_cast<std::size_t>(settings.every);
  const std::size_t looked_at = (run.entries.size() + every - 1) / every;
  RouteChanges changes;
  constexpr std::size_t batch = 32;
  for (std::size_t begin = 0; begin < looked_at; begin += batch) {
    const std::size_t count = std::min(batch, looked_at - begin);
    std::vector<std::vector<float>> lines(count);
    for_each_entry(executor, count, [&](std::size_t i) {
      lines[i] = reader.read(run.entries[(begin + i) * every].path);
    });
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t index = (begin + i) * every;
      const DatasetEntry& entry = run.entries[index];
      FollowedImage image{index, entry.file, entry.stamp_s, std::move(lines[i])};
      if (odometry.empty()) {
        image.fix = tracker.search(image.line);
      } else {
        const Pose2& before = odometry[index - std::min(index, every)];
        image.fix = tracker.track(image.line, inverse(before) * odometry[index]);
      }
      if (image.fix) {
        image.changed = changes.add(image.fix->fix);
      } else {
        changes.reset();
      }
      if (!truth.empty()) {
        image.truth = truth[index];
        image.true_place = place_on_route(tracker.lines().poses(), truth[index].position());
      }
      report(std::move(image));
    }
  }
}

FollowSummary summarise_follow(const std::vector<FollowedImage>& images, bool headings_known) {
  FollowSummary summary;
  summary.images = images.size();
  for (const FollowedImage& image : images) {
    if (!image.fix) continue;
    ++summary.on_route;
    switch (image.fix->origin) {
      case RouteFixOrigin::prediction:
        ++summary.predicted;
        break;
      case RouteFixOrigin::recovery:
        ++summary.recovered;
        break;
      case RouteFixOrigin::search:
        ++summary.searched;
        break;
    }
    if (!image.truth) continue;
    const Pose2& pose = image.fix->fix.pose;
    summary.position_m.push_back(distance(pose.position(), image.truth->position()));
    summary.along_m.push_back(std::abs(image.fix->along_m - image.true_place->along_m));
    summary.lateral_m.push_back(std::abs(image.fix->lateral_m - image.true_place->lateral_m));
    if (headings_known) {
      summary.heading_rad.push_back(
          std::abs(angle_difference(pose.heading_rad, image.truth->heading_rad)));
    }
  }
  return summary;
}

std::vector<std::pair<double, double>> changed_stretches(const std::vector<FollowedImage>& images) {
  std::vector<std::pair<double, double>> stretches;
  bool going_on = false;
  for (const FollowedImage& image : images) {
    const bool changed = image.fix && !image.changed.empty();
    if (changed) {
      const double along_m = image.fix->along_m;
      if (!going_on) stretches.emplace_back(along_m, along_m);
      stretches.back().first = std::min(stretches.back().first, along_m);
      stretches.back().second = std::max(stretches.back().second, along_m);
    }
    going_on = changed;
  }
  return stretches;
}

std::string_view name_of(RouteFixOrigin origin) {
  switch (origin) {
    case RouteFixOrigin::prediction:
      return "prediction";
    case RouteFixOrigin::recovery:
      return "recovery";
    case RouteFixOrigin::search:
      return "search";
  }
  return "search";
}

}  // namespace panonav::command
