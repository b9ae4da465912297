#include "runs/mission_moments.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/direction_field.hpp"
#include "panonav/relative_pose/pair_evidence.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::command {

namespace {

bool is_known(const Pose2& pose) {
  return std::isfinite(pose.x_m);
}

}  // namespace

void MissionMoments::set_image(const Image& image, const Panorama& panorama) {
  clock_.stage("driving, image");
  image_ = image;
  panorama_ = panorama;
}

recordings::RunMoment MissionMoments::make(const NavigationDecision& decision, const Pose2& pose,
                                           const simulation::Scene& scene) {
  clock_.stage("signature, decision");
  recordings::RunMoment moment{.stamp_s = static_cast<double>(moment_count_++), .pose = pose};
  if (decision.homing && panorama_) moment.homing = homing();
  moment.picture = std::exchange(image_, std::nullopt);
  moment.panorama = std::exchange(panorama_, std::nullopt);
  moment.truth = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad};
  moment.sure = decision.probability >= 0.5;
  moment.state = to_string(decision.state);
  moment.probability = decision.probability;
  moment.values.emplace_back("probability", format_fixed(decision.probability, 4));
  for (const NavigationDecision::Event event : decision.events) {
    moment.values.emplace_back("event", to_string(event));
  }
  if (decision.nearest) {
    moment.values.emplace_back("nearest", robot_.info(*decision.nearest).name);
    moment.best_match =
        robot_.memory().thumbnail(*decision.nearest).value_or(std::vector<std::uint8_t>{});
    auto path = make_planned_path(*decision.nearest);
    if (path != plan_) moment.plan = plan_ = std::move(path);
  }
  if (moment_count_ == 1) moment.walls = viewer::scene_outlines(scene);
  if (shown_goal_ != robot_.goal()) {
    add_direction_field(moment);
    shown_goal_ = robot_.goal();
  }
  clock_.stage("for viewers");
  clock_.add_to(moment);
  return moment;
}

/// Returns the known positions of the planned path, each with the heading to the next one.
std::vector<Pose2> MissionMoments::make_planned_path(ViewId from) const {
  std::vector<Pose2> path;
  const auto node = robot_.graph().node_of(from);
  if (!node) return path;
  for (const std::size_t next : robot_.planner().plan_path(*node)) {
    const Pose2& pose = remembered_.truth[next];
    if (is_known(pose)) path.push_back({pose.x_m, pose.y_m, 0.0});
  }
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    path[i].heading_rad = std::atan2(path[i + 1].y_m - path[i].y_m, path[i + 1].x_m - path[i].x_m);
  }
  return path;
}

/// Returns the home vector from the robot's view to the goal's view; nullopt if it is unknown.
std::optional<recordings::RunHoming> MissionMoments::homing() const {
  const ViewId goal = robot_.goal();
  const VisualMemory views = robot_.memory().load({&goal, 1});
  const auto home = compute_pair_evidence(homing_view(views.signature(goal)),
                                          homing_view(robot_.encoder().signature(*panorama_)));
  if (!home || !home->vector.has_direction()) return std::nullopt;
  return recordings::RunHoming{home->vector.direction_rad(), home->probability};
}

/// Adds the views with their areas, the direction to the goal at each view, and the goal.
void MissionMoments::add_direction_field(recordings::RunMoment& moment) const {
  const auto guides = direction_field(remembered_.graph, robot_.goal(), field_);
  std::vector<std::size_t> areas;
  for (std::size_t i = 0; i < guides.size(); ++i) {
    const Pose2& pose = remembered_.truth[i];
    if (!is_known(pose)) continue;
    moment.references.push_back(pose.position());
    moment.reference_views.push_back(
        {robot_.info(remembered_.graph.view(i)).name,
         std::isfinite(pose.heading_rad) ? std::optional(pose.heading_rad) : std::nullopt});
    areas.push_back(robot_.planner().areas().area_of[i]);
    if (!guides[i].direction_rad || !std::isfinite(pose.heading_rad)) continue;
    moment.directions.push_back(
        {pose.x_m, pose.y_m, wrap_angle(pose.heading_rad + *guides[i].direction_rad)});
  }
  moment.regions = voronoi_regions(moment.references, areas);
  Pose2 goal = remembered_.truth[*remembered_.graph.node_of(robot_.goal())];
  if (!is_known(goal)) return;
  if (!std::isfinite(goal.heading_rad)) goal.heading_rad = 0.0;
  moment.goal = goal;
}

std::optional<ViewId> set_goal_of_viewer(RobotNavigator& robot,
                                         const simulation::RememberedPlace& remembered,
                                         RunRecord& record, Session& session) {
  const auto clicked = record.take_viewer_input();
  if (!clicked) return std::nullopt;
  std::optional<std::size_t> nearest;
  double min_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < remembered.truth.size(); ++i) {
    const double distance_m = distance(remembered.truth[i].position(), clicked->position());
    if (robot.graph().exits(i).empty() || !(distance_m < min_m)) continue;
    nearest = i;
    min_m = distance_m;
  }
  if (!nearest) return std::nullopt;
  const ViewId view = robot.graph().view(*nearest);
  const std::string name = robot.info(view).name;
  robot.set_goal(name);
  session.note("a viewer sends the robot to " + to_readable_line(name));
  return view;
}

}  // namespace panonav::command
