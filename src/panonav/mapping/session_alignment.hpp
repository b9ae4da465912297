#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/loop_closure.hpp"
#include "panonav/mapping/pose_graph.hpp"
#include "panonav/mapping/topological_map.hpp"

namespace panonav {

/// Conditions for the alignment of the maps of two sessions.
struct SessionAlignmentOptions {
  /// Smallest number of places of the second session, at least half a metre apart along its path,
  /// whose matches must agree on one relative pose of the maps.
  int min_places = 10;
  /// Smallest share of the places in the overlap of the maps whose views match: similar shelves
  /// match at single places, but not along a whole path.
  double min_confirmed = 0.7;
  /// Smallest ratio of agreeing places between the best relative pose and the second best.
  double distinctness = 2.0;
  /// Drift of both maps, in metres for each metre between two places.
  double max_drift = 0.1;
};
void visit_options(SessionAlignmentOptions& options, OptionVisitor& visitor);

/// The relative pose of the maps of two sessions, with its evidence.
struct SessionAlignment {
  Pose2 first_from_second;  ///< transforms the second map into the frame of the first
  /// Matches that agree with this pose: `earlier` is the index of a node of the first session,
  /// `later` that of a node of the second.
  std::vector<LoopClosure> matches;
  int places = 0;        ///< number of matched places, at least half a metre apart
  int other_places = 0;  ///< the same for the second best relative pose
  /// Places of the second session near a view of the first, at least half a metre apart.
  int expected_places = 0;
  int confirmed_places = 0;  ///< expected places with a match nearby
  std::size_t refuted = 0;   ///< number of matches that disagree with the pose
};

/// Estimates the relative pose of two maps from their views. For each view of the second
/// session, loop closures are searched among the views of the first. Each closure proposes a
/// relative pose; the largest set of agreeing closures is used. nullopt if the set has too few
/// places, another set has nearly as many, or too few places of the overlap match. All nodes of a
/// map must be in one frame. `memory` contains the views of both sessions; a view of both is a
/// match. Throws OptionError, ContractError on a map that `validate` refuses or whose views are not
/// in the memory. Cost: two searches and some home vectors of 0.3 ms for each node of the second.
[[nodiscard]] std::optional<SessionAlignment> align_sessions(
    const VisualMemory& memory, const TopologicalMap& first, const TopologicalMap& second,
    const SessionAlignmentOptions& options = {});

/// Joins both maps by the matches, in the frame of the first, and optimises all poses as one pose
/// graph, in which only the first node of each connected component is fixed.
[[nodiscard]] TopologicalMap join_sessions(const TopologicalMap& first,
                                           const TopologicalMap& second,
                                           const SessionAlignment& alignment,
                                           const PoseGraphOptions& graph = {});

}  // namespace panonav
