#include "panonav/evaluation/mission.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/evaluation/mapping_run.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/signature/fourier_signature.hpp"
#include "panonav/simulation/recording.hpp"

namespace panonav {

namespace {

constexpr double pi = std::numbers::pi;
// Between robot and things where references are taken.
constexpr double room_m = 0.2;

std::vector<FourierSignature> see_all(const MissionPlace& place, const std::vector<Pose2>& poses,
                                      std::uint64_t seed, Executor& executor) {
  std::vector<std::optional<FourierSignature>> seen(poses.size());
  executor.for_chunks(poses.size(), 4, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      seen[i] = see(place, poses[i], Random(seed, i).next());
    }
  });
  std::vector<FourierSignature> views;
  for (auto& view : seen) views.push_back(std::move(*view));
  return views;
}

// Without views; packs so that the largest magnitude of these just fits.
VisualMemory empty_memory(const std::vector<FourierSignature>& views) {
  float largest = 0.0F;
  for (const FourierSignature& view : views) {
    largest = std::max(largest, *std::ranges::max_element(view.magnitudes().subspan(
                                    static_cast<std::size_t>(view.rows()))));
  }
  return {{views.front().rows(), views.front().components()},
          largest > 0.0F ? largest : 1.0F,
          views.front().elevations()};
}

// Whether the robot touches nothing on the straight way. Scenes name areas to drive in, too, whose
// borders are nothing to touch.
bool has_room(const FreeSpace& space, double robot_radius_m, Point2 from, Point2 to) {
  constexpr double fine_m = 0.01;
  const int steps = std::max(1, static_cast<int>(std::ceil(distance(from, to) / fine_m)));
  for (int i = 1; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    if (space.clearance_m({from.x_m + share * (to.x_m - from.x_m),
                           from.y_m + share * (to.y_m - from.y_m)}) < robot_radius_m) {
      return false;
    }
  }
  return true;
}

// The shortest way, or the straight one where the map of free places has none.
double shortest_way_m(const FreeSpace& space, Point2 from, Point2 to) {
  if (!std::isfinite(to.x_m) || !std::isfinite(to.y_m)) return distance(from, to);
  const auto way = space.shortest_path(from, to);
  if (!way) return distance(from, to);
  double length = 0.0;
  for (std::size_t i = 1; i < way->size(); ++i) length += distance((*way)[i - 1], (*way)[i]);
  return length;
}

}  // namespace

MissionPlace make_mission_place(Scene scene, Executor& executor, std::optional<Point2> inside) {
  MissionPlace place;
  place.scene = std::move(scene);
  place.free_space =
      std::make_shared<const FreeSpace>(place.scene, free_space_options(place.scene), inside);
  place.renderer = std::make_shared<const Renderer>(place.scene, RendererOptions{}, executor);
  return place;
}

FourierSignature see(const MissionPlace& place, const Pose2& pose, std::uint64_t seed) {
  if (place.sight) return place.sight(pose, seed);
  Executor here(1);
  const FrameOptions frame{.camera_height_m = place.scene.camera_height_m};
  return compute_signature(preprocess(take_panorama(*place.renderer, pose, place.rendering, frame,
                                                    place.sensor, seed, here),
                                      {}),
                           place.components);
}

RememberedPlace remember_grid(const MissionPlace& place, double spacing_m, std::uint64_t seed,
                              Executor& executor) {
  Random random(seed, 1);
  std::vector<Pose2> poses;
  for (const GridPosition& at : place.free_space->grid(spacing_m)) {
    const double heading_rad = random.uniform(-pi, pi);
    if (place.free_space->clearance_m(at.position) < place.scene.robot_radius_m + room_m) continue;
    poses.push_back({at.position.x_m, at.position.y_m, heading_rad});
  }
  const auto views = see_all(place, poses, seed, executor);
  VisualMemory memory = empty_memory(views);
  for (std::size_t i = 0; i < views.size(); ++i) {
    static_cast<void>(memory.append(views[i], {.name = std::to_string(i)}));
  }
  const Lattice lattice = arrange(memory, {}, {}, executor);
  return {std::move(memory), navigation_graph(lattice), std::move(poses), spacing_m};
}

RememberedPlace remember_drive(const MissionPlace& place, const std::vector<Pose2>& poses,
                               const OdometryNoise& wheels, std::uint64_t seed,
                               Executor& executor) {
  const auto views = see_all(place, poses, seed, executor);
  const auto told = simulate_odometry(poses, wheels, seed);
  VisualMemory memory = empty_memory(views);
  TopologicalMapper mapper(memory);
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::optional<Pose2> moved;
    if (i > 0) moved = inverse(told[i - 1]) * told[i];
    static_cast<void>(mapper.add(memory.append(views[i], {.name = std::to_string(i)}),
                                 OdometryView(views[i]), moved));
  }
  mapper.finish();
  const TopologicalMap map = mapper.map();
  double way_m = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    way_m += distance(poses[i - 1].position(), poses[i].position());
  }
  NavigationGraph graph = navigation_graph(map, memory, executor);
  return {std::move(memory), std::move(graph), poses,
          way_m / static_cast<double>(std::max<std::size_t>(1, poses.size() - 1))};
}

MissionRobot::MissionRobot(const MissionPlace& place, const BaseOptions& base,
                           const OdometryNoise& motion, const Pose2& start, std::uint64_t seed)
    : space_(place.free_space.get()),
      robot_radius_m_(place.scene.robot_radius_m),
      base_(base),
      motion_(motion),
      pose_(start),
      random_(seed, 1) {
  validate(base_);
  motion_.drive = base_.drive;
  validate(motion_);
}

void MissionRobot::command(const Velocity& velocity) {
  const Pose2 step = sample_step(motion_after(velocity, base_.period_s), motion_, random_);
  const Pose2 there = pose_ * step;
  if (!has_room(*space_, robot_radius_m_, pose_.position(), there.position())) {
    // It touches something: it turns, but does not move.
    obstacle_ = true;
    pose_.heading_rad = there.heading_rad;
    return;
  }
  travelled_m_ += std::hypot(step.x_m, step.y_m);
  pose_ = there;
}

std::optional<double> MissionRobot::free_direction(double wanted_rad, double distance_m) {
  const auto is_open = [&](double direction_rad, double way_m) {
    return has_room(
        *space_, robot_radius_m_, pose_.position(),
        pose_ * Point2{way_m * std::cos(direction_rad), way_m * std::sin(direction_rad)});
  };
  if (is_open(wanted_rad, distance_m)) {
    side_ = 0;
    return wanted_rad;
  }
  const double apart_rad = radians(15.0);
  // Farther round it would turn back: whoever sends it must know that the way is shut.
  constexpr int feelers_each_side = 6;
  const int kept = side_;
  for (int i = 1; i <= feelers_each_side; ++i) {
    for (const int side : {1, -1}) {
      if (kept != 0 && side != kept) continue;
      const double direction_rad = wanted_rad + side * i * apart_rad;
      if (!is_open(direction_rad, 0.5 * distance_m)) continue;
      side_ = side;
      return wrap_angle(direction_rad);
    }
  }
  side_ = -kept;
  return std::nullopt;
}

bool MissionRobot::take_obstacle() noexcept {
  return std::exchange(obstacle_, false);
}

namespace {

// To a point as far as the robot knows its own speeds, until it is there, something stops it or it
// should long be there. Returns whether it was stopped.
bool drive(MissionRobot& robot, const BaseOptions& base, double direction_rad, double distance_m) {
  Point2 target{distance_m * std::cos(direction_rad), distance_m * std::sin(direction_rad)};
  constexpr double near_m = 0.003;
  const double longest_s = 2.0 * (pi / base.turn_rad_s + distance_m / base.speed_m_s) + 1.0;
  for (double time_s = 0.0; time_s < longest_s; time_s += base.period_s) {
    const double left_m = std::hypot(target.x_m, target.y_m);
    if (left_m <= near_m) return false;
    const Velocity velocity = command_towards(std::atan2(target.y_m, target.x_m), left_m, base);
    robot.command(velocity);
    if (robot.take_obstacle()) return true;
    target = remaining_way(target, motion_after(velocity, base.period_s));
  }
  return false;
}

}  // namespace

MissionRun run_mission(const MissionPlace& place, const RememberedPlace& remembered,
                       Navigator& navigator, const Mission& mission, const MissionOptions& options,
                       std::uint64_t seed, const LookReport& report_look) {
  const auto node = remembered.graph.node_of(mission.goal);
  if (!node) throw ContractError("goal", std::to_string(mission.goal.value), "a view of the graph");
  const Point2 goal = remembered.truth.at(*node).position();
  const FreeSpace& space = *place.free_space;
  MissionRobot robot(place, options.base, options.motion, mission.start, seed);
  Random noise_of_views(seed, 2);
  MissionRun run;
  run.shortest_m = shortest_way_m(space, mission.start.position(), goal);
  const double carried_after_m = 0.5 * run.shortest_m;
  navigator.forget_place();
  navigator.set_goal(mission.goal);
  RobotReport report;
  for (;;) {
    run.path.push_back(robot.pose());
    const NavigationDecision decision =
        navigator.look(see(place, robot.pose(), noise_of_views.next()), report);
    run.decisions.push_back(decision);
    if (report_look) report_look(decision, robot.pose());
    if (decision.state != NavigationState::moving) {
      run.end = decision.state;
      break;
    }
    const auto free_rad = robot.free_direction(decision.direction_rad, decision.advance_m);
    report.obstacle = !free_rad;
    if (free_rad) {
      const bool wanted = *free_rad == decision.direction_rad;
      report.obstacle =
          drive(robot, options.base, *free_rad, (wanted ? 1.0 : 0.5) * decision.advance_m);
    }
    if (mission.carried_to && !run.carried_at && robot.travelled_m() >= carried_after_m) {
      run.carried_at = run.path.size() - 1;
      run.shortest_m += shortest_way_m(space, mission.carried_to->position(), goal) -
                        shortest_way_m(space, robot.pose().position(), goal);
      robot.carry_to(*mission.carried_to);
      report.obstacle = false;
    }
  }
  run.travelled_m = robot.travelled_m();
  run.end_distance_m = distance(robot.pose().position(), goal);
  return run;
}

std::vector<MissionRun> run_missions(const MissionPlace& place, const RememberedPlace& remembered,
                                     const std::vector<Mission>& missions,
                                     const MissionOptions& options, std::uint64_t seed,
                                     Executor& executor) {
  std::vector<MissionRun> runs(missions.size());
  const AreaPlanner planner(remembered.graph, options.planner);
  const MemoryViewSource source(remembered.memory);
  executor.for_chunks(missions.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      Navigator navigator(source, planner, options.navigator);
      runs[i] =
          run_mission(place, remembered, navigator, missions[i], options, Random(seed, i).next());
    }
  });
  return runs;
}

std::vector<Mission> random_missions(const MissionPlace& place, const RememberedPlace& remembered,
                                     const RandomMissionOptions& options, std::uint64_t seed) {
  require(options.count >= 0, "missions", options.count, ">= 0");
  require(options.beside_m > 0.0, "distance from a reference", options.beside_m, "> 0");
  Random random(seed, 3);
  const FreeSpace& space = *place.free_space;
  const auto anywhere = [&] {
    if (!std::isfinite(options.beside_m)) return space.random_pose(random);
    for (;;) {
      const Pose2& reference = remembered.truth[random.index(remembered.truth.size())];
      const double off_m = options.beside_m * std::sqrt(random.uniform());
      const double direction_rad = random.uniform(-pi, pi);
      const Pose2 there{reference.x_m + off_m * std::cos(direction_rad),
                        reference.y_m + off_m * std::sin(direction_rad), random.uniform(-pi, pi)};
      if (space.is_free_between(reference.position(), there.position())) return there;
    }
  };
  std::vector<Mission> missions;
  const double least_m = 2.0 * remembered.spacing_m;
  while (missions.size() < static_cast<std::size_t>(options.count)) {
    const std::size_t goal = random.index(remembered.truth.size());
    Mission mission{remembered.graph.view(goal), anywhere(), {}};
    if (options.carried) mission.carried_to = anywhere();
    if (distance(mission.start.position(), remembered.truth[goal].position()) < least_m) continue;
    missions.push_back(mission);
  }
  return missions;
}

}  // namespace panonav
