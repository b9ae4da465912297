// [M03] section 4.1, future work of its authors: a long corridor with a loop, identical doors and
// junctions.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lab/m03/experiments.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

constexpr std::uint64_t corridor_seed = 70'000;
constexpr std::uint64_t sparse_seed = 71'000;
constexpr int max_images = 64;  // 16 m: longer than any stretch of the ring without distinct object
constexpr std::size_t max_images_after = 10;
constexpr double correct_radius_m = 0.5;
// Spacings of the references of sparse memories; with the default number of scenes, 20 runs each.
constexpr std::array<double, 3> sparse_spacings_m{0.5, 1.0, 2.0};
constexpr int sparse_runs_each = 4;
constexpr int sparse_images = 40;  // 10 m

// Half a period of the highest of 15 components: smaller objects contribute hardly anything to
// them.
constexpr int min_distinct_degrees = 13;

struct BoundingBox {
  simulation::Vector3 low{1e9, 1e9, 1e9};
  simulation::Vector3 high{-1e9, -1e9, -1e9};
  [[nodiscard]] bool contains(const simulation::Vector3& p) const {
    constexpr double margin = 0.02;
    return p.x_m >= low.x_m - margin && p.x_m <= high.x_m + margin && p.y_m >= low.y_m - margin &&
           p.y_m <= high.y_m + margin && p.z_m >= low.z_m - margin && p.z_m <= high.z_m + margin;
  }
};

/// Returns the boxes around the objects that exist only once in the corridor.
std::vector<BoundingBox> find_distinct_objects(const simulation::Scene& scene) {
  std::vector<BoundingBox> boxes;
  for (const std::string_view name : {"window", "notice board", "plant"}) {
    BoundingBox box;
    for (const simulation::Mesh& mesh : scene.meshes) {
      if (!std::string_view(mesh.object).starts_with(name)) continue;
      for (const simulation::Vector3& v : mesh.vertices) {
        box.low = {std::min(box.low.x_m, v.x_m), std::min(box.low.y_m, v.y_m),
                   std::min(box.low.z_m, v.z_m)};
        box.high = {std::max(box.high.x_m, v.x_m), std::max(box.high.y_m, v.y_m),
                    std::max(box.high.z_m, v.z_m)};
      }
    }
    if (box.low.x_m <= box.high.x_m) boxes.push_back(box);
  }
  return boxes;
}

/// True if one of the distinct objects covers at least `min_distinct_degrees` of azimuth.
bool is_distinct_object_visible(const simulation::PlaceRecording& place,
                                std::span<const BoundingBox> things, Point2 at) {
  const simulation::Vector3 eye{at.x_m, at.y_m, place.scene.camera_height_m};
  std::vector<int> covered(things.size());
  for (int azimuth = 0; azimuth < 360; ++azimuth) {
    std::vector<bool> seen(things.size());
    for (int elevation = -25; elevation <= 35; elevation += 10) {
      const Direction3 ray = Direction3::from_angles(radians(azimuth), radians(elevation));
      const double distance_m = place.renderer->distance_along(eye, ray);
      if (!std::isfinite(distance_m)) continue;
      const simulation::Vector3 hit{eye.x_m + distance_m * ray.x, eye.y_m + distance_m * ray.y,
                                    eye.z_m + distance_m * ray.z};
      for (std::size_t t = 0; t < things.size(); ++t) {
        if (things[t].contains(hit)) seen[t] = true;
      }
    }
    for (std::size_t t = 0; t < things.size(); ++t) covered[t] += seen[t] ? 1 : 0;
  }
  return std::ranges::any_of(covered, [](int degrees) { return degrees >= min_distinct_degrees; });
}

/// Plans a drive along the ring from a random start in a random direction, with a lateral offset of
/// up to 0.3 m.
std::vector<Pose2> plan_ring_drive(const simulation::Scene& scene, int images, Random& random) {
  const double lateral_offset_m = random.uniform(-0.3, 0.3);
  const bool backwards = random.index(2) == 1;
  Point2 middle;
  for (const Point2 p : scene.tour) {
    middle.x_m += p.x_m / static_cast<double>(scene.tour.size());
    middle.y_m += p.y_m / static_cast<double>(scene.tour.size());
  }
  std::vector<Point2> ring;
  for (const Point2 p : scene.tour) {
    ring.push_back({p.x_m + (middle.x_m > p.x_m ? lateral_offset_m : -lateral_offset_m),
                    p.y_m + (middle.y_m > p.y_m ? lateral_offset_m : -lateral_offset_m)});
  }
  if (backwards) std::ranges::reverse(ring);
  std::vector<Pose2> corners;
  for (std::size_t i = 0; i <= 2 * ring.size(); ++i) {
    const Point2 p = ring[i % ring.size()];
    corners.push_back({p.x_m, p.y_m, 0.0});
  }
  const auto dense = simulation::resample(corners, 0.01);
  const auto lap = dense.size() / 2;
  const auto start = static_cast<std::size_t>(random.index(lap));
  std::vector<Pose2> poses;
  for (int i = 0; i < images; ++i) {
    const std::size_t at = start + 25 * static_cast<std::size_t>(i);
    if (at + 1 >= dense.size()) break;
    Pose2 pose = dense[at];
    pose.heading_rad =
        wrap_angle(std::atan2(dense[at + 1].y_m - pose.y_m, dense[at + 1].x_m - pose.x_m));
    poses.push_back(pose);
  }
  return poses;
}

struct CorridorRuns {
  std::vector<RunSet> sets;
  std::vector<std::optional<std::size_t>> first_distinct;  ///< per run, step of first distinct view
  std::vector<viewer::MapLayer> things;                    ///< map layers of the first scene
};

/// Drives of a robot through the corridor and the memory that it uses.
struct CorridorPlan {
  double spacing_m = m03_spacing_m;  ///< between neighbouring references
  int runs_each = 1;                 ///< in each scene
  int images = max_images;           ///< per run
  bool ends_after_distinct = true;   ///< runs end `max_images_after` images after a distinct view
};

CorridorRuns record_corridors(const TrackingExperiments& m03, const CorridorPlan& plan) {
  const ReproductionOptions& options = m03.options;
  Executor& executor = m03.executor;
  CorridorRuns corridors;
  const int scenes = std::max(1, (options.scenes + 1) / 2);
  for (int s = 0; s < scenes; ++s) {
    const simulation::PlaceRecording place =
        m03.record_variant("corridor", s, plan.spacing_m, options.columns / 2);
    const std::uint64_t seed = place.seed;
    const auto remembered = make_tracking_place(place, executor);
    const auto things = find_distinct_objects(place.scene);
    std::vector<std::vector<Pose2>> paths(static_cast<std::size_t>(plan.runs_each));
    std::vector<std::optional<std::size_t>> first(paths.size());
    executor.for_each_chunk(paths.size(), 1, [&](std::size_t r, std::size_t, std::size_t) {
      Random random(seed * 1000003U + 70U, r);
      paths[r] = plan_ring_drive(place.scene, plan.images, random);
      for (std::size_t i = 0; i < paths[r].size(); ++i) {
        if (!is_distinct_object_visible(place, things, paths[r][i].position())) continue;
        first[r] = i;
        if (plan.ends_after_distinct) {
          paths[r].resize(std::min(paths[r].size(), i + max_images_after));
        }
        break;
      }
    });
    corridors.first_distinct.insert(corridors.first_distinct.end(), first.begin(), first.end());
    corridors.sets.push_back(make_run_set(
        remembered,
        record_runs(paths, place, *place.renderer, *remembered, {}, seed * 100003U, executor),
        executor));
    if (s == 0) {
      viewer::MapLayer layer{.label = "stands only once", .colour = viewer::PlotColour::green};
      for (const BoundingBox& box : things) {
        layer.crosses.push_back(
            {0.5 * (box.low.x_m + box.high.x_m), 0.5 * (box.low.y_m + box.high.y_m)});
      }
      corridors.things = viewer::scene_layers(place.scene);
      corridors.things.push_back(layer);
    }
  }
  return corridors;
}

// Counts of hypotheses before and after the first view of a distinct object.
struct CorridorMeasures {
  std::size_t before = 0;            // images before it
  std::size_t near_mode_before = 0;  // of these, with a mode near the truth
  std::size_t localised_before = 0;
  std::size_t distinct_runs = 0;  // runs that reach such a view
  std::size_t right = 0;
  std::size_t right_to_end = 0;
  std::vector<double> images_before;  // images before that view, per such run
  std::vector<double> hypotheses;     // number of modes, per image before it

  void add(const TrackedRun& run, std::optional<std::size_t> first) {
    std::optional<std::size_t> found;
    bool lost_again = false;
    for (const TrackedImage& image : run) {
      const bool is_right = image.error_m < correct_radius_m;
      if (!first || image.step < *first) {
        ++before;
        near_mode_before += image.nearest_mode_m < correct_radius_m ? 1 : 0;
        localised_before += image.state == LocalisationState::localised ? 1 : 0;
        hypotheses.push_back(static_cast<double>(image.modes));
        continue;
      }
      if (is_right && !found) found = image.step - *first;
      if (!is_right && image.step >= *first + 3) lost_again = true;
    }
    if (!first) return;  // no distinct object came into view
    ++distinct_runs;
    images_before.push_back(static_cast<double>(*first));
    right += found && *found < 3 ? 1 : 0;
    right_to_end += found && *found < 3 && !lost_again ? 1 : 0;
  }
};

/// Adds the images until localised and the wrong localisations of runs through the corridor.
void add_headline_rows(const CorridorRuns& corridors, std::span<const TrackedRun> runs,
                       const std::string& id, const std::string& what, bool with_targets,
                       Reproduction& result) {
  std::vector<double> images;
  std::size_t wrong_runs = 0;
  std::size_t found_runs = 0;
  for (const TrackedRun& run : runs) {
    const auto count = images_until_localised(run, m03_wrong_m);
    images.push_back(count ? *count : static_cast<double>(run.size()) + 1.0);
    found_runs += count ? 1 : 0;
    wrong_runs +=
        std::ranges::any_of(
            run, [](const TrackedImage& image) { return image.is_confidently_wrong(m03_wrong_m); })
            ? 1
            : 0;
  }
  add_median(result, id + ".until_localised",
             what +
                 ": images until the error is below 1 m from then on (one more than there are "
                 "if never)",
             "images", images, with_targets ? std::optional(at_most(6.0)) : std::nullopt);
  const RunRows rows{result, id, what, corridors.sets, runs};
  rows.append_single_image_rates();
  add_rate(result, id + ".found", what + ": runs whose error is below 1 m at the end", found_runs,
           runs.size());
  add_rate(result, id + ".wrong_runs",
           what + ": runs that report localised at least once while off by more than 1 m",
           wrong_runs, runs.size(), with_targets ? std::optional(at_most(0.0)) : std::nullopt);
  rows.add_rate_of_wrong_answers();
}

/// Returns the largest log-likelihood ratio that an image can give a position, by the model that
/// each memory learnt; near 0 if no reference resembles its neighbours.
std::vector<double> max_log_ratios(std::span<const RunSet> sets) {
  std::vector<double> ratios;
  for (const RunSet& set : sets) {
    const ObservationModel& model = set.place->model();
    ratios.push_back(model.sharpness * std::pow(model.far_difference, 4));
  }
  return ratios;
}

}  // namespace

void TrackingExperiments::reproduce_sparse_corridor() {
  for (const double spacing_m : sparse_spacings_m) {
    const CorridorRuns corridors = record_corridors(*this, {.spacing_m = spacing_m,
                                                            .runs_each = sparse_runs_each,
                                                            .images = sparse_images,
                                                            .ends_after_distinct = false});
    const std::string every = format_centimetres(spacing_m);
    const std::string id = "m03.corridor.sparse." + every.substr(0, every.find(' '));
    const std::string what = "corridor, references every " + every + ", ";
    add_headline_rows(corridors, track(corridors.sets, {}, sparse_seed), id,
                      what + "heading unknown", true, result);
    add_median(result, id + ".max_log_ratio",
               what + "largest log-likelihood ratio of an image at a place, by the learnt model",
               "", max_log_ratios(corridors.sets));
    add_headline_rows(corridors, track_as_published(corridors.sets, {}, sparse_seed),
                      id + ".published", what + "heading known, weights by eq. 1", false, result);
  }
}

void TrackingExperiments::reproduce_corridor() {
  const CorridorRuns corridors =
      record_corridors(*this, {.runs_each = 2 * options.variants * options.runs});
  const FilterSetting setting;
  const auto runs = track(corridors.sets, setting, corridor_seed);
  CorridorMeasures measures;
  for (std::size_t r = 0; r < runs.size(); ++r) measures.add(runs[r], corridors.first_distinct[r]);
  const RunRows rows{result, "m03.corridor", "corridor", corridors.sets, runs};
  if (measures.before > 0) {
    add_rate(
        result, "m03.corridor.kept_before",
        "corridor of identical doors, from a random start on the ring; the first distinct place "
        "is where the window, the notice board or the plant first covers " +
            std::to_string(min_distinct_degrees) +
            " degrees of the view; before it, images after which a mode is within 0.5 m of "
            "the truth",
        measures.near_mode_before, measures.before, at_least(0.99));
    rows.append_single_image_rates();
    add_rate(result, "m03.corridor.sure_before",
             "corridor: before the first distinct place, images at which it reports localised",
             measures.localised_before, measures.before);
    add_mean(result, "m03.corridor.modes_before",
             "corridor: modes kept before the first distinct place", "modes", measures.hypotheses);
  }
  rows.add_rate_of_wrong_answers(at_most(0.0));
  add_headline_rows(corridors, track_as_published(corridors.sets, {}, corridor_seed),
                    "m03.corridor.published", "corridor, heading known, weights by eq. 1", false,
                    result);
  add_headline_rows(corridors, runs, "m03.corridor.ours", "corridor, heading unknown", false,
                    result);
  if (measures.distinct_runs > 0) {
    add_rate(result, "m03.corridor.right_after",
             "corridor: runs whose heaviest mode is within 0.5 m of the truth at the first "
             "distinct place or one of the two images after it",
             measures.right, measures.distinct_runs, at_least(0.99));
    add_rate(result, "m03.corridor.right_for_good",
             "corridor: the same, and at all images from the fourth to the tenth",
             measures.right_to_end, measures.distinct_runs);
    add_median(result, "m03.corridor.images_before",
               "corridor: images before the first distinct place", "images",
               measures.images_before);
  }
  const RunSet& shown = corridors.sets.front();
  const std::size_t last = shown.runs.front().steps.size() - 1;
  const std::size_t first = std::min(corridors.first_distinct.front().value_or(last), last);
  const std::array<std::size_t, 4> steps{0, first / 2, first, std::min(first + 2, last)};
  add_plot(result, "corridor.svg",
           "A corridor of identical doors: the particles keep to places that look alike until "
           "something that stands only once comes into view.",
           make_particle_maps(*shown.place, corridors.things, shown.runs.front(), setting,
                              corridor_seed, steps, "Corridor"),
           2);
}

}  // namespace panonav::lab
