// [M03] section 4.1: global localisation, figure 7 (1-3).

#include <array>
#include <string>
#include <vector>

#include "experiments/m03/experiments.hpp"
#include "panonav/core/statistics.hpp"

namespace panonav {

namespace {

constexpr std::uint64_t seed_of_clean = 10'000;
constexpr std::uint64_t seed_of_hard = 20'000;

struct Rule {
  std::string id;
  std::string name;
  InjectionMethod injection;
};

const std::array<Rule, 4>& rules() {
  static const std::array<Rule, 4> all{
      Rule{"none", "nothing injected", InjectionMethod::none},
      Rule{"uniform", "50 injected anywhere", InjectionMethod::uniform},
      Rule{"topological", "the paper's injection", InjectionMethod::topological},
      Rule{"explained", "our rule of injection", InjectionMethod::explained}};
  return all;
}

void paper_rows(std::span<const RunSet> sets, Executor& executor, Reproduction& result) {
  for (const Rule& rule : {rules()[0], rules()[2]}) {
    FilterSetting setting = paper_setting();
    setting.injection = rule.injection;
    const auto runs = track_sets(sets, setting, seed_of_clean, executor);
    const std::string id = "m03.global.clean." + rule.id;
    const std::string name = "global localisation as the paper's, clean, " + rule.name;
    const bool judged = rule.injection == InjectionMethod::none;
    const auto target = [&](Target value) { return judged ? std::optional(value) : std::nullopt; };
    add_median(result, id + ".images",
               name + ": images until the error is below 25 cm from then on", "images",
               capped_images(runs, m03_spacing_m), target(at_most(4.0)),
               judged ? std::optional(std::pair{5.0, 6.0}) : std::nullopt);
    tell_single_images(result.rows.back(), sets);
    add_mean(result, id + ".images_mean", name + ": images", "images",
             capped_images(runs, m03_spacing_m));
    add_rate(result, id + ".within_10", name + ": runs localised within 10 images",
             localised_within(runs, m03_spacing_m, 10), runs.size(), target(at_least(0.99)));
    add_median(result, id + ".error_10", name + ": error after 10 images", "m",
               errors_after(runs, 10), target(at_most(m03_spacing_m)));
    add_confidently_wrong(result, id + ".wrong", name, runs);
  }
}

void hard_rows(std::span<const RunSet> sets, const Rule& rule, std::span<const TrackedRun> runs,
               Reproduction& result) {
  const std::string id = "m03.global.hard." + rule.id;
  const std::string name = "global localisation, heading unknown, compass on, hard, " + rule.name;
  const bool judged = rule.injection == InjectionMethod::topological ||
                      rule.injection == InjectionMethod::explained;
  const auto target = [&](Target value) { return judged ? std::optional(value) : std::nullopt; };
  const auto images = capped_images(runs, m03_spacing_m);
  add_median(result, id + ".images", name + ": images until the error is below 25 cm from then on",
             "images", images, target(at_most(4.0)));
  tell_single_images(result.rows.back(), sets);
  add_mean(result, id + ".images_mean", name + ": images", "images", images);
  add_rate(result, id + ".within_10", name + ": runs localised within 10 images",
           localised_within(runs, m03_spacing_m, 10), runs.size(), target(at_least(0.99)));
  const auto errors = errors_after(runs, 10);
  add_median(result, id + ".error_10", name + ": error after 10 images", "m", errors,
             target(at_most(0.5 * m03_spacing_m)));
  std::size_t half = 0;
  for (const double error : errors) half += error < 0.5 * m03_spacing_m ? 1 : 0;
  add_rate(result, id + ".half_10", name + ": runs with an error below 12.5 cm after 10 images",
           half, errors.size());
  std::size_t early = 0;
  for (const TrackedRun& run : runs) {
    early += images_until_first_right(run, m03_spacing_m).value_or(m03_most_images) <= 1 ? 1 : 0;
  }
  add_rate(result, id + ".first_image",
           name + ": runs with an error below 25 cm at the first image", early, runs.size());
  add_confidently_wrong(result, id + ".wrong", name, runs);
}

void ratio_row(const Rule& rule, const std::vector<double>& with,
               const std::vector<double>& without, Reproduction& result) {
  std::vector<double> saved;
  for (std::size_t i = 0; i < with.size(); ++i) saved.push_back(with[i] / mean(without));
  add_row(result, "m03.global.hard.ratio." + rule.id,
          "global localisation on hard: mean number of images with " + rule.name +
              ", over that with nothing injected (" + std::to_string(m03_most_images) +
              " for runs that need more)",
          mean_figure(saved), "",
          rule.injection == InjectionMethod::uniform ? std::nullopt : std::optional(at_most(0.5)),
          rule.injection == InjectionMethod::topological ? std::optional(std::pair{0.5, 0.6})
                                                         : std::nullopt);
}

}  // namespace

void reproduce_global_localisation(const TrackingReproductionOptions& options,
                                   std::span<const OfficeRuns> offices, Executor& executor,
                                   Reproduction& result) {
  std::vector<RunSet> constant;
  std::vector<RunSet> hard;
  for (const OfficeRuns& office : offices) {
    constant.push_back(office.constant_heading);
    hard.push_back(office.hard);
  }
  paper_rows(constant, executor, result);
  LinePlot curves{.title = "Global localisation on hard: error over images (bars: 5 to 95 %)",
                  .x_label = "images",
                  .y_label = "error [m]",
                  .series = {},
                  .log_y = true,
                  .x_range = std::pair{0.5, 15.5}};
  std::vector<double> without;
  for (const Rule& rule : rules()) {
    const auto runs = track_sets(hard, compass_setting(rule.injection), seed_of_hard, executor);
    hard_rows(hard, rule, runs, result);
    const auto images = capped_images(runs, m03_spacing_m);
    if (rule.injection == InjectionMethod::none) {
      without = images;
    } else {
      ratio_row(rule, images, without, result);
    }
    curves.series.push_back(error_over_images(rule.name, runs, m03_most_images));
    for (double& x : curves.series.back().x) {
      x += 0.08 * static_cast<double>(curves.series.size() - 1);
    }
  }
  add_plot(result, options.out, "global_error.svg",
           "Error of the heaviest mode over the images, from no knowledge of position and heading, "
           "for four rules of injection.",
           curves);
  const std::array<std::size_t, 3> steps{0, 2, 8};
  const OfficeRuns& shown = offices.front();
  add_plot(result, options.out, "fig07_global_localisation.svg",
           "Global localisation with as many particles as references and nothing injected, heading "
           "unknown, hard ([M03] figure 7, 1 to 3).",
           particle_maps(*shown.hard.place, shown.furniture, shown.hard.runs.front(),
                         compass_setting(InjectionMethod::none), seed_of_hard, steps,
                         "Global localisation"),
           3);
}

}  // namespace panonav
