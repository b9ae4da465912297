// [M03] section 4.1: the kidnapped robot, figures 8 and 9.

#include <array>
#include <string>
#include <vector>

#include "experiments/m03/experiments.hpp"
#include "panonav/core/statistics.hpp"

namespace panonav {

namespace {

constexpr std::size_t first_after = m03_images_before_kidnapping;
constexpr std::uint64_t seed_of_kidnapping = 40'000;

}  // namespace

void reproduce_kidnapping(const TrackingReproductionOptions& options,
                          std::span<const OfficeRuns> offices, Executor& executor,
                          Reproduction& result) {
  std::vector<RunSet> sets;
  for (const OfficeRuns& office : offices) sets.push_back(office.kidnapped);
  if (number_of_runs(sets) == 0) return;
  LinePlot curves{.title = "Kidnapped robot, hard: error over images (bars: 5 to 95 %)",
                  .x_label = "images after it was kidnapped",
                  .y_label = "error [m]",
                  .series = {},
                  .x_range = std::pair{0.5, 15.5}};
  std::vector<MapPlot> maps;
  std::vector<double> topological;
  for (const auto& [injection, id, name] :
       {std::tuple{InjectionMethod::uniform, "uniform", "50 injected anywhere"},
        {InjectionMethod::topological, "topological", "the paper's injection"},
        {InjectionMethod::explained, "explained", "our rule of injection"}}) {
    const FilterSetting setting = compass_setting(injection);
    const auto runs = track_sets(sets, setting, seed_of_kidnapping, executor);
    const std::string row = std::string("m03.kidnapped.hard.") + id;
    const std::string what = std::string("kidnapped, hard, ") + name;
    const bool judged = injection != InjectionMethod::uniform;
    const auto target = [&](Target value) { return judged ? std::optional(value) : std::nullopt; };
    const auto images = capped_images(runs, m03_spacing_m, first_after);
    add_median(result, row + ".images",
               what + ": images until the error is below 25 cm from then on", "images", images,
               target(at_most(3.0)),
               injection == InjectionMethod::topological ? std::optional(std::pair{3.0, 4.0})
                                                         : std::nullopt);
    tell_single_images(result.rows.back(), sets);
    add_mean(result, row + ".images_mean", what + ": images", "images", images);
    add_rate(result, row + ".within_8", what + ": runs localised within 8 images",
             localised_within(runs, m03_spacing_m, 8, first_after), runs.size(),
             target(at_least(0.99)));
    add_confidently_wrong(result, row + ".wrong", what, runs);
    if (injection == InjectionMethod::topological) topological = images;
    if (injection == InjectionMethod::explained) {
      std::vector<double> difference;
      for (std::size_t i = 0; i < images.size(); ++i) {
        difference.push_back(images[i] - topological[i]);
      }
      add_row(result, row + ".images_less",
              "kidnapped, hard: images with our rule less those with the paper's injection (mean, "
              "same runs)",
              mean_figure(difference), "images", at_most(0.0));
    }
    curves.series.push_back(error_over_images(name, runs, m03_most_images, first_after));
    for (double& x : curves.series.back().x) {
      x += 0.08 * static_cast<double>(curves.series.size() - 1);
    }
    const RunSet& shown = sets.front();
    if (shown.runs.empty()) continue;
    const std::array<std::size_t, 3> steps{first_after, first_after + 2, first_after + 5};
    for (MapPlot& map : particle_maps(*shown.place, offices.front().furniture, shown.runs.front(),
                                      setting, seed_of_kidnapping, steps, std::string(name))) {
      maps.push_back(std::move(map));
    }
  }
  add_plot(result, options.out, "kidnapped_error.svg",
           "Error of the heaviest mode after the robot was kidnapped by at least 1 m away.",
           curves);
  if (maps.empty()) return;
  add_plot(result, options.out, "fig08_kidnapped.svg",
           "The kidnapped robot 1, 3 and 6 images after it was kidnapped: injected anywhere "
           "([M03] figure 8), around the best matches ([M03] figure 9), and by our rule.",
           maps, 3);
}

}  // namespace panonav
