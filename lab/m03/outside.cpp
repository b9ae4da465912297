// Experiment: a robot leaves the memorised area and returns.

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "lab/m03/experiments.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/recording.hpp"

namespace panonav::lab {

namespace {

constexpr std::uint64_t excursion_seed = 120'000;
constexpr std::size_t uncounted_images = 5;
constexpr double min_outside_distance_m = 1.0;  ///< from the nearest reference

struct OutsideRuns {
  std::vector<RunSet> sets;
  /// Distances to the nearest reference in metres, per run and image.
  std::vector<std::vector<double>> reference_distances_m;
};

/// Draws a free position with `low_x` <= x <= `high_x`.
Point2 sample_free_position(const simulation::FreeSpace& space, double low_x, double high_x,
                            Random& random) {
  for (;;) {
    const Pose2 pose = space.random_pose(random);
    if (pose.x_m >= low_x && pose.x_m <= high_x) return pose.position();
  }
}

/// Plans a path from the memorised area to a position far outside it and back to another position
/// inside, with headings along the path.
std::vector<Pose2> plan_excursion(const simulation::FreeSpace& space, double border_m,
                                  Random& random) {
  const double low = space.low().x_m;
  const double high = space.high().x_m;
  const Point2 from = sample_free_position(space, low, border_m - 0.5, random);
  const Point2 outside_position = sample_free_position(space, border_m + 2.0, high, random);
  const Point2 to = sample_free_position(space, low, border_m - 0.5, random);
  std::vector<Pose2> corners;
  for (const auto& [a, b] : {std::pair{from, outside_position}, {outside_position, to}}) {
    for (const Point2 p : space.shortest_path(a, b).value_or(std::vector<Point2>{a, b})) {
      corners.push_back({p.x_m, p.y_m, 0.0});
    }
  }
  auto poses = simulation::resample(corners, m03_spacing_m);
  simulation::face_path(poses);
  for (Pose2& pose : poses) pose.heading_rad = wrap_angle(pose.heading_rad);
  return poses;
}

OutsideRuns record_excursions(const TrackingExperiments& m03, const std::string& name) {
  const ReproductionOptions& options = m03.options;
  Executor& executor = m03.executor;
  OutsideRuns outside;
  const int scenes = std::max(1, options.scenes / 3);
  const int runs_each = 2 * options.variants * options.runs;
  for (int s = 0; s < scenes; ++s) {
    const simulation::PlaceRecording place =
        m03.record_variant(name, s, m03_spacing_m, options.columns / 2);
    const std::uint64_t seed = place.seed;
    const double border_m = 0.5 * (place.scene.floor_low.x_m + place.scene.floor_high.x_m);
    const auto remembered =
        make_tracking_place(place, executor, [&](Point2 p) { return p.x_m < border_m; });
    std::vector<std::vector<Pose2>> paths;
    for (int r = 0; r < runs_each; ++r) {
      Random random(seed * 1000003U + 120U, static_cast<std::uint64_t>(r));
      paths.push_back(plan_excursion(*place.free_space, border_m, random));
    }
    const auto references = remembered->reference_positions();
    for (const auto& path : paths) {
      std::vector<double> reference_distances_m;
      for (const Pose2& pose : path) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const Point2 p : references) nearest = std::min(nearest, distance(p, pose.position()));
        reference_distances_m.push_back(nearest);
      }
      outside.reference_distances_m.push_back(std::move(reference_distances_m));
    }
    RunSet set{
        remembered,
        record_runs(paths, place, *place.renderer, *remembered, {}, seed * 100003U, executor),
        {}};
    // Images outside the memorised area are no queries for single-image localisation.
    std::vector<TrackingRun> inside = set.runs;
    for (std::size_t r = 0; r < inside.size(); ++r) {
      const auto& reference_distances_m =
          outside.reference_distances_m[outside.reference_distances_m.size() - inside.size() + r];
      for (std::size_t i = 0; i < inside[r].steps.size(); ++i) {
        if (reference_distances_m[i] > m03_spacing_m) inside[r].steps[i].view.reset();
      }
    }
    set.single_images = localise_single_images(*remembered, inside, executor);
    outside.sets.push_back(std::move(set));
  }
  return outside;
}

constexpr double bin_m = 0.25;
constexpr std::size_t bins = 16;

/// Counts of the states that the filter reports over all runs.
struct ReportedStates {
  // Counts per bin of the distance to the nearest reference, from the sixth image on.
  std::array<std::size_t, bins> queries{};
  std::array<std::size_t, bins> lost{};
  std::array<std::size_t, bins> localised{};
  std::size_t inside = 0;  ///< images inside before the robot leaves
  std::size_t lost_inside = 0;
  std::size_t outside = 0;  ///< images far from all references
  std::size_t lost_outside = 0;
  std::size_t localised_outside = 0;
  std::vector<double> until_lost;   ///< number of images, per run
  std::vector<double> until_found;  ///< number of images after the return, per run
};

void add_run(ReportedStates& reports, const TrackedRun& run,
             std::span<const double> reference_distances_m) {
  bool left = false;
  bool back = false;
  int images_outside = 0;  // until the filter reports lost
  int images_back = 0;
  bool said_lost = false;
  bool said_found = false;
  for (const TrackedImage& image : run) {
    const double reference_distance_m = reference_distances_m[image.step];
    const bool is_lost = image.state == LocalisationState::lost;
    const bool is_localised = image.state == LocalisationState::localised;
    if (image.step >= uncounted_images) {
      const auto bin = std::min(bins - 1, static_cast<std::size_t>(reference_distance_m / bin_m));
      ++reports.queries[bin];
      reports.lost[bin] += is_lost ? 1 : 0;
      reports.localised[bin] += is_localised ? 1 : 0;
    }
    if (reference_distance_m > min_outside_distance_m) {
      left = true;
      ++reports.outside;
      reports.lost_outside += is_lost ? 1 : 0;
      reports.localised_outside += is_localised ? 1 : 0;
      images_outside += said_lost ? 0 : 1;
      said_lost = said_lost || is_lost;
    } else if (reference_distance_m <= m03_spacing_m && left) {
      back = true;
      images_back += said_found ? 0 : 1;
      said_found = said_found || (is_localised && image.is_within(m03_spacing_m));
    } else if (reference_distance_m <= m03_spacing_m && image.step >= uncounted_images) {
      ++reports.inside;
      reports.lost_inside += is_lost ? 1 : 0;
    }
  }
  const auto capped = [](bool said, int images) {
    return static_cast<double>(said ? std::min(images, m03_max_images) : m03_max_images);
  };
  if (left) reports.until_lost.push_back(capped(said_lost, images_outside));
  if (back) reports.until_found.push_back(capped(said_found, images_back));
}

void add_rows(const RunRows& rows, const ReportedStates& reports) {
  const auto& [result, id, what] = std::tie(rows.result, rows.id, rows.what);
  if (reports.inside > 0) {
    add_rate(result, id + ".lost_inside",
             what + ": images before it leaves, from the sixth on, that are called lost",
             reports.lost_inside, reports.inside);
    rows.append_single_image_rates();
  }
  if (reports.outside > 0) {
    add_rate(result, id + ".lost_outside",
             what + ": images more than 1 m from all references that are called lost",
             reports.lost_outside, reports.outside);
    add_rate(result, id + ".sure_outside",
             what + ": images more than 1 m from all references that are called localised",
             reports.localised_outside, reports.outside);
    add_median(result, id + ".images_until_lost",
               what + ": images until it is called lost, from 1 m outside on", "images",
               reports.until_lost);
  }
  if (!reports.until_found.empty()) {
    add_median(result, id + ".images_until_found",
               what + ": images back inside until it is called localised, within 25 cm", "images",
               reports.until_found);
    add_rate(result, id + ".found_within_5",
             what + ": runs called localised, within 25 cm, within 5 images back inside",
             count_where(reports.until_found, [](double images) { return images <= 5.0; }),
             reports.until_found.size());
  }
}

}  // namespace

void TrackingExperiments::reproduce_leaving(const std::string& name) {
  const OutsideRuns outside = record_excursions(*this, name);
  const auto runs = track(outside.sets, FilterSetting{}, excursion_seed);
  ReportedStates reports;
  for (std::size_t r = 0; r < runs.size(); ++r)
    add_run(reports, runs[r], outside.reference_distances_m[r]);
  RunRows rows{result, "m03.leaving." + name,
               name + ", one half memorised, the robot drives out of it and back", outside.sets,
               runs};
  add_rows(rows, reports);
  rows.what = name + ", leaving and returning";
  rows.add_rate_of_wrong_answers();
  viewer::Series lost_series{.label = "called lost"};
  viewer::Series localised_series{.label = "called localised"};
  for (std::size_t b = 0; b < bins; ++b) {
    if (reports.queries[b] == 0) continue;
    for (const auto& [series, counts] :
         {std::pair{&lost_series, &reports.lost}, {&localised_series, &reports.localised}}) {
      add_point(*series, (static_cast<double>(b) + 0.5) * bin_m,
                success_rate((*counts)[b], reports.queries[b]));
    }
  }
  const std::string file = "leaving_" + name + ".svg";
  add_plot(result, file, "States that the filter reports, by distance to the nearest reference.",
           viewer::LinePlot{.title = "Leaving the memorised half of " + name,
                            .x_label = "distance to the nearest reference [m]",
                            .y_label = "share of the images",
                            .series = {lost_series, localised_series},
                            .y_range = std::pair{0.0, 1.02}});
}

}  // namespace panonav::lab
