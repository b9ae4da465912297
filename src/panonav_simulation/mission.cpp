#include "panonav_simulation/mission.hpp"
#include "panonav_simulation/make_each.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/motion/trajectory.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/signature/fourier_signature.hpp"
#include "panonav_simulation/line_camera.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::simulation {

namespace {

// Smallest clearance, in addition to the robot's radius, of the references that are recorded.
constexpr double min_reference_clearance_m = 0.2;
// Largest distance between the lines of a route.
constexpr double line_spacing_m = 0.1;

std::vector<FourierSignature> sense_views(const MissionPlace& place,
                                          const std::vector<Pose2>& poses, std::uint64_t seed,
                                          Executor& executor) {
  return make_each(executor, poses.size(), [&](std::size_t i) {
    return sense_view(place, poses[i], Random(seed, i).next());
  });
}

// Makes an empty memory whose full scale is the largest magnitude of `views`, without component 0.
VisualMemory make_empty_memory(const std::vector<FourierSignature>& views) {
  float largest = 0.0F;
  for (const FourierSignature& view : views) {
    largest = std::max(largest, *std::ranges::max_element(view.magnitudes().subspan(
                                    static_cast<std::size_t>(view.rows()))));
  }
  return {{views.front().rows(), views.front().components()},
          largest > 0.0F ? largest : 1.0F,
          views.front().elevations()};
}

// Records a route along the poses of the map's largest component up to a gap.
RoutePanorama record_route(const MissionPlace& place, const std::vector<Pose2>& poses,
                           const TopologicalMap& map, std::uint64_t seed, Executor& executor) {
  struct RouteStop {
    Pose2 truth;
    Pose2 mapped;
  };
  std::vector<RouteStop> stops;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    if (map.nodes[i].component != 0) {
      if (stops.empty()) continue;
      break;
    }
    const RouteStop next{poses[i], map.nodes[i].pose};
    if (stops.empty()) {
      stops.push_back(next);
      continue;
    }
    const RouteStop last = stops.back();
    const double far_m = distance(last.mapped.position(), next.mapped.position());
    const int steps = std::max(1, static_cast<int>(std::ceil(far_m / line_spacing_m)));
    for (int k = 1; k <= steps; ++k) {
      const double share = static_cast<double>(k) / steps;
      stops.push_back({interpolate(last.truth, next.truth, share),
                       interpolate(last.mapped, next.mapped, share)});
    }
  }
  auto lines = make_each(executor, stops.size(), [&](std::size_t i) {
    return place.line(stops[i].truth, Random(seed, i).next());
  });
  RoutePanorama route(static_cast<int>(lines.front().size()));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    static_cast<void>(route.append(stops[i].mapped, std::span<const float>(lines[i])));
  }
  return route;
}

// Returns the length of the shortest path; the straight distance if there is no path.
double shortest_path_m(const FreeSpace& space, Point2 from, Point2 to) {
  if (!std::isfinite(to.x_m) || !std::isfinite(to.y_m)) return distance(from, to);
  const auto path = space.shortest_path(from, to);
  return path ? path_length_m(*path) : distance(from, to);
}

}  // namespace

MissionPlace make_mission_place(Scene scene, Executor& executor, std::optional<Point2> inside) {
  return {make_place(std::move(scene), executor, inside)};
}

std::function<std::vector<float>(const Pose2& pose, std::uint64_t seed)> make_line_sensor(
    const MissionPlace& place) {
  const auto camera =
      std::make_shared<const LineCamera>(make_line_camera(place.scene.camera_height_m));
  return [camera, renderer = place.renderer](const Pose2& pose, std::uint64_t seed) {
    return capture_line(*renderer, pose, *camera, seed);
  };
}

FourierSignature sense_view(const MissionPlace& place, const Pose2& pose, std::uint64_t seed,
                            const People* people) {
  if (place.view_sensor) return place.view_sensor(pose, seed);
  Executor here(1);
  const double height_m = place.scene.camera_height_m;
  // People are painted into panoramas: before the sensor's noise, unless the noise is that of the
  // mirror image.
  const bool is_unwarped = place.rendering.unwarper != nullptr;
  const FrameOptions frame{.camera_height_m = height_m};
  Panorama view = is_unwarped || people == nullptr
                      ? capture_panorama(*place.renderer, pose, place.rendering, frame,
                                         place.sensor, seed, here)
                      : place.renderer->render_panorama({.pose = pose, .height_m = height_m},
                                                        place.rendering, here);
  if (people != nullptr) people->paint(view, pose, height_m);
  if (people != nullptr && !is_unwarped) view = apply_sensor(std::move(view), place.sensor, seed);
  return compute_signature(preprocess(std::move(view), {}), place.components);
}

RememberedPlace memorise_grid(const MissionPlace& place, double spacing_m, std::uint64_t seed,
                              Executor& executor) {
  Random random(seed, 1);
  std::vector<Pose2> poses;
  for (const GridPosition& at : place.free_space->grid(spacing_m)) {
    const double heading_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
    if (place.free_space->clearance_m(at.position) <
        place.scene.robot_radius_m + min_reference_clearance_m)
      continue;
    poses.push_back({at.position.x_m, at.position.y_m, heading_rad});
  }
  const auto views = sense_views(place, poses, seed, executor);
  VisualMemory memory = make_empty_memory(views);
  for (std::size_t i = 0; i < views.size(); ++i) {
    static_cast<void>(memory.append(views[i], {.name = std::to_string(i)}));
  }
  const Lattice lattice = arrange(memory, {}, {}, executor);
  RememberedPlace remembered{std::move(memory), graph_from_lattice(lattice), std::move(poses),
                             spacing_m};
  for (const Lattice::Node& node : lattice.nodes) {
    remembered.arranged.push_back(node.component == 0 ? std::optional(node.pose.position())
                                                      : std::nullopt);
  }
  return remembered;
}

RememberedPlace memorise_drive(const MissionPlace& place, const std::vector<Pose2>& poses,
                               const OdometryNoise& wheels, std::uint64_t seed,
                               Executor& executor) {
  const auto views = sense_views(place, poses, seed, executor);
  const auto odometry = simulate_odometry(poses, wheels, seed);
  VisualMemory memory = make_empty_memory(views);
  TopologicalMapper mapper(memory);
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::optional<Pose2> moved;
    if (i > 0) moved = inverse(odometry[i - 1]) * odometry[i];
    static_cast<void>(mapper.add(memory.append(views[i], {.name = std::to_string(i)}),
                                 OdometryView(views[i]), moved));
  }
  mapper.finish();
  const TopologicalMap map = mapper.map();
  for (const TopologicalMap::Node& node : map.nodes) {
    if (node.component != 0) continue;
    memory.set_pose(node.view, ReferencePose{node.pose.x_m, node.pose.y_m, node.pose.heading_rad});
  }
  const double path_m = path_length_m(poses);
  NavigationGraph graph = make_graph_from_map_and_neighbours(map, memory, executor);
  std::vector<KnownRoute> routes;
  if (place.line) {
    std::vector<KnownRoute::View> placed;
    for (const TopologicalMap::Node& node : map.nodes) {
      if (node.component == 0) placed.push_back({node.view, node.pose});
    }
    const std::uint64_t seed_of_lines = Random(seed, 1).next();
    routes.push_back(
        make_known_route(record_route(place, poses, map, seed_of_lines, executor), placed));
  }
  return {std::move(memory), std::move(graph), poses,
          path_m / static_cast<double>(std::max<std::size_t>(1, poses.size() - 1)),
          std::move(routes)};
}

namespace {

// Drives past obstacles, by the nearest free direction; after a contact before half of the distance
// it backs off and tries the next one. True if an obstacle stopped the robot for good.
bool drive_past_obstacles(MissionRobot& robot, const BaseOptions& base, double direct_rad,
                          double distance_m) {
  constexpr int max_contacts = 12;  // directions of `find_free_direction`
  for (int contacts = 0; contacts < max_contacts; ++contacts) {
    const auto free_rad = robot.find_free_direction(direct_rad, distance_m);
    if (!free_rad) return true;
    const double before_m = robot.travelled_m();
    const double heading_rad = robot.odometry().heading_rad;
    const double length_m = (*free_rad == direct_rad ? 1.0 : 0.5) * distance_m;
    if (!drive_step(robot, base, *free_rad, length_m)) return false;
    if (robot.obstacle_sensor() == ObstacleSensor::truth) return true;
    const bool has_advanced = robot.travelled_m() - before_m >= 0.5 * length_m;
    robot.back_off();
    if (has_advanced) return false;
    direct_rad = wrap_angle(direct_rad - (robot.odometry().heading_rad - heading_rad));
  }
  return true;
}

/// Localises by particles; returns the nearest reference, nullopt while it is not localised.
class NearestReferenceEstimator {
 public:
  NearestReferenceEstimator(const VisualMemory& memory, const OdometryNoise& odometry)
      : memory_(&memory), filter_(memory, {}, odometry) {}

  std::optional<ViewId> observe(const Pose2& moved, const FourierSignature& view) {
    filter_.move(moved);
    const auto estimate = filter_.observe(pack(view, memory_->full_scale()));
    if (estimate.state != LocalisationState::localised || !estimate.pose) return std::nullopt;
    return filter_.find_nearest_view(estimate.pose->position());
  }

 private:
  const VisualMemory* memory_;
  MonteCarloLocaliser filter_;
};

/// Runs consecutive missions of one robot.
class MissionRunner {
 public:
  MissionRunner(const MissionPlace& place, const RememberedPlace& remembered, const Pose2& start,
                const MissionOptions& options, std::uint64_t seed)
      : place_(place),
        remembered_(remembered),
        options_(options),
        robot_(place, options.base, options.motion, start, seed, options.people, options.obstacles),
        noise_of_views_(seed, 2),
        noise_of_lines_(seed, 4) {
    if (options.monte_carlo) estimator_.emplace(remembered.memory, options.motion);
  }

  MissionRun run(Navigator& navigator, ViewId goal_view, const std::optional<Pose2>& kidnapped_to,
                 const StepReport& report_step, const GoalSource& other_goal) {
    Point2 goal = remembered_.truth.at(*remembered_.graph.node_of(goal_view)).position();
    const FreeSpace& space = *place_.free_space;
    MissionRun run;
    run.shortest_m = shortest_path_m(space, robot_.pose().position(), goal);
    const double start_travelled_m = robot_.travelled_m();
    const std::size_t start_contacts = robot_.contacts();
    const double kidnapping_travelled_m = start_travelled_m + 0.5 * run.shortest_m;
    navigator.set_goal(goal_view);
    for (;;) {
      run.path.push_back(robot_.pose());
      const NavigationDecision decision = step(navigator);
      run.decisions.push_back(decision);
      if (report_step) report_step(decision, robot_.pose());
      if (decision.state != NavigationDecision::State::moving) {
        run.end = decision.state;
        break;
      }
      if (const auto other = other_goal ? other_goal() : std::nullopt) {
        const Point2 here = robot_.pose().position();
        const Point2 there = remembered_.truth.at(*remembered_.graph.node_of(*other)).position();
        run.shortest_m += shortest_path_m(space, here, there) - shortest_path_m(space, here, goal);
        goal = there;
        continue;  // decide again at this pose
      }
      move(decision);
      if (kidnapped_to && !run.kidnapped_at && robot_.travelled_m() >= kidnapping_travelled_m) {
        run.kidnapped_at = run.path.size() - 1;
        run.shortest_m += shortest_path_m(space, kidnapped_to->position(), goal) -
                          shortest_path_m(space, robot_.pose().position(), goal);
        robot_.teleport_to(*kidnapped_to);
        obstacle_ = false;
      }
    }
    run.travelled_m = robot_.travelled_m() - start_travelled_m;
    run.contacts = robot_.contacts() - start_contacts;
    run.end_distance_m = distance(robot_.pose().position(), goal);
    return run;
  }

 private:
  NavigationDecision step(Navigator& navigator) {
    const FourierSignature view =
        sense_view(place_, robot_.pose(), noise_of_views_.next(), &robot_.people());
    RobotReport report{.obstacle = std::exchange(obstacle_, false)};
    const Pose2 moved = robot_.take_odometry();
    if (estimator_) {
      // The estimate is passed on only when the navigator is in doubt about the place.
      const auto estimate = estimator_->observe(moved, view);
      if (in_doubt_) report.estimate = estimate;
    }
    std::vector<float> line;
    if (place_.line && !navigator.routes().empty()) {
      line = place_.line(robot_.pose(), noise_of_lines_.next());
      report.line = line;
      report.moved = moved;
    }
    const NavigationDecision decision = navigator.observe(view, report);
    in_doubt_ = std::ranges::any_of(decision.events, [](NavigationDecision::Event event) {
      return event == NavigationDecision::Event::unknown_place ||
             event == NavigationDecision::Event::relocalised ||
             event == NavigationDecision::Event::kidnapped;
    });
    return decision;
  }

  void move(const NavigationDecision& decision) {
    obstacle_ =
        drive_past_obstacles(robot_, options_.base, decision.direction_rad, decision.advance_m);
    // Wait, because a person in the path may move away.
    constexpr double pause_s = 1.0;
    if (obstacle_ || decision.advance_m == 0.0) robot_.wait(pause_s);
  }

  const MissionPlace& place_;
  const RememberedPlace& remembered_;
  const MissionOptions& options_;
  MissionRobot robot_;
  Random noise_of_views_;
  Random noise_of_lines_;
  std::optional<NearestReferenceEstimator> estimator_;
  bool in_doubt_ = true;  // about the place, after the last step
  bool obstacle_ = false;
};

void require_goal(const RememberedPlace& remembered, ViewId goal) {
  if (remembered.graph.node_of(goal)) return;
  throw ContractError("goal", std::to_string(goal.value), "a view of the graph");
}

}  // namespace

std::string explain_other_ends(const std::map<NavigationDecision::State, std::size_t>& ends,
                               std::size_t false_arrivals, NavigationDecision::State expected) {
  std::string text;
  const auto add = [&](std::size_t count, const std::string& end) {
    if (count == 0) return;
    text += (text.empty() ? "of the other runs, " : ", ") + std::to_string(count) + " " + end;
  };
  if (expected == NavigationDecision::State::arrived)
    add(false_arrivals, "report an arrival but are farther off");
  for (const auto& [end, count] : ends) {
    if (end != expected) add(count, "end as " + std::string(to_string(end)));
  }
  return text;
}

MissionRun run_mission(const MissionPlace& place, const RememberedPlace& remembered,
                       Navigator& navigator, const Mission& mission, const MissionOptions& options,
                       std::uint64_t seed, const StepReport& report_step,
                       const GoalSource& other_goal) {
  require_goal(remembered, mission.goal);
  navigator.forget_place();
  return MissionRunner(place, remembered, mission.start, options, seed)
      .run(navigator, mission.goal, mission.kidnapped_to, report_step, other_goal);
}

std::vector<MissionRun> run_tour(const MissionPlace& place, const RememberedPlace& remembered,
                                 Navigator& navigator, const Pose2& start,
                                 std::span<const ViewId> goals, const MissionOptions& options,
                                 std::uint64_t seed) {
  for (const ViewId goal : goals) require_goal(remembered, goal);
  navigator.forget_place();
  MissionRunner runner(place, remembered, start, options, seed);
  std::vector<MissionRun> runs;
  for (const ViewId goal : goals) {
    runs.push_back(runner.run(navigator, goal, std::nullopt, {}, {}));
    // A robot that ended lost must relocalise, and not start from its last, doubtful estimate.
    if (runs.back().end == NavigationDecision::State::lost) navigator.forget_place();
  }
  return runs;
}

std::vector<MissionRun> run_missions(const MissionPlace& place, const RememberedPlace& remembered,
                                     const std::vector<Mission>& missions,
                                     const MissionOptions& options, std::uint64_t seed,
                                     Executor& executor) {
  const AreaPlanner planner(remembered.graph, options.planner);
  const MemoryViewSource source(remembered.memory);
  return make_each(executor, missions.size(), [&](std::size_t i) {
    Navigator navigator(source, planner, options.navigator);
    navigator.set_routes(remembered.routes);
    return run_mission(place, remembered, navigator, missions[i], options, Random(seed, i).next());
  });
}

std::vector<Mission> sample_missions(const MissionPlace& place, const RememberedPlace& remembered,
                                     const RandomMissionOptions& options, std::uint64_t seed) {
  require(options.count >= 0, "missions", options.count, ">= 0");
  require(options.max_distance_m > 0.0, "distance from a reference", options.max_distance_m, "> 0");
  Random random(seed, 3);
  const FreeSpace& space = *place.free_space;
  const auto sample_pose = [&] {
    if (!std::isfinite(options.max_distance_m)) return space.random_pose(random);
    for (;;) {
      const Pose2& reference = remembered.truth[random.index(remembered.truth.size())];
      const double off_m = options.max_distance_m * std::sqrt(random.uniform());
      const double direction_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
      const Pose2 there{reference.x_m + off_m * std::cos(direction_rad),
                        reference.y_m + off_m * std::sin(direction_rad),
                        random.uniform(-std::numbers::pi, std::numbers::pi)};
      if (space.is_free_between(reference.position(), there.position())) return there;
    }
  };
  std::vector<Mission> missions;
  const double min_m = 2.0 * remembered.spacing_m;
  while (missions.size() < static_cast<std::size_t>(options.count)) {
    const std::size_t goal = random.index(remembered.truth.size());
    Mission mission{remembered.graph.view(goal), sample_pose(), {}};
    if (options.kidnapped) mission.kidnapped_to = sample_pose();
    if (distance(mission.start.position(), remembered.truth[goal].position()) < min_m) continue;
    missions.push_back(mission);
  }
  return missions;
}

}  // namespace panonav::simulation
