#include "corridor_walks.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "panonav/motion/odometry.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::bench {

namespace {

constexpr std::uint64_t seed = 1;
constexpr double spacing_m = 0.25;
constexpr double laser_height_m = 0.3;
constexpr int beams = 360;

simulation::PlaceRecording record(std::uint64_t corridor_seed, Executor& executor) {
  return simulation::record_place(
      {.scene = "corridor", .seed = corridor_seed, .spacing_m = spacing_m, .queries = 1}, executor);
}

RangeScan scan_at(const simulation::Renderer& renderer, const Pose2& pose) {
  RangeScan scan;
  for (int b = 0; b < beams; ++b) {
    const double azimuth = pose.heading_rad + 2.0 * std::numbers::pi * b / beams;
    scan.push_back(static_cast<float>(renderer.distance_along(
        {pose.x_m, pose.y_m, laser_height_m}, Direction3::from_angles(azimuth, 0.0))));
  }
  return scan;
}

std::vector<Walk> walks(const Corridor& corridor, const lab::RunCondition& condition,
                        Executor& executor) {
  std::vector<Walk> made;
  for (lab::TrackingRun& run :
       lab::record_walks(corridor.place, *corridor.remembered, condition,
                         {.variants = 1, .runs_each = 4, .images = 21, .seed = seed}, executor)) {
    Walk walk;
    std::vector<Pose2> truth;
    for (const lab::TrackingStep& step : run.steps) {
      truth.push_back(step.truth);
      walk.scans.push_back(scan_at(*corridor.place.renderer, step.truth));
    }
    const auto readings = simulation::simulate_odometry(truth, OdometryNoise{}, seed + made.size());
    walk.odometry.push_back({});
    for (std::size_t i = 1; i < readings.size(); ++i) {
      walk.odometry.push_back(inverse(readings[i - 1]) * readings[i]);
    }
    walk.run = std::move(run);
    made.push_back(std::move(walk));
  }
  return made;
}

std::vector<const simulation::PlacedView*> nearest_to_walks(const Corridor& corridor) {
  std::vector<std::pair<double, const simulation::PlacedView*>> views;
  for (const simulation::PlacedView& view : corridor.place.references) {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const auto* walks : {&corridor.clean, &corridor.hard}) {
      for (const Walk& walk : *walks) {
        for (const lab::TrackingStep& step : walk.run.steps) {
          nearest_m = std::min(nearest_m, distance(step.truth.position(), view.pose.position()));
        }
      }
    }
    views.emplace_back(nearest_m, &view);
  }
  std::ranges::stable_sort(views, {}, &std::pair<double, const simulation::PlacedView*>::first);
  std::vector<const simulation::PlacedView*> sorted;
  for (const auto& [nearest_m, view] : views) sorted.push_back(view);
  return sorted;
}

}  // namespace

Corridor make_corridor() {
  std::fprintf(stderr, "rendering the corridor\n");
  Executor executor(0);
  Corridor corridor;
  corridor.place = record(seed, executor);
  corridor.remembered = lab::make_tracking_place(corridor.place, executor);
  corridor.clean = walks(corridor, lab::make_clean_condition(), executor);
  corridor.hard = walks(corridor, lab::make_hard_condition(), executor);
  for (const simulation::PlacedView& reference : corridor.place.references) {
    corridor.mapped_from.push_back(reference.pose);
    corridor.map_scans.push_back(scan_at(*corridor.place.renderer, reference.pose));
  }
  return corridor;
}

std::shared_ptr<const lab::TrackingPlace> corridors_with(const Corridor& corridor,
                                                         std::size_t count) {
  const VisualMemory& first = corridor.remembered->memory();
  VisualMemory memory(first.shape(), first.full_scale(), first.elevations());
  const auto append = [&](const simulation::PlacedView& view, double offset_m) {
    if (memory.size() == count) return;
    memory.append(lab::compute_packed_signature(view.panorama, first),
                  {std::to_string(memory.size()),
                   ReferencePose{view.pose.x_m + offset_m, view.pose.y_m, view.pose.heading_rad},
                   {}});
  };
  for (const simulation::PlacedView* view : nearest_to_walks(corridor)) append(*view, 0.0);
  Executor executor(0);
  for (std::uint64_t number = 1; memory.size() < count; ++number) {
    std::fprintf(stderr, "rendering another corridor\n");
    const simulation::PlaceRecording other = record(seed + number, executor);
    for (const simulation::PlacedView& view : other.references) {
      append(view, 100.0 * static_cast<double>(number));
    }
  }
  return std::make_shared<const lab::TrackingPlace>(std::move(memory), spacing_m);
}

}  // namespace panonav::bench
