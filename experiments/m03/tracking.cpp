// [M03] section 4.1: position tracking through a stretch without images, figure 7 (4-6).

#include <array>
#include <string>
#include <vector>

#include "experiments/m03/experiments.hpp"
#include "panonav/core/statistics.hpp"

namespace panonav {

namespace {

constexpr std::size_t images_before_blind = 10;
constexpr std::size_t blind_steps = 8;  // of 0.25 m: 2 m
constexpr std::size_t first_after_blind = images_before_blind + blind_steps;
constexpr std::uint64_t seed_of_tracking = 30'000;

// "Large odometric errors": 20 % of the distance and 10 degrees a metre.
FilterSetting large_error_setting(InjectionMethod injection) {
  FilterSetting setting = compass_setting(injection);
  setting.odometry.translation_from_translation = 0.05;
  setting.odometry.translation_scale_error = 0.2;
  setting.odometry.rotation_from_translation = radians(10.0);
  // The filter has no model of a wrong scale: it is told of as much random error instead.
  setting.told_odometry.translation_from_translation = 0.25;
  setting.told_odometry.rotation_from_translation = radians(10.0);
  return setting;
}

}  // namespace

void reproduce_position_tracking(const TrackingReproductionOptions& options,
                                 std::span<const OfficeRuns> offices, Executor& executor,
                                 Reproduction& result) {
  std::vector<RunSet> sets;
  for (const OfficeRuns& office : offices) {
    RunSet set{office.hard.place, {}, office.hard.single_images};
    for (const TrackingRun& run : office.hard.runs) {
      if (run.steps.size() <= first_after_blind + 2) continue;
      set.runs.push_back(without_images(run, images_before_blind, blind_steps));
    }
    sets.push_back(std::move(set));
  }
  LinePlot curves{.title = "After 2 m without images (bars: 5 to 95 %)",
                  .x_label = "images after the blind stretch",
                  .y_label = "error [m]",
                  .series = {},
                  .x_range = std::pair{0.5, 5.5}};
  for (const auto& [injection, id, name] :
       {std::tuple{InjectionMethod::topological, "topological", "the paper's injection"},
        {InjectionMethod::explained, "explained", "our rule of injection"},
        {InjectionMethod::none, "none", "nothing injected"}}) {
    const auto runs = track_sets(sets, large_error_setting(injection), seed_of_tracking, executor);
    const std::string row = std::string("m03.tracking.hard.") + id;
    const std::string what = std::string(
                                 "tracking through 2 m without images, odometry off by 20 % of the "
                                 "distance and 10 degrees a metre, hard, ") +
                             name;
    // Only runs that knew the place before: others have nothing to keep.
    std::vector<TrackedRun> known;
    for (const TrackedRun& run : runs) {
      if (run.at(images_before_blind - 1).is_within(m03_spacing_m)) known.push_back(run);
    }
    add_rate(result, row + ".known_before", what + ": runs with an error below 25 cm before",
             known.size(), runs.size());
    if (known.empty()) continue;
    std::size_t back = 0;
    for (const TrackedRun& run : known) {
      back +=
          images_until_first_right(run, m03_spacing_m, first_after_blind).value_or(3) <= 2 ? 1 : 0;
    }
    add_rate(result, row + ".back_2", what + ": error below 25 cm at the first or second image",
             back, known.size(),
             injection == InjectionMethod::none ? std::nullopt : std::optional(at_least(0.99)));
    tell_single_images(result.rows.back(), sets);
    add_rate(result, row + ".back_2_for_good",
             what + ": error below 25 cm within 2 images and from then on",
             localised_within(known, m03_spacing_m, 2, first_after_blind), known.size());
    add_median(result, row + ".error_1", what + ": error at the first image after", "m",
               errors_after(known, 1, first_after_blind));
    add_confidently_wrong(result, row + ".wrong", what, runs);
    curves.series.push_back(error_over_images(name, known, 5, first_after_blind));
    for (double& x : curves.series.back().x) {
      x += 0.05 * static_cast<double>(curves.series.size() - 1);
    }
  }
  add_plot(result, options.out, "tracking_error.svg",
           "Error of the heaviest mode after 2 m of dead reckoning.", curves);
  if (sets.front().runs.empty()) return;
  const std::array<std::size_t, 3> steps{images_before_blind - 1, first_after_blind - 1,
                                         first_after_blind};
  add_plot(
      result, options.out, "fig07_position_tracking.svg",
      "Position tracking: before, at the end of, and one image after 2 m without images ([M03] "
      "figure 7, 4 to 6).",
      particle_maps(*sets.front().place, offices.front().furniture, sets.front().runs.front(),
                    large_error_setting(InjectionMethod::explained), seed_of_tracking, steps,
                    "Tracking"),
      3);
}

}  // namespace panonav
