#pragma once

// The navigator's state in structs; assigning a default value resets one.

#include <limits>
#include <map>
#include <set>

#include "panonav/localisation/place_model.hpp"
#include "panonav/navigation/internal/area_views.hpp"
#include "panonav/navigation/internal/place_scale.hpp"
#include "panonav/navigation/internal/route_pilot.hpp"
#include "panonav/navigation/navigator.hpp"

namespace panonav {

/// Scales of a memory, which a navigator learns once at construction.
struct MemoryScales {
  PlaceScale place;   ///< learnt with all components
  PlaceScale coarse;  ///< learnt with the first `coarse_components`
  float full_scale = 1.0F;
  int components = 0;
  int coarse_components = 0;            ///< 0: all
  double median_edge_length = 1.0;      ///< median length of an edge
  std::vector<std::uint8_t> is_narrow;  ///< by node: not 0 near a narrow gate

  /// Largest difference between a view and a reference of the same place.
  [[nodiscard]] double max_difference(const QueryView& view) const noexcept {
    return (view.components == components ? place : coarse).max_difference();
  }
};

/// The goal of the run. Lasts until another one is set.
struct NavigationGoal {
  std::size_t node = 0;
  std::set<std::size_t> around;  ///< nodes, its own included
  HomingView view;
  ArrivalScale arrival;
};

/// Evidence against the assumed place of the robot. Reset with each goal.
struct PlaceDoubt {
  int unknown_steps = 0;                  ///< successive steps at which no reference matched
  int improbable_steps = 0;               ///< successive steps at which the place was improbable
  int other_place_steps = 0;              ///< successive steps that agree on another place
  std::optional<std::size_t> other_node;  ///< that place
};

/// Place of the robot in the memory. Kept when the goal changes, until `Navigator::forget_place`.
struct NavigationPlace {
  std::optional<std::size_t> node;
  std::optional<std::size_t> known_node;   ///< node at which the view last matched
  std::optional<Point2> known_position_m;  ///< of `known_node` in the robot's frame
  PlaceDoubt doubt;
};

/// The step before the present observation.
struct LastStep {
  std::optional<HomingView> view;       ///< view at the start of the step
  std::optional<double> direction_rad;  ///< in the frame of `view`; nullopt: the robot stood still
  double advance_m = 0.0;
  std::optional<double> path_length;       ///< remaining before it; only after a whole step
  std::optional<std::size_t> target_edge;  ///< edge that the step followed; nullopt for a detour
};

/// Obstacles in front of the robot. Reset with each goal.
struct Obstruction {
  bool is_present = false;  ///< in the step before this observation
  int level = 0;  ///< grows by 2 with each obstructed step, falls by 1 with each other step
};

/// Steps made along an edge since the path to the goal last became shorter.
struct EdgeAttempts {
  std::size_t node = 0;  ///< from which the edge was first tried
  int steps = 0;
  int obstructed_steps = 0;
};

/// Progress of the run. Reset with each goal.
struct Progress {
  int steps = 0;
  int attempts = 0;
  int path_searches = 0;  ///< number of searches for a place with a path, in this attempt
  double min_path_length = std::numeric_limits<double>::infinity();  ///< since the last plan
  int steps_without_progress = 0;  ///< since the path became shorter or an edge was blocked
  std::map<std::size_t, EdgeAttempts> edge_attempts;  ///< by edge, since the path became shorter
  /// Nodes around the latest blocked edge, ascending, until the robot leaves them.
  std::vector<std::size_t> near_blocked_edge;
  std::set<std::size_t> suspect_edges;  ///< edges that were blocked in earlier attempts

  [[nodiscard]] bool was_obstructed() const;
  /// Returns the attempts along an edge; if there are none yet, adds an entry that starts at
  /// `node`.
  EdgeAttempts& get_or_create_attempts(std::size_t edge, std::size_t node) {
    return edge_attempts.try_emplace(edge, EdgeAttempts{node}).first->second;
  }
};

/// An edge that is followed to its end, even if other references match better meanwhile.
struct CommittedEdge {
  std::size_t from = 0;  ///< node
  Guide guide;           ///< there
  int steps_left = 0;
};

/// The plan to the goal. Reset when edges are blocked or unblocked.
struct Plan {
  std::vector<Guide> field;  ///< of the loaded area
  std::optional<CommittedEdge> committed;
};

/// An observation and the decision after it.
struct Step {
  const FourierSignature& signature;
  const RobotReport& report;
  QueryView view;
  NavigationDecision decision;
  /// Direction of the last step in the robot's current frame; nullopt if there was none.
  std::optional<double> last_direction_rad;

  void add_event(NavigationDecision::Event event) { decision.events.push_back(event); }
};

struct Navigator::Core {
  /// Same as the constructor of `Navigator`.
  Core(const ViewSource& source, AreaPlanner planner, const NavigatorOptions& options);

  const ViewSource* source;
  AreaPlanner planner;
  NavigatorOptions options;
  AreaViews views;
  MemoryScales scales;
  PlaceCriterion criterion;
  RoutePilot pilot;

  NavigationDecision::State state = NavigationDecision::State::moving;
  std::optional<NavigationGoal> goal;
  NavigationPlace place;
  LastStep last;
  Obstruction obstruction;
  Progress progress;
  Plan plan;
  std::optional<HomingPursuit> homing;  ///< while the robot homes to the goal
  std::vector<double> path_reductions;  ///< by the last whole steps, over all goals

  void set_goal(ViewId goal);
  void forget_place();
  [[nodiscard]] NavigationDecision observe(const FourierSignature& view, const RobotReport& report);

 private:
  [[nodiscard]] const NavigationGraph& graph() const { return planner.graph(); }
  [[nodiscard]] const Guide& guide() const;
  void replan();
  void abandon_plans(Step& step);
  void decide(Step& step);
  void choose_motion(Step& step);

  // The place (navigator_place.cpp).
  struct PlaceCandidates;
  [[nodiscard]] bool needs_all_components() const;
  [[nodiscard]] PlaceCandidates find_candidates(const QueryView& view);
  void locate(Step& step);
  void search_place(Step& step);
  void update_place_doubt(Step& step);
  [[nodiscard]] bool is_localised_on_route() const;
  [[nodiscard]] double compute_place_probability(const Step& step) const;
  void update_probability(Step& step);
  void choose_place(const PlaceCandidates& candidates, Step& step);
  void relocalise(Step& step);
  void set_place(std::size_t node, Step& step);
  void prefetch_next_area();

  // Progress and obstacles (navigator_progress.cpp).
  void block_failed_edges(Step& step);
  void detect_obstruction(Step& step);
  void update_path_length();
  void block_edge(std::size_t edge, Step& step);
  void unblock_edges_or_end(Step& step, NavigationDecision::State end_state);
  [[nodiscard]] bool relocalise_with_path(Step& step);
  [[nodiscard]] double relative_length(const Guide& ahead) const;
  [[nodiscard]] int max_steps_without_progress() const;
  [[nodiscard]] double detour_rad() const;

  // The next motion.
  [[nodiscard]] bool is_at_goal() const;
  void home_to_goal(Step& step);
  [[nodiscard]] std::optional<double> direction_to_known_place(const QueryView& view);
  [[nodiscard]] bool return_to_known_place(Step& step);
  void commit_to_edge_if_needed(Step& step);
  [[nodiscard]] std::optional<double> direction_along_edge(std::size_t from, const Guide& ahead,
                                                           const Step& step);
  void follow_field(Step& step);
  void begin_leg_if_possible(Step& step);
  [[nodiscard]] bool follow_route(Step& step);
};

}  // namespace panonav
