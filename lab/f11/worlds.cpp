// [F11] further: time, places that look alike, Gazebo worlds, recordings, large maps.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "lab/f11/experiments.hpp"
#include "lab/rows.hpp"
#include "panonav/camera/camera.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/positions.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/panorama/unwarper.hpp"
#include "panonav/signature/signature_extractor.hpp"
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

/// Two loops that share their start, driven again and again up to `length_m`.
std::vector<Pose2> two_loops(const simulation::PlaceRecording& place, double length_m,
                             double spacing_m, Random& random) {
  const simulation::FreeSpace& space = *place.free_space;
  constexpr double min_side_m = 2.0;
  const auto far_from = [&](const std::vector<Point2>& others) {
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
  while (places.size() < 5) places.push_back(far_from(places));
  std::vector<Point2> way;
  // Each round is 2 m or longer, so that this is enough.
  const auto rounds = static_cast<int>(std::ceil(length_m / min_side_m));
  for (int round = 0; round < rounds && round < 20; ++round) {
    for (const std::size_t i : {0U, 1U, 2U, 0U, 3U, 4U}) way.push_back(places[i]);
  }
  const auto views = static_cast<std::size_t>(std::lround(length_m / spacing_m));
  return drive(place, way, spacing_m, views);
}

/// A data set's views with what is known of their places.
struct ReadRecording {
  simulation::MappingRecording recording;
  bool posed = false;
};
ReadRecording read_recording(const std::filesystem::path& folder, PanoramaShape shape,
                             Executor& executor) {
  const Dataset dataset = read_dataset(folder);
  const PanoramaReader reader(dataset.source, shape);
  ReadRecording result;
  std::vector<std::optional<FourierSignature>> views(dataset.entries.size());
  executor.for_chunks(views.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      views[i] =
          compute_signature(preprocess(reader.read(dataset.entries[i].path), {}), components);
    }
  });
  result.posed = true;
  for (std::size_t i = 0; i < views.size(); ++i) {
    result.recording.views.push_back(std::move(*views[i]));
    const auto& pose = dataset.entries[i].pose;
    result.posed = result.posed && pose.has_value();
    result.recording.truth.push_back(pose ? Pose2{pose->x_m, pose->y_m, 0.0} : Pose2{});
    result.recording.wheels.push_back({});
  }
  return result;
}

/// Pairs of views, one over the other, three pairs in a row.
viewer::PicturePlot pairs_picture(const std::string& title,
                                  const std::vector<std::pair<Panorama, Panorama>>& pairs) {
  constexpr int gap = 8;
  constexpr int across = 3;
  const int rows = pairs.front().first.rows();
  const int columns = pairs.front().first.columns();
  const int down = (static_cast<int>(pairs.size()) + across - 1) / across;
  viewer::PicturePlot plot{
      .title = title, .columns = across * (columns + 4 * gap), .rows = down * (2 * rows + 4 * gap)};
  plot.x_range = {0.0, plot.columns};
  plot.y_range = {0.0, plot.rows};
  plot.values.assign(static_cast<std::size_t>(plot.columns) * static_cast<std::size_t>(plot.rows),
                     std::numeric_limits<float>::quiet_NaN());
  const auto draw = [&](const Panorama& view, int top, int left) {
    for (int row = 0; row < rows; ++row) {
      const auto target = static_cast<std::size_t>(plot.rows - 1 - top - row) *
                              static_cast<std::size_t>(plot.columns) +
                          static_cast<std::size_t>(left);
      // Azimuth grows to the left in a picture that is looked at from inside; the root shows what
      // is dark.
      for (int c = 0; c < columns; ++c) {
        plot.values[target + static_cast<std::size_t>(columns - 1 - c)] =
            std::sqrt(view.at(row, c));
      }
    }
  };
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const int top = static_cast<int>(i) / across * (2 * rows + 4 * gap) + gap;
    const int left = static_cast<int>(i) % across * (columns + 4 * gap) + 2 * gap;
    draw(pairs[i].first, top, left);
    draw(pairs[i].second, top + rows + gap / 2, left);
  }
  return plot;
}

void map_indoor_walk(const MappingReproductionOptions& options, Executor& executor,
                     Reproduction& result) {
  const std::filesystem::path folder = options.data / "indoor_walk_360";
  constexpr PanoramaShape shape{80, 512};
  const auto walk = read_recording(folder, shape, executor);
  // The pictures stand metres apart.
  const auto parts = simulation::map_recording(walk.recording, {});
  const auto bridged = simulation::map_recording(walk.recording, {.mapping = {.bridge_m = 1.5}});
  const auto closures_of = [](const simulation::MappedRecording& mapped) {
    std::vector<MapEdge> closures;
    for (const MapEdge& edge : mapped.map.edges) {
      if (edge.kind == LinkKind::closure) closures.push_back(edge);
    }
    return closures;
  };
  const auto linked =
      static_cast<double>(std::ranges::count(parts.map.edges, LinkKind::sequence, &MapEdge::kind));
  add_row(result, "f11.indoor_walk.linked",
          "indoor_walk_360: consecutive pictures linked by a step read from them",
          linked / static_cast<double>(walk.recording.views.size() - 1), "");
  add_row(result, "f11.indoor_walk.closures", "indoor_walk_360: loops closed",
          static_cast<double>(closures_of(bridged).size()), "closures");
  // What single views would close: for the eye.
  const auto single = simulation::map_recording(
      walk.recording,
      {.mapping = {.bridge_m = 1.5}, .closure = {.sequence = 1, .max_drift = 100.0}});
  const auto refused = closures_of(single);
  add_row(result, "f11.indoor_walk.without_sequence",
          "indoor_walk_360: loops that single views would close, were no sequence asked for",
          static_cast<double>(refused.size()), "closures");
  viewer::MapLayer lines{.label = "closures", .colour = viewer::PlotColour::vermilion};
  const auto place_of = [&](ViewId view) {
    return bridged.estimate[view.value - bridged.map.nodes[0].view.value];
  };
  for (const MapEdge& edge : closures_of(bridged)) {
    lines.lines.push_back({place_of(edge.a), place_of(edge.b)});
  }
  add_plot(result, options.out, "f11_indoor_walk.svg",
           "A walk through a building, pictures metres apart: steps that the views do not show "
           "count as 1.5 m straight ahead; closures in orange",
           viewer::MapPlot{.title = "indoor_walk_360, no positions known",
                           .layers = {{.label = "consecutive pictures",
                                       .colour = viewer::PlotColour::blue,
                                       .lines = {bridged.estimate},
                                       .dots = bridged.estimate},
                                      lines}});
  if (refused.empty()) return;
  const Dataset dataset = read_dataset(folder);
  const PanoramaReader reader(dataset.source, shape);
  std::vector<std::pair<Panorama, Panorama>> pairs;
  constexpr std::size_t max_pairs = 12;
  for (const MapEdge& edge : refused) {
    if (pairs.size() == max_pairs) break;
    const std::uint64_t first = single.map.nodes[0].view.value;
    pairs.emplace_back(reader.read(dataset.entries[edge.a.value - first].path),
                       reader.read(dataset.entries[edge.b.value - first].path));
  }
  add_plot(result, options.out, "f11_indoor_walk_pairs.svg",
           "Pairs of pictures (one over the other) that pass every check of a loop closure but the "
           "sequence: corridors of one kind on several floors. None of them becomes a closure",
           pairs_picture("indoor_walk_360: pairs that no sequence of views confirms", pairs));
}

}  // namespace

void measure_step_time(const MappingReproductionOptions& options, Executor& executor,
                       Reproduction& result) {
  const simulation::PlaceRecording place = simulation::empty_place(
      simulation::make_scene("loop", {.seed = options.seed}), options.seed, 512, executor);
  const auto views = static_cast<std::size_t>(std::min(60, options.views));
  const auto poses = drive(place, {}, 0.1, views);
  Camera camera;
  camera.model = HyperboloidalModel{};
  camera.image_size = {640, 480};
  camera.centre = {320.0, 240.0};
  camera.rim_radius_px = 230.0;
  camera.inner_radius_px = 40.0;
  std::vector<Image> images;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    images.push_back(
        simulation::take_picture(*place.renderer, poses[i], camera, {}, {}, i, executor));
  }
  const Unwarper unwarper(camera, {80, 512});
  const SignatureExtractor extractor({80, 512}, components);
  SignatureExtractor::Workspace workspace;
  VisualOdometry odometry;
  std::vector<double> all_us;
  std::vector<double> step_us;
  for (const Image& image : images) {
    const auto start = Clock::now();
    FourierSignature signature = extractor.signature(unwarper, image.view(), workspace);
    const auto middle = Clock::now();
    static_cast<void>(odometry.add(OdometryView(std::move(signature))));
    step_us.push_back(microseconds_since(middle));
    all_us.push_back(microseconds_since(start));
  }
  add_row(result, "f11.time.step",
          "time of a step from a mirror image of 640 x 480 to a pose, median",
          1e-3 * median(all_us), "ms", at_most(0.3), std::pair(54.0, 153.0));
  add_row(result, "f11.time.odometry", "of these, from signature to pose", 1e-3 * median(step_us),
          "ms");
  // Figure 6 shows the influence of the components on the time, too.
  viewer::Series times{.label = "signature to pose", .x = {}, .y = {}};
  for (const int count : {6, 10, 15, 20, 32, 64}) {
    const SignatureExtractor extract({80, 512}, count);
    VisualOdometry steps;
    std::vector<double> taken_us;
    for (const Image& image : images) {
      FourierSignature signature = extract.signature(unwarper, image.view(), workspace);
      const auto start = Clock::now();
      static_cast<void>(steps.add(OdometryView(std::move(signature))));
      taken_us.push_back(microseconds_since(start));
    }
    times.add(count, 1e-3 * median(taken_us));
    add_row(result, "f11.time.components_" + std::to_string(count),
            "from signature to pose with " + std::to_string(count) + " components", times.y.back(),
            "ms");
  }
  add_plot(result, options.out, "f11_figure6_time.svg",
           "Figure 6: time of a step against the number of components",
           viewer::LinePlot{.title = "Time from a signature to a pose, median",
                            .x_label = "components",
                            .y_label = "time [ms]",
                            .series = {times}});
}

void reproduce_identical_doors(const MappingReproductionOptions& options, Executor& executor,
                               Reproduction& result) {
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
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(s);
    const simulation::PlaceRecording place = simulation::empty_place(
        simulation::make_scene("corridor", {.seed = seed}), seed, options.columns, executor);
    std::vector<Point2> way;
    for (int round = 0; round < 3; ++round) {
      way.insert(way.end(), place.scene.tour.begin(), place.scene.tour.end());
    }
    const auto recording =
        simulation::record_for_mapping(place, drive(place, way, spacing_m, views), components + 2,
                                       simulation::cheap_wheels(), 1000 * seed, executor);
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

void reproduce_mapping_in_world(const MappingReproductionOptions& options, const std::string& name,
                                Executor& executor, Reproduction& result) {
  constexpr double length_m = 60.0;
  constexpr double spacing_m = 0.15;
  const simulation::PlaceRecording place = simulation::empty_place(
      simulation::read_world(options.data, name), options.seed, options.columns, executor);
  std::vector<double> wheels_m;
  std::vector<double> open_m;
  std::vector<double> closed_m;
  std::vector<double> ground_open_m;
  std::vector<double> ground_m;
  std::vector<double> with_wheels_m;
  std::size_t better = 0;
  std::size_t better_without = 0;
  std::size_t right = 0;
  std::size_t wrong = 0;
  std::vector<viewer::MapPlot> maps;
  for (int run = 0; run < options.runs; ++run) {
    Random random(options.seed, 300 + static_cast<std::uint64_t>(run));
    const auto recording = simulation::record_for_mapping(
        place, two_loops(place, length_m, spacing_m, random), components + 2,
        simulation::cheap_wheels(),
        1000 * options.seed + 10'000 * static_cast<std::uint64_t>(run + 1), executor);
    const auto open = simulation::map_recording(recording, {.mapping = {.close_loops = false}});
    const auto closed = simulation::map_recording(recording, {});
    const VisualOdometryOptions ground{.camera_height_m = place.scene.camera_height_m};
    const auto ground_open = simulation::map_recording(
        recording, {.mapping = {.close_loops = false}, .odometry = ground});
    const auto with_ground = simulation::map_recording(recording, {.odometry = ground});
    const auto with_wheels = simulation::map_recording(recording, {.wheels = true});
    const std::vector<Point2> wheels = positions_of(recording.wheels);
    wheels_m.push_back(rms_m(wheels, open.truth, false));
    open_m.push_back(rms_m(open.estimate, open.truth, true));
    closed_m.push_back(rms_m(closed.estimate, closed.truth, true));
    ground_open_m.push_back(rms_m(ground_open.estimate, ground_open.truth, false));
    ground_m.push_back(rms_m(with_ground.estimate, with_ground.truth, false));
    with_wheels_m.push_back(rms_m(with_wheels.estimate, with_wheels.truth, false));
    better += with_wheels_m.back() < wheels_m.back() ? 1 : 0;
    better_without += ground_m.back() < wheels_m.back() ? 1 : 0;
    for (const auto* mapped : {&closed, &with_ground, &with_wheels}) {
      right += mapped->right_closures;
      wrong += mapped->wrong_closures;
    }
    if (run < 4) {
      viewer::MapPlot map{.title = name + ", path " + std::to_string(run + 1),
                          .layers = viewer::scene_layers(place.scene)};
      map.layers.push_back(
          {.label = "ground truth", .colour = viewer::PlotColour::black, .lines = {open.truth}});
      std::vector<Point2> wheel_line;
      const Alignment wheel_alignment = align(wheels, open.truth);
      for (const Point2& p : wheels) wheel_line.push_back(wheel_alignment.apply(p));
      map.layers.push_back(
          {.label = "wheels", .colour = viewer::PlotColour::vermilion, .lines = {wheel_line}});
      map.layers.push_back(
          {.label = "views alone",
           .colour = viewer::PlotColour::blue,
           .lines = {simulation::laid_over(with_ground.estimate, with_ground.truth)}});
      map.layers.push_back(
          {.label = "views, steps from wheels",
           .colour = viewer::PlotColour::green,
           .lines = {simulation::laid_over(with_wheels.estimate, with_wheels.truth)}});
      maps.push_back(std::move(map));
    }
  }
  const auto runs = static_cast<std::size_t>(options.runs);
  const std::string id = "f11." + name;
  const std::string what = name + ", 60 m with two loops";
  add_median(result, id + ".wheels", what + ": position error (rms) of the wheels of a cheap robot",
             "m", wheels_m);
  add_median(result, id + ".open", what + ": of the views alone, one scale, no closure", "m",
             open_m);
  add_median(result, id + ".closed", what + ": of the views alone, one scale, loops closed", "m",
             closed_m);
  add_median(result, id + ".ground_open",
             what + ": of the views alone, height of the camera known, no closure", "m",
             ground_open_m);
  add_median(result, id + ".ground",
             what + ": of the views alone, height of the camera known, loops closed", "m",
             ground_m);
  add_median(result, id + ".closed_wheels", what + ": with steps from these wheels, loops closed",
             "m", with_wheels_m);
  add_rate(result, id + ".better", what + ": paths on which ours, steps from wheels, is better",
           better, runs, at_least(0.5));
  add_rate(result, id + ".better_without",
           what + ": paths on which ours, views and height of the camera alone, is better",
           better_without, runs);
  add_rate(result, id + ".right_closures", what + ": closures between views at most 1 m apart",
           right, std::max<std::size_t>(1, right + wrong));
  const std::string file = "f11_" + name + ".svg";
  add_plot(result, options.out, file,
           "Paths of 60 m with two loops in " + name + ", laid over the truth", maps, 2);
}

void reproduce_mapped_recordings(const MappingReproductionOptions& options, Executor& executor,
                                 Reproduction& result) {
  if (simulation::has_data(options.data, "sussex_route")) {
    const auto route = read_recording(options.data / "sussex_route", {}, executor);
    const auto mapped =
        simulation::map_recording(route.recording, {.mapping = {.close_loops = false}});
    add_row(result, "f11.sussex.rms",
            "sussex_route, 7 m outdoors: position error (rms), views alone, one scale",
            rms_m(mapped.estimate, mapped.truth, true), "m");
    add_row(result, "f11.sussex.shape", "sussex_route: shape difference",
            simulation::shape_error(mapped.estimate, mapped.truth), "");
    add_plot(
        result, options.out, "f11_sussex_route.svg", "A route outdoors, laid over the tracker's",
        viewer::MapPlot{
            .title = "sussex_route",
            .layers = {
                {.label = "tracker", .colour = viewer::PlotColour::black, .lines = {mapped.truth}},
                {.label = "visual odometry",
                 .colour = viewer::PlotColour::blue,
                 .lines = {simulation::laid_over(mapped.estimate, mapped.truth)}}}});
  }
  if (simulation::has_data(options.data, "indoor_walk_360"))
    map_indoor_walk(options, executor, result);
}

void measure_large_maps(const MappingReproductionOptions& options, Executor& executor,
                        Reproduction& result) {
  // Round after round, each a little beside the others.
  constexpr int columns = 256;
  const simulation::PlaceRecording place = simulation::empty_place(
      simulation::make_scene("loop", {.seed = options.seed}), options.seed, columns, executor);
  Random random(options.seed, 400);
  std::vector<Point2> way;
  const auto rounds = options.max_views / 180 + 2;
  for (int round = 0; round < rounds; ++round) {
    const double aside_m = random.uniform(-0.15, 0.15);
    for (const Point2& p : place.scene.tour) way.push_back({p.x_m + aside_m, p.y_m + aside_m});
  }
  const auto recording = simulation::record_for_mapping(
      place, drive(place, way, 0.1, static_cast<std::size_t>(options.max_views)), components + 2,
      simulation::cheap_wheels(), 1000 * options.seed, executor);
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
    // The mapper keeps view, path length and component of each node for its search for closures.
    constexpr std::size_t passed_node_bytes = 3 * sizeof(double);
    const double bytes = static_cast<double>(
        mapped.map.nodes.size() *
            (static_cast<std::size_t>(2 * recording.views.front().rows() * components) +
             sizeof(MapNode) + passed_node_bytes) +
        mapped.map.edges.size() * (sizeof(MapEdge) + sizeof(PoseEdge)));
    add_row(result, id + ".memory", what + ": packed signatures, nodes and edges", 1e-6 * bytes,
            "MB");
    add_row(result, id + ".shape", what + ": shape difference",
            simulation::shape_error(mapped.estimate, mapped.truth), "");
    add_row(result, id + ".wrong", what + ": closures between views more than 1 m apart",
            static_cast<double>(mapped.wrong_closures), "closures");
  }
}

}  // namespace panonav::lab
