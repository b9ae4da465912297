#include "panonav_ros2/memory_localiser.hpp"

#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav::ros2 {

MemoryLocaliser::MemoryLocaliser(Participant& participant, const LocalisationNodeSetup& setup,
                                 RobotMotion& motion, GoalDriver& driver, NowNs now_ns)
    : setup_(setup),
      motion_(motion),
      driver_(driver),
      now_ns_(std::move(now_ns)),
      poses_(participant, "~/pose", {.depth = 1, .transient_local = true}),
      particles_(participant, "~/particles"),
      references_(participant, "~/references", {.depth = 1, .transient_local = true}),
      best_matches_(participant, "~/best_match/compressed"),
      base_from_camera_(setup.node.base_from_camera()) {}

LoadedMemory& MemoryLocaliser::loaded() const {
  if (!memory_) throw Error("the memory is being made; allowed: first finish, then this");
  return *memory_;
}

void MemoryLocaliser::load(std::filesystem::path path) {
  MemoryFile file = MemoryFile::open(path, Access::read_only);
  if (read_length_unit(file) != LengthUnit::metres) {
    throw FileError(
        path.string(),
        "has positions in view steps, and ROS needs metres; first scale it by the known "
        "distance between two of its views, or record a drive with odometry");
  }
  Tracker tracker(path, setup_.tracker);
  std::unique_ptr<LoadedMemory> memory(
      new LoadedMemory{std::move(path), std::move(file), std::move(tracker)});
  driver_.set_memory(*memory);
  memory_ = std::move(memory);
  last_observation_.reset();
  last_pose_.reset();
  publish_references();
}

void MemoryLocaliser::load_neighbour(const std::string& name) {
  namespace fs = std::filesystem;
  std::error_code code;
  const fs::path folder = fs::weakly_canonical(fs::absolute(loaded().path), code).parent_path();
  const fs::path path = fs::weakly_canonical(folder / name, code);
  if (code || path.parent_path() != folder) {
    throw ContractError("file to load", "'" + to_readable_line(shorten_middle(name, 80)) + "'",
                        "the name of a file in the folder of the memory");
  }
  load(path);
  motion_.set_map_from_path(std::nullopt);  // it referred to the other memory
}

/// Reads the changes of the memory and keeps the robot's pose.
void MemoryLocaliser::reload() {
  if (!loaded().tracker.is_memory_held()) {
    if (loaded().tracker.refresh()) publish_references();
    return;
  }
  const auto pose = last_pose_;
  load(loaded().path);
  if (pose) start_tracker_at(*pose);
}

void MemoryLocaliser::load_interrupted_mission() {
  interrupted_mission_ = driver_.load_interrupted_mission();
}

void MemoryLocaliser::add_view(const std::string& name) {
  if (!last_observation_ || !last_pose_) {
    throw Error("the robot is not localised, so a view of this place has no position");
  }
  last_observation_->pose =
      ReferencePose{last_pose_->x_m, last_pose_->y_m, last_pose_->heading_rad};
  last_observation_->name = make_name_on_floor(loaded().tracker.floor(), name);
  Memoriser memoriser(loaded().path, {.source = setup_.tracker.source});
  memoriser.add(*last_observation_);
  memoriser.finish();
  reload();
}

void MemoryLocaliser::remove_view(const std::string& name) {
  MemoryFile writable = MemoryFile::open(loaded().path, Access::read_write);
  const ViewId view = find_view_by_name_or_id(writable, name);
  writable.remove({&view, 1});
  reload();
}

void MemoryLocaliser::start_globally() {
  loaded().tracker.start_globally();
}

void MemoryLocaliser::start_at(const Pose2& map_from_base, double deviation_m,
                               double heading_deviation_rad) {
  loaded().tracker.start_at(map_from_base * base_from_camera_, deviation_m, heading_deviation_rad);
}

void MemoryLocaliser::start_at(const Pose2& map_from_base) {
  start_tracker_at(map_from_base * base_from_camera_);
}

void MemoryLocaliser::start_tracker_at(const Pose2& map_from_camera) {
  constexpr double heading_deviation_rad = 0.1;  // about the largest error when localised
  Tracker& tracker = loaded().tracker;
  tracker.start_at(map_from_camera, 0.5 * tracker.localiser().model().spacing_m,
                   heading_deviation_rad);
}

recordings::RunMoment MemoryLocaliser::localise(Observation observation, std::int64_t stamp_ns,
                                                const RobotMotion::Motion& moved) {
  if (interrupted_mission_) resume(*std::exchange(interrupted_mission_, std::nullopt), moved);
  Tracker& tracker = loaded().tracker;
  refresh_if_due();
  tracker.move_to(*observation.odometry);
  std::optional<PackedSignature> view;  // nullopt: a narrow picture
  std::optional<Place> place;           // answer to a narrow picture
  if (tracker.takes_narrow_pictures()) {
    place = tracker.localise(observation);
  } else {
    view = tracker.encoder().packed(observation);
  }
  MonteCarloEstimate estimate = view ? tracker.observe(*view) : tracker.observe(*place);
  if (tracker.floor() != published_floor_) publish_references();
  last_pose_ = estimate.pose;
  if (estimate.pose) estimate.pose = *estimate.pose * inverse(base_from_camera_);
  recordings::RunMoment moment;
  set_localisation(moment, estimate);
  if (!moment.sure) last_pose_.reset();
  if (last_pose_) correct_motion(*moment.pose, moved.path_from_base, moment);
  driver_.drive(observation, last_pose_);
  last_observation_ = std::move(observation);
  publish_estimate(moment, stamp_ns);
  if (best_matches_.subscribers() > 0) {
    std::optional<ViewId> best;
    if (place && !place->matches.empty()) best = place->matches.front().view;
    if (view) {
      const auto found = tracker.index()->search(*view, {.top = 1}, {});
      if (!found.matches.empty()) best = found.matches.front().view;
    }
    if (best) publish_best_match(*best, stamp_ns);
  }
  return moment;
}

/// Reads the changes that other robots made in a memory on a server, at most every ten seconds.
void MemoryLocaliser::refresh_if_due() {
  constexpr std::chrono::seconds interval(10);  // new views are not urgent
  const auto now = std::chrono::steady_clock::now();
  if (memory_->tracker.is_memory_held() || now - last_refresh_ < interval) return;
  last_refresh_ = now;
  reload();
}

/// Continues a mission: starts at the pose that odometry gives since the mission was stored.
void MemoryLocaliser::resume(const Mission& mission, const RobotMotion::Motion& now) {
  const Pose2 pose = mission.map_from_odom * now.odom_from_base;
  start_at(pose);
  motion_.set_map_from_path(pose * inverse(now.path_from_base));
  driver_.start(mission);
}

void MemoryLocaliser::correct_motion(const Pose2& map_from_base, const Pose2& path_from_base,
                                     recordings::RunMoment& moment) {
  const auto previous_map_from_path =
      motion_.set_map_from_path(map_from_base * inverse(path_from_base));
  if (!previous_map_from_path) return;
  const Pose2 before = *previous_map_from_path * path_from_base;
  const double turn_rad = angle_difference(before.heading_rad, map_from_base.heading_rad);
  moment.values.emplace_back(
      "correction_m", format_fixed(distance(before.position(), map_from_base.position()), 4));
  moment.values.emplace_back("correction_rad", format_fixed(std::abs(turn_rad), 4));
}

/// Publishes the pose if the estimate is certain, and particles if there are subscribers.
void MemoryLocaliser::publish_estimate(recordings::RunMoment& moment, std::int64_t stamp_ns) const {
  constexpr std::size_t max_shown_particles = 500;  // more would not show more
  const Tracker& tracker = memory_->tracker;
  if (last_pose_) poses_.publish(recordings::pose_message(moment, stamp_ns, setup_.frames.map));
  if (particles_.subscribers() > 0) {
    moment.particles =
        recordings::resample_systematically(tracker.particles(), max_shown_particles);
    particles_.publish(recordings::poses_message(moment.particles, stamp_ns, setup_.frames.map));
  }
}

void MemoryLocaliser::publish_best_match(ViewId view, std::int64_t stamp_ns) const {
  try {
    const auto thumbnail = memory_->file.thumbnail(view);
    if (!thumbnail) return;
    constexpr std::uint8_t first_byte_of_png = 0x89;
    const bool is_png = !thumbnail->empty() && thumbnail->front() == first_byte_of_png;
    best_matches_.publish({{stamp_ns, setup_.frames.base}, is_png ? "png" : "jpeg", *thumbnail});
  } catch (const ContractError&) {
    // Another program has removed this view from the memory since the memory was read.
  }
}

/// Publishes the positions of the views on the robot's floor, each with its index.
void MemoryLocaliser::publish_references() {
  published_floor_ = memory_->tracker.floor();
  recordings::PointValues cloud;
  for (const PosedView& view : memory_->tracker.posed_views()) {
    cloud.add(view.pose.position(), static_cast<double>(cloud.values.size() / 4));
  }
  references_.publish(cloud.message(now_ns_(), setup_.frames.map, "number"));
}

}  // namespace panonav::ros2
