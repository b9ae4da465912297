// [Y03] section 5: drives across a straight path, and parameter sweeps.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/rows.hpp"
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
// Index of the drive at a lateral offset for which a view is synthesised.
constexpr std::size_t synthesised_offset_index = 3;
const std::vector<double> margins_m{0.04, 0.08, 0.14, 0.24, 0.34};

// An error above this puts the prediction near the margin from which contours start (14 cm).
constexpr double lost_cm = 10.0;

// Errors of one localisation method over all variants.
struct MethodErrors {
  std::vector<double> mean_cm;                 // per variant
  std::vector<std::vector<double>> images_cm;  // per variant and image
  std::vector<double> heading_deg;             // mean per variant
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

  [[nodiscard]] std::size_t images() const {
    std::size_t count = 0;
    for (const auto& one : images_cm) count += one.size();
    return count;
  }
  /// Counts the variants with an error above `limit_cm` in at least one image.
  [[nodiscard]] std::size_t count_variants_above(double limit_cm) const {
    return count_where(images_cm, [&](const std::vector<double>& images) {
      return std::ranges::any_of(images, [&](double error) { return error > limit_cm; });
    });
  }
};

// Returns the standard deviation over all images of the variants with the indices `chosen`.
double image_deviation(const std::vector<std::vector<double>>& images,
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

// Returns the 95 % bootstrap interval of this deviation, resampling variants.
std::pair<double, double> deviation_interval(const std::vector<std::vector<double>>& images,
                                             std::uint64_t seed) {
  constexpr int samples = 400;
  Random random(seed, 9);
  std::vector<double> values;
  std::vector<std::size_t> chosen(images.size());
  for (int sample = 0; sample < samples; ++sample) {
    for (std::size_t& one : chosen) one = random.index(images.size());
    values.push_back(image_deviation(images, chosen));
  }
  return {quantile(values, 0.025), quantile(values, 0.975)};
}

// Results of one variant: localised drives by the ids of their rows, and sweeps.
struct VariantResults {
  std::map<std::string, DriveErrors> drives;
  std::map<std::string, std::vector<DriveErrors>> sweeps;
  GoalRun goal;
};

// Returns the median time of localising one line of a drive, in ms; each starts from the pose
// predicted by odometry.
template <typename Fit>
double measure_fit_ms(const LineDrive& drive, const Fit& fit) {
  std::vector<double> times_ms;
  constexpr int rounds = 3;
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 1; i < drive.lines.size(); ++i) {
      const auto begin = std::chrono::steady_clock::now();
      const auto fix = fit(drive.lines[i], drive.truth[i - 1] * drive.steps[i]);
      const std::chrono::duration<double, std::milli> duration =
          std::chrono::steady_clock::now() - begin;
      if (fix) times_ms.push_back(duration.count());
    }
  }
  return times_ms.empty() ? 0.0 : median(times_ms);
}

VariantResults localise_drives(const LabRoute& lab, bool sweeps) {
  VariantResults variant;
  const RouteLines lines(lab.route);
  const RouteContours contours(lab.route);
  variant.drives = {
      {"straight.fit", follow_by_fit(lines, lab.across)},
      {"straight.contours", follow_by_contours(contours, lab.across)},
      {"changed.fit", follow_by_fit(lines, lab.across_changed)},
      {"changed.plain",
       follow_by_fit(RouteLines(lab.route, {.robust = false}), lab.across_changed)},
      {"changed.contours", follow_by_contours(contours, lab.across_changed)},
      {"sparse.fit", follow_by_fit(RouteLines(thin_route(lab.route, 5)), lab.across)},
      {"scale.fit", follow_by_fit(RouteLines(scale_route(lab.route, 1.01)), lab.across)}};
  variant.goal = run_to_goals(lab, lines, lab.seed * 31 + 5);
  if (!sweeps) return variant;
  for (const std::size_t every : thinnings) {
    variant.sweeps["spacing"].push_back(
        follow_by_fit(RouteLines(thin_route(lab.route, every)), lab.across));
  }
  for (const LineDrive& drive : lab.lateral_drives) {
    variant.sweeps["offset"].push_back(follow_by_fit(lines, drive));
  }
  for (const double margin_m : margins_m) {
    variant.sweeps["margin"].push_back(
        follow_by_contours(RouteContours(lab.route, margin_m), lab.across));
  }
  return variant;
}

// Collects and reports the results of all variants.
class LabResults {
 public:
  LabResults(const ReproductionOptions& options, Reproduction& result)
      : options_(options), result_(result) {}

  void add(const LabRoute& lab, const VariantResults& variant) {
    for (const auto& [id, drive] : variant.drives) errors_[id].add(drive);
    for (const auto& [id, drives] : variant.sweeps) {
      sweeps_[id].resize(drives.size());
      for (std::size_t k = 0; k < drives.size(); ++k) sweeps_[id][k].add(drives[k]);
    }
    goal_cm_.push_back(100.0 * variant.goal.error_m);
    arrived_ += variant.goal.arrived ? 1 : 0;
    changed_percent_.push_back(100.0 * lab.changed_fraction);
    const auto time_ms = [&](const auto& route) {
      return measure_fit_ms(lab.across,
                            [&](const std::vector<float>& line, const Pose2& predicted) {
                              return route.fit(line, predicted);
                            });
    };
    fit_ms_.push_back(time_ms(RouteLines(lab.route)));
    contours_ms_.push_back(time_ms(RouteContours(lab.route)));
  }

  void report() const {
    const std::string drive = "5 m route, a line every 2 cm, driven at 30 degrees to it";
    const std::string moved = "the same with things moved, a tenth of what is seen";
    report_method("straight.fit", drive + ", direct fit", at_most(0.5), published_straight_,
                  at_most(0.3));
    add_row(result_, "y03.straight.fit.heading", drive + ", direct fit: mean error of the heading",
            mean_figure(errors_.at("straight.fit").heading_deg, options_.seed), "deg",
            at_most(0.1));
    report_method("straight.contours", drive + ", dual contours as published", std::nullopt,
                  published_straight_);
    add_mean(result_, "y03.changed.share", "directions that show something else after things moved",
             "%", changed_percent_);
    report_method("changed.fit", moved + ", direct fit with masking", at_most(0.8),
                  published_moved_);
    report_changed_images("before", "scene as memorised", errors_.at("straight.fit"));
    report_changed_images("after", "things moved; the first four of a drive cannot be",
                          errors_.at("changed.fit"));
    report_method("changed.plain", moved + ", direct fit without masking", std::nullopt,
                  published_moved_);
    report_method("changed.contours", moved + ", dual contours as published", std::nullopt,
                  published_moved_);
    report_method("sparse.fit", "the same with a line every 10 cm, direct fit", at_most(0.8));
    report_method("scale.fit", "recorded with 1 % error of the odometry's scale, direct fit",
                  at_most(3.0));
    add_median(result_, "y03.goal.error",
               "closed loop (100, 0) to (200, -50) to (300, 0) cm: error at the goal", "cm",
               goal_cm_, at_most(2.0), std::pair(4.0, 4.0));
    add_rate(result_, "y03.goal.arrived", "closed loop: the robot reports its arrival", arrived_,
             goal_cm_.size());
    add_median(result_, "y03.time", "from horizon scanline to pose, one core, direct fit", "ms",
               fit_ms_, at_most(0.5), std::pair(200.0, 200.0));
    add_median(result_, "y03.time.contours",
               "from horizon scanline to pose, one core, dual contours", "ms", contours_ms_,
               std::nullopt, std::pair(200.0, 200.0));
  }

  void draw_sweeps() const {
    std::vector<double> spacings_m;
    for (const std::size_t every : thinnings) {
      spacings_m.push_back(lab_spacing_m * static_cast<double>(every));
    }
    draw_sweep("spacing", spacings_m, "Way between the lines, direct fit", "way between lines [cm]",
               "direct fit", "Error against the distance between memorised lines.");
    draw_sweep("offset", lateral_offsets_m, "Distance from the path, direct fit",
               "distance from the path [cm]", "direct fit",
               "Error of drives parallel to the path.");
    draw_sweep("margin", margins_m, "Margin of the contours", "margin on either side [cm]",
               "dual contours",
               "Error of the published contours against the margin from which they start.");
  }

 private:
  // Published mean and standard deviation of the error, in cm.
  using Published = std::pair<double, double>;
  static constexpr Published published_straight_{1.98, 1.0};
  static constexpr Published published_moved_{3.46, 0.56};

  void report_method(const std::string& id, const std::string& what, std::optional<Target> target,
                     std::optional<Published> published = std::nullopt,
                     std::optional<Target> sigma_target = std::nullopt) const {
    const MethodErrors& errors = errors_.at(id);
    const auto range = [&](double Published::*value) {
      return published ? std::optional(std::pair((*published).*value, (*published).*value))
                       : std::nullopt;
    };
    std::vector<std::size_t> all(errors.images_cm.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    add_row(result_, "y03." + id + ".error", what + ": mean error of the position",
            mean_figure(errors.mean_cm, options_.seed), "cm", target, range(&Published::first))
        .over = "mean of " + std::to_string(errors.mean_cm.size()) + " variants";
    add_row(result_, "y03." + id + ".sigma", what + ": standard deviation of the error, all images",
            Figure(image_deviation(errors.images_cm, all),
                   deviation_interval(errors.images_cm, options_.seed)),
            "cm", sigma_target, range(&Published::second));
    add_rate(result_, "y03." + id + ".missed", what + ": images without an answer", errors.missed,
             errors.images());
    add_rate(result_, "y03." + id + ".lost",
             what + ": drives with an error above 10 cm in at least one image",
             errors.count_variants_above(lost_cm), errors.images_cm.size());
  }

  void report_changed_images(const std::string& id, const std::string& scene,
                             const MethodErrors& errors) const {
    add_rate(result_, "y03.changed.named." + id,
             "images in which something is named as changed, " + scene, errors.changed,
             errors.images());
  }

  void draw_sweep(const std::string& id, const std::vector<double>& x_m, const std::string& title,
                  const std::string& x_label, const std::string& label,
                  const std::string& caption) const {
    const std::vector<MethodErrors>& errors = sweeps_.at(id);
    viewer::Series series{.label = label};
    for (std::size_t i = 0; i < x_m.size(); ++i) {
      add_point(series, 100.0 * x_m[i], mean_figure(errors[i].mean_cm, options_.seed));
    }
    add_plot(
        result_, id + ".svg", caption,
        viewer::LinePlot{
            .title = title, .x_label = x_label, .y_label = "mean error [cm]", .series = {series}});
    for (std::size_t i = 0; i < x_m.size(); ++i) {
      const std::string x_cm = std::to_string(std::lround(100.0 * x_m[i]));
      add_row(result_, "y03.sweep." + id + "." + x_cm + "cm", title + ": " + x_cm + " cm",
              mean(errors[i].mean_cm), "cm");
    }
  }

  const ReproductionOptions& options_;
  Reproduction& result_;
  std::map<std::string, MethodErrors> errors_;
  std::map<std::string, std::vector<MethodErrors>> sweeps_;
  std::vector<double> goal_cm_;
  std::vector<double> fit_ms_;
  std::vector<double> contours_ms_;
  std::vector<double> changed_percent_;
  std::size_t arrived_ = 0;
};

}  // namespace

void RouteExperiments::reproduce_lab_drives() const {
  LabResults results(options, result);
  // Process a few variants at a time: all threads render each variant, then variants are evaluated
  // in parallel.
  constexpr int batch = 4;
  for (int begin = 0; begin < options.scenes; begin += batch) {
    std::vector<LabRoute> labs;
    for (int i = begin; i < std::min(begin + batch, options.scenes); ++i) {
      labs.push_back(record_lab_route(options.seed + static_cast<std::uint64_t>(i),
                                      i < options.swept ? lateral_offsets_m : std::vector<double>{},
                                      executor));
    }
    const auto variants = simulation::make_each(executor, labs.size(), [&](std::size_t i) {
      return localise_drives(labs[i], begin + static_cast<int>(i) < options.swept);
    });
    // Add results sequentially, because `add` measures run times.
    for (std::size_t i = 0; i < labs.size(); ++i) results.add(labs[i], variants[i]);
    if (begin > 0) continue;
    const auto& drives = variants[0].drives;
    draw_route_panorama(labs[0], result);
    draw_virtual_view(labs[0], labs[0].lateral_drives[synthesised_offset_index], result);
    draw_drives(labs[0],
                {drives.at("straight.fit"), drives.at("straight.contours"),
                 drives.at("changed.fit"), drives.at("changed.contours")},
                result);
    draw_goal_run(labs[0], variants[0].goal, result);
  }
  results.report();
  results.draw_sweeps();
}

}  // namespace panonav::lab
