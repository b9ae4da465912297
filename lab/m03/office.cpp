// [M03] section 4.1 in offices: global localisation, tracking, the kidnapped robot, sweeps.

#include <array>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "lab/m03/experiments.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

constexpr std::uint64_t seed_of_clean = 10'000;
constexpr std::uint64_t seed_of_hard = 20'000;
constexpr std::uint64_t seed_of_tracking = 30'000;
constexpr std::uint64_t seed_of_kidnapping = 40'000;
constexpr std::uint64_t seed_of_particles = 50'000;
constexpr std::uint64_t seed_of_odometry = 60'000;
constexpr std::size_t images_before_blind = 10;
constexpr std::size_t blind_steps = 8;  // of 0.25 m: 2 m
constexpr std::size_t first_after_blind = images_before_blind + blind_steps;

struct NamedInjection {
  InjectionMethod injection;
  std::string id;
  std::string name;
};
const NamedInjection no_injection{InjectionMethod::none, "none", "nothing injected"};
const NamedInjection anywhere_injection{InjectionMethod::uniform, "uniform",
                                        "50 injected anywhere"};
const NamedInjection paper_injection{InjectionMethod::topological, "topological",
                                     "the paper's injection"};
const NamedInjection own_injection{InjectionMethod::explained, "explained",
                                   "our rule of injection"};

void add_paper_rows(const TrackingExperiments& m03) {
  const auto sets = m03.collect_sets(&OfficeRuns::constant_heading);
  for (const NamedInjection& rule : {no_injection, paper_injection}) {
    FilterSetting setting = paper_setting();
    setting.injection = rule.injection;
    const auto runs = m03.track(sets, setting, seed_of_clean);
    const bool is_papers = rule.injection == InjectionMethod::none;
    const RunRows rows{.result = m03.result,
                       .id = "m03.global.clean." + rule.id,
                       .what = "global localisation as the paper's, clean, " + rule.name,
                       .sets = sets,
                       .runs = runs,
                       .with_targets = is_papers};
    rows.add_images_until_localised(at_most(4.0),
                                    is_papers ? std::optional(std::pair{5.0, 6.0}) : std::nullopt);
    rows.add_images_mean();
    rows.add_rate_localised_within(10, at_least(0.99));
    rows.add_error_after(10, at_most(m03_spacing_m));
    rows.add_rate_of_wrong_answers();
  }
  const auto published =
      m03.track_as_published(sets, {.particles_per_reference = 1.0}, seed_of_clean);
  const RunRows rows{.result = m03.result,
                     .id = "m03.global.clean.published",
                     .what = "global localisation, clean, the paper's weights (eq. 1)",
                     .sets = sets,
                     .runs = published};
  rows.add_images_until_localised(std::nullopt, std::pair{5.0, 6.0});
  rows.add_images_mean();
  rows.add_rate_localised_within(10);
  rows.add_error_after(10);
}

void add_hard_rows(const TrackingExperiments& m03, std::span<const RunSet> sets,
                   const NamedInjection& rule, std::span<const TrackedRun> runs) {
  const RunRows rows{.result = m03.result,
                     .id = "m03.global.hard." + rule.id,
                     .what = "global localisation, heading unknown, compass on, hard, " + rule.name,
                     .sets = sets,
                     .runs = runs,
                     .with_targets = rule.injection == InjectionMethod::topological ||
                                     rule.injection == InjectionMethod::explained};
  rows.add_images_until_localised(at_most(4.0));
  rows.add_images_mean();
  rows.add_rate_localised_within(10, at_least(0.99));
  rows.add_error_after(10, at_most(0.5 * m03_spacing_m));
  const auto errors = errors_after(runs, 10);
  add_rate(m03.result, rows.id + ".half_10",
           rows.what + ": runs with an error below 12.5 cm after 10 images",
           count_where(errors, [](double error) { return error < 0.5 * m03_spacing_m; }),
           errors.size());
  add_rate(m03.result, rows.id + ".first_image",
           rows.what + ": runs with an error below 25 cm at the first image",
           count_where(runs,
                       [](const TrackedRun& run) {
                         return images_until_first_fix(run, m03_spacing_m).value_or(2) <= 1;
                       }),
           runs.size());
  rows.add_rate_of_wrong_answers();
}

void add_ratio_row(const NamedInjection& rule, const std::vector<double>& with,
                   const std::vector<double>& without, Reproduction& result) {
  std::vector<double> saved;
  for (std::size_t i = 0; i < with.size(); ++i) saved.push_back(with[i] / mean(without));
  add_row(result, "m03.global.hard.ratio." + rule.id,
          "global localisation on hard: mean number of images with " + rule.name +
              ", over that with nothing injected (" + std::to_string(m03_max_images) +
              " for runs that need more)",
          mean_figure(saved), "",
          rule.injection == InjectionMethod::uniform ? std::nullopt : std::optional(at_most(0.5)),
          rule.injection == InjectionMethod::topological ? std::optional(std::pair{0.5, 0.6})
                                                         : std::nullopt);
}

// Returns the setting for "large odometric errors": 20 % of the distance and 10 degrees per metre.
FilterSetting large_error_setting(InjectionMethod injection) {
  FilterSetting setting = compass_setting(injection);
  setting.odometry.translation_from_translation = 0.05;
  setting.odometry.translation_scale_error = 0.2;
  setting.odometry.rotation_from_translation = radians(10.0);
  // The filter does not model a scale error, so its random error is set as large as both together.
  setting.assumed_odometry.translation_from_translation = 0.25;
  setting.assumed_odometry.rotation_from_translation = radians(10.0);
  return setting;
}

// Returns the runs that are localised at the last image before the stretch without images.
std::vector<TrackedRun> filter_known_before_blind(std::span<const TrackedRun> runs) {
  std::vector<TrackedRun> known;
  for (const TrackedRun& run : runs) {
    if (run.at(images_before_blind - 1).is_within(m03_spacing_m)) known.push_back(run);
  }
  return known;
}

void add_tracking_rows(const TrackingExperiments& m03, std::span<const RunSet> sets,
                       const NamedInjection& rule, std::span<const TrackedRun> runs,
                       std::span<const TrackedRun> known) {
  const std::string row = "m03.tracking.hard." + rule.id;
  const std::string what =
      "tracking through 2 m without images, odometry off by 20 % of the distance and 10 degrees a "
      "metre, hard, " +
      rule.name;
  add_rate(m03.result, row + ".known_before", what + ": runs with an error below 25 cm before",
           known.size(), runs.size());
  if (known.empty()) return;
  const auto is_relocalised = [](const TrackedRun& run) {
    return images_until_first_fix(run, m03_spacing_m, first_after_blind).value_or(3) <= 2;
  };
  add_rate(m03.result, row + ".back_2", what + ": error below 25 cm at the first or second image",
           count_where(known, is_relocalised), known.size(),
           rule.injection == InjectionMethod::none ? std::nullopt : std::optional(at_least(0.99)));
  const RunRows rows{.result = m03.result, .id = row, .what = what, .sets = sets, .runs = runs};
  rows.append_single_image_rates();
  add_rate(m03.result, row + ".back_2_for_good",
           what + ": error below 25 cm within 2 images and from then on",
           count_localised_within(known, m03_spacing_m, 2, first_after_blind), known.size());
  add_median(m03.result, row + ".error_1", what + ": error at the first image after", "m",
             errors_after(known, 1, first_after_blind));
  rows.add_rate_of_wrong_answers();
}

void add_kidnapping_rows(const TrackingExperiments& m03, std::span<const RunSet> sets,
                         const NamedInjection& rule, std::span<const TrackedRun> runs,
                         const std::vector<double>& images_of_paper) {
  const RunRows rows{.result = m03.result,
                     .id = "m03.kidnapped.hard." + rule.id,
                     .what = "kidnapped, hard, " + rule.name,
                     .sets = sets,
                     .runs = runs,
                     .first_step = m03_images_before_kidnapping,
                     .with_targets = rule.injection != InjectionMethod::uniform};
  rows.add_images_until_localised(at_most(3.0), rule.injection == InjectionMethod::topological
                                                    ? std::optional(std::pair{3.0, 4.0})
                                                    : std::nullopt);
  rows.add_images_mean();
  rows.add_rate_localised_within(8, at_least(0.99));
  rows.add_rate_of_wrong_answers();
  if (rule.injection != InjectionMethod::explained) return;
  std::vector<double> difference =
      capped_images_until_localised(runs, m03_spacing_m, rows.first_step);
  for (std::size_t i = 0; i < difference.size(); ++i) difference[i] -= images_of_paper[i];
  add_row(m03.result, rows.id + ".images_less",
          "kidnapped, hard: images with our rule less those with the paper's injection (mean, same "
          "runs)",
          mean_figure(difference), "images", at_most(0.0));
}

// Success rate and number of images of a filter against a varied quantity.
struct SweepCurve {
  viewer::Series success;
  viewer::Series images;

  explicit SweepCurve(const std::string& label) : success{.label = label}, images{.label = label} {}
  void add(double x, std::span<const TrackedRun> runs) {
    add_point(success, x,
              success_rate(count_localised_within(runs, m03_spacing_m, 10), runs.size()));
    add_point(images, x, mean_figure(capped_images_until_localised(runs, m03_spacing_m)));
  }
};

void draw_curves(const TrackingExperiments& m03, const std::string& file, const std::string& title,
                 const std::string& x_label, const std::vector<SweepCurve>& curves) {
  viewer::LinePlot success{.title = title + ": runs localised within 10 images",
                           .x_label = x_label,
                           .y_label = "share of the runs",
                           .log_x = true,
                           .y_range = std::pair{0.0, 1.02}};
  viewer::LinePlot images{.title = title + ": mean number of images until localised",
                          .x_label = x_label,
                          .y_label = "images (15 for runs that need more)",
                          .log_x = true,
                          .y_range = std::pair{0.0, 15.0}};
  for (const SweepCurve& curve : curves) {
    success.series.push_back(curve.success);
    images.series.push_back(curve.images);
  }
  add_plot(m03.result, file + "_success.svg", title + ": success.", success);
  add_plot(m03.result, file + "_images.svg", title + ": images.", images);
}

void scale_noise(OdometryNoise& noise, double factor) {
  noise.translation_from_translation *= factor;
  noise.translation_from_rotation *= factor;
  noise.rotation_from_translation *= factor;
  noise.rotation_from_rotation *= factor;
  noise.translation_scale_error *= factor;
  noise.rotation_scale_error *= factor;
}

}  // namespace

void TrackingExperiments::record_office(int number) {
  const simulation::PlaceRecording place =
      record_variant("office", number, m03_spacing_m, options.columns);
  const auto remembered = make_tracking_place(place, executor);
  const auto walk = [&](const RunCondition& condition, const WalkOptions& walks) {
    return make_run_set(remembered, record_walks(place, *remembered, condition, walks, executor),
                        executor);
  };
  OfficeRuns office{viewer::scene_layers(place.scene),
                    walk(make_clean_condition(), {.variants = 1,
                                                  .runs_each = options.variants * options.runs,
                                                  .constant_heading = true,
                                                  .seed = 1}),
                    walk(make_hard_condition(),
                         {.variants = options.variants, .runs_each = options.runs, .seed = 2}),
                    {}};
  // Carry the robot from each run to another run in the same variant, so that only the position
  // changes.
  std::vector<TrackingRun> kidnapped_runs;
  const auto each = static_cast<std::size_t>(options.runs);
  for (std::size_t i = 0; i < office.hard.runs.size(); ++i) {
    const std::size_t first = i / each * each;
    for (std::size_t k = 1; k < each; ++k) {
      const TrackingRun& other = office.hard.runs[first + (i - first + k) % each];
      if (auto run = make_kidnapped_run(office.hard.runs[i], other, m03_images_before_kidnapping,
                                        1.0, static_cast<std::size_t>(m03_max_images))) {
        kidnapped_runs.push_back(std::move(*run));
        break;
      }
    }
  }
  office.kidnapped = {remembered, std::move(kidnapped_runs), office.hard.single_images};
  offices.push_back(std::move(office));
}

void TrackingExperiments::reproduce_global_localisation() {
  add_paper_rows(*this);
  const auto hard = collect_sets(&OfficeRuns::hard);
  viewer::LinePlot curves{
      .title = "Global localisation on hard: error over images (bars: 5 to 95 %)",
      .x_label = "images",
      .y_label = "error [m]",
      .log_y = true,
      .x_range = std::pair{0.5, 15.5}};
  std::vector<double> without;
  for (const NamedInjection& rule :
       {no_injection, anywhere_injection, paper_injection, own_injection}) {
    const auto runs = track(hard, compass_setting(rule.injection), seed_of_hard);
    add_hard_rows(*this, hard, rule, runs);
    const auto images = capped_images_until_localised(runs, m03_spacing_m);
    if (rule.injection == InjectionMethod::none) {
      without = images;
    } else {
      add_ratio_row(rule, images, without, result);
    }
    curves.series.push_back(make_error_series(rule.name, runs, m03_max_images, 0,
                                              0.08 * static_cast<double>(curves.series.size())));
  }
  add_plot(result, "global_error.svg",
           "Error of the heaviest mode over the images, from no knowledge of position and heading, "
           "for four rules of injection.",
           curves);
  const std::array<std::size_t, 3> steps{0, 2, 8};
  const OfficeRuns& shown = offices.front();
  add_plot(result, "fig07_global_localisation.svg",
           "Global localisation with as many particles as references and nothing injected, heading "
           "unknown, hard ([M03] figure 7, 1 to 3).",
           make_particle_maps(*shown.hard.place, shown.furniture, shown.hard.runs.front(),
                              compass_setting(InjectionMethod::none), seed_of_hard, steps,
                              "Global localisation"),
           3);
}

void TrackingExperiments::reproduce_position_tracking() {
  std::vector<RunSet> sets;
  for (const OfficeRuns& office : offices) {
    RunSet set{office.hard.place, {}, office.hard.single_images};
    for (const TrackingRun& run : office.hard.runs) {
      if (run.steps.size() <= first_after_blind + 2) continue;
      set.runs.push_back(drop_images(run, images_before_blind, blind_steps));
    }
    sets.push_back(std::move(set));
  }
  viewer::LinePlot curves{.title = "After 2 m without images (bars: 5 to 95 %)",
                          .x_label = "images after the blind stretch",
                          .y_label = "error [m]",
                          .x_range = std::pair{0.5, 5.5}};
  for (const NamedInjection& rule : {paper_injection, own_injection, no_injection}) {
    const auto runs = track(sets, large_error_setting(rule.injection), seed_of_tracking);
    const auto known = filter_known_before_blind(runs);
    add_tracking_rows(*this, sets, rule, runs, known);
    if (known.empty()) continue;
    curves.series.push_back(make_error_series(rule.name, known, 5, first_after_blind,
                                              0.05 * static_cast<double>(curves.series.size())));
  }
  add_plot(result, "tracking_error.svg", "Error of the heaviest mode after 2 m of dead reckoning.",
           curves);
  if (sets.front().runs.empty()) return;
  const std::array<std::size_t, 3> steps{images_before_blind - 1, first_after_blind - 1,
                                         first_after_blind};
  add_plot(
      result, "fig07_position_tracking.svg",
      "Position tracking: before, at the end of, and one image after 2 m without images ([M03] "
      "figure 7, 4 to 6).",
      make_particle_maps(*sets.front().place, offices.front().furniture, sets.front().runs.front(),
                         large_error_setting(InjectionMethod::explained), seed_of_tracking, steps,
                         "Tracking"),
      3);
}

void TrackingExperiments::reproduce_kidnapping() {
  const auto sets = collect_sets(&OfficeRuns::kidnapped);
  constexpr std::size_t first = m03_images_before_kidnapping;
  if (std::ranges::all_of(sets, [](const RunSet& set) { return set.runs.empty(); })) return;
  viewer::LinePlot curves{.title = "Kidnapped robot, hard: error over images (bars: 5 to 95 %)",
                          .x_label = "images after it was kidnapped",
                          .y_label = "error [m]",
                          .x_range = std::pair{0.5, 15.5}};
  std::vector<viewer::MapPlot> maps;
  std::vector<double> images_of_paper;
  for (const NamedInjection& rule : {anywhere_injection, paper_injection, own_injection}) {
    const FilterSetting setting = compass_setting(rule.injection);
    const auto runs = track(sets, setting, seed_of_kidnapping);
    if (rule.injection == InjectionMethod::topological) {
      images_of_paper = capped_images_until_localised(runs, m03_spacing_m, first);
    }
    add_kidnapping_rows(*this, sets, rule, runs, images_of_paper);
    curves.series.push_back(make_error_series(rule.name, runs, m03_max_images, first,
                                              0.08 * static_cast<double>(curves.series.size())));
    const RunSet& shown = sets.front();
    if (shown.runs.empty()) continue;
    const std::array<std::size_t, 3> steps{first, first + 2, first + 5};
    std::ranges::move(
        make_particle_maps(*shown.place, offices.front().furniture, shown.runs.front(), setting,
                           seed_of_kidnapping, steps, rule.name),
        std::back_inserter(maps));
  }
  add_plot(result, "kidnapped_error.svg",
           "Error of the heaviest mode after the robot was kidnapped by at least 1 m away.",
           curves);
  if (maps.empty()) return;
  add_plot(result, "fig08_kidnapped.svg",
           "The kidnapped robot 1, 3 and 6 images after it was kidnapped: injected anywhere "
           "([M03] figure 8), around the best matches ([M03] figure 9), and by our rule.",
           maps, 3);
}

void TrackingExperiments::reproduce_sweeps() {
  struct SweptSetting {
    std::string id;
    std::string name;
    std::string label;  ///< short, for the plots
    std::vector<RunSet> sets;
    FilterSetting setting;
  };
  const auto hard = collect_sets(&OfficeRuns::hard);
  std::vector<SweepCurve> particles;
  std::vector<SweepCurve> odometry;
  for (const SweptSetting& kind :
       {SweptSetting{"paper", "as the paper, clean", "as the paper, clean",
                     collect_sets(&OfficeRuns::constant_heading), paper_setting()},
        SweptSetting{"topological", "compass and the paper's injection, hard",
                     "paper's injection, hard", hard,
                     compass_setting(InjectionMethod::topological)},
        SweptSetting{"explained", "compass and our rule of injection, hard", "our rule, hard", hard,
                     compass_setting(InjectionMethod::explained)}}) {
    const auto add_sweep_point = [&](const std::string& id, const std::string& what,
                                     std::uint64_t seed, const FilterSetting& setting, double x,
                                     SweepCurve& curve) {
      const auto runs = track(kind.sets, setting, seed);
      const RunRows rows{result, "m03." + id + "." + kind.id + "." + format_number(x),
                         what + ", " + kind.name, kind.sets, runs};
      rows.add_rate_localised_within(10);
      rows.add_images_mean();
      curve.add(x, runs);
    };
    particles.emplace_back(kind.label);
    for (const double share : {0.1, 0.25, 0.5, 1.0, 2.0, 4.0}) {
      FilterSetting setting = kind.setting;
      setting.particles_per_reference = share;
      add_sweep_point("particles", format_number(share) + " particles a reference",
                      seed_of_particles, setting, share, particles.back());
    }
    odometry.emplace_back(kind.label);
    for (const double factor : {0.5, 1.0, 2.0, 4.0, 8.0}) {
      FilterSetting setting = kind.setting;
      scale_noise(setting.odometry, factor);
      scale_noise(setting.assumed_odometry, factor);
      add_sweep_point("odometry",
                      "odometry with " + format_number(factor) + " times the usual noise",
                      seed_of_odometry, setting, factor, odometry.back());
    }
  }
  draw_curves(*this, "particles", "Number of particles", "particles a reference", particles);
  draw_curves(*this, "odometry", "Noise of odometry", "times the usual noise", odometry);
}

}  // namespace panonav::lab
