// [M03] section 4.1: how many particles are needed, and what odometry may be like.

#include <string>
#include <vector>

#include "experiments/m03/experiments.hpp"
#include "panonav/core/statistics.hpp"

namespace panonav {

namespace {

constexpr std::uint64_t seed_of_particles = 50'000;
constexpr std::uint64_t seed_of_odometry = 60'000;

struct Curve {
  Series success;
  Series images;
};

void add_point(Curve& curve, double x, std::span<const TrackedRun> runs) {
  add_point(curve.success, x, success_rate(localised_within(runs, m03_spacing_m, 10), runs.size()));
  add_point(curve.images, x, mean_figure(capped_images(runs, m03_spacing_m)));
}

void add_rows(Reproduction& result, const std::string& id, const std::string& what,
              std::span<const TrackedRun> runs) {
  add_rate(result, id + ".within_10", what + ": runs localised within 10 images",
           localised_within(runs, m03_spacing_m, 10), runs.size());
  add_mean(result, id + ".images_mean", what + ": images", "images",
           capped_images(runs, m03_spacing_m));
}

void write(const TrackingReproductionOptions& options, const std::string& file,
           const std::string& title, const std::string& x_label, const std::vector<Curve>& curves,
           Reproduction& result) {
  LinePlot success{.title = title + ": runs localised within 10 images",
                   .x_label = x_label,
                   .y_label = "share of the runs",
                   .series = {},
                   .log_x = true,
                   .y_range = std::pair{0.0, 1.02}};
  LinePlot images{.title = title + ": mean number of images until localised",
                  .x_label = x_label,
                  .y_label = "images (15 for runs that need more)",
                  .series = {},
                  .log_x = true,
                  .y_range = std::pair{0.0, 15.0}};
  for (const Curve& curve : curves) {
    success.series.push_back(curve.success);
    images.series.push_back(curve.images);
  }
  add_plot(result, options.out, file + "_success.svg", title + ": success.", success);
  add_plot(result, options.out, file + "_images.svg", title + ": images.", images);
}

std::string shown(double factor) {
  std::string text = std::to_string(factor);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace

void reproduce_tracking_sweeps(const TrackingReproductionOptions& options,
                               std::span<const OfficeRuns> offices, Executor& executor,
                               Reproduction& result) {
  std::vector<RunSet> constant;
  std::vector<RunSet> hard;
  for (const OfficeRuns& office : offices) {
    constant.push_back(office.constant_heading);
    hard.push_back(office.hard);
  }
  struct Kind {
    std::string id;
    std::string name;
    std::string label;  ///< short, for the plots
    const std::vector<RunSet>* sets;
    FilterSetting setting;
  };
  const std::vector<Kind> kinds{
      {"paper", "as the paper, clean", "as the paper, clean", &constant, paper_setting()},
      {"topological", "compass and the paper's injection, hard", "paper's injection, hard", &hard,
       compass_setting(InjectionMethod::topological)},
      {"explained", "compass and our rule of injection, hard", "our rule, hard", &hard,
       compass_setting(InjectionMethod::explained)}};
  std::vector<Curve> particles;
  std::vector<Curve> odometry;
  for (const Kind& kind : kinds) {
    Curve curve{{.label = kind.label}, {.label = kind.label}};
    for (const double share : {0.1, 0.25, 0.5, 1.0, 2.0, 4.0}) {
      FilterSetting setting = kind.setting;
      setting.particles_per_reference = share;
      const auto runs = track_sets(*kind.sets, setting, seed_of_particles, executor);
      add_rows(result, "m03.particles." + kind.id + "." + shown(share),
               shown(share) + " particles a reference, " + kind.name, runs);
      add_point(curve, share, runs);
    }
    particles.push_back(std::move(curve));
    Curve noisy{{.label = kind.label}, {.label = kind.label}};
    for (const double factor : {0.5, 1.0, 2.0, 4.0, 8.0}) {
      FilterSetting setting = kind.setting;
      for (OdometryNoise* noise : {&setting.odometry, &setting.told_odometry}) {
        noise->translation_from_translation *= factor;
        noise->translation_from_rotation *= factor;
        noise->rotation_from_translation *= factor;
        noise->rotation_from_rotation *= factor;
        noise->translation_scale_error *= factor;
        noise->rotation_scale_error *= factor;
      }
      const auto runs = track_sets(*kind.sets, setting, seed_of_odometry, executor);
      add_rows(result, "m03.odometry." + kind.id + "." + shown(factor),
               "odometry with " + shown(factor) + " times the usual noise, " + kind.name, runs);
      add_point(noisy, factor, runs);
    }
    odometry.push_back(std::move(noisy));
  }
  write(options, "particles", "Number of particles", "particles a reference", particles, result);
  write(options, "odometry", "Noise of odometry", "times the usual noise", odometry, result);
}

}  // namespace panonav
