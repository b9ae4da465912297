#include "panonav_ros2/goal_driver.hpp"

#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/run_messages.hpp"

namespace panonav::ros2 {

using Steady = std::chrono::steady_clock;

GoalDriver::GoalDriver(Participant& participant, const LocalisationNodeSetup& setup,
                       WarningLog& log, const RobotMotion& motion, NowNs now_ns)
    : setup_(setup),
      log_(log),
      motion_(motion),
      now_ns_(std::move(now_ns)),
      velocities_(participant, "cmd_vel", {.depth = 1}),
      feedback_(participant, "~/goal/feedback"),
      results_(participant, "~/goal/result"),
      areas_(participant, "~/areas", {.depth = 1, .transient_local = true}) {}

void GoalDriver::set_memory(const LoadedMemory& memory) {
  end("another memory");
  navigator_.reset();
  route_driver_.reset();
  chain_driver_.reset();
  explorer_.reset();
  memory_ = &memory;
  mission_file_.emplace(memory.path, setup_.node.resume_s);
}

std::optional<Mission> GoalDriver::load_interrupted_mission() {
  return mission_file_.value().load(log_);
}

void GoalDriver::start(const Mission& mission) {
  try {
    if (memory_ == nullptr)
      throw Error("the memory is being made; allowed: first finish, then this");
    if (memory_->tracker.takes_narrow_pictures()) {
      throw Error("the images are narrow ones; allowed for drives: images of all azimuths");
    }
    end("another goal");
    route_driver_.reset();
    chain_driver_.reset();
    if (mission.goal) {
      set_goal(mission.goal->position());
    } else {
      make_route_driver(mission);
    }
  } catch (const Error& refusal) {
    if (mission_file_) mission_file_->remove();
    results_.publish(make_message(error, std::string("refused: ") + refusal.what(), {}));
    throw;
  }
  mission_ = mission;
  if (route_driver_)
    mission_.min_correlation = route_driver_->follower().tracker().limits().min_correlation;
  begin();
}

void GoalDriver::begin() {
  velocity_ = {};
  is_obstructed_ = false;
  const std::lock_guard lock(mutex_);
  has_mission_ = true;
  last_command_ = Steady::now();
}

void GoalDriver::start_exploration(bool has_ranges) {
  try {
    if (explorer_ && !explorer_->explorer().view_poses().empty()) {
      throw Error("the exploration was started before; allowed: cancel");
    }
    const ExplorationSetup& exploration = setup_.exploration.value();
    const Pose2 camera = setup_.node.base_from_camera();
    explorer_.emplace(
        setup_.memory, exploration.pictures,
        RobotExplorerOptions{
            .exploration = exploration.exploration,
            .base = setup_.navigator.base,
            .odometry = setup_.tracker.odometry.value_or(OdometryNoise{}),
            .robot_radius_m = setup_.node.robot_radius_m + std::hypot(camera.x_m, camera.y_m),
            .has_ranges = has_ranges,
            .signature = exploration.signature,
            .preprocessing = exploration.preprocessing});
  } catch (const Error& refusal) {
    results_.publish(make_message(error, std::string("refused: ") + refusal.what(), {}));
    throw;
  }
  begin();
}

void GoalDriver::explore(const Observation& observation, const SensedObstacles& sensed) {
  if (!has_mission()) return;
  using State = ExplorationDecision::State;
  const RobotExplorer::Step step = explorer_->step(observation, sensed);
  const std::string state(to_string(step.decision.state));
  if (step.decision.state == State::lost) {
    end(state, error);
  } else if (step.decision.state == State::done) {
    end(state + (explorer_->explorer().progress().is_complete
                     ? ": nothing is left to explore"
                     : ": the largest distance (max_metres) is driven"),
        fine);
  } else {
    send(step.velocity);
    if (step.decided) feedback_.publish(make_message(fine, state, describe_exploration()));
  }
}

std::vector<recordings::ros::KeyValue> GoalDriver::describe_exploration() const {
  const Explorer& explorer = explorer_->explorer();
  const ExplorationProgress progress = explorer.progress();
  const double share = progress.floor_m2 > 0.0 ? progress.covered_m2 / progress.floor_m2 : 0.0;
  return {{"views", std::to_string(explorer.view_poses().size())},
          {"covered", format_fixed(share, 3)},
          {"floor_m2", format_fixed(progress.floor_m2, 2)},
          {"travelled_m", format_fixed(explorer.travelled_m(), 2)},
          {"deviation_m", format_fixed(progress.position_deviation_m, 3)}};
}

void GoalDriver::make_route_driver(const Mission& mission) {
  const bool is_chain = memory_->file.route_method(mission.route) == RouteMethod::chain;
  if (mission.back && !is_chain) {
    throw FileError(memory_->path.string(),
                    "has no chain of snapshots '" + mission.route +
                        "'; allowed for the way back: a route that panonav route record --method "
                        "chain made");
  }
  if (is_chain) {
    chain_driver_.emplace(memory_->file, setup_.tracker.source, mission.route,
                          mission.back ? ChainDirection::back : ChainDirection::forward,
                          setup_.navigator.base);
    return;
  }
  RouteDriverOptions options{.follower = {.name = mission.route, .tracker = {}, .fit = {}},
                             .base = setup_.navigator.base,
                             .resume_m = mission.along_m};
  options.follower.tracker.min_correlation = mission.min_correlation;
  route_driver_.emplace(memory_->file, setup_.tracker.source, options);
}

void GoalDriver::set_goal(Point2 goal) {
  const Tracker& tracker = memory_->tracker;
  const ViewId nearest = tracker.find_nearest_view(goal);
  const VisualMemory loaded = tracker.index()->load({&nearest, 1});
  if (loaded.empty()) throw Error("the view nearest to the goal was removed; set the goal again");
  const std::string& name = loaded.info(nearest).name;
  if (navigator_) {
    navigator_->set_goal(name);
  } else {
    navigator_.emplace(memory_->path, name, setup_.navigator);
    publish_areas();
  }
}

void GoalDriver::report_contact(Point2 contact) {
  // A robot in contact that rotates, or drives away, is not obstructed.
  is_obstructed_ |= velocity_.forward_m_s * contact.x_m + velocity_.left_m_s * contact.y_m > 0.0;
}

void GoalDriver::drive(const Observation& observation, const std::optional<Pose2>& pose) {
  if (!has_mission()) return;
  if (is_obstructed_ && !mission_.goal) {
    end("an obstacle is on the route", error);
    return;
  }
  if (chain_driver_) {
    drive_along_chain(observation);
    return;
  }
  mission_file_->store_if_due(mission_, motion_.map_from_odom());
  if (route_driver_) {
    drive_along_route(observation, pose);
  } else {
    drive_to_goal(observation, pose);
  }
}

void GoalDriver::drive_to_goal(const Observation& observation, const std::optional<Pose2>& pose) {
  RobotReport report{.obstacle = std::exchange(is_obstructed_, false)};
  if (pose) report.estimate = memory_->tracker.find_nearest_view(pose->position());
  const RobotNavigator::Step step = navigator_->step(observation, report);
  const NavigationDecision& decision = step.decision;
  const std::string state(to_string(decision.state));
  if (decision.state != NavigationDecision::State::moving) {
    end(state, decision.state == NavigationDecision::State::arrived ? fine : error);
    return;
  }
  send(step.velocity);
  if (!step.decided) return;
  feedback_.publish(make_message(
      fine, state,
      {{"way", format_fixed(decision.path_length, 3)},
       {"probability", format_fixed(decision.probability, 4)},
       {"nearest", decision.nearest ? navigator_->info(*decision.nearest).name : std::string()}}));
}

void GoalDriver::drive_along_route(const Observation& observation,
                                   const std::optional<Pose2>& pose) {
  const RouteDriver::Step step = route_driver_->step(observation, pose);
  mission_.along_m = step.along_m;
  const std::string state(to_string(step.state));
  if (step.state == RouteDriver::State::arrived || step.state == RouteDriver::State::lost) {
    end(state, step.state == RouteDriver::State::arrived ? fine : error);
    return;
  }
  send(step.velocity);
  std::vector<recordings::ros::KeyValue> values{{"along_m", format_fixed(step.along_m, 3)},
                                                {"length_m", format_fixed(step.length_m, 3)}};
  if (step.fix) values.push_back({"lateral_m", format_fixed(step.fix->lateral_m, 3)});
  feedback_.publish(make_message(fine, state, std::move(values)));
}

void GoalDriver::drive_along_chain(const Observation& observation) {
  const ChainDriver::Step step = chain_driver_->step(observation);
  const std::string state(to_string(step.state));
  if (step.state == ChainState::arrived || step.state == ChainState::lost) {
    end(state, step.state == ChainState::arrived ? fine : error);
    return;
  }
  send(step.velocity);
  if (!step.decided) return;
  feedback_.publish(make_message(fine, state,
                                 {{"snapshot", std::to_string(step.snapshot)},
                                  {"snapshots", std::to_string(chain_driver_->chain().snapshots())},
                                  {"remaining_m", format_fixed(step.remaining_m, 3)}}));
}

void GoalDriver::send(const Velocity& velocity) {
  velocity_ = velocity;
  const std::lock_guard lock(mutex_);
  velocities_.publish(
      {{velocity.forward_m_s, velocity.left_m_s, 0.0}, {0.0, 0.0, velocity.turn_rad_s}});
  last_command_ = Steady::now();
}

void GoalDriver::end(const std::string& why, std::uint8_t level) {
  {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(has_mission_, false)) return;
    velocities_.publish({});
  }
  if (!explorer_) {
    mission_file_->remove();
    results_.publish(make_message(level, why, {}));
    return;
  }
  std::string fault;
  try {
    explorer_->finish();
  } catch (const Error& failure) {
    fault = std::string("; the memory is not complete: ") + failure.what();
  }
  results_.publish(
      make_message(fault.empty() ? level : error, why + fault, describe_exploration()));
}

void GoalDriver::stop_if_silent() {
  const std::chrono::duration<double> timeout(setup_.node.command_timeout_s);
  const std::lock_guard lock(mutex_);
  if (!has_mission_ || Steady::now() - last_command_ < timeout) return;
  velocities_.publish({});
  last_command_ = Steady::now();
  log_.warn("command", "no image for " + format_fixed(setup_.node.command_timeout_s, 2) +
                           " s; the robot is stopped until the next image");
}

/// Publishes the areas over which paths are planned: one point per view with the number of its
/// area.
void GoalDriver::publish_areas() {
  recordings::PointValues cloud;
  const auto& planner = navigator_->planner();
  for (const auto& [view, pose] : memory_->tracker.posed_views()) {
    const auto node = planner.graph().node_of(view);
    if (node) cloud.add(pose.position(), static_cast<double>(planner.areas().area_of[*node]));
  }
  areas_.publish(cloud.message(now_ns_(), setup_.frames.map, "area"));
}

bool GoalDriver::has_mission() const {
  const std::lock_guard lock(mutex_);
  return has_mission_;
}

recordings::ros::DiagnosticArray GoalDriver::make_message(
    std::uint8_t level, const std::string& state,
    std::vector<recordings::ros::KeyValue> values) const {
  return {{now_ns_(), setup_.frames.map},
          {{level, "panonav: goal", to_readable_line(state), {}, std::move(values)}}};
}

}  // namespace panonav::ros2
