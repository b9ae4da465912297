#include "reports/track_report.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "cli/session.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav_viewer/plot.hpp"
#include "reports/report_page.hpp"
#include "reports/track_pictures.hpp"

namespace panonav::command {

namespace {

viewer::LinePlot draw_errors(const std::vector<TrackedImage>& images, double spacing_m,
                             const std::string& unit) {
  viewer::Series localised{.label = "error, localised", .style = viewer::SeriesStyle::points};
  viewer::Series ambiguous{.label = "error, ambiguous", .style = viewer::SeriesStyle::points};
  viewer::Series spread{.label = "spread of particles", .style = viewer::SeriesStyle::lines};
  viewer::Series lost{.label = "lost: no estimate", .style = viewer::SeriesStyle::points};
  viewer::Series spacing{.label = "spacing of views", .style = viewer::SeriesStyle::lines};
  for (std::size_t i = 0; i < images.size(); ++i) {
    const TrackedImage& image = images[i];
    const auto x = static_cast<double>(i + 1);
    spread.add(x, image.estimate.spread_m);
    if (image.estimate.state == LocalisationState::lost) {
      lost.add(x, image.estimate.spread_m);
    } else if (const auto error = position_error_m(image)) {
      viewer::Series& series = is_position_known(image) ? localised : ambiguous;
      series.add(x, *error);
    }
  }
  spacing.x = {1.0, static_cast<double>(images.size())};
  spacing.y = {spacing_m, spacing_m};
  return viewer::LinePlot{.title = "Errors and uncertainty",
                          .x_label = "image",
                          .y_label = unit == "m" ? "metres" : unit,
                          .series = {localised, ambiguous, spread, lost, spacing},
                          .log_y = true};
}

viewer::LinePlot draw_particles(const std::vector<TrackedImage>& images) {
  viewer::Series all{.label = "particles", .style = viewer::SeriesStyle::lines};
  viewer::Series injected{.label = "new, at random positions",
                          .style = viewer::SeriesStyle::points};
  viewer::Series effective{.label = "effective number, by their weights",
                           .style = viewer::SeriesStyle::lines};
  for (std::size_t i = 0; i < images.size(); ++i) {
    const MonteCarloEstimate& estimate = images[i].estimate;
    const auto add = [&](viewer::Series& series, double value) {
      series.add(static_cast<double>(i + 1), value);
    };
    add(all, estimate.particles);
    add(effective, estimate.effective_particles);
    if (estimate.injected > 0) add(injected, estimate.injected);
  }
  return viewer::LinePlot{.title = "Particles",
                          .x_label = "image",
                          .y_label = "number",
                          .series = {all, injected, effective},
                          .log_y = true};
}

std::string explain_state(LocalisationState state) {
  switch (state) {
    case LocalisationState::localised:
      return "localised: position and heading known";
    case LocalisationState::position_known:
      return "position known, heading not";
    case LocalisationState::ambiguous:
      return "ambiguous: several places or a large area possible";
    case LocalisationState::lost:
      return "lost: no place of the memory fits";
  }
  return {};
}

/// Returns a table row for each run of consecutive images with the same state.
std::vector<std::vector<std::string>> make_stretch_rows(const std::vector<TrackedImage>& images) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t begin = 0; begin < images.size();) {
    const auto state = images[begin].estimate.state;
    std::size_t end = begin;
    std::vector<double> errors;
    for (; end < images.size() && images[end].estimate.state == state; ++end) {
      if (const auto error = position_error_m(images[end])) errors.push_back(*error);
    }
    const std::string from = std::to_string(begin + 1);
    rows.push_back(
        {end == begin + 1 ? from : from + " to " + std::to_string(end), explain_state(state),
         errors.empty() ? "" : format_fixed(median(errors), 3) + " m",
         errors.empty() ? "" : format_fixed(*std::ranges::max_element(errors), 3) + " m"});
    begin = end;
  }
  return rows;
}

std::string format_share(std::size_t count, std::size_t total) {
  return format_fixed(100.0 * static_cast<double>(count) / static_cast<double>(total), 0) + " %";
}

std::string format_length(double length_m) {
  return length_m < 1.0 ? format_fixed(100.0 * length_m, 1) + " cm"
                        : format_fixed(length_m, 1) + " m";
}

std::vector<std::pair<std::string, std::string>> main_figures(const TrackSummary& summary,
                                                              std::size_t total) {
  std::vector<std::pair<std::string, std::string>> figures{
      {format_share(summary.localised, total), "of the images localised"},
      {summary.first_localised ? "image " + std::to_string(*summary.first_localised) : "never",
       summary.first_localised ? "was the first at which the robot was localised" : "localised"}};
  if (summary.position_known > 0) {
    figures.emplace_back(format_share(summary.position_known, total),
                         "of the images with a known position, but no heading");
  }
  if (!summary.errors_m.empty()) {
    figures.emplace_back(format_length(median(summary.errors_m)), "median error while localised");
    figures.emplace_back(format_length(quantile(summary.errors_m, 0.95)),
                         "limit for 95 % of these errors");
  }
  if (!summary.heading_errors_rad.empty()) {
    figures.emplace_back(format_fixed(degrees(median(summary.heading_errors_rad)), 1) + " degrees",
                         "median error of the heading");
  }
  return figures;
}

}  // namespace

std::size_t count_shown_particles(std::size_t images) {
  constexpr std::size_t max_particles = 300;
  constexpr std::size_t min_particles = 30;
  constexpr std::size_t max_particles_per_page = 300000;
  return std::clamp(max_particles_per_page / std::max<std::size_t>(1, images), min_particles,
                    max_particles);
}

void write_track_report(const std::filesystem::path& folder, const Tracker& tracker,
                        const std::vector<TrackedImage>& images, const TrackSummary& summary,
                        const viewer::RunPage& replay_page) {
  const VisualMemory& memory = tracker.memory();
  const double spacing_m = tracker.localiser().model().spacing_m;
  const bool is_metric = tracker.length_unit() == LengthUnit::metres;
  const bool truth_known =
      std::ranges::any_of(images, [](const auto& image) { return image.truth.has_value(); });
  viewer::ReportPage page(
      "Tracked run",
      "A robot took " + format_count(images.size(), "image") +
          " while it moved. After each one, panonav computed where the robot was, from a memory "
          "of " +
          format_count(memory.size(), "view") + " and from " +
          (tracker.visual_odometry() == nullptr ? "its odometry, which has errors"
                                                : "the motion between its images") +
          ". Particles are positions at which the robot may be: they are far apart while its "
          "position is unknown, and close together when it is known.");
  page.add_figures(main_figures(summary, images.size()));
  page.begin_section("The run, image by image");
  page.add_text(
      "Each small dot is a particle: a possible position of the robot. Grey dots are the stored "
      "views; the median distance of a view to the nearest other one is " +
      (is_metric ? format_fixed(100.0 * spacing_m, 0) + " cm"
                 : format_fixed(spacing_m, 1) + " view steps") +
      ". The large dot is the estimate: the mean of the group of particles with the "
      "highest probability. There is no large dot while the robot is lost." +
      std::string(truth_known ? " The ring is the true position." : ""));
  page.add_run(replay_page);
  page.begin_section("The whole run");
  viewer::MapPlot whole_run = draw_track(memory, images, {});
  whole_run.unit = to_string(tracker.length_unit());
  page.add_plots(
      {{std::move(whole_run),
        truth_known ? "True and estimated path. Crosses: true positions while the robot was lost"
                    : "The estimated path, with gaps where the robot was not localised"},
       {draw_errors(images, spacing_m, to_string(tracker.length_unit())),
        truth_known ? "Error of each estimate, and distance of the particles from their mean, on a "
                      "logarithmic scale"
                    : "Distance of the particles from their mean, on a logarithmic scale"}});
  page.begin_section("What was known about the position");
  page.add_table({"images", "the robot was", "median error", "largest error"},
                 make_stretch_rows(images));
  page.begin_section("Particles");
  page.add_text(
      "The tracker uses more particles while many positions are possible, and fewer when the "
      "particles are close together. It also adds new particles at random positions, so that it "
      "finds a robot that was carried to another place.");
  page.add_plots(
      {{draw_particles(images), "Number of particles after each image, on a logarithmic scale"}});
  page.write(folder, "index.html", "panonav track");
}

}  // namespace panonav::command
