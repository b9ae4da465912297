// The two sets of [F11]: a loop of equally spaced views, and views captured by threshold.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "lab/f11/experiments.hpp"
#include "lab/rows.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/positions.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

constexpr double first_spacing_m = 0.1;
// Pictures between which the second set captures by threshold, and the threshold: about 9 cm of way
// in rooms of this size, so that 150 views cover about a round.
constexpr double second_spacing_m = 0.025;
constexpr double capture_difference = 0.015;
// Pictures for each view of the first set from which the second one captures.
constexpr std::size_t second_pictures = 3;
constexpr std::array<int, 7> k1_values{2, 4, 8, 16, 26, 40, 64};
constexpr std::array<int, 6> k2_values{4, 8, 14, 20, 40, 64};
constexpr int max_components = 64;
constexpr int default_components = 15;
constexpr std::array<int, 5> other_components{6, 10, 20, 32, 64};

/// Figure 6: mu of the published rule for each k1 and k2.
using Grid = std::map<std::pair<int, int>, std::vector<double>>;

// Distances depend on k1 alone and turns on k2 alone, so each is read once.
void add_published(const simulation::MappingRecording& recording, Grid& grid) {
  const std::size_t steps = recording.views.size() - 1;
  std::map<int, std::vector<double>> lengths;
  std::map<int, std::vector<double>> turns;
  for (std::size_t i = 0; i < steps; ++i) {
    const FourierSignature& before = recording.views[i];
    const FourierSignature& after = recording.views[i + 1];
    for (const int k1 : k1_values) lengths[k1].push_back(dissimilarity_l2(after, before, k1));
    for (const int k2 : k2_values) {
      const auto reading = compass(after, before, {.components = k2});
      turns[k2].push_back(reading ? reading->heading_rad : 0.0);
    }
  }
  const std::vector<Point2> truth = positions_of(recording.truth);
  for (const int k1 : k1_values) {
    for (const int k2 : k2_values) {
      Pose2 pose;
      std::vector<Point2> estimate{pose.position()};
      for (std::size_t i = 0; i < steps; ++i) {
        const double length = lengths[k1][i];
        const double turn = turns[k2][i];
        pose = pose * Pose2{length * std::cos(0.5 * turn), length * std::sin(0.5 * turn), turn};
        estimate.push_back(pose.position());
      }
      grid[{k1, k2}].push_back(simulation::shape_error(estimate, truth));
    }
  }
}

std::pair<std::pair<int, int>, double> best_of(const Grid& grid) {
  std::pair<std::pair<int, int>, double> best{{0, 0}, 2.0};
  for (const auto& [key, values] : grid) {
    const double middle = median(values);
    if (middle < best.second) best = {key, middle};
  }
  return best;
}

void plot_grid(const Grid& grid, const std::string& title, const std::filesystem::path& path) {
  viewer::LinePlot plot{.title = title,
                        .x_label = "components for the distance, k1",
                        .y_label = "shape difference",
                        .series = {},
                        .log_x = true};
  for (const int k2 : k2_values) {
    viewer::Series series{.label = "k2 = " + std::to_string(k2), .x = {}, .y = {}};
    for (const int k1 : k1_values) {
      series.add(k1, median(grid.at({k1, k2})));
    }
    plot.series.push_back(std::move(series));
  }
  viewer::write_plot(path, plot);
}

viewer::MapPlot plot_of(const std::string& title, const simulation::PlaceRecording& place,
                        const simulation::MappingRecording& recording,
                        const simulation::MappedRecording& open,
                        const simulation::MappedRecording& closed) {
  viewer::MapPlot plot{.title = title, .layers = viewer::scene_layers(place.scene)};
  std::vector<Point2> wheels;
  for (const std::size_t i : open.number) wheels.push_back(recording.wheels[i].position());
  plot.layers.push_back(
      {.label = "ground truth", .colour = viewer::PlotColour::black, .lines = {open.truth}});
  plot.layers.push_back({.label = "wheels",
                         .colour = viewer::PlotColour::vermilion,
                         .lines = {simulation::laid_over(wheels, open.truth)}});
  plot.layers.push_back({.label = "visual odometry",
                         .colour = viewer::PlotColour::blue,
                         .lines = {simulation::laid_over(open.estimate, open.truth)}});
  plot.layers.push_back({.label = "loops closed",
                         .colour = viewer::PlotColour::green,
                         .lines = {simulation::laid_over(closed.estimate, closed.truth)}});
  return plot;
}

double wheel_shape_error(const simulation::MappingRecording& recording,
                         const simulation::MappedRecording& mapped) {
  std::vector<Point2> wheels;
  for (const std::size_t i : mapped.number) wheels.push_back(recording.wheels[i].position());
  return simulation::shape_error(wheels, mapped.truth);
}

/// The same recording mapped in three ways.
struct SetErrors {
  std::vector<double> open, closed, closed_with_wheels, wheels, ground_open, ground;
  std::size_t right = 0;
  std::size_t wrong = 0;
  std::size_t missing = 0;  // recordings without any closure

  void add(const simulation::MappingRecording& recording,
           const simulation::MappedRecording& without, const simulation::MappedRecording& with,
           const simulation::MappedRecording& with_wheels) {
    open.push_back(simulation::shape_error(without.estimate, without.truth));
    closed.push_back(simulation::shape_error(with.estimate, with.truth));
    closed_with_wheels.push_back(simulation::shape_error(with_wheels.estimate, with_wheels.truth));
    wheels.push_back(wheel_shape_error(recording, with));
    right += with.right_closures + with_wheels.right_closures;
    wrong += with.wrong_closures + with_wheels.wrong_closures;
    missing += with.right_closures == 0 ? 1 : 0;
  }

  void add_ground(const simulation::MappingRecording& recording, simulation::MappingRunOptions run,
                  double camera_height_m) {
    run.odometry.camera_height_m = camera_height_m;
    const auto closed_map = simulation::map_recording(recording, run);
    run.mapping.close_loops = false;
    const auto open_map = simulation::map_recording(recording, run);
    ground.push_back(simulation::shape_error(closed_map.estimate, closed_map.truth));
    ground_open.push_back(simulation::shape_error(open_map.estimate, open_map.truth));
  }

  void report(const std::string& id, const std::string& what, Reproduction& result) const {
    add_median(result, id + ".ground_open",
               what + ": shape difference without closure, height of the camera known", "",
               ground_open);
    add_median(result, id + ".ground",
               what + ": shape difference with closure, height of the camera known", "", ground);
    add_median(result, id + ".wheels", what + ": shape difference of the wheels alone", "", wheels);
    add_rate(result, id + ".right_closures", what + ": closures between views at most 1 m apart",
             right, std::max<std::size_t>(1, right + wrong));
    add_rate(result, id + ".unclosed", what + ": recordings in which no loop was closed", missing,
             open.size());
  }
};

}  // namespace

void reproduce_first_set(const MappingReproductionOptions& options, Executor& executor,
                         Reproduction& result) {
  SetErrors errors;
  Grid grid;
  std::map<int, std::vector<double>> by_components;
  std::map<int, std::vector<double>> by_spacing;
  std::map<int, std::vector<double>> closed_by_spacing;
  std::vector<double> headings_deg;
  std::vector<double> compass_deg;
  std::vector<viewer::MapPlot> maps;
  for (int s = 0; s < options.scenes; ++s) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(s);
    const simulation::PlaceRecording place = simulation::empty_place(
        simulation::make_scene("loop", {.seed = seed}), seed, options.columns, executor);
    const simulation::MappingRecording recording = simulation::record_for_mapping(
        place, drive(place, {}, first_spacing_m, static_cast<std::size_t>(options.views)),
        max_components + 2, simulation::cheap_wheels(), 1000 * seed, executor);
    const auto open = simulation::map_recording(recording, {.mapping = {.close_loops = false}});
    const auto closed = simulation::map_recording(recording, {});
    errors.add(recording, open, closed, simulation::map_recording(recording, {.wheels = true}));
    errors.add_ground(recording, {}, place.scene.camera_height_m);
    add_published(recording, grid);
    by_components[default_components].push_back(errors.open.back());
    for (const int components : other_components) {
      const auto mapped = simulation::map_recording(
          recording, {.mapping = {.close_loops = false}, .components = components});
      by_components[components].push_back(simulation::shape_error(mapped.estimate, mapped.truth));
    }
    by_spacing[1].push_back(errors.open.back());
    closed_by_spacing[1].push_back(errors.closed.back());
    for (const int every : {2, 3, 5}) {
      const auto thinned = simulation::every_nth(recording, static_cast<std::size_t>(every));
      const auto mapped = simulation::map_recording(thinned, {.mapping = {.close_loops = false}});
      by_spacing[every].push_back(simulation::shape_error(mapped.estimate, mapped.truth));
      const auto looped = simulation::map_recording(thinned, {});
      closed_by_spacing[every].push_back(simulation::shape_error(looped.estimate, looped.truth));
    }
    for (std::size_t i = 0; i + 3 < recording.views.size(); ++i) {
      const auto before = simulation::first_components(recording.views[i], default_components);
      const auto after = simulation::first_components(recording.views[i + 3], default_components);
      const Pose2 motion = inverse(recording.truth[i]) * recording.truth[i + 3];
      const auto step = visual_step(OdometryView(before), OdometryView(after));
      const double found = step ? step->before_from_after.heading_rad : 0.0;
      headings_deg.push_back(degrees(std::abs(angle_difference(found, motion.heading_rad))));
      if (const auto reading = compass(after, before)) {
        compass_deg.push_back(
            degrees(std::abs(angle_difference(reading->heading_rad, motion.heading_rad))));
      }
    }
    if (s < 4) {
      maps.push_back(plot_of("loop " + std::to_string(seed), place, recording, open, closed));
    }
  }
  const std::string what = "loop, " + std::to_string(options.views) + " views 10 cm apart";
  add_median(result, "f11.loop.open", what + ": shape difference without closure", "", errors.open,
             at_most(0.02), std::pair(0.04, 0.04));
  add_median(result, "f11.loop.closed", what + ": shape difference with closure", "", errors.closed,
             at_most(0.006));
  add_median(result, "f11.loop.closed_wheels",
             what + ": shape difference with closure and steps from wheels", "",
             errors.closed_with_wheels, at_most(0.002));
  errors.report("f11.loop", what, result);
  add_median(result, "f11.loop.published",
             what + ": shape difference by the published rule, k1 = 26, k2 = 20", "",
             grid.at({26, 20}), std::nullopt, std::pair(0.04, 0.04));
  const auto best = best_of(grid);
  add_median(result, "f11.loop.published_best",
             what + ": shape difference by the published rule, best of figure 6, k1 = " +
                 std::to_string(best.first.first) + ", k2 = " + std::to_string(best.first.second),
             "", grid.at(best.first));
  for (const auto& [components, values] : by_components) {
    add_median(
        result, "f11.loop.components_" + std::to_string(components),
        what + ": shape difference without closure, " + std::to_string(components) + " components",
        "", values);
  }
  for (const auto& [every, values] : by_spacing) {
    const std::string spacing = std::to_string(10 * every);
    add_median(result, "f11.loop.spacing_" + spacing + "cm",
               "loop, views " + spacing + " cm apart: shape difference without closure", "",
               values);
    add_median(result, "f11.loop.spacing_" + spacing + "cm_closed",
               "loop, views " + spacing + " cm apart: shape difference with closure", "",
               closed_by_spacing[every]);
  }
  add_median(result, "f11.loop.heading_30cm", "loop: heading error between views 30 cm apart",
             "deg", headings_deg, at_most(2.0));
  add_median(result, "f11.loop.compass_30cm",
             "loop: heading error of the compass alone between views 30 cm apart", "deg",
             compass_deg);
  plot_grid(grid, "First set: shape difference by the published rule, median",
            options.out / "f11_figure6a.svg");
  result.pictures.push_back(
      {"f11_figure6a.svg", "Figure 6 (a): shape difference against k1, for several k2"});
  add_plot(result, options.out, "f11_figure4.svg",
           "Figure 4: maps of the loop beside the truth and the wheels, laid over the truth with "
           "one scale",
           maps, 2);
}

void reproduce_second_set(const MappingReproductionOptions& options, Executor& executor,
                          Reproduction& result) {
  SetErrors errors;
  Grid grid;
  const auto views = static_cast<std::size_t>(options.views);
  std::vector<double> nodes;
  std::vector<double> ways_m;
  std::vector<viewer::MapPlot> maps;
  for (int s = 0; s < options.scenes; ++s) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(s);
    const simulation::PlaceRecording place = simulation::empty_place(
        simulation::make_scene("lab", {.seed = seed}), seed, options.columns, executor);
    std::vector<Point2> way = place.scene.tour;
    way.insert(way.end(), place.scene.tour.begin(), place.scene.tour.end());
    const simulation::MappingRecording recording = simulation::record_for_mapping(
        place, drive(place, way, second_spacing_m, second_pictures * views), max_components + 2,
        simulation::cheap_wheels(), 1000 * seed, executor);
    simulation::MappingRunOptions run{.mapping = {.capture_difference = capture_difference},
                                      .max_nodes = views * 3 / 4};
    const auto closed = simulation::map_recording(recording, run);
    run.wheels = true;
    const auto with_wheels = simulation::map_recording(recording, run);
    run.wheels = false;
    run.mapping.close_loops = false;
    const auto open = simulation::map_recording(recording, run);
    errors.add(recording, open, closed, with_wheels);
    run.mapping.close_loops = true;
    errors.add_ground(recording, run, place.scene.camera_height_m);
    nodes.push_back(static_cast<double>(open.number.size()));
    ways_m.push_back(second_spacing_m * static_cast<double>(open.number.back()));
    simulation::MappingRecording captured;
    for (const std::size_t i : open.number) {
      captured.truth.push_back(recording.truth[i]);
      captured.wheels.push_back(recording.wheels[i]);
      captured.views.push_back(recording.views[i]);
    }
    add_published(captured, grid);
    if (s < 4) {
      maps.push_back(plot_of("lab " + std::to_string(seed), place, recording, open, closed));
    }
  }
  const std::string what = "lab, views captured by threshold";
  add_median(result, "f11.lab.views", what + ": views", "views", nodes, std::nullopt,
             std::pair(150.0, 150.0));
  add_median(result, "f11.lab.way", what + ": way", "m", ways_m);
  add_median(result, "f11.lab.open", what + ": shape difference without closure", "", errors.open,
             at_most(0.01), std::pair(0.015, 0.015));
  // Loops that close take errors of length away, as those of heading.
  if (median(errors.closed) <= 0.01) {
    result.rows.back().reason =
        "the unit of length of the views changes beside every piece of furniture; loop closures "
        "correct it";
  }
  add_median(result, "f11.lab.closed", what + ": shape difference with closure", "", errors.closed,
             at_most(0.01));
  add_median(result, "f11.lab.closed_wheels",
             what + ": shape difference with closure and steps from wheels", "",
             errors.closed_with_wheels);
  errors.report("f11.lab", what, result);
  add_median(result, "f11.lab.published",
             what + ": shape difference by the published rule, k1 = 4, k2 = 8", "", grid.at({4, 8}),
             std::nullopt, std::pair(0.015, 0.015));
  const auto best = best_of(grid);
  add_median(result, "f11.lab.published_best",
             what + ": shape difference by the published rule, best of figure 6, k1 = " +
                 std::to_string(best.first.first) + ", k2 = " + std::to_string(best.first.second),
             "", grid.at(best.first));
  plot_grid(grid, "Second set: shape difference by the published rule, median",
            options.out / "f11_figure6b.svg");
  result.pictures.push_back(
      {"f11_figure6b.svg", "Figure 6 (b): shape difference against k1, for several k2"});
  add_plot(result, options.out, "f11_figure5.svg",
           "Figure 5: maps of the second set beside the truth and the wheels, laid over the truth",
           maps, 2);
}

}  // namespace panonav::lab
