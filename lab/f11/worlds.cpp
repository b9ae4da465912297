// Further experiments on [F11]: run time, similar places, Gazebo worlds, recordings, large maps.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/f11/published_rule.hpp"
#include "lab/rows.hpp"
#include "panonav/camera/camera.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/panorama/unwarper.hpp"
#include "panonav/signature/signature_extractor.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "panonav_simulation/mirror.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/worlds.hpp"
#include "panonav_viewer/picture_plot.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

using Clock = std::chrono::steady_clock;
constexpr int components = 15;

double microseconds_since(Clock::time_point start) {
  return 1e6 * std::chrono::duration<double>(Clock::now() - start).count();
}

double rms_m(std::span<const Point2> estimate, std::span<const Point2> truth, bool scale) {
  return align(estimate, truth, {.allow_scale = scale}).rms_m;
}

/// Plans two loops that share their start, repeated up to `length_m`.
std::vector<Pose2> plan_two_loops(const simulation::PlaceRecording& place, double length_m,
                                  double spacing_m, Random& random) {
  const simulation::FreeSpace& space = *place.free_space;
  constexpr double min_side_m = 2.0;
  const auto sample_far_from = [&](const std::vector<Point2>& others) {
    Point2 point = space.random_pose(random).position();
    constexpr int trials = 200;
    for (int i = 0; i < trials; ++i) {
      const bool near = std::ranges::any_of(
          others, [&](const Point2& other) { return distance(other, point) < min_side_m; });
      if (!near) break;
      point = space.random_pose(random).position();
    }
    return point;
  };
  std::vector<Point2> places{space.random_pose(random).position()};
  while (places.size() < 5) places.push_back(sample_far_from(places));
  std::vector<Point2> path;
  // Each round is at least 2 m long, so this many rounds reach `length_m`.
  const auto rounds = static_cast<int>(std::ceil(length_m / min_side_m));
  for (int round = 0; round < rounds && round < 20; ++round) {
    for (const std::size_t i : {0U, 1U, 2U, 0U, 3U, 4U}) path.push_back(places[i]);
  }
  const auto views = static_cast<std::size_t>(std::lround(length_m / spacing_m));
  return drive(place, path, spacing_m, views);
}

/// Reads the views of a data set, and their positions where known (else the origin).
simulation::MappingRecording read_recording(const std::filesystem::path& folder,
                                            PanoramaShape shape, Executor& executor) {
  const Dataset dataset = read_dataset(folder);
  const PanoramaReader reader(dataset.source, shape);
  simulation::MappingRecording recording;
  recording.views = simulation::make_each(executor, dataset.entries.size(), [&](std::size_t i) {
    return compute_signature(preprocess(reader.read(dataset.entries[i].path), {}), components);
  });
  for (const DatasetEntry& entry : dataset.entries) {
    recording.truth.push_back(entry.pose ? Pose2{entry.pose->x_m, entry.pose->y_m, 0.0} : Pose2{});
    recording.wheels.push_back({});
  }
  return recording;
}

/// Draws pairs of views, the first above the second, three pairs per row.
viewer::PicturePlot draw_pairs(const std::string& title,
                               const std::vector<std::pair<Panorama, Panorama>>& pairs) {
  constexpr int gap = 8;
  constexpr int pairs_per_row = 3;
  const int rows = pairs.front().first.rows();
  const int columns = pairs.front().first.columns();
  const int row_count = (static_cast<int>(pairs.size()) + pairs_per_row - 1) / pairs_per_row;
  viewer::PicturePlot plot{.title = title,
                           .columns = pairs_per_row * (columns + 4 * gap),
                           .rows = row_count * (2 * rows + 4 * gap)};
  plot.x_range = {0.0, plot.columns};
  plot.y_range = {0.0, plot.rows};
  plot.values.assign(static_cast<std::size_t>(plot.columns) * static_cast<std::size_t>(plot.rows),
                     std::numeric_limits<float>::quiet_NaN());
  const auto draw = [&](const Panorama& view, int top, int left) {
    for (int row = 0; row < rows; ++row) {
      const auto target = static_cast<std::size_t>(plot.rows - 1 - top - row) *
                              static_cast<std::size_t>(plot.columns) +
                          static_cast<std::size_t>(left);
      // Draw azimuth growing to the left, as viewed from inside; the square root brightens dark
      // areas.
      for (int c = 0; c < columns; ++c) {
        plot.values[target + static_cast<std::size_t>(columns - 1 - c)] =
            std::sqrt(view.at(row, c));
      }
    }
  };
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const int top = static_cast<int>(i) / pairs_per_row * (2 * rows + 4 * gap) + gap;
    const int left = static_cast<int>(i) % pairs_per_row * (columns + 4 * gap) + 2 * gap;
    draw(pairs[i].first, top, left);
    draw(pairs[i].second, top + rows + gap / 2, left);
  }
  return plot;
}

std::vector<TopologicalMap::Edge> filter_closures(const simulation::MappedRecording& mapped) {
  std::vector<TopologicalMap::Edge> closures;
  std::ranges::copy_if(
      mapped.map.edges, std::back_inserter(closures),
      [](const TopologicalMap::Edge& edge) { return edge.kind == Link::Kind::closure; });
  return closures;
}

viewer::MapPlot plot_indoor_walk(const simulation::MappedRecording& bridged_map) {
  viewer::MapLayer lines{.label = "closures", .colour = viewer::PlotColour::vermilion};
  const auto position_of = [&](ViewId view) {
    return bridged_map.estimate[view.value - bridged_map.map.nodes[0].view.value];
  };
  for (const TopologicalMap::Edge& edge : filter_closures(bridged_map)) {
    lines.lines.push_back({position_of(edge.a), position_of(edge.b)});
  }
  return {.title = "indoor_walk_360, no positions known",
          .layers = {{.label = "consecutive pictures",
                      .colour = viewer::PlotColour::blue,
                      .lines = {bridged_map.estimate},
                      .dots = bridged_map.estimate},
                     lines}};
}

void map_indoor_walk(const MappingExperiments& f11) {
  const std::filesystem::path folder = f11.options.data / "indoor_walk_360";
  constexpr PanoramaShape shape{80, 512};
  const simulation::MappingRecording walk = read_recording(folder, shape, f11.executor);
  // Consecutive pictures are metres apart, and many steps cannot be computed from the views.
  const auto unbridged_map = simulation::map_recording(walk, {});
  const auto bridged_map = simulation::map_recording(walk, {.mapping = {.bridge_m = 1.5}});
  const auto linked = static_cast<double>(std::ranges::count(
      unbridged_map.map.edges, Link::Kind::sequence, &TopologicalMap::Edge::kind));
  add_row(f11.result, "f11.indoor_walk.linked",
          "indoor_walk_360: consecutive pictures linked by a step read from them",
          linked / static_cast<double>(walk.views.size() - 1), "");
  add_row(f11.result, "f11.indoor_walk.closures", "indoor_walk_360: loops closed",
          static_cast<double>(filter_closures(bridged_map).size()), "closures");
  // Map with closures by single views, for comparison.
  const auto single =
      simulation::map_recording(walk, {.mapping = {.bridge_m = 1.5}, .closure = {.sequence = 1}});
  auto unconfirmed = filter_closures(single);
  add_row(f11.result, "f11.indoor_walk.without_sequence",
          "indoor_walk_360: loops that single views would close, were no sequence asked for",
          static_cast<double>(unconfirmed.size()), "closures");
  add_plot(f11.result, "f11_indoor_walk.svg",
           "A walk through a building, pictures metres apart: steps that the views do not show "
           "count as 1.5 m straight ahead; closures in orange",
           plot_indoor_walk(bridged_map));
  if (unconfirmed.empty()) return;
  const Dataset dataset = read_dataset(folder);
  const PanoramaReader reader(dataset.source, shape);
  const auto view_of = [&](ViewId view) {
    return reader.read(dataset.entries[view.value - single.map.nodes[0].view.value].path);
  };
  constexpr std::size_t max_pairs = 12;
  if (unconfirmed.size() > max_pairs) unconfirmed.resize(max_pairs);
  std::vector<std::pair<Panorama, Panorama>> pairs;
  for (const TopologicalMap::Edge& edge : unconfirmed)
    pairs.emplace_back(view_of(edge.a), view_of(edge.b));
  add_plot(f11.result, "f11_indoor_walk_pairs.svg",
           "Pairs of pictures (one over the other) that pass every check of a loop closure but the "
           "sequence: corridors of one kind on several floors. None of them becomes a closure",
           draw_pairs("indoor_walk_360: pairs that no sequence of views confirms", pairs));
}

/// Mirror images along the round trip of `loop`, with their unwarper.
struct MirrorImages {
  std::vector<Image> images;
  Unwarper unwarper;
};

MirrorImages capture_mirror_images(const MappingExperiments& f11) {
  const simulation::PlaceRecording place = f11.make_variant("loop", 0);
  const Camera camera = simulation::make_simulated_mirror_camera();
  std::vector<Image> images;
  for (const Pose2& pose :
       drive(place, {}, 0.1, static_cast<std::size_t>(std::min(60, f11.options.views)))) {
    images.push_back(simulation::capture_image(*place.renderer, pose, camera, {}, {}, images.size(),
                                               f11.executor));
  }
  return {std::move(images), Unwarper(camera, {80, 512})};
}

/// Median run times of one step of visual odometry.
struct StepTimes {
  double total_ms = 0.0;     ///< from the mirror image
  double odometry_ms = 0.0;  ///< from the signature
};

StepTimes measure_step_times(const MirrorImages& seen, int count) {
  const SignatureExtractor extractor({80, 512}, count);
  SignatureExtractor::Workspace workspace;
  VisualOdometry odometry;
  std::vector<double> all_us;
  std::vector<double> step_us;
  for (const Image& image : seen.images) {
    const auto start = Clock::now();
    FourierSignature signature = extractor.signature(seen.unwarper, image.view(), workspace);
    const auto middle = Clock::now();
    static_cast<void>(odometry.add(OdometryView(std::move(signature))));
    step_us.push_back(microseconds_since(middle));
    all_us.push_back(microseconds_since(start));
  }
  return {1e-3 * median(all_us), 1e-3 * median(step_us)};
}

/// Position errors of paths with two loops in one world, one value per path and way of mapping.
struct WorldErrors {
  std::vector<double> wheels, open, closed, known_height_open, known_height, with_wheels;  // [m]
  std::size_t right = 0;
  std::size_t wrong = 0;
  std::vector<viewer::MapPlot> maps;  // of the first four

  void add(const simulation::PlaceRecording& place, const simulation::MappingRecording& recording,
           const std::string& name) {
    const VisualOdometryOptions known{.camera_height_m = place.scene.camera_height_m};
    const auto open_map = simulation::map_recording(recording, {.mapping = {.close_loops = false}});
    const auto closed_map = simulation::map_recording(recording, {});
    const auto known_height_open_map = simulation::map_recording(
        recording, {.mapping = {.close_loops = false}, .odometry = known});
    const auto known_height_map = simulation::map_recording(recording, {.odometry = known});
    const auto wheels_map = simulation::map_recording(recording, {.wheels = true});
    const auto error_of = [](const simulation::MappedRecording& mapped, bool scale) {
      return rms_m(mapped.estimate, mapped.truth, scale);
    };
    wheels.push_back(rms_m(positions_of(recording.wheels), open_map.truth, false));
    open.push_back(error_of(open_map, true));
    closed.push_back(error_of(closed_map, true));
    known_height_open.push_back(error_of(known_height_open_map, false));
    known_height.push_back(error_of(known_height_map, false));
    with_wheels.push_back(error_of(wheels_map, false));
    for (const auto* mapped : {&closed_map, &known_height_map, &wheels_map}) {
      right += mapped->right_closures;
      wrong += mapped->wrong_closures;
    }
    if (maps.size() == 4) return;
    maps.push_back({.title = name + ", path " + std::to_string(maps.size() + 1),
                    .layers = viewer::scene_layers(place.scene)});
    const auto draw = [&](const std::string& label, viewer::PlotColour colour,
                          std::vector<Point2> line) {
      maps.back().layers.push_back({.label = label, .colour = colour, .lines = {std::move(line)}});
    };
    const auto truth = open_map.truth;
    std::vector<Point2> wheel_line = positions_of(recording.wheels);
    const Alignment alignment = align(wheel_line, truth);
    for (Point2& p : wheel_line) p = alignment.apply(p);
    draw("ground truth", viewer::PlotColour::black, truth);
    draw("wheels", viewer::PlotColour::vermilion, std::move(wheel_line));
    draw("views alone", viewer::PlotColour::blue,
         simulation::align_to(known_height_map.estimate, known_height_map.truth));
    draw("views, steps from wheels", viewer::PlotColour::green,
         simulation::align_to(wheels_map.estimate, wheels_map.truth));
  }

  /// Counts the paths on which these errors are smaller than those of the wheels.
  [[nodiscard]] std::size_t count_better_than_wheels(const std::vector<double>& errors) const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < errors.size(); ++i) count += errors[i] < wheels[i] ? 1 : 0;
    return count;
  }
};

}  // namespace

void MappingExperiments::measure_step_time() const {
  const MirrorImages seen = capture_mirror_images(*this);
  const StepTimes default_times = measure_step_times(seen, components);
  add_row(result, "f11.time.step",
          "time of a step from a mirror image of 640 x 480 to a pose, median",
          default_times.total_ms, "ms", at_most(0.3), std::pair(54.0, 153.0));
  add_row(result, "f11.time.odometry", "of these, from signature to pose",
          default_times.odometry_ms, "ms");
  // Figure 6 also shows how the number of components changes the run time.
  viewer::Series times{.label = "signature to pose"};
  for (const int count : {6, 10, 15, 20, 32, 64}) {
    times.add(count, measure_step_times(seen, count).odometry_ms);
    add_row(result, "f11.time.components_" + std::to_string(count),
            "from signature to pose with " + std::to_string(count) + " components", times.y.back(),
            "ms");
  }
  add_plot(result, "f11_figure6_time.svg",
           "Figure 6: time of a step against the number of components",
           viewer::LinePlot{.title = "Time from a signature to a pose, median",
                            .x_label = "components",
                            .y_label = "time [ms]",
                            .series = {times}});
}

void MappingExperiments::reproduce_identical_doors() const {
  const int scenes = std::max(1, options.scenes / 5);
  constexpr double spacing_m = 0.2;
  const auto views = static_cast<std::size_t>(2 * options.views);
  const std::string what = "corridor of identical doors, " +
                           std::to_string(std::lround(spacing_m * static_cast<double>(views))) +
                           " m";
  std::size_t right = 0;
  std::size_t wrong = 0;
  std::vector<double> errors;
  for (int s = 0; s < scenes; ++s) {
    const simulation::PlaceRecording place = make_variant("corridor", s);
    std::vector<Point2> path;
    for (int round = 0; round < 3; ++round) {
      path.insert(path.end(), place.scene.tour.begin(), place.scene.tour.end());
    }
    const auto recording = simulation::record_for_mapping(
        place, drive(place, path, spacing_m, views), components + 2,
        simulation::make_noisy_wheels(), 1000 * place.seed, executor);
    for (const bool wheels : {false, true}) {
      const auto mapped = simulation::map_recording(recording, {.wheels = wheels});
      right += mapped.right_closures;
      wrong += mapped.wrong_closures;
      if (wheels) errors.push_back(simulation::shape_error(mapped.estimate, mapped.truth));
    }
  }
  add_rate(result, "f11.corridor.right_closures",
           what + ": closures between views at most 1 m apart", right,
           std::max<std::size_t>(1, right + wrong));
  add_median(result, "f11.corridor.closed_wheels",
             what + ": shape difference with closure and steps from wheels", "", errors);
}

void MappingExperiments::reproduce_world(const std::string& name) const {
  constexpr double length_m = 60.0;
  constexpr double spacing_m = 0.15;
  const simulation::PlaceRecording place =
      simulation::make_empty_place(simulation::read_gazebo_world(options.data, name), options.seed,
                                   {.columns = options.columns, .rays_per_axis = 1}, executor);
  WorldErrors errors;
  for (int run = 0; run < options.runs; ++run) {
    Random random(options.seed, 300 + static_cast<std::uint64_t>(run));
    const auto recording = simulation::record_for_mapping(
        place, plan_two_loops(place, length_m, spacing_m, random), components + 2,
        simulation::make_noisy_wheels(),
        1000 * options.seed + 10'000 * static_cast<std::uint64_t>(run + 1), executor);
    errors.add(place, recording, name);
  }
  const auto runs = static_cast<std::size_t>(options.runs);
  const std::string id = "f11." + name;
  const std::string what = name + ", 60 m with two loops: ";
  const auto add = [&](const std::string& key, const std::string& how,
                       const std::vector<double>& errors_m) {
    add_median(result, id + key, what + how, "m", errors_m);
  };
  add(".wheels", "position error (rms) of the wheels of a cheap robot", errors.wheels);
  add(".open", "of the views alone, one scale, no closure", errors.open);
  add(".closed", "of the views alone, one scale, loops closed", errors.closed);
  add(".ground_open", "of the views alone, height of the camera known, no closure",
      errors.known_height_open);
  add(".ground", "of the views alone, height of the camera known, loops closed",
      errors.known_height);
  add(".closed_wheels", "with steps from these wheels, loops closed", errors.with_wheels);
  add_rate(result, id + ".better", what + "paths on which ours, steps from wheels, is better",
           errors.count_better_than_wheels(errors.with_wheels), runs, at_least(0.5));
  add_rate(result, id + ".better_without",
           what + "paths on which ours, views and height of the camera alone, is better",
           errors.count_better_than_wheels(errors.known_height), runs);
  add_rate(result, id + ".right_closures", what + "closures between views at most 1 m apart",
           errors.right, std::max<std::size_t>(1, errors.right + errors.wrong));
  add_plot(result, "f11_" + name + ".svg",
           "Paths of 60 m with two loops in " + name + ", laid over the truth", errors.maps, 2);
}

void MappingExperiments::reproduce_recordings() const {
  if (simulation::has_data(options.data, "sussex_route")) {
    const auto route = read_recording(options.data / "sussex_route", {}, executor);
    const auto mapped = simulation::map_recording(route, {.mapping = {.close_loops = false}});
    add_row(result, "f11.sussex.rms",
            "sussex_route, 7 m outdoors: position error (rms), views alone, one scale",
            rms_m(mapped.estimate, mapped.truth, true), "m");
    add_row(result, "f11.sussex.shape", "sussex_route: shape difference",
            simulation::shape_error(mapped.estimate, mapped.truth), "");
    add_plot(
        result, "f11_sussex_route.svg", "A route outdoors, laid over the tracker's",
        viewer::MapPlot{
            .title = "sussex_route",
            .layers = {
                {.label = "tracker", .colour = viewer::PlotColour::black, .lines = {mapped.truth}},
                {.label = "visual odometry",
                 .colour = viewer::PlotColour::blue,
                 .lines = {simulation::align_to(mapped.estimate, mapped.truth)}}}});
  }
  if (simulation::has_data(options.data, "indoor_walk_360")) map_indoor_walk(*this);
}

void MappingExperiments::measure_large_maps() const {
  // Each round has its own small lateral offset, so that no view repeats exactly.
  constexpr int columns = 256;
  const simulation::PlaceRecording place = simulation::make_empty_place(
      simulation::make_scene("loop", {.seed = options.seed}), options.seed,
      {.columns = columns, .rays_per_axis = 1}, executor);
  Random random(options.seed, 400);
  std::vector<Point2> path;
  const auto rounds = options.max_views / 180 + 2;
  for (int round = 0; round < rounds; ++round) {
    const double lateral_offset_m = random.uniform(-0.15, 0.15);
    for (const Point2& p : place.scene.tour)
      path.push_back({p.x_m + lateral_offset_m, p.y_m + lateral_offset_m});
  }
  const auto recording = simulation::record_for_mapping(
      place, drive(place, path, 0.1, static_cast<std::size_t>(options.max_views)), components + 2,
      simulation::make_noisy_wheels(), 1000 * options.seed, executor);
  for (std::size_t views = 100; views <= recording.views.size(); views *= 10) {
    const auto mapped = simulation::map_recording(recording, {.max_nodes = views});
    const std::string id = "f11.large." + std::to_string(views);
    const std::string what = "map of " + std::to_string(views) + " views";
    add_row(result, id + ".step",
            what + ": time of a view, mean, all optimisation shared among them",
            1e3 * mapped.mean_step_s, "ms",
            views == 10'000 ? std::optional(at_most(20.0)) : std::nullopt);
    add_row(result, id + ".longest", what + ": longest time of a view", 1e3 * mapped.max_step_s,
            "ms");
    add_row(result, id + ".finish", what + ": the last optimisation of the whole",
            1e3 * mapped.finish_s, "ms");
    // For its closure search the mapper stores view, path length and component of each node.
    constexpr std::size_t search_node_bytes = 3 * sizeof(double);
    const double bytes = static_cast<double>(
        mapped.map.nodes.size() *
            (static_cast<std::size_t>(2 * recording.views.front().rows() * components) +
             sizeof(TopologicalMap::Node) + search_node_bytes) +
        mapped.map.edges.size() * (sizeof(TopologicalMap::Edge) + sizeof(PoseEdge)));
    add_row(result, id + ".memory", what + ": packed signatures, nodes and edges", 1e-6 * bytes,
            "MB");
    add_row(result, id + ".shape", what + ": shape difference",
            simulation::shape_error(mapped.estimate, mapped.truth), "");
    add_row(result, id + ".wrong", what + ": closures between views more than 1 m apart",
            static_cast<double>(mapped.wrong_closures), "closures");
  }
}

}  // namespace panonav::lab
