// Monte-Carlo localisation on real views: a route outdoors, a gantry over plants.

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

namespace panonav::lab {

namespace {

constexpr std::uint64_t seed_of_route = 100'000;
constexpr std::uint64_t seed_of_gantry = 110'000;

struct PosedView {
  ReferencePose pose;
  Panorama panorama;
};

std::vector<PosedView> read_views(const std::filesystem::path& folder) {
  const Dataset dataset = read_dataset(folder);
  const PanoramaReader reader(dataset.source, {});
  std::vector<PosedView> views;
  for (const DatasetEntry& entry : dataset.entries) {
    if (entry.pose) views.push_back({*entry.pose, reader.read(entry.path)});
  }
  return views;
}

/// Headings along the path, whose positions jitter by more than lies between two of them: those of
/// a straight line fitted to the positions within `half` before and after.
std::vector<double> tangents(const std::vector<PosedView>& views, std::size_t half) {
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

void add_rows(Reproduction& result, const std::string& id, const std::string& what, double radius_m,
              std::span<const RunSet> sets, std::span<const TrackedRun> runs) {
  const std::string centimetres = std::to_string(std::lround(100.0 * radius_m)) + " cm";
  const auto needed = capped_images(runs, radius_m);
  add_median(result, id + ".images",
             what + ": images until the error is below " + centimetres + " from then on", "images",
             needed);
  tell_single_images(result.rows.back(), sets);
  add_mean(result, id + ".images_mean", what + ": images", "images", needed);
  add_rate(result, id + ".within_10", what + ": runs localised within 10 images",
           localised_within(runs, radius_m, 10), runs.size());
  add_median(result, id + ".error_10", what + ": error after 10 images", "m",
             errors_after(runs, 10));
  add_confidently_wrong(result, id + ".wrong", what, runs);
}

}  // namespace

void reproduce_recorded_route(const TrackingReproductionOptions& options, Executor& executor,
                              Reproduction& result) {
  const auto views = read_views(options.data / "sussex_route");
  constexpr std::size_t around = 8;  // 12 cm of the route
  constexpr std::size_t stride = 8;  // images of a run are 12 cm apart
  constexpr std::size_t images = 20;
  constexpr double spacing_m = 0.1;
  const auto headings = tangents(views, around);
  std::vector<ReferencePose> poses;
  std::vector<const Panorama*> references;
  for (std::size_t i = 0; i < views.size(); i += 2) {
    poses.push_back(views[i].pose);
    references.push_back(&views[i].panorama);
  }
  auto facing = poses;
  for (std::size_t k = 0; k < facing.size(); ++k) facing[k].heading_rad = headings[2 * k];
  const auto plain = remember_views(poses, references, spacing_m, executor);
  const auto with_headings = remember_views(facing, references, spacing_m, executor);
  std::vector<TrackingRun> runs;
  for (std::size_t start = 1; start + stride * (images - 1) < views.size(); start += 4) {
    std::vector<Pose2> truth;
    std::vector<PackedSignature> seen;
    for (std::size_t k = 0; k < images; ++k) {
      const std::size_t i = start + stride * k;
      truth.push_back({views[i].pose.x_m, views[i].pose.y_m, headings[i]});
      seen.push_back(signature_for(views[i].panorama, plain->memory()));
    }
    runs.push_back(run_through(truth, std::move(seen)));
  }
  // The tracked positions jitter by some millimetres, and the tangent is not the heading.
  FilterSetting setting;
  setting.odometry.rotation_from_translation = setting.told_odometry.rotation_from_translation =
      0.1;
  for (const bool compass : {false, true}) {
    const std::vector<RunSet> sets{make_run_set(compass ? with_headings : plain, runs, executor)};
    setting.options.compass = compass;
    const auto tracked = track_sets(sets, setting, seed_of_route, executor);
    add_rows(result, std::string("m03.sussex_route.") + (compass ? "compass" : "no_compass"),
             std::string("route outdoors (sussex_route), even images memorised, stretches of 20 "
                         "odd images 12 cm apart, which overlap, ") +
                 (compass ? "memory with headings along the path, compass on"
                          : "memory without headings"),
             0.25, sets, tracked);
  }
}

namespace {

/// A walk from place to neighbouring place that comes to none twice; as long as it can be, up to
/// `images`.
std::vector<std::size_t> walk_over(const std::vector<PosedView>& views, double spacing_m,
                                   std::size_t images, Random& random) {
  std::vector<std::size_t> walk{static_cast<std::size_t>(random.index(views.size()))};
  std::vector<bool> visited(views.size());
  visited[walk.front()] = true;
  while (walk.size() < images) {
    std::vector<std::size_t> next;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const double way = distance(views[i].pose.position(), views[walk.back()].pose.position());
      if (!visited[i] && way < 1.5 * spacing_m) next.push_back(i);
    }
    if (next.empty()) break;
    walk.push_back(next[random.index(next.size())]);
    visited[walk.back()] = true;
  }
  return walk;
}

}  // namespace

void reproduce_gantry(const TrackingReproductionOptions& options, Executor& executor,
                      Reproduction& result) {
  const auto views = read_views(options.data / "gantry_plants");
  constexpr double spacing_m = 0.1;
  constexpr std::size_t images = 15;
  const std::size_t wanted =
      5 * static_cast<std::size_t>(options.variants) * static_cast<std::size_t>(options.runs);
  FilterSetting setting;
  setting.odometry.drive = setting.told_odometry.drive = DriveKind::holonomic;
  std::vector<RunSet> sets;
  for (std::uint64_t attempt = 0; sets.size() < wanted && attempt < 20 * wanted; ++attempt) {
    Random random(options.seed, attempt);
    const auto walk = walk_over(views, spacing_m, images, random);
    if (walk.size() < images) continue;
    std::vector<ReferencePose> poses;
    std::vector<const Panorama*> references;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (std::ranges::find(walk, i) != walk.end()) continue;
      poses.push_back(views[i].pose);
      references.push_back(&views[i].panorama);
    }
    const auto remembered = remember_views(poses, references, spacing_m, executor);
    std::vector<Pose2> truth;
    std::vector<PackedSignature> seen;
    for (const std::size_t i : walk) {
      const ReferencePose& pose = views[i].pose;
      truth.push_back({pose.x_m, pose.y_m, pose.heading_rad.value_or(0.0)});
      seen.push_back(signature_for(views[i].panorama, remembered->memory()));
    }
    sets.push_back(make_run_set(remembered, {run_through(truth, std::move(seen))}, executor));
  }
  const auto tracked = track_sets(sets, setting, seed_of_gantry, executor);
  add_rows(result, "m03.gantry_plants",
           "gantry over plants (gantry_plants), random walks over its 10 cm grid, whose views are "
           "left out of the memory",
           2.0 * spacing_m, sets, tracked);
}

}  // namespace panonav::lab
