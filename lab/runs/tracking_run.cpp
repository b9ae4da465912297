#include "lab/runs/tracking_run.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/recording.hpp"

namespace panonav::lab {

namespace {

constexpr int memory_components = 15;         // [M04]
constexpr std::size_t full_scale_views = 32;  // determine the full scale of a memory

FourierSignature compute_default_signature(const Panorama& view) {
  return compute_signature(preprocess(view, {}), memory_components);
}

// Combines two seeds into one that differs from those of neighbouring pairs.
std::uint64_t mix_seeds(std::uint64_t a, std::uint64_t b) {
  return a * 1000003U + b;
}

}  // namespace

TrackingPlace::TrackingPlace(VisualMemory memory, double spacing_m)
    : memory_(std::move(memory)),
      spacing_m_(spacing_m),
      ranking_(std::make_shared<const ColumnRanking>(memory_)),
      model_(learn_observation_model(*ranking_)),
      localiser_(memory_) {
  require(spacing_m > 0.0, "spacing_m", spacing_m, "> 0");
}

std::vector<Point2> TrackingPlace::reference_positions() const {
  std::vector<Point2> positions;
  for (const ViewId view : memory_.views()) {
    if (const auto& pose = memory_.info(view).pose) positions.push_back(pose->position());
  }
  return positions;
}

VisualMemory make_memory_of_views(std::span<const ReferencePose> poses,
                                  std::span<const Panorama* const> views, Executor& executor) {
  require(!views.empty() && views.size() == poses.size(), "reference views",
          static_cast<double>(views.size()), ">= 1, as many as poses");
  const auto signatures = simulation::make_each(
      executor, views.size(), [&](std::size_t i) { return compute_default_signature(*views[i]); });
  // The command line program uses the same full scale: of the first views, without component 0,
  // which is the mean brightness.
  float full_scale = 0.0F;
  for (std::size_t i = 0; i < std::min(full_scale_views, signatures.size()); ++i) {
    const auto rows = static_cast<std::size_t>(signatures[i].rows());
    const auto structure = signatures[i].magnitudes().subspan(rows);
    full_scale = std::max(full_scale, *std::ranges::max_element(structure));
  }
  VisualMemory memory(signatures[0].shape(), full_scale, signatures[0].elevations());
  for (std::size_t i = 0; i < signatures.size(); ++i) {
    memory.append(signatures[i], {std::to_string(i), poses[i], {}});
  }
  return memory;
}

VisualMemory make_memory_of_references(const simulation::PlaceRecording& place, Executor& executor,
                                       const std::function<bool(Point2)>& kept) {
  std::vector<ReferencePose> poses;
  std::vector<const Panorama*> views;
  for (const simulation::PlacedView& view : place.references) {
    if (kept && !kept(view.pose.position())) continue;
    poses.push_back({view.pose.x_m, view.pose.y_m, view.pose.heading_rad});
    views.push_back(&view.panorama);
  }
  return make_memory_of_views(poses, views, executor);
}

FeatureSource extract_reference_features(const simulation::PlaceRecording& place,
                                         const VisualMemory& memory, Executor& executor) {
  const std::span<const ViewId> views = memory.views();
  auto features = simulation::make_each(executor, views.size(), [&](std::size_t i) {
    const Point2 at = memory.info(views[i]).pose->position();
    return extract_features(place.references[place.nearest_reference(at)].panorama);
  });
  const auto kept = std::make_shared<std::map<ViewId, std::optional<LocalFeatures>>>();
  for (std::size_t i = 0; i < views.size(); ++i) kept->emplace(views[i], std::move(features[i]));
  return [kept](ViewId view) { return kept->at(view); };
}

QueryFeatures make_query_features(const Panorama& view) {
  return [&view](Handedness handedness) {
    return extract_features(handedness == Handedness::original ? view : mirror(view));
  };
}

std::shared_ptr<const TrackingPlace> make_tracking_place(std::span<const ReferencePose> poses,
                                                         std::span<const Panorama* const> views,
                                                         double spacing_m, Executor& executor) {
  return std::make_shared<const TrackingPlace>(make_memory_of_views(poses, views, executor),
                                               spacing_m);
}

std::shared_ptr<const TrackingPlace> make_tracking_place(const simulation::PlaceRecording& place,
                                                         Executor& executor,
                                                         const std::function<bool(Point2)>& kept) {
  return std::make_shared<const TrackingPlace>(make_memory_of_references(place, executor, kept),
                                               place.spacing_m);
}

PackedSignature compute_packed_signature(const Panorama& panorama, const VisualMemory& memory) {
  return pack(compute_default_signature(panorama), memory.full_scale());
}

TrackingRun make_tracking_run(std::span<const Pose2> poses, std::vector<PackedSignature> views) {
  require(poses.size() == views.size(), "number of views", static_cast<double>(views.size()),
          "that of the poses");
  TrackingRun run;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    std::optional<Pose2> moved;
    if (i > 0) moved = inverse(poses[i - 1]) * poses[i];
    run.steps.push_back({poses[i], moved, std::move(views[i])});
  }
  return run;
}

std::optional<TrackingRun> make_kidnapped_run(const TrackingRun& before, const TrackingRun& after,
                                              std::size_t images, double distance_m,
                                              std::size_t min_images) {
  if (before.steps.size() < images || images == 0) return std::nullopt;
  const Point2 last_position = before.steps[images - 1].truth.position();
  const auto found = std::ranges::find_if(after.steps, [&](const TrackingStep& step) {
    return distance(step.truth.position(), last_position) >= distance_m;
  });
  if (after.steps.end() - found < static_cast<std::ptrdiff_t>(min_images)) return std::nullopt;
  TrackingRun run;
  run.steps.assign(before.steps.begin(),
                   before.steps.begin() + static_cast<std::ptrdiff_t>(images));
  run.steps.insert(run.steps.end(), found, after.steps.end());
  run.steps[images].moved.reset();
  return run;
}

TrackingRun shuffle_pieces(const TrackingRun& run, std::size_t piece, Random& random) {
  const std::size_t pieces = piece == 0 ? 0 : run.steps.size() / piece;
  require(pieces >= 3, "pieces of the run", static_cast<double>(pieces), ">= 3");
  std::vector<std::size_t> order(pieces);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = pieces - 1; i > 0; --i) std::swap(order[i], order[random.index(i + 1)]);
  TrackingRun shuffled;
  for (std::size_t i = 0; i < pieces; ++i) {
    const auto first = run.steps.begin() + static_cast<std::ptrdiff_t>(order[i] * piece);
    shuffled.steps.insert(shuffled.steps.end(), first, first + static_cast<std::ptrdiff_t>(piece));
    const bool continues = i > 0 && order[i] == order[i - 1] + 1;
    if (!continues) shuffled.steps[i * piece].moved.reset();
  }
  return shuffled;
}

TrackingRun drop_images(TrackingRun run, std::size_t first, std::size_t count) {
  for (std::size_t i = first; i < std::min(first + count, run.steps.size()); ++i) {
    run.steps[i].view.reset();
  }
  return run;
}

RunCondition make_clean_condition() {
  return {.id = "clean", .name = "clean", .sensor = {}};
}

RunCondition make_hard_condition() {
  return {.id = "hard",
          .name = "hard",
          .light_change = 0.3,
          .moved_objects = 0.1,
          .sensor = {.read_noise = 0.3}};
}

std::vector<TrackingRun> record_runs(const std::vector<std::vector<Pose2>>& poses,
                                     const simulation::PlaceRecording& place,
                                     const simulation::Renderer& renderer,
                                     const TrackingPlace& remembered,
                                     const simulation::SensorOptions& sensor, std::uint64_t seed,
                                     Executor& executor) {
  std::vector<std::pair<std::size_t, std::size_t>> jobs;
  std::vector<std::vector<PackedSignature>> views(poses.size());
  for (std::size_t r = 0; r < poses.size(); ++r) {
    views[r].resize(poses[r].size());
    for (std::size_t i = 0; i < poses[r].size(); ++i) jobs.emplace_back(r, i);
  }
  executor.for_each_chunk(jobs.size(), 4, [&](std::size_t begin, std::size_t end, std::size_t) {
    Executor here(1);
    for (std::size_t j = begin; j < end; ++j) {
      const auto [r, i] = jobs[j];
      views[r][i] = compute_packed_signature(
          simulation::capture_panorama(renderer, poses[r][i], place.rendering,
                                       {.camera_height_m = place.scene.camera_height_m}, sensor,
                                       seed + 1000 * r + i, here),
          remembered.memory());
    }
  });
  std::vector<TrackingRun> runs;
  for (std::size_t r = 0; r < poses.size(); ++r) {
    runs.push_back(make_tracking_run(poses[r], std::move(views[r])));
  }
  return runs;
}

std::vector<TrackingRun> record_walks(const simulation::PlaceRecording& place,
                                      const TrackingPlace& remembered,
                                      const RunCondition& condition, const WalkOptions& options,
                                      Executor& executor) {
  require(options.variants >= 1, "variants", options.variants, ">= 1");
  require(options.runs_each >= 1, "runs_each", options.runs_each, ">= 1");
  require(options.images >= 1, "images", options.images, ">= 1");
  const bool changed = condition.light_change > 0.0 || condition.moved_objects > 0.0;
  std::vector<TrackingRun> runs;
  for (int v = 0; v < options.variants; ++v) {
    const std::uint64_t seed =
        mix_seeds(mix_seeds(options.seed, place.seed), static_cast<std::uint64_t>(v));
    Random random(seed);
    auto now = static_cast<const simulation::SimulatedPlace&>(place);
    if (changed) {
      now = simulation::make_place(
          simulation::make_scene(place.scene.name,
                                 {.seed = place.seed,
                                  .moved_objects = condition.moved_objects,
                                  .moved_seed = seed,
                                  .light = random.uniform(1.0 - condition.light_change,
                                                          1.0 + condition.light_change)}),
          executor);
    }
    std::vector<std::vector<Pose2>> poses;
    for (int r = 0; r < options.runs_each; ++r) {
      Random walk(seed, static_cast<std::uint64_t>(r) + 1);
      Pose2 start = now.free_space->random_pose(walk);
      auto path = simulation::random_walk(
          start, [&](Point2 p) { return now.free_space->is_free(p); },
          {.poses = options.images, .step_m = options.step_m}, walk);
      if (options.constant_heading) {
        for (Pose2& pose : path) pose.heading_rad = 0.0;
      }
      poses.push_back(std::move(path));
    }
    auto recorded = record_runs(poses, place, *now.renderer, remembered, condition.sensor,
                                mix_seeds(seed, 50000), executor);
    std::ranges::move(recorded, std::back_inserter(runs));
  }
  return runs;
}

void SingleImages::add(const SingleImages& other) {
  images += other.images;
  right += other.right;
  near += other.near;
  right_by_dissimilarity += other.right_by_dissimilarity;
}

SingleImages localise_single_images(const TrackingPlace& place, std::span<const TrackingRun> runs,
                                    Executor& executor) {
  const auto positions = place.reference_positions();
  std::vector<SingleImages> parts(runs.size());
  executor.for_each_chunk(runs.size(), 1, [&](std::size_t r, std::size_t, std::size_t) {
    for (const TrackingStep& step : runs[r].steps) {
      if (!step.view) continue;
      const Point2 truth = step.truth.position();
      double nearest = distance(positions.at(0), truth);
      for (const Point2 position : positions) {
        nearest = std::min(nearest, distance(position, truth));
      }
      const auto distance_to = [&](ViewId view) {
        return distance(place.memory().info(view).pose->position(), truth);
      };
      const double best = distance_to(place.localiser().localise(*step.view).matches.at(0).view);
      const auto found = place.memory().search(*step.view, {.top = 1});
      ++parts[r].images;
      parts[r].right_by_dissimilarity +=
          distance_to(found.matches.at(0).view) <= nearest + 1e-9 ? 1 : 0;
      parts[r].right += best <= nearest + 1e-9 ? 1 : 0;
      parts[r].near += best <= place.spacing_m() ? 1 : 0;
    }
  });
  SingleImages sum;
  for (const SingleImages& part : parts) sum.add(part);
  return sum;
}

}  // namespace panonav::lab
