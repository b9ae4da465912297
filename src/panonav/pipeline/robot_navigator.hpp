#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav/navigation/known_route.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/navigation/navigator.hpp"
#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file_views.hpp"

namespace panonav {

/// Options for sending a robot to a goal.
struct RobotNavigatorOptions {
  /// Source of the edges between the views of a memory.
  enum class GraphOrigin {
    map,          ///< map of a `Mapper`: edges are its motions
    lattice,      ///< map of the verb `arrange`: directions come from the phases of views
    links,        ///< links of the memory, with lengths
    arrangement,  ///< computed by arranging the views; if no other exists
  };

  NavigatorOptions navigator;        ///< options of decisions
  PlannerOptions planner;            ///< options of path planning
  BaseOptions base;                  ///< drive of the robot, and limits of its velocity commands
  std::optional<GraphOrigin> edges;  ///< nullopt: the first origin that the memory has
  /// Name of a recorded route of the memory. The robot follows the route where the planned path
  /// coincides with it.
  std::optional<std::string> route;
  KnownRouteOptions known_route;  ///< how the route is followed
};
/// Returns "map", "lattice", "links" or "arrangement".
[[nodiscard]] std::string_view to_string(RobotNavigatorOptions::GraphOrigin origin);
/// Returns the origin with this name; nullopt if there is none.
[[nodiscard]] std::optional<RobotNavigatorOptions::GraphOrigin> parse_graph_origin(
    std::string_view name);

/// Drives a robot to a memorised view: takes an image, returns a velocity. Reads views from the
/// memory file when needed; holds the whole graph, but only the views in and around the current
/// area. Drives on one floor: no edge leads to another. Making the graph temporarily loads the
/// views of all nodes of a map, or all views for an arrangement. One thread at a time.
class RobotNavigator {
 public:
  /// The robot's next motion after an observation.
  struct Step {
    NavigationDecision decision;  ///< the latest decision
    Velocity velocity;            ///< for the next period of the base (`BaseOptions::period_s`)
    bool decided =
        false;  ///< true: this observation led to a new decision; false: the previous one continues
  };

  /// `goal`: name or id of a view. `source`: layout of the images; nullopt: that of the memory.
  /// Throws FileError if the memory has no views, if it does not have the edges or the route of the
  /// options, or if no edge leads to the goal; OptionError.
  RobotNavigator(const std::filesystem::path& memory, const std::string& goal,
                 const RobotNavigatorOptions& options = {},
                 const std::optional<PictureSource>& source = std::nullopt,
                 Executor* executor = nullptr);
  RobotNavigator(const RobotNavigator&) = delete;
  RobotNavigator& operator=(const RobotNavigator&) = delete;

  /// Sets another goal and keeps the estimate of the robot's place. Throws FileError as the
  /// constructor.
  void set_goal(const std::string& goal);

  /// Returns the next motion; call it once in each period of the base. Evaluates the image only for
  /// a new decision: when the last step is completed (by odometry, or by the commanded velocities),
  /// or when `report` indicates an obstacle. Throws like `ViewEncoder::signature` and
  /// `Navigator::observe`.
  [[nodiscard]] Step step(const Observation& observation, RobotReport report = {});

  /// Returns the source of the edges.
  [[nodiscard]] RobotNavigatorOptions::GraphOrigin origin() const noexcept { return origin_; }
  [[nodiscard]] ViewId goal() const noexcept { return goal_; }  ///< The goal's id in the memory.
  /// Returns the views and the edges between them.
  [[nodiscard]] const NavigationGraph& graph() const noexcept { return planner().graph(); }
  /// Returns the planner, which knows the path and the blocked edges.
  [[nodiscard]] const AreaPlanner& planner() const noexcept { return navigator_->planner(); }
  /// Returns the file from which views are read.
  [[nodiscard]] const MemoryFile& memory() const noexcept { return views_.file(); }
  /// Reads name, pose and stamp of a view from the file.
  [[nodiscard]] ReferenceInfo info(ViewId view) const;
  /// Returns why no path leads from a view to the goal, if they are on two floors; else empty.
  [[nodiscard]] std::string explain_other_floor(ViewId view) const;
  /// Returns the navigator, for programs that compute observations and velocities themselves.
  [[nodiscard]] Navigator& navigator() noexcept { return *navigator_; }
  /// Returns the encoder that makes queries of pictures.
  [[nodiscard]] const ViewEncoder& encoder() const noexcept { return encoder_; }
  /// Returns how the scanlines of the followed route are made; null without a route.
  [[nodiscard]] const RouteSource* route() const noexcept {
    return route_source_ ? &*route_source_ : nullptr;
  }

 private:
  [[nodiscard]] NavigationDecision observe(const Observation& observation, RobotReport report);

  RobotNavigatorOptions options_;
  MemoryFileViews views_;
  ViewEncoder encoder_;
  RobotNavigatorOptions::GraphOrigin origin_ = RobotNavigatorOptions::GraphOrigin::map;
  ViewId goal_;
  std::vector<KnownRoute> routes_;
  std::optional<RouteSource> route_source_;
  std::optional<LineEncoder> line_encoder_;
  std::optional<Navigator> navigator_;
  // State of the current step.
  Step last_step_;
  Point2 target_;                  // end of the step in the current robot frame
  double time_left_s_ = 0.0;       // after which the step ends in any case
  Pose2 moved_;                    // motion since the decision
  std::optional<Pose2> odometry_;  // of the last observation
};

}  // namespace panonav
