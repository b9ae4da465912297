#include "lab/runs/tracking_filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/geometry/angles.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::lab {

FilterSetting paper_setting() {
  FilterSetting setting;
  setting.options.compass = false;
  setting.injection = InjectionMethod::none;
  setting.particles_per_reference = 1.0;
  setting.odometry.drive = DriveKind::holonomic;
  setting.assumed_odometry.drive = DriveKind::holonomic;
  setting.heading_known = true;
  return setting;
}

FilterSetting compass_setting(InjectionMethod injection) {
  FilterSetting setting;
  setting.injection = injection;
  setting.particles_per_reference = 1.0;
  return setting;
}

TrackedRun track_run(const TrackingPlace& place, const TrackingRun& run,
                     const FilterSetting& setting, std::uint64_t seed,
                     const StepObserver& observer) {
  MonteCarloOptions options = setting.options;
  options.seed = static_cast<int>(seed % 1000000007U);
  options.injection = setting.injection == InjectionMethod::explained
                          ? MonteCarloOptions::Injection::explained
                          : MonteCarloOptions::Injection::none;
  if (setting.particles_per_reference) {
    const double particles =
        *setting.particles_per_reference * static_cast<double>(place.memory().size());
    options.min_particles = options.max_particles =
        std::max(1, static_cast<int>(std::lround(particles)));
  }
  MonteCarloLocaliser filter(place.ranking(), place.model(), options, setting.assumed_odometry);
  set_injection_method(filter, setting.injection, place.ranking());
  if (setting.heading_known && !run.steps.empty()) {
    filter.start_globally(run.steps.front().truth.heading_rad);
  }
  simulation::SimulatedOdometry odometry(setting.odometry, seed);
  Pose2 before = odometry.pose();
  TrackedRun tracked;
  for (std::size_t i = 0; i < run.steps.size(); ++i) {
    const TrackingStep& step = run.steps[i];
    if (step.moved) {
      const Pose2 now = odometry.advance(*step.moved);
      filter.move(inverse(before) * now);
      before = now;
    }
    if (!step.view) {
      if (observer) observer(i, filter, filter.estimate());
      continue;
    }
    const MonteCarloEstimate estimate = filter.observe(*step.view);
    TrackedImage image;
    image.step = i;
    image.state = estimate.state;
    image.answered = estimate.position.has_value();
    image.error_m = image.nearest_mode_m = std::numeric_limits<double>::infinity();
    image.heading_error_rad = std::numbers::pi;
    if (!estimate.modes.empty()) {
      const Pose2& heaviest = estimate.modes.front().mean;
      image.error_m = distance(heaviest.position(), step.truth.position());
      image.heading_error_rad =
          std::abs(angle_difference(heaviest.heading_rad, step.truth.heading_rad));
    }
    for (const PoseMode& mode : estimate.modes) {
      image.nearest_mode_m =
          std::min(image.nearest_mode_m, distance(mode.mean.position(), step.truth.position()));
    }
    image.modes = estimate.modes.size();
    image.particles = estimate.particles;
    image.injected = estimate.injected;
    tracked.push_back(image);
    if (observer) observer(i, filter, estimate);
  }
  return tracked;
}

std::vector<TrackedRun> track_runs(const TrackingPlace& place, std::span<const TrackingRun> runs,
                                   const FilterSetting& setting, std::uint64_t first_seed,
                                   Executor& executor) {
  return simulation::make_each(executor, runs.size(), [&](std::size_t i) {
    return track_run(place, runs[i], setting, first_seed + i);
  });
}

std::optional<int> images_until_localised(const TrackedRun& run, double radius_m,
                                          std::size_t first_step) {
  int images = 0;
  std::optional<int> found;
  for (const TrackedImage& image : run) {
    if (image.step < first_step) continue;
    ++images;
    if (!image.is_within(radius_m)) {
      found.reset();
    } else if (!found) {
      found = images;
    }
  }
  return found;
}

std::optional<int> images_until_first_fix(const TrackedRun& run, double radius_m,
                                          std::size_t first_step) {
  int images = 0;
  for (const TrackedImage& image : run) {
    if (image.step < first_step) continue;
    ++images;
    if (image.is_within(radius_m)) return images;
  }
  return std::nullopt;
}

}  // namespace panonav::lab
