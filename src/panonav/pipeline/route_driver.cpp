#include "panonav/pipeline/route_driver.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/route/route_position.hpp"

namespace panonav {

std::string_view to_string(RouteDriver::State state) {
  constexpr std::array<std::string_view, 4> names{"searching", "driving", "arrived", "lost"};
  return names.at(static_cast<std::size_t>(state));
}

RouteDriver::RouteDriver(const MemoryFile& memory, const std::optional<PictureSource>& source,
                         const RouteDriverOptions& options)
    : options_(options), follower_(memory, source, options.follower) {
  validate(options_.base);
  if (follower_.source().assumed_unit_m) {
    throw FileError(memory.path().string(), "route '" + follower_.name() +
                                                "' is in view steps; first scale the memory to "
                                                "metres, by the known distance between two of its "
                                                "views");
  }
  for (std::size_t i = 1; i < poses().size(); ++i) {
    length_m_ += distance(poses()[i - 1].position(), poses()[i].position());
  }
}

void RouteDriver::plan_path_from(Point2 place) {
  // Largest distance between the robot and a passage of the route. A robot at the end of a closed
  // route therefore starts at its beginning.
  constexpr double reach_m = 0.5;
  const auto passes = find_passes(poses(), place, reach_m);
  const auto pass = std::ranges::min_element(passes, {}, [&](const auto& each) {
    return options_.resume_m ? std::abs(each.along_m - *options_.resume_m) : each.along_m;
  });
  start_m_ = pass == passes.end() ? project_onto_route(poses(), place).along_m : pass->along_m;
  // Smallest length of a path, needed if the robot is already at the route's end.
  constexpr double min_path_m = 0.01;
  const double from_m = std::min(start_m_, std::max(0.0, length_m_ - min_path_m));
  path_.emplace(route_segment(poses(), from_m, length_m_), options_.path);
}

RouteDriver::Step RouteDriver::step(const Observation& observation,
                                    const std::optional<Pose2>& other_estimate) {
  if (!observation.odometry) {
    throw ContractError("odometry of the observation", "unknown", "known, to repeat a route");
  }
  const Pose2 moved = inverse(odometry_.value_or(*observation.odometry)) * *observation.odometry;
  odometry_ = observation.odometry;
  RouteDriver::Step step;
  step.length_m = length_m_;
  step.fix = follower_.step(observation).fix;
  const auto& robot = follower_.tracker().pose();
  const bool confirmed = robot && other_estimate &&
                         distance(robot->position(), other_estimate->position()) <
                             options_.follower.tracker.recovery_m;
  blind_m_ = step.fix || confirmed ? 0.0 : blind_m_ + std::hypot(moved.x_m, moved.y_m);
  if (!path_) {
    if (!step.fix) {
      if (++failed_searches_ >= max_searches) step.state = RouteDriver::State::lost;
      return step;
    }
    plan_path_from(step.fix->pose.position());
  }
  step.along_m = start_m_ + path_->along_m();
  step.state = RouteDriver::State::lost;
  if (!robot || blind_m_ > max_blind_m) return step;
  const auto aim = path_->next_target(robot->position());
  step.along_m = start_m_ + path_->along_m();
  step.state = aim ? RouteDriver::State::driving : RouteDriver::State::arrived;
  if (!aim) return step;
  const Point2 ahead = inverse(*robot) * *aim;
  step.velocity = compute_command_towards(std::atan2(ahead.y_m, ahead.x_m),
                                          std::hypot(ahead.x_m, ahead.y_m), options_.base);
  return step;
}

ChainDriver::ChainDriver(const MemoryFile& memory, const std::optional<PictureSource>& source,
                         const std::optional<std::string>& name, ChainDirection direction,
                         const BaseOptions& base)
    : guide_(memory, source, name, direction), helm_(base) {
  validate(base);
}

ChainDriver::Step ChainDriver::step(const Observation& observation) {
  if (!observation.odometry) {
    throw ContractError("odometry of the observation", "unknown", "known, to repeat a route");
  }
  const Pose2& odometry = *observation.odometry;
  Step step;
  if (helm_.needs_decision(odometry)) {
    helm_.begin(guide_.step(observation), odometry);
    step.decided = true;
  }
  step.state = helm_.decision()->state;
  step.snapshot = guide_.snapshot_number(helm_.decision()->target);
  step.remaining_m = helm_.remaining_m(odometry);
  step.velocity = helm_.velocity(odometry);
  return step;
}

}  // namespace panonav
