// The two view sets of [F11]: equally spaced views of a loop, and views captured by threshold.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/f11/published_rule.hpp"
#include "lab/rows.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

constexpr double loop_spacing_m = 0.1;
constexpr PublishedFigure first_figure{.shape_difference = 0.04, .k1 = 26, .k2 = 20};
constexpr PublishedFigure second_figure{.shape_difference = 0.015, .k1 = 4, .k2 = 8};
// Spacing of the pictures from which the second set captures views, and the image difference that
// captures one: a view about every 9 cm in rooms of this size, so that 150 views cover about one
// round.
constexpr double capture_spacing_m = 0.025;
constexpr double capture_difference = 0.015;
// Number of pictures recorded per view of the second set.
constexpr std::size_t pictures_per_captured_view = 3;
constexpr std::array<int, 7> k1_values{2, 4, 8, 16, 26, 40, 64};
constexpr std::array<int, 6> k2_values{4, 8, 14, 20, 40, 64};
constexpr int max_components = 64;
constexpr int default_components = 15;
constexpr std::array<int, 5> other_components{6, 10, 20, 32, 64};

/// Shape differences (mu, figure 6) of the published rule for each pair (k1, k2), one per
/// recording.
using ErrorsByComponents = std::map<std::pair<int, int>, std::vector<double>>;

// Distances depend on k1 alone and turns on k2 alone, so each is computed once per value.
void add_published_errors(const simulation::MappingRecording& recording, ErrorsByComponents& grid) {
  const std::size_t steps = recording.views.size() - 1;
  std::map<int, std::vector<double>> lengths;
  std::map<int, std::vector<double>> turns;
  for (std::size_t i = 0; i < steps; ++i) {
    const FourierSignature& before = recording.views[i];
    const FourierSignature& after = recording.views[i + 1];
    for (const int k1 : k1_values) lengths[k1].push_back(dissimilarity_l2(after, before, k1));
    for (const int k2 : k2_values) {
      const auto reading = compass(after, before, k2);
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

std::pair<std::pair<int, int>, double> find_best(const ErrorsByComponents& grid) {
  std::pair<std::pair<int, int>, double> best{{0, 0}, 2.0};
  for (const auto& [key, values] : grid) {
    const double middle = median(values);
    if (middle < best.second) best = {key, middle};
  }
  return best;
}

viewer::LinePlot plot_grid(const ErrorsByComponents& grid, const std::string& title) {
  viewer::LinePlot plot{.title = title,
                        .x_label = "components for the distance, k1",
                        .y_label = "shape difference",
                        .log_x = true};
  for (const int k2 : k2_values) {
    viewer::Series series{.label = "k2 = " + std::to_string(k2)};
    for (const int k1 : k1_values) series.add(k1, median(grid.at({k1, k2})));
    plot.series.push_back(std::move(series));
  }
  return plot;
}

std::vector<Point2> select_wheel_positions(const simulation::MappingRecording& recording,
                                           const simulation::MappedRecording& mapped) {
  std::vector<Point2> wheels;
  for (const std::size_t i : mapped.number) wheels.push_back(recording.wheels[i].position());
  return wheels;
}

/// Results of one view set in all variants of its scene, each mapped in several ways.
struct SetResults {
  std::string id;
  std::string what;
  std::vector<double> open, closed, closed_with_wheels, wheels, known_height_open, known_height;
  std::vector<double> mirror_open, mirror_closed;
  std::size_t right = 0;
  std::size_t wrong = 0;
  std::size_t unclosed_recordings = 0;  // recordings without a correct closure
  ErrorsByComponents grid;
  std::vector<viewer::MapPlot> maps;  // of the first four variants

  /// Maps a recording in all ways and adds the errors; returns the map without loop closures.
  simulation::MappedRecording add(const simulation::PlaceRecording& place,
                                  const simulation::MappingRecording& recording,
                                  simulation::MappingRunOptions run) {
    const auto with = simulation::map_recording(recording, run);
    run.wheels = true;
    const auto with_wheels = simulation::map_recording(recording, run);
    run.wheels = false;
    run.mapping.close_loops = false;
    auto without = simulation::map_recording(recording, run);
    open.push_back(simulation::shape_error(without.estimate, without.truth));
    closed.push_back(simulation::shape_error(with.estimate, with.truth));
    closed_with_wheels.push_back(simulation::shape_error(with_wheels.estimate, with_wheels.truth));
    wheels.push_back(simulation::shape_error(select_wheel_positions(recording, with), with.truth));
    right += with.right_closures + with_wheels.right_closures;
    wrong += with.wrong_closures + with_wheels.wrong_closures;
    unclosed_recordings += with.right_closures == 0 ? 1 : 0;
    run.odometry.camera_height_m = place.scene.camera_height_m;
    const auto open_map = simulation::map_recording(recording, run);
    run.mapping.close_loops = true;
    const auto closed_map = simulation::map_recording(recording, run);
    known_height.push_back(simulation::shape_error(closed_map.estimate, closed_map.truth));
    known_height_open.push_back(simulation::shape_error(open_map.estimate, open_map.truth));
    if (maps.size() < 4) draw(place, recording, without, with);
    return without;
  }

  /// Maps the mirror images of a drive and adds the errors.
  void add_mirror(const simulation::MappingRecording& by_mirror) {
    for (const bool close_loops : {false, true}) {
      const auto mapped =
          simulation::map_recording(by_mirror, {.mapping = {.close_loops = close_loops}});
      auto& errors = close_loops ? mirror_closed : mirror_open;
      errors.push_back(simulation::shape_error(mapped.estimate, mapped.truth));
    }
  }

  struct Targets {
    Target open;
    Target closed;
    std::optional<Target> closed_with_wheels;
    PublishedFigure published;  ///< without closure
  };
  void report(const Targets& targets, Reproduction& result) const {
    const double figure = targets.published.shape_difference;
    const auto published = std::pair(figure, figure);
    const std::pair components(targets.published.k1, targets.published.k2);
    const auto add = [&](const std::string& key, const std::string& how,
                         const std::vector<double>& values,
                         std::optional<Target> target = std::nullopt,
                         std::optional<std::pair<double, double>> theirs = std::nullopt) {
      add_median(result, id + "." + key, what + ": shape difference " + how, "", values, target,
                 theirs);
    };
    add("open", "without closure", open, targets.open, published);
    result.rows.back().reason = "the same recordings differ by " +
                                to_general_text(median(closed), 3) + " with loops closed, and by " +
                                to_general_text(median(wheels), 3) + " by the wheels alone";
    add("closed", "with closure", closed, targets.closed);
    add("closed_wheels", "with closure and steps from wheels", closed_with_wheels,
        targets.closed_with_wheels);
    add("ground_open", "without closure, height of the camera known", known_height_open);
    add("ground", "with closure, height of the camera known", known_height);
    add("wheels", "of the wheels alone", wheels);
    const std::string mirror = "from mirror images of 640 x 480, ";
    add("mirror.open", mirror + "without closure", mirror_open, targets.open, published);
    result.rows.back().reason = "the same images differ by " +
                                to_general_text(median(mirror_closed), 3) + " with loops closed";
    add("mirror.closed", mirror + "with closure", mirror_closed, targets.closed);
    add_rate(result, id + ".right_closures", what + ": closures between views at most 1 m apart",
             right, std::max<std::size_t>(1, right + wrong));
    add_rate(result, id + ".unclosed", what + ": recordings in which no loop was closed",
             unclosed_recordings, open.size());
    const auto best = find_best(grid).first;
    const auto with = [](std::pair<int, int> k) {
      return "k1 = " + std::to_string(k.first) + ", k2 = " + std::to_string(k.second);
    };
    add("published", "by the published rule, " + with(components), grid.at(components),
        std::nullopt, published);
    add("published_best", "by the published rule, best of figure 6, " + with(best), grid.at(best));
  }

 private:
  void draw(const simulation::PlaceRecording& place, const simulation::MappingRecording& recording,
            const simulation::MappedRecording& without, const simulation::MappedRecording& with) {
    viewer::MapPlot plot{.title = place.scene.name + " " + std::to_string(place.seed),
                         .layers = viewer::scene_layers(place.scene)};
    const auto& truth = without.truth;
    plot.layers.push_back(
        {.label = "ground truth", .colour = viewer::PlotColour::black, .lines = {truth}});
    plot.layers.push_back(
        {.label = "wheels",
         .colour = viewer::PlotColour::vermilion,
         .lines = {simulation::align_to(select_wheel_positions(recording, without), truth)}});
    plot.layers.push_back({.label = "visual odometry",
                           .colour = viewer::PlotColour::blue,
                           .lines = {simulation::align_to(without.estimate, truth)}});
    plot.layers.push_back({.label = "loops closed",
                           .colour = viewer::PlotColour::green,
                           .lines = {simulation::align_to(with.estimate, with.truth)}});
    maps.push_back(std::move(plot));
  }
};

/// The first set with fewer views, with other numbers of components, and the heading errors of its
/// steps.
struct FirstSetVariations {
  std::map<int, std::vector<double>> by_components;
  std::map<int, std::vector<double>> by_spacing;
  std::map<int, std::vector<double>> closed_by_spacing;
  std::vector<double> headings_deg;
  std::vector<double> compass_deg;

  void add_variations(const simulation::MappingRecording& recording, double open_loop_error,
                      double closed_loop_error) {
    const auto error_of = [](const simulation::MappingRecording& views,
                             const simulation::MappingRunOptions& run) {
      const auto mapped = simulation::map_recording(views, run);
      return simulation::shape_error(mapped.estimate, mapped.truth);
    };
    by_components[default_components].push_back(open_loop_error);
    for (const int components : other_components) {
      by_components[components].push_back(
          error_of(recording, {.mapping = {.close_loops = false}, .components = components}));
    }
    by_spacing[1].push_back(open_loop_error);
    closed_by_spacing[1].push_back(closed_loop_error);
    for (const int every : {2, 3, 5}) {
      const auto thinned = simulation::thin_recording(recording, static_cast<std::size_t>(every));
      by_spacing[every].push_back(error_of(thinned, {.mapping = {.close_loops = false}}));
      closed_by_spacing[every].push_back(error_of(thinned, {}));
    }
    for (std::size_t i = 0; i + 3 < recording.views.size(); ++i) add_step(recording, i, i + 3);
  }

  void report(const std::string& what, Reproduction& result) const {
    for (const auto& [components, values] : by_components) {
      const std::string count = std::to_string(components);
      add_median(result, "f11.loop.components_" + count,
                 what + ": shape difference without closure, " + count + " components", "", values);
    }
    for (const auto& [every, values] : by_spacing) {
      const std::string spacing = std::to_string(10 * every);
      const std::string id = "f11.loop.spacing_" + spacing + "cm";
      const std::string apart = "loop, views " + spacing + " cm apart: shape difference ";
      add_median(result, id, apart + "without closure", "", values);
      add_median(result, id + "_closed", apart + "with closure", "", closed_by_spacing.at(every));
    }
    add_median(result, "f11.loop.heading_30cm", "loop: heading error between views 30 cm apart",
               "deg", headings_deg, at_most(2.0));
    add_median(result, "f11.loop.compass_30cm",
               "loop: heading error of the compass alone between views 30 cm apart", "deg",
               compass_deg);
  }

 private:
  void add_step(const simulation::MappingRecording& recording, std::size_t from, std::size_t to) {
    const auto before = simulation::first_components(recording.views[from], default_components);
    const auto after = simulation::first_components(recording.views[to], default_components);
    const Pose2 motion = inverse(recording.truth[from]) * recording.truth[to];
    const auto off_deg = [&](double found_rad) {
      return degrees(std::abs(angle_difference(found_rad, motion.heading_rad)));
    };
    const auto step = visual_step(OdometryView(before), OdometryView(after));
    headings_deg.push_back(off_deg(step ? step->before_from_after.heading_rad : 0.0));
    if (const auto reading = compass(after, before)) {
      compass_deg.push_back(off_deg(reading->heading_rad));
    }
  }
};

simulation::MappingRecording record_drive(const MappingExperiments& f11,
                                          const simulation::PlaceRecording& place,
                                          const std::vector<Pose2>& poses) {
  return simulation::record_for_mapping(place, poses, max_components + 2,
                                        simulation::make_noisy_wheels(), 1000 * place.seed,
                                        f11.executor);
}

/// Drives along the same path as a recording with a mirror camera.
simulation::MappingRecording record_again_by_mirror(const MappingExperiments& f11,
                                                    const simulation::PlaceRecording& place,
                                                    const simulation::MappingRecording& recording) {
  return record_by_mirror(place, recording.truth, max_components + 2,
                          simulation::make_noisy_wheels(), 1000 * place.seed, f11.executor);
}

/// A drive through a variant of a scene, recorded as panoramas and by a mirror camera.
using DriveMeasurement = std::function<void(const simulation::PlaceRecording& place,
                                            const simulation::MappingRecording& recording,
                                            const simulation::MappingRecording& by_mirror)>;

/// Measures the published rule, and `measure`, on drives along the round trip through all variants
/// of a scene, and the rule on drives beside it, at `offsets_m`, through every second one.
void measure_round_trips(const MappingExperiments& f11, const std::string& scene,
                         std::span<const double> offsets_m, PublishedRuleStudy& published,
                         const DriveMeasurement& measure = {}) {
  for (int s = 0; s < f11.options.scenes; ++s) {
    const simulation::PlaceRecording place = f11.make_variant(scene, s);
    const auto recording = record_drive(
        f11, place, drive(place, {}, loop_spacing_m, static_cast<std::size_t>(f11.options.views)));
    const auto by_mirror = record_again_by_mirror(f11, place, recording);
    if (measure) measure(place, recording, by_mirror);
    published.add(place, recording, by_mirror, f11.executor);
    published.add_spacings(recording, loop_spacing_m, f11.executor);
    if (s % 2 == 0)
      published.add_offset_tours(place, offsets_m, loop_spacing_m, recording.views.size(),
                                 f11.executor);
  }
}

}  // namespace

simulation::PlaceRecording MappingExperiments::make_variant(const std::string& scene,
                                                            int number) const {
  const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(number);
  return simulation::make_empty_place(simulation::make_scene(scene, {.seed = seed}), seed,
                                      {.columns = options.columns, .rays_per_axis = 1}, executor);
}

void MappingExperiments::reproduce_first_set() const {
  SetResults set{.id = "f11.loop",
                 .what = "loop, " + std::to_string(options.views) + " views 10 cm apart"};
  FirstSetVariations variations;
  constexpr std::array offsets_m{-0.3, -0.15, 0.15, 0.3};
  PublishedRuleStudy published(first_figure);
  measure_round_trips(
      *this, "loop", offsets_m, published,
      [&](const simulation::PlaceRecording& place, const simulation::MappingRecording& recording,
          const simulation::MappingRecording& by_mirror) {
        set.add(place, recording, {});
        add_published_errors(recording, set.grid);
        set.add_mirror(by_mirror);
        variations.add_variations(recording, set.open.back(), set.closed.back());
      });
  set.report({.open = at_most(0.02),
              .closed = at_most(0.006),
              .closed_with_wheels = at_most(0.002),
              .published = first_figure},
             result);
  published.report(set.id, set.what, result);
  variations.report(set.what, result);
  add_plot(result, "f11_figure6a.svg", "Figure 6 (a): shape difference against k1, for several k2",
           plot_grid(set.grid, "First set: shape difference by the published rule, median"));
  add_plot(result, "f11_figure4.svg",
           "Figure 4: maps of the loop beside the truth and the wheels, laid over the truth with "
           "one scale",
           set.maps, 2);
}

void MappingExperiments::reproduce_second_set() const {
  SetResults set{.id = "f11.lab", .what = "lab, views captured by threshold"};
  const auto views = static_cast<std::size_t>(options.views);
  constexpr std::array offsets_m{-0.2, 0.0, 0.2, 0.4, 0.6};
  PublishedRuleStudy published(second_figure);
  std::vector<double> nodes;
  std::vector<double> path_lengths_m;
  for (int s = 0; s < options.scenes; ++s) {
    const simulation::PlaceRecording place = make_variant("lab", s);
    std::vector<Point2> path = place.scene.tour;
    path.insert(path.end(), place.scene.tour.begin(), place.scene.tour.end());
    const auto recording = record_drive(
        *this, place, drive(place, path, capture_spacing_m, pictures_per_captured_view * views));
    const auto open = set.add(
        place, recording,
        {.mapping = {.capture_difference = capture_difference}, .max_nodes = views * 3 / 4});
    nodes.push_back(static_cast<double>(open.number.size()));
    path_lengths_m.push_back(capture_spacing_m * static_cast<double>(open.number.back()));
    simulation::MappingRecording captured;
    for (const std::size_t i : open.number) {
      captured.truth.push_back(recording.truth[i]);
      captured.wheels.push_back(recording.wheels[i]);
      captured.views.push_back(recording.views[i]);
    }
    add_published_errors(captured, set.grid);
    const auto by_mirror = record_again_by_mirror(*this, place, captured);
    set.add_mirror(by_mirror);
    published.add(place, captured, by_mirror, executor);
    published.add_spacings(recording, capture_spacing_m, executor);
    if (s % 2 == 0)
      published.add_offset_tours(place, offsets_m, loop_spacing_m, views * 3 / 5, executor);
  }
  add_median(result, "f11.lab.views", set.what + ": views", "views", nodes, std::nullopt,
             std::pair(150.0, 150.0));
  add_median(result, "f11.lab.way", set.what + ": path length", "m", path_lengths_m);
  set.report({.open = at_most(0.01),
              .closed = at_most(0.01),
              .closed_with_wheels = std::nullopt,
              .published = second_figure},
             result);
  published.report(set.id, set.what, result);
  add_plot(result, "f11_figure6b.svg", "Figure 6 (b): shape difference against k1, for several k2",
           plot_grid(set.grid, "Second set: shape difference by the published rule, median"));
  add_plot(result, "f11_figure5.svg",
           "Figure 5: maps of the second set beside the truth and the wheels, laid over the truth",
           set.maps, 2);
}

void MappingExperiments::measure_wide_room() const {
  constexpr std::array offsets_m{-0.6, 0.6, 1.2, 1.8};
  PublishedRuleStudy published(first_figure);
  measure_round_trips(*this, "hall", offsets_m, published);
  published.report("f11.hall", "hall, " + std::to_string(options.views) + " views 10 cm apart",
                   result);
}

}  // namespace panonav::lab
