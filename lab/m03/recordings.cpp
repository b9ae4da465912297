// Global localisation in Gazebo worlds and on real views: an outdoor route, and a gantry over
// plants.

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lab/m03/experiments.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

namespace {

constexpr std::uint64_t seed_of_worlds = 90'000;
constexpr std::uint64_t seed_of_route = 100'000;
constexpr std::uint64_t seed_of_gantry = 110'000;

struct RecordedView {
  ReferencePose pose;
  Panorama panorama;
};

std::vector<RecordedView> read_views(const std::filesystem::path& folder) {
  const Dataset dataset = read_dataset(folder);
  const PanoramaReader reader(dataset.source, {});
  std::vector<RecordedView> views;
  for (const DatasetEntry& entry : dataset.entries) {
    if (entry.pose) views.push_back({*entry.pose, reader.read(entry.path)});
  }
  return views;
}

/// Estimates headings along a path whose positions jitter by more than their spacing, by fitting a
/// line through the positions up to `half` before and after each one.
std::vector<double> fit_tangents(const std::vector<RecordedView>& views, std::size_t half) {
  std::vector<double> headings;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::size_t begin = i > half ? i - half : 0;
    const std::size_t end = std::min(views.size(), i + half + 1);
    const double middle = 0.5 * static_cast<double>(begin + end - 1);
    double x = 0.0;
    double y = 0.0;
    for (std::size_t j = begin; j < end; ++j) {
      x += (static_cast<double>(j) - middle) * views[j].pose.x_m;
      y += (static_cast<double>(j) - middle) * views[j].pose.y_m;
    }
    headings.push_back(wrap_angle(std::atan2(y, x)));
  }
  return headings;
}

void add_standard_rows(const RunRows& rows) {
  rows.add_images_until_localised();
  rows.add_images_mean();
  rows.add_rate_localised_within(10);
  rows.add_error_after(10);
  rows.add_rate_of_wrong_answers();
}

/// Plans a random walk over neighbouring grid positions without visiting any twice; at most
/// `images` long, shorter at a dead end.
std::vector<std::size_t> plan_grid_walk(const std::vector<RecordedView>& views, double spacing_m,
                                        std::size_t images, Random& random) {
  std::vector<std::size_t> walk{static_cast<std::size_t>(random.index(views.size()))};
  std::vector<bool> visited(views.size());
  visited[walk.front()] = true;
  while (walk.size() < images) {
    std::vector<std::size_t> next;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const double distance_m =
          distance(views[i].pose.position(), views[walk.back()].pose.position());
      if (!visited[i] && distance_m < 1.5 * spacing_m) next.push_back(i);
    }
    if (next.empty()) break;
    walk.push_back(next[random.index(next.size())]);
    visited[walk.back()] = true;
  }
  return walk;
}

}  // namespace

void TrackingExperiments::reproduce_gazebo_world(const std::string& name) {
  constexpr double spacing_m = 0.5;
  const simulation::PlaceRecording place =
      simulation::record_place(simulation::read_gazebo_world(options.data, name),
                               {.seed = options.seed,
                                .spacing_m = spacing_m,
                                .queries = 1,
                                .rows = options.rows,
                                .columns = options.columns / 2,
                                .mirror = options.optics == Optics::mirror},
                               executor);
  const auto remembered = make_tracking_place(place, executor);
  RunCondition noisy = make_clean_condition();
  noisy.id = "noisy";
  noisy.name = "the sensor noise of hard";
  noisy.sensor = make_hard_condition().sensor;
  const WalkOptions walks{.variants = 1,
                          .runs_each = 5 * options.variants * options.runs,
                          .images = 20,
                          .step_m = spacing_m,
                          .seed = 3};
  for (const RunCondition& condition : {make_clean_condition(), noisy}) {
    const std::vector<RunSet> sets{make_run_set(
        remembered, record_walks(place, *remembered, condition, walks, executor), executor)};
    const auto runs = track(sets, FilterSetting{}, seed_of_worlds);
    const RunRows rows{.result = result,
                       .id = "m03." + name + "." + condition.id,
                       .what = name + ", " + std::to_string(remembered->memory().size()) +
                               " references on a 50 cm grid, " + condition.name,
                       .sets = sets,
                       .runs = runs,
                       .radius_m = 1.0};
    add_rate(result, rows.id + ".within_15",
             rows.what + ": runs with an error below 1 m within 15 images and from then on",
             count_localised_within(runs, 1.0, 15), runs.size(),
             name == "small_warehouse" && condition.id == "clean" ? std::optional(at_least(0.95))
                                                                  : std::nullopt);
    rows.append_single_image_rates();
    const auto needed = capped_images_until_localised(runs, 1.0);
    const std::string images = rows.what + ": images until the error is below 1 m from then on";
    add_median(result, rows.id + ".images", images, "images", needed);
    add_mean(result, rows.id + ".images_mean", images, "images", needed);
    rows.add_error_after(15);
    rows.add_rate_of_wrong_answers();
  }
}

void TrackingExperiments::reproduce_recorded_route() {
  const auto views = read_views(options.data / "sussex_route");
  constexpr std::size_t tangent_half_window = 8;  // half window of the tangent fit; 12 cm
  constexpr std::size_t stride = 8;               // 12 cm between two images of a run
  constexpr std::size_t images = 20;
  constexpr double spacing_m = 0.1;
  const auto headings = fit_tangents(views, tangent_half_window);
  std::vector<ReferencePose> poses;
  std::vector<const Panorama*> references;
  for (std::size_t i = 0; i < views.size(); i += 2) {
    poses.push_back(views[i].pose);
    references.push_back(&views[i].panorama);
  }
  auto poses_with_headings = poses;
  for (std::size_t k = 0; k < poses_with_headings.size(); ++k)
    poses_with_headings[k].heading_rad = headings[2 * k];
  const auto without_headings = make_tracking_place(poses, references, spacing_m, executor);
  const auto with_headings =
      make_tracking_place(poses_with_headings, references, spacing_m, executor);
  std::vector<TrackingRun> runs;
  for (std::size_t start = 1; start + stride * (images - 1) < views.size(); start += 4) {
    std::vector<Pose2> truth;
    std::vector<PackedSignature> seen;
    for (std::size_t k = 0; k < images; ++k) {
      const std::size_t i = start + stride * k;
      truth.push_back({views[i].pose.x_m, views[i].pose.y_m, headings[i]});
      seen.push_back(compute_packed_signature(views[i].panorama, without_headings->memory()));
    }
    runs.push_back(make_tracking_run(truth, std::move(seen)));
  }
  // The recorded positions jitter by some millimetres, and the tangent of the path is only an
  // approximation of the heading; hence the large rotation noise.
  FilterSetting setting;
  setting.odometry.rotation_from_translation = setting.assumed_odometry.rotation_from_translation =
      0.1;
  for (const bool compass : {false, true}) {
    const std::vector<RunSet> sets{
        make_run_set(compass ? with_headings : without_headings, runs, executor)};
    setting.options.compass = compass;
    const auto tracked = track(sets, setting, seed_of_route);
    add_standard_rows(
        {result, std::string("m03.sussex_route.") + (compass ? "compass" : "no_compass"),
         std::string("route outdoors (sussex_route), even images memorised, stretches of 20 "
                     "odd images 12 cm apart, which overlap, ") +
             (compass ? "memory with headings along the path, compass on"
                      : "memory without headings"),
         sets, tracked});
  }
}

void TrackingExperiments::reproduce_gantry() {
  const auto views = read_views(options.data / "gantry_plants");
  constexpr double spacing_m = 0.1;
  constexpr std::size_t images = 15;
  const std::size_t run_count =
      5 * static_cast<std::size_t>(options.variants) * static_cast<std::size_t>(options.runs);
  FilterSetting setting;
  setting.odometry.drive = setting.assumed_odometry.drive = DriveKind::holonomic;
  std::vector<RunSet> sets;
  for (std::uint64_t attempt = 0; sets.size() < run_count && attempt < 20 * run_count; ++attempt) {
    Random random(options.seed, attempt);
    const auto walk = plan_grid_walk(views, spacing_m, images, random);
    if (walk.size() < images) continue;
    std::vector<ReferencePose> poses;
    std::vector<const Panorama*> references;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (std::ranges::find(walk, i) != walk.end()) continue;
      poses.push_back(views[i].pose);
      references.push_back(&views[i].panorama);
    }
    const auto remembered = make_tracking_place(poses, references, spacing_m, executor);
    std::vector<Pose2> truth;
    std::vector<PackedSignature> seen;
    for (const std::size_t i : walk) {
      const ReferencePose& pose = views[i].pose;
      truth.push_back({pose.x_m, pose.y_m, pose.heading_rad.value_or(0.0)});
      seen.push_back(compute_packed_signature(views[i].panorama, remembered->memory()));
    }
    sets.push_back(make_run_set(remembered, {make_tracking_run(truth, std::move(seen))}, executor));
  }
  const auto tracked = track(sets, setting, seed_of_gantry);
  add_standard_rows(
      {result, "m03.gantry_plants",
       "gantry over plants (gantry_plants), random walks over its 10 cm grid, whose views are "
       "left out of the memory",
       sets, tracked, 2.0 * spacing_m});
}

}  // namespace panonav::lab
