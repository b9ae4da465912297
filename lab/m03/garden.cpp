// [M03] section 4.1, future work of its authors: changing brightness outdoors.

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "lab/m03/experiments.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav_simulation/paths.hpp"

namespace panonav::lab {

namespace {

constexpr std::uint64_t garden_seed = 80'000;
constexpr double garden_spacing_m = 0.5;
constexpr int images = 16;
constexpr std::array<double, 7> lights{0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0};
// Indices into `lights`, one per image: a cloud passes, then the sun comes out.
constexpr std::array<std::size_t, 12> changing{3, 2, 1, 0, 1, 2, 3, 4, 5, 6, 5, 4};

struct GardenRuns {
  std::array<std::vector<RunSet>, lights.size()> constant_light;  ///< the same paths in each light
  std::vector<RunSet> changing;
};

GardenRuns record_gardens(const TrackingExperiments& m03) {
  const ReproductionOptions& options = m03.options;
  Executor& executor = m03.executor;
  GardenRuns gardens;
  const int scenes = std::max(1, (options.scenes + 1) / 2);
  const int runs_each = options.variants * options.runs;
  for (int s = 0; s < scenes; ++s) {
    const simulation::PlaceRecording place =
        m03.record_variant("garden", s, garden_spacing_m, options.columns / 2);
    const std::uint64_t seed = place.seed;
    const auto remembered = make_tracking_place(place, executor);
    std::vector<std::vector<Pose2>> paths;
    for (int r = 0; r < runs_each; ++r) {
      Random random(seed * 1000003U + 80U, static_cast<std::uint64_t>(r));
      const Pose2 start = place.free_space->random_pose(random);
      paths.push_back(simulation::random_walk(
          start, [&](Point2 p) { return place.free_space->is_free(p); },
          {.poses = images, .step_m = garden_spacing_m}, random));
    }
    std::array<std::vector<TrackingRun>, lights.size()> runs;
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const simulation::Scene scene =
          simulation::make_scene("garden", {.seed = seed, .light = lights[l]});
      const simulation::Renderer renderer(scene, simulation::RendererOptions{}, executor);
      runs[l] = record_runs(paths, place, renderer, *remembered, {}, seed * 100003U + 20'000U * l,
                            executor);
    }
    std::vector<TrackingRun> under_clouds = runs[0];
    for (std::size_t r = 0; r < under_clouds.size(); ++r) {
      for (std::size_t i = 0; i < under_clouds[r].steps.size(); ++i) {
        under_clouds[r].steps[i].view = runs[changing[(i + r) % changing.size()]][r].steps[i].view;
      }
    }
    for (std::size_t l = 0; l < lights.size(); ++l) {
      gardens.constant_light[l].push_back(make_run_set(remembered, std::move(runs[l]), executor));
    }
    gardens.changing.push_back(make_run_set(remembered, std::move(under_clouds), executor));
  }
  return gardens;
}

}  // namespace

void TrackingExperiments::reproduce_garden() {
  const GardenRuns gardens = record_gardens(*this);
  const auto add_rows = [&](const std::string& id, const std::string& light,
                            std::span<const RunSet> sets) {
    auto runs = track(sets, FilterSetting{}, garden_seed);
    const RunRows rows{result, "m03.garden." + id, "garden, 50 cm grid, " + light, sets,
                       runs,   garden_spacing_m};
    rows.add_images_until_localised();
    rows.add_rate_localised_within(10);
    rows.add_error_after(10);
    rows.add_rate_of_wrong_answers();
    return runs;
  };
  viewer::Series right{.label = "one image alone: nearest place"};
  viewer::Series near{.label = "one image alone: within 0.5 m"};
  viewer::Series success{.label = "filter, within 10 images"};
  viewer::Series first{.label = "filter, first image"};
  viewer::Series needed{.label = "constant light"};
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const auto runs = add_rows("light_" + format_fixed(lights[l], 2),
                               "light " + format_fixed(lights[l], 2) + " times that of the memory",
                               gardens.constant_light[l]);
    const SingleImages single = sum_single_images(gardens.constant_light[l]);
    add_point(right, lights[l], success_rate(single.right, single.images));
    add_point(near, lights[l], success_rate(single.near, single.images));
    const auto share_within = [&](int images) {
      return success_rate(count_localised_within(runs, garden_spacing_m, images), runs.size());
    };
    add_point(success, lights[l], share_within(10));
    add_point(first, lights[l], share_within(1));
    add_point(needed, lights[l],
              mean_figure(capped_images_until_localised(runs, garden_spacing_m)));
  }
  (void)add_rows("light_changing", "light that changes at each image between 0.50 and 2.00",
                 gardens.changing);
  add_plot(result, "garden_success.svg",
           "Outdoors in other light than memorised: single images, and the filter.",
           viewer::LinePlot{.title = "Garden: localisation against brightness",
                            .x_label = "light, times that of the memory",
                            .y_label = "share",
                            .series = {right, near, first, success},
                            .log_x = true,
                            .x_range = std::pair{0.4, 2.5},
                            .y_range = std::pair{0.0, 1.02}});
  add_plot(result, "garden_images.svg", "Images until localised against brightness.",
           viewer::LinePlot{.title = "Garden: mean number of images until localised",
                            .x_label = "light, times that of the memory",
                            .y_label = "images",
                            .series = {needed},
                            .log_x = true,
                            .x_range = std::pair{0.4, 2.5},
                            .y_range = std::pair{0.0, 15.0}});
}

}  // namespace panonav::lab
