#pragma once

// The state of a navigator in named values, each of which is forgotten by assignment.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/homing/homing_pursuit.hpp"
#include "panonav/localisation/place_model.hpp"
#include "panonav/navigation/area_planner.hpp"
#include "panonav/navigation/direction_field.hpp"
#include "panonav/navigation/internal/area_views.hpp"
#include "panonav/navigation/internal/place_scale.hpp"
#include "panonav/navigation/internal/route_pilot.hpp"
#include "panonav/navigation/navigator.hpp"

namespace panonav {

/// What a navigator learns of its memory once.
struct MemoryScales {
  PlaceScale place;   ///< by all components
  PlaceScale coarse;  ///< by the first ones
  float full_scale = 1.0F;
  int components = 0;
  int coarse_components = 0;         ///< 0: all
  double typical_length = 1.0;       ///< of an edge
  std::vector<std::uint8_t> narrow;  ///< by node

  /// A reference that differs by more was taken at another place.
  [[nodiscard]] double limit(const SeenView& view) const noexcept {
    return (view.components == components ? place : coarse).limit();
  }
};

/// Where to go. Lasts until another goal is set.
struct NavigationGoal {
  std::size_t node = 0;
  std::set<std::size_t> around;  ///< nodes, its own included
  HomingView view;
  ArrivalScale arrival;
};

/// What speaks against the place where the robot is taken to be. Begins anew with a goal.
struct PlaceDoubt {
  int unknown_steps = 0;  ///< one after the other at which no reference looked right
  int improbable_steps =
      0;                    ///< one after the other at which the place was probably not the robot's
  int elsewhere_steps = 0;  ///< one after the other that agree on another place
  std::optional<std::size_t> elsewhere;
};

/// Where the robot is. Lasts from goal to goal, until it is told to be forgotten.
struct NavigationPlace {
  std::optional<std::size_t> node;
  std::optional<std::size_t> known_node;  ///< where the place last looked right
  std::optional<Point2> known_at;  ///< that, in the robot's frame, as far as steps tell; metres
  PlaceDoubt doubt;
};

/// The step before: of one observation for the next.
struct LastStep {
  std::optional<HomingView> view;       ///< from which it began
  std::optional<double> direction_rad;  ///< in the frame of `view`; empty: the robot stood
  double advance_m = 0.0;
  std::optional<double> way;             ///< that was left before it, if it was a whole step
  std::optional<std::size_t> aimed_for;  ///< the edge, unless the step led around
};

/// What stands in the robot's way. Begins anew with a goal.
struct Obstruction {
  bool now = false;  ///< in the step before this observation
  int level = 0;     ///< grows by 2 with each step that fails, falls by 1 with each that does not
};

/// What became of the steps along an edge since the robot came nearer to the goal.
struct EdgeTries {
  std::size_t node = 0;  ///< from which it was tried first
  int steps = 0;
  int obstructed = 0;
};

/// How far the run has come. Begins anew with a goal.
struct Progress {
  int steps = 0;
  int attempts = 0;
  int ways_sought = 0;  ///< from places without one, in this attempt
  double min_way = std::numeric_limits<double>::infinity();  ///< since the last plan
  int steps_in_vain = 0;                   ///< since the way became shorter or an edge was closed
  std::map<std::size_t, EdgeTries> tries;  ///< by edge, since the way became shorter
  bool closed_here = false;                ///< an edge, and the robot was not far from there since
  std::vector<std::size_t> around_closed;  ///< nodes around that edge, ascending
  std::set<std::size_t> suspects;          ///< edges that were closed in earlier attempts

  [[nodiscard]] bool was_obstructed() const;
};

/// An edge that is held to until its end: other references may be nearer on the way.
struct UnderWay {
  std::size_t from = 0;  ///< node
  Guide guide;           ///< there
  int steps_left = 0;
};

/// The way to the goal. Begins anew where edges are closed or opened.
struct Plan {
  std::vector<Guide> field;  ///< of the loaded area
  std::optional<UnderWay> under_way;
};

/// An observation and what is decided after it.
struct Step {
  const FourierSignature& signature;
  const RobotReport& report;
  SeenView view;
  NavigationDecision decision;
  /// Where the step before led, in the frame of the robot now, unless it failed.
  std::optional<double> heading_for_rad;

  void note(NavigationEvent event) { decision.events.push_back(event); }
};

struct Navigator::Core {
  /// As the constructor of `Navigator`.
  Core(const ViewSource& source, AreaPlanner planner, const NavigatorOptions& options);

  const ViewSource* source;
  AreaPlanner planner;
  NavigatorOptions options;
  AreaViews views;
  MemoryScales scales;
  PlaceCriterion criterion;
  RoutePilot pilot;

  NavigationState state = NavigationState::moving;
  std::optional<NavigationGoal> goal;
  NavigationPlace place;
  LastStep last;
  Obstruction obstruction;
  Progress progress;
  Plan plan;
  std::optional<HomingPursuit> homing;  ///< the last stretch, while it lasts
  std::vector<double> step_ways;        ///< by which the last steps brought any goal nearer

  void set_goal(ViewId goal);
  void forget_place();
  [[nodiscard]] NavigationDecision observe(const FourierSignature& view, const RobotReport& report);

 private:
  [[nodiscard]] const NavigationGraph& graph() const { return planner.graph(); }
  [[nodiscard]] const Guide& guide() const;
  void plan_anew();
  void forget_plans(Step& step);
  void decide(Step& step);

  // The place (navigator_place.cpp).
  struct Located;
  [[nodiscard]] bool needs_all_components() const;
  [[nodiscard]] Located search_around(const SeenView& view);
  void locate(Step& step);
  [[nodiscard]] bool line_tells() const;
  void judge_place(Step& step);
  void accept(const Located& located, Step& step);
  void relocalise(Step& step);
  void enter(std::size_t node, Step& step);
  void load_ahead();

  // Progress and what hinders it (navigator_progress.cpp).
  void notice_obstacles(Step& step);
  void count_try();
  void close_way(std::size_t edge, Step& step);
  void try_again(Step& step, NavigationState otherwise);
  [[nodiscard]] bool find_way_from_here(Step& step);
  [[nodiscard]] double relative_length(const Guide& ahead) const;
  [[nodiscard]] int patience() const;
  [[nodiscard]] double detour_rad() const;

  // Where to go.
  [[nodiscard]] bool is_at_goal() const;
  void go_home(Step& step);
  [[nodiscard]] std::optional<double> way_back_rad(const SeenView& view);
  [[nodiscard]] bool go_back(Step& step);
  void begin_long_way();
  [[nodiscard]] std::optional<double> direction_of(std::size_t from, const Guide& ahead,
                                                   const Step& step);
  void follow(Step& step);
  void begin_leg(Step& step);
  [[nodiscard]] bool go_along_route(Step& step);
};

}  // namespace panonav
