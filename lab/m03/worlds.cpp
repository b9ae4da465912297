// Global localisation in Gazebo worlds.

#include <string>
#include <vector>

#include "lab/m03/experiments.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

namespace {

constexpr std::uint64_t seed_of_worlds = 90'000;
constexpr double world_spacing_m = 0.5;
constexpr int images = 20;

}  // namespace

void reproduce_gazebo_world(const TrackingReproductionOptions& options, const std::string& name,
                            Executor& executor, Reproduction& result) {
  const simulation::PlaceRecording place =
      simulation::record_place(simulation::read_world(options.data, name),
                               {.seed = options.seed,
                                .spacing_m = world_spacing_m,
                                .queries = 1,
                                .rows = options.rows,
                                .columns = options.columns / 2},
                               executor);
  const auto remembered = remember_for_tracking(place, executor);
  RunCondition noisy = clean_condition();
  noisy.id = "noisy";
  noisy.name = "the sensor noise of hard";
  noisy.sensor = hard_condition().sensor;
  const WalkOptions walks{.variants = 1,
                          .runs_each = 5 * options.variants * options.runs,
                          .images = images,
                          .step_m = world_spacing_m,
                          .seed = 3};
  for (const RunCondition& condition : {clean_condition(), noisy}) {
    const std::vector<RunSet> sets{make_run_set(
        remembered, record_walks(place, *remembered, condition, walks, executor), executor)};
    const auto runs = track_sets(sets, FilterSetting{}, seed_of_worlds, executor);
    const std::string id = "m03." + name + "." + condition.id;
    const std::string what = name + ", " + std::to_string(remembered->memory().size()) +
                             " references on a 50 cm grid, " + condition.name;
    const bool judged = name == "small_warehouse" && condition.id == "clean";
    add_rate(result, id + ".within_15",
             what + ": runs with an error below 1 m within 15 images and from then on",
             localised_within(runs, 1.0, 15), runs.size(),
             judged ? std::optional(at_least(0.95)) : std::nullopt);
    tell_single_images(result.rows.back(), sets);
    const auto needed = capped_images(runs, 1.0);
    add_median(result, id + ".images", what + ": images until the error is below 1 m from then on",
               "images", needed);
    add_mean(result, id + ".images_mean",
             what + ": images until the error is below 1 m from then on", "images", needed);
    add_median(result, id + ".error_15", what + ": error after 15 images", "m",
               errors_after(runs, 15));
    add_confidently_wrong(result, id + ".wrong", what, runs);
  }
}

}  // namespace panonav::lab
