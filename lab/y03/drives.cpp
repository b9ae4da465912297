// [Y03] section 5: drives across a straight path, and sweeps.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lab/rows.hpp"
#include "lab/y03/experiments.hpp"
#include "lab/y03/figures.hpp"
#include "lab/y03/lab.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

namespace {

const std::vector<double> lateral_offsets_m{0.0, 0.1, 0.25, 0.5, 0.75, 1.0};
const std::vector<std::size_t> thinnings{1, 2, 5, 10, 15, 25};
// Of the drives beside the path, the one from which a view is synthesised for people.
constexpr std::size_t shown_offset = 3;
const std::vector<double> margins_m{0.04, 0.08, 0.14, 0.24, 0.34};

// Errors of one way of localising, over all variants.
struct Errors {
  std::vector<double> mean_cm;                 // one a variant
  std::vector<std::vector<double>> images_cm;  // of each variant
  std::vector<double> heading_deg;             // means
  std::size_t missed = 0;
  std::size_t changed = 0;

  void add(const DriveErrors& drive) {
    double sum = 0.0;
    double turn = 0.0;
    images_cm.emplace_back();
    for (const double off : drive.position_m) {
      sum += off;
      images_cm.back().push_back(100.0 * off);
    }
    for (const double off : drive.heading_rad) turn += off;
    mean_cm.push_back(100.0 * sum / static_cast<double>(drive.position_m.size()));
    heading_deg.push_back(degrees(turn / static_cast<double>(drive.heading_rad.size())));
    missed += drive.missed;
    changed += drive.changed;
  }
};

// Of the images of these variants.
double deviation(const std::vector<std::vector<double>>& images,
                 const std::vector<std::size_t>& chosen) {
  double n = 0.0;
  double sum = 0.0;
  double squares = 0.0;
  for (const std::size_t i : chosen) {
    for (const double value : images[i]) {
      n += 1.0;
      sum += value;
      squares += value * value;
    }
  }
  return std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)));
}

// 95 % bootstrap interval; the variants are what is drawn.
std::pair<double, double> deviation_interval(const std::vector<std::vector<double>>& images,
                                             std::uint64_t seed) {
  constexpr int samples = 400;
  Random random(seed, 9);
  std::vector<double> values;
  std::vector<std::size_t> chosen(images.size());
  for (int sample = 0; sample < samples; ++sample) {
    for (std::size_t& one : chosen) one = random.index(images.size());
    values.push_back(deviation(images, chosen));
  }
  return {quantile(values, 0.025), quantile(values, 0.975)};
}

void report(Reproduction& result, std::uint64_t seed, const std::string& id,
            const std::string& what, const Errors& errors, std::optional<Target> target,
            std::optional<double> published, std::optional<Target> sigma_target = std::nullopt,
            std::optional<double> published_sigma = std::nullopt) {
  const auto pair = [](std::optional<double> value) {
    return value ? std::optional(std::pair(*value, *value)) : std::nullopt;
  };
  std::vector<std::size_t> all(errors.images_cm.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  add_row(result, "y03." + id + ".error", what + ": mean error of the position",
          mean_figure(errors.mean_cm, seed), "cm", target, pair(published))
      .over = "mean of " + std::to_string(errors.mean_cm.size()) + " variants";
  add_row(result, "y03." + id + ".sigma", what + ": standard deviation of the error, all images",
          Figure(deviation(errors.images_cm, all), deviation_interval(errors.images_cm, seed)),
          "cm", sigma_target, pair(published_sigma));
  std::size_t images = 0;
  for (const auto& one : errors.images_cm) images += one.size();
  add_rate(result, "y03." + id + ".missed", what + ": images without an answer", errors.missed,
           images);
}

// What each variant gives to the rows.
struct Variant {
  DriveErrors fit, contours;
  DriveErrors changed, changed_plain, changed_contours;
  DriveErrors sparse, wrong_scale;
  std::vector<DriveErrors> by_spacing, by_offset, by_margin;
  GoalRun goal;
};

// Median over the lines of a drive, each from where odometry puts it.
template <typename Fit>
double time_of_fit_ms(const LineDrive& drive, const Fit& fit) {
  std::vector<double> times_ms;
  constexpr int rounds = 3;
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 1; i < drive.lines.size(); ++i) {
      const auto begin = std::chrono::steady_clock::now();
      const auto fix = fit(drive.lines[i], drive.truth[i - 1] * drive.steps[i]);
      const std::chrono::duration<double, std::milli> taken =
          std::chrono::steady_clock::now() - begin;
      if (fix) times_ms.push_back(taken.count());
    }
  }
  return times_ms.empty() ? 0.0 : median(times_ms);
}

Variant examine(const LabRoute& lab, bool sweeps) {
  Variant variant;
  const RouteLines lines(lab.route);
  const RouteContours contours(lab.route);
  variant.fit = drive_by_fit(lines, lab.across);
  variant.contours = drive_by_contours(contours, lab.across);
  variant.changed = drive_by_fit(lines, lab.across_changed);
  variant.changed_plain =
      drive_by_fit(RouteLines(lab.route, {.robust = false}), lab.across_changed);
  variant.changed_contours = drive_by_contours(contours, lab.across_changed);
  variant.sparse = drive_by_fit(RouteLines(thinned(lab.route, 5)), lab.across);
  variant.wrong_scale = drive_by_fit(RouteLines(scaled(lab.route, 1.01)), lab.across);
  variant.goal = run_to_goals(lab, lines, lab.seed * 31 + 5);
  if (!sweeps) return variant;
  for (const std::size_t every : thinnings) {
    variant.by_spacing.push_back(drive_by_fit(RouteLines(thinned(lab.route, every)), lab.across));
  }
  for (const LineDrive& drive : lab.beside) {
    variant.by_offset.push_back(drive_by_fit(lines, drive));
  }
  for (const double margin_m : margins_m) {
    variant.by_margin.push_back(
        drive_by_contours(RouteContours(lab.route, {.margin_m = margin_m}), lab.across));
  }
  return variant;
}

// Curve of mean errors with intervals.
viewer::Series error_series(const std::string& label, const std::vector<double>& x,
                            const std::vector<std::vector<double>>& means_cm, std::uint64_t seed) {
  viewer::Series series{.label = label};
  for (std::size_t i = 0; i < x.size(); ++i) {
    add_point(series, x[i], mean_figure(means_cm[i], seed));
  }
  return series;
}

}  // namespace

void reproduce_lab_drives(const RouteReproductionOptions& options, Executor& executor,
                          const ReproductionProgress& progress, Reproduction& result) {
  Errors fit, contours, changed, changed_plain, changed_contours, sparse, wrong_scale;
  std::vector<Errors> spacing(thinnings.size());
  std::vector<Errors> offset(lateral_offsets_m.size());
  std::vector<Errors> margin(margins_m.size());
  std::vector<double> goal_cm;
  std::vector<double> fit_ms;
  std::vector<double> contours_ms;
  std::vector<double> changed_percent;
  std::size_t arrived = 0;
  // A few variants at a time: each renders on all threads, then all are examined side by side.
  constexpr int batch = 4;
  for (int begin = 0; begin < options.scenes; begin += batch) {
    const int end = std::min(begin + batch, options.scenes);
    std::vector<LabRoute> labs;
    for (int i = begin; i < end; ++i) {
      if (progress) {
        progress("lab", static_cast<double>(i) / static_cast<double>(options.scenes));
      }
      labs.push_back(record_lab_route(options.seed + static_cast<std::uint64_t>(i),
                                      i < options.swept ? lateral_offsets_m : std::vector<double>{},
                                      executor));
    }
    auto variants = simulation::make_each(executor, labs.size(), [&](std::size_t i) {
      return examine(labs[i], begin + static_cast<int>(i) < options.swept);
    });
    for (std::size_t i = 0; i < labs.size(); ++i) {
      const Variant& variant = variants[i];
      fit.add(variant.fit);
      contours.add(variant.contours);
      changed.add(variant.changed);
      changed_plain.add(variant.changed_plain);
      changed_contours.add(variant.changed_contours);
      sparse.add(variant.sparse);
      wrong_scale.add(variant.wrong_scale);
      for (std::size_t k = 0; k < variant.by_spacing.size(); ++k)
        spacing[k].add(variant.by_spacing[k]);
      for (std::size_t k = 0; k < variant.by_offset.size(); ++k)
        offset[k].add(variant.by_offset[k]);
      for (std::size_t k = 0; k < variant.by_margin.size(); ++k)
        margin[k].add(variant.by_margin[k]);
      goal_cm.push_back(100.0 * variant.goal.error_m);
      arrived += variant.goal.arrived ? 1 : 0;
      changed_percent.push_back(100.0 * labs[i].changed_share);
      // One after the other: nothing else works meanwhile.
      const RouteLines lines(labs[i].route);
      fit_ms.push_back(time_of_fit_ms(labs[i].across,
                                      [&](const std::vector<float>& line, const Pose2& predicted) {
                                        return lines.fit(line, predicted);
                                      }));
      const RouteContours dual(labs[i].route);
      contours_ms.push_back(time_of_fit_ms(
          labs[i].across, [&](const std::vector<float>& line, const Pose2& predicted) {
            return dual.fit(line, predicted);
          }));
      if (begin > 0 || i > 0) continue;
      draw_route_panorama(labs[i], options.out, result);
      draw_virtual_view(labs[i], labs[i].beside[shown_offset], options.out, result);
      draw_drives(labs[i],
                  {variant.fit, variant.contours, variant.changed, variant.changed_contours},
                  options.out, result);
      draw_goal_run(labs[i], variant.goal, options.out, result);
    }
  }
  const std::uint64_t seed = options.seed;
  const std::string drive = "5 m route, a line every 2 cm, driven at 30 degrees to it";
  report(result, seed, "straight.fit", drive + ", direct fit", fit, at_most(0.5), 1.98,
         at_most(0.3), 1.0);
  add_row(result, "y03.straight.fit.heading", drive + ", direct fit: mean error of the heading",
          mean_figure(fit.heading_deg, seed), "deg", at_most(0.1));
  report(result, seed, "straight.contours", drive + ", dual contours as published", contours,
         std::nullopt, 1.98, std::nullopt, 1.0);
  add_mean(result, "y03.changed.share", "directions that show something else after things moved",
           "%", changed_percent);
  const std::string moved = "the same with things moved, a tenth of what is seen";
  report(result, seed, "changed.fit", moved + ", direct fit with masking", changed, at_most(0.8),
         3.46, std::nullopt, 0.56);
  const auto report_named = [&](const std::string& id, const std::string& scene,
                                const Errors& errors) {
    std::size_t images = 0;
    for (const auto& one : errors.images_cm) images += one.size();
    add_rate(result, "y03.changed.named." + id,
             "images in which something is named as changed, " + scene, errors.changed, images);
  };
  report_named("before", "scene as memorised", fit);
  report_named("after", "things moved; the first four of a drive cannot be", changed);
  report(result, seed, "changed.plain", moved + ", direct fit without masking", changed_plain,
         std::nullopt, 3.46, std::nullopt, 0.56);
  report(result, seed, "changed.contours", moved + ", dual contours as published", changed_contours,
         std::nullopt, 3.46, std::nullopt, 0.56);
  report(result, seed, "sparse.fit", "the same with a line every 10 cm, direct fit", sparse,
         at_most(0.8), std::nullopt);
  report(result, seed, "scale.fit", "recorded with 1 % error of the odometry's scale, direct fit",
         wrong_scale, at_most(3.0), std::nullopt);
  add_median(result, "y03.goal.error",
             "closed loop (100, 0) to (200, -50) to (300, 0) cm: error at the goal", "cm", goal_cm,
             at_most(2.0), std::pair(4.0, 4.0));
  add_rate(result, "y03.goal.arrived", "closed loop: the robot says that it arrived", arrived,
           goal_cm.size());
  add_median(result, "y03.time", "from horizon scanline to pose, one core, direct fit", "ms",
             fit_ms, at_most(0.5), std::pair(200.0, 200.0));
  add_median(result, "y03.time.contours", "from horizon scanline to pose, one core, dual contours",
             "ms", contours_ms, std::nullopt, std::pair(200.0, 200.0));

  const auto means = [](const std::vector<Errors>& errors) {
    std::vector<std::vector<double>> values;
    for (const Errors& one : errors) values.push_back(one.mean_cm);
    return values;
  };
  std::vector<double> spacings_cm;
  for (const std::size_t every : thinnings) {
    spacings_cm.push_back(100.0 * lab_spacing_m * static_cast<double>(every));
  }
  std::vector<double> offsets_cm;
  for (const double off : lateral_offsets_m) offsets_cm.push_back(100.0 * off);
  std::vector<double> margins_cm;
  for (const double off : margins_m) margins_cm.push_back(100.0 * off);
  const auto draw = [&](const std::string& file, const std::string& title,
                        const std::string& x_label, const std::vector<double>& x,
                        const std::vector<Errors>& errors, const std::string& label,
                        const std::string& caption) {
    viewer::LinePlot plot{.title = title, .x_label = x_label, .y_label = "mean error [cm]"};
    plot.series.push_back(error_series(label, x, means(errors), seed));
    add_plot(result, options.out, file, caption, plot);
    for (std::size_t i = 0; i < x.size(); ++i) {
      add_row(result,
              "y03.sweep." + file.substr(0, file.find('.')) + "." +
                  std::to_string(std::lround(x[i])) + "cm",
              title + ": " + std::to_string(std::lround(x[i])) + " cm", mean(errors[i].mean_cm),
              "cm");
    }
  };
  draw("spacing.svg", "Way between the lines, direct fit", "way between lines [cm]", spacings_cm,
       spacing, "direct fit", "Error against the way between memorised lines.");
  draw("offset.svg", "Distance from the path, direct fit", "distance from the path [cm]",
       offsets_cm, offset, "direct fit", "Error of drives parallel to the path.");
  draw("margin.svg", "Margin of the contours", "margin on either side [cm]", margins_cm, margin,
       "dual contours",
       "Error of the published contours against the margin from which they start.");
}

}  // namespace panonav::lab
