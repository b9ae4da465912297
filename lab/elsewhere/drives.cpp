// Maps, positions and routes of drives: how far they can be believed where nothing was developed.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "lab/elsewhere/experiments.hpp"
#include "lab/runs/tracking_run.hpp"
#include "lab/y03/routes.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "panonav_simulation/recording.hpp"

namespace panonav::lab {

namespace {

constexpr double image_spacing_m = 0.25;  // recommended for a recording
constexpr int max_drive_images = 300;     // of a drive: 75 m
constexpr int max_drives = 3;             // in each place
constexpr int drive_components = 15;
/// Step whose heading is off by more than this has found another solution, as half a turn.
constexpr double wrong_turn_rad = std::numbers::pi / 2.0;
constexpr double max_lateral_offset_m = 0.5;  // of queries beside a drive or route, to either side
constexpr double route_length_m = 20.0;
constexpr double line_spacing_m = 0.1;
/// Quantile of chi squared with two degrees of freedom.
constexpr double square_95 = 5.991;

/// Squared error of a position over the covariance xx, xy, yy.
double normalised_square(Point2 error, double xx, double xy, double yy) {
  return (yy * error.x_m * error.x_m - 2.0 * xy * error.x_m * error.y_m +
          xx * error.y_m * error.y_m) /
         (xx * yy - xy * xy);
}

/// Results of the maps of all drives.
struct DriveMaps {
  std::vector<double> by_images;  ///< shape differences without wheels
  std::vector<double> with_wheels;
  std::vector<double> wheels_alone;
  std::size_t worse_than_wheels = 0;
  std::size_t steps = 0;
  std::size_t wrong_turns = 0;
  std::array<std::size_t, 2> right_closures{};  ///< without and with wheels
  std::array<std::size_t, 2> wrong_closures{};

  void add(const simulation::MappingRecording& drive, const simulation::MappedRecording& images,
           const simulation::MappedRecording& wheels) {
    by_images.push_back(simulation::shape_error(images.estimate, images.truth));
    with_wheels.push_back(simulation::shape_error(wheels.estimate, wheels.truth));
    wheels_alone.push_back(simulation::shape_error(positions_of(drive.wheels), wheels.truth));
    worse_than_wheels += with_wheels.back() > wheels_alone.back() ? 1 : 0;
    for (const TopologicalMap::Edge& edge : images.map.edges) {
      if (edge.kind != Link::Kind::sequence) continue;
      const std::size_t first = images.map.nodes.front().view.value;
      const Pose2 truth =
          inverse(drive.truth[edge.a.value - first]) * drive.truth[edge.b.value - first];
      ++steps;
      wrong_turns +=
          std::abs(angle_difference(edge.a_from_b.heading_rad, truth.heading_rad)) > wrong_turn_rad
              ? 1
              : 0;
    }
    for (const auto& [index, mapped] : {std::pair(0U, &images), {1U, &wheels}}) {
      right_closures[index] += mapped->right_closures;
      wrong_closures[index] += mapped->wrong_closures;
    }
  }
};

/// Statements about positions, and how many of them were true.
struct Statements {
  std::size_t count = 0;
  std::size_t within_radius = 0;
  std::size_t within_ellipse = 0;
};

/// Asks for places beside a drive whose images are memorised with their true poses.
void ask_beside(const simulation::PlaceRecording& place, const std::vector<Pose2>& drive, int count,
                std::uint64_t seed, Executor& executor, Statements& statements) {
  const auto seen = simulation::capture_views(place, place.rendering, drive, seed, {}, executor);
  std::vector<ReferencePose> poses;
  std::vector<const Panorama*> views;
  for (const simulation::PlacedView& view : seen) {
    poses.push_back({view.pose.x_m, view.pose.y_m, view.pose.heading_rad});
    views.push_back(&view.panorama);
  }
  const VisualMemory memory = make_memory_of_views(poses, views, executor);
  const Localiser localiser(memory);
  Random random(seed, 2);
  std::vector<Pose2> queries;
  constexpr int max_tries = 100;
  for (int i = 0; i < count * max_tries && queries.size() < static_cast<std::size_t>(count); ++i) {
    const Pose2 pose = drive[random.index(drive.size())] *
                       Pose2{random.uniform(-0.5 * image_spacing_m, 0.5 * image_spacing_m),
                             random.uniform(-max_lateral_offset_m, max_lateral_offset_m),
                             random.uniform(-std::numbers::pi, std::numbers::pi)};
    if (place.free_space->is_free(pose.position())) queries.push_back(pose);
  }
  const auto asked =
      simulation::capture_views(place, place.rendering, queries, seed + drive.size(), {}, executor);
  for (const simulation::PlacedView& query : asked) {
    const Place found = localiser.localise(compute_packed_signature(query.panorama, memory));
    if (!found.position || !found.position->radius_m) continue;
    const Point2 error{found.position->x_m - query.pose.x_m, found.position->y_m - query.pose.y_m};
    const auto [xx, xy, yy] = found.position->covariance();
    ++statements.count;
    statements.within_radius +=
        std::hypot(error.x_m, error.y_m) <= *found.position->radius_m ? 1 : 0;
    statements.within_ellipse += normalised_square(error, xx, xy, yy) <= square_95 ? 1 : 0;
  }
}

/// Searches for a robot beside a route, by single lines.
void search_on_route(const RouteScene& place, int count, std::uint64_t seed, Executor& executor,
                     Statements& statements) {
  const auto path = plan_curved_route(place, route_length_m, line_spacing_m, seed);
  if (path.size() < 2) return;
  const RouteTracker tracker(record_route(place, path, seed, executor));
  Random random(seed, 3);
  for (int i = 0; i < count; ++i) {
    const Pose2 truth = path[random.index(path.size())] *
                        Pose2{random.uniform(0.0, line_spacing_m),
                              random.uniform(-max_lateral_offset_m, max_lateral_offset_m),
                              random.uniform(-std::numbers::pi, std::numbers::pi)};
    const std::uint64_t noise = random.next();
    if (!place.free_space->is_free(truth.position())) continue;
    const auto fix =
        tracker.search(simulation::capture_line(*place.renderer, truth, place.camera, noise));
    if (!fix) continue;
    const auto& c = fix->covariance;
    ++statements.count;
    statements.within_ellipse +=
        normalised_square({fix->pose.x_m - truth.x_m, fix->pose.y_m - truth.y_m}, c[0], c[1],
                          c[4]) <= square_95
            ? 1
            : 0;
  }
}

void report_maps(const DriveMaps& maps, Reproduction& result) {
  const std::string id = "elsewhere.drives.maps";
  const std::string images = "maps of drives by images alone: ";
  const std::string wheels = "maps of drives with wheels: ";
  add_median(result, id + ".images.median", images + "shape difference", "", maps.by_images,
             at_most(0.05));
  add_row(result, id + ".images.worst", images + "largest shape difference",
          *std::ranges::max_element(maps.by_images), "", at_most(0.15));
  add_rate(result, id + ".images.wrong_turns", images + "steps that turn by over 90 degrees more",
           maps.wrong_turns, maps.steps, at_most(0.0));
  add_rate(result, id + ".images.wrong_closures", images + "closures of views over 1 m apart",
           maps.wrong_closures[0], maps.wrong_closures[0] + maps.right_closures[0]);
  add_median(result, id + ".wheels.median", wheels + "shape difference", "", maps.with_wheels);
  add_median(result, id + ".wheels.alone", "the same of the wheels alone", "", maps.wheels_alone);
  add_rate(result, id + ".wheels.worse", wheels + "worse than the wheels alone",
           maps.worse_than_wheels, maps.with_wheels.size(), at_most(0.0));
  add_rate(result, id + ".wheels.wrong_closures", wheels + "closures of views over 1 m apart",
           maps.wrong_closures[1], maps.wrong_closures[1] + maps.right_closures[1], at_most(0.002));
}

}  // namespace

void ElsewhereExperiments::reproduce_drives() {
  DriveMaps maps;
  const auto count = static_cast<std::size_t>(options.queries);
  for (const RecordedGround& ground : grounds) {
    const simulation::PlaceRecording& place = ground.variants.front();
    Statements beside;
    std::vector<std::vector<Pose2>> drives;
    for (int i = 0; i < std::min(options.walks, max_drives); ++i) {
      const auto planned = simulation::plan_recording(
          place.scene, *place.free_space,
          {.path = simulation::RecordingPath::walk,
           .heading = simulation::RecordingHeading::path,
           .spacing_m = image_spacing_m,
           .poses = std::min(options.walk_pictures, max_drive_images)},
          {}, Random(options.seed, 10 + static_cast<std::uint64_t>(i)).next());
      std::vector<Pose2> poses;
      for (const simulation::RecordedPose& pose : planned) poses.push_back(pose.pose);
      drives.push_back(std::move(poses));
    }
    std::vector<simulation::MappingRecording> recordings;
    for (std::size_t i = 0; i < drives.size(); ++i) {
      const std::uint64_t seed = options.seed + 1000 * (i + 1);
      recordings.push_back(simulation::record_for_mapping(place, drives[i], drive_components,
                                                          OdometryNoise{}, seed, executor));
      ask_beside(place, drives[i], options.queries, seed, executor, beside);
    }
    const auto mapped = simulation::make_each(executor, 2 * recordings.size(), [&](std::size_t i) {
      return simulation::map_recording(recordings[i / 2],
                                       {.components = drive_components, .wheels = i % 2 == 1});
    });
    for (std::size_t i = 0; i < recordings.size(); ++i) {
      maps.add(recordings[i], mapped[2 * i], mapped[2 * i + 1]);
    }
    const std::string id = "elsewhere.drives." + ground.name;
    const std::string what = ground.name +
                             ", places up to 0.5 m beside a drive with an image every " +
                             format_centimetres(image_spacing_m) + ": ";
    if (beside.count > 0) {
      add_rate(result, id + ".radius", what + "positions within the stated 95 % radius",
               beside.within_radius, beside.count, at_least(0.9));
      add_rate(result, id + ".ellipse", what + "positions within the stated 95 % ellipse",
               beside.within_ellipse, beside.count, at_least(0.9));
    }
    Statements on_route;
    const RouteScene route_place = make_route_scene(place.scene, ground.name, executor);
    search_on_route(route_place, 2 * static_cast<int>(count), options.seed, executor, on_route);
    if (on_route.count > 0) {
      add_rate(result, id + ".route",
               ground.name +
                   ", up to 0.5 m beside a route of 20 m: poses found by one line within "
                   "the 95 % ellipse of their covariance",
               on_route.within_ellipse, on_route.count, at_least(0.9));
    }
  }
  report_maps(maps, result);
}

}  // namespace panonav::lab
