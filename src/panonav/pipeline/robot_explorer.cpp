#include "panonav/pipeline/robot_explorer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav {

namespace {

// Distance by which the robot backs off, in its radii: leaves room for a rotation and for driving
// along a wall.
constexpr double back_off_radii = 0.1;
// Longest time for it, since something may be behind the robot.
constexpr double max_back_off_s = 2.0;

const std::filesystem::path& require_new(const std::filesystem::path& memory) {
  if (memory_exists(memory)) {
    throw FileError(memory.string(), "already exists; allowed: a new memory file");
  }
  return memory;
}

ChainState to_chain_state(ExplorationDecision::State state) {
  if (state == ExplorationDecision::State::done) return ChainState::arrived;
  if (state == ExplorationDecision::State::lost) return ChainState::lost;
  return ChainState::travelling;
}

}  // namespace

ExplorationMemory::ExplorationMemory(const std::filesystem::path& memory,
                                     const PictureSource& source, const SignatureOptions& signature,
                                     const PreprocessingOptions& preprocessing)
    : memoriser_(require_new(memory), {.source = source,
                                       .signature = signature,
                                       .preprocessing = preprocessing,
                                       .map = false}) {}

void ExplorationMemory::add(Observation view) {
  names_.push_back("view_" + std::to_string(names_.size() + 1));
  view.name = names_.back();
  view.pose.reset();
  memoriser_.add(std::move(view));
}

void ExplorationMemory::finish(const Explorer& explorer, Executor& executor) {
  static_cast<void>(memoriser_.finish(executor));
  std::vector<ViewId> ids;
  for (const std::string& name : names_) ids.push_back(memoriser_.find(name).value());
  store_map(*memoriser_.file(), explorer.map(ids), LengthUnit::metres);
}

RobotExplorer::RobotExplorer(const std::filesystem::path& memory, const PictureSource& source,
                             const RobotExplorerOptions& options)
    : options_(options),
      source_(source),
      memory_(memory, source, options.signature, options.preprocessing),
      explorer_(options.exploration, options.robot_radius_m, options.has_ranges, options.odometry),
      helm_(options.base) {
  validate(options_.base);
}

Pose2 RobotExplorer::map_from_odometry() const {
  return explorer_.pose() * inverse(decided_at_);
}

void RobotExplorer::advance_time(const Observation& observation) {
  const auto stamp_s = observation.stamp_s;
  time_s_ += stamp_s && stamp_s_ ? std::max(0.0, *stamp_s - *stamp_s_) : options_.base.period_s;
  stamp_s_ = stamp_s;
}

// Allows twice the expected time, since wheels may slip.
bool RobotExplorer::is_overdue() const {
  const BaseOptions& base = options_.base;
  const double expected_s =
      std::numbers::pi / base.turn_rad_s + last_step_.decision.advance_m / base.speed_m_s;
  return time_s_ - decided_s_ > 2.0 * expected_s + 1.0;
}

std::optional<RobotExplorer::Contact> RobotExplorer::find_contact(const SensedObstacles& sensed,
                                                                  const Pose2& odometry) const {
  const Velocity& velocity = last_step_.velocity;
  if (velocity.forward_m_s == 0.0 && velocity.left_m_s == 0.0) return std::nullopt;
  const double course_rad = std::atan2(velocity.left_m_s, velocity.forward_m_s);
  const bool is_stuck =
      is_overdue() && helm_.remaining_m(odometry) > 0.5 * last_step_.decision.advance_m;
  if (!sensed.contact_rad && !is_stuck) return std::nullopt;
  return Contact{odometry, sensed.contact_rad.value_or(course_rad), course_rad, time_s_};
}

bool RobotExplorer::has_backed_off(const Pose2& odometry) const {
  return distance(odometry.position(), contact_->odometry.position()) >=
             back_off_radii * options_.robot_radius_m ||
         time_s_ - contact_->started_s > max_back_off_s;
}

Velocity RobotExplorer::compute_back_off_velocity() const {
  const BaseOptions& base = options_.base;
  const double speed_m_s =
      std::min(base.speed_m_s, back_off_radii * options_.robot_radius_m / base.period_s);
  return {.forward_m_s = -speed_m_s * std::cos(contact_->course_rad),
          .left_m_s = -speed_m_s * std::sin(contact_->course_rad)};
}

RobotExplorer::Step RobotExplorer::step(const Observation& observation,
                                        const SensedObstacles& sensed) {
  if (!observation.odometry) {
    throw ContractError("odometry of the observation", "unknown", "known, to explore");
  }
  const Pose2& odometry = *observation.odometry;
  advance_time(observation);
  last_step_.decided = false;
  if (!contact_) contact_ = find_contact(sensed, odometry);
  if (contact_ && !has_backed_off(odometry)) {
    last_step_.velocity = compute_back_off_velocity();
    return last_step_;
  }
  if (contact_ || helm_.needs_decision(odometry) || (!helm_.is_over() && is_overdue())) {
    decide(observation, sensed);
  }
  last_step_.velocity = helm_.velocity(odometry);
  return last_step_;
}

void RobotExplorer::decide(const Observation& observation, const SensedObstacles& sensed) {
  const Pose2& odometry = *observation.odometry;
  if (!encoder_) {
    Executor alone;
    encoder_.emplace(make_memory_header({&observation, 1}, source_, options_.signature,
                                        options_.preprocessing, alone),
                     source_);
    decided_at_ = odometry;
  }
  ExplorationReport report{.moved = inverse(decided_at_) * odometry, .ranges = sensed.ranges};
  if (contact_) {
    const double turned_rad = odometry.heading_rad - contact_->odometry.heading_rad;
    report.contact_rad = wrap_angle(contact_->contact_rad - turned_rad);
    report.course_rad = wrap_angle(contact_->course_rad - turned_rad);
    contact_.reset();
  }
  const ExplorationDecision decision = explorer_.observe(encoder_->signature(observation), report);
  if (decision.memorise) memory_.add(observation);
  last_step_ = {.decision = decision, .decided = true};
  helm_.begin({.state = to_chain_state(decision.state),
               .turn_rad = decision.direction_rad,
               .advance_m = decision.advance_m},
              odometry);
  decided_at_ = odometry;
  decided_s_ = time_s_;
}

void RobotExplorer::finish() {
  if (explorer_.view_poses().empty()) return;
  Executor alone;
  memory_.finish(explorer_, alone);
}

}  // namespace panonav
