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

/// When two sessions count as having places in common.
struct SessionAlignmentOptions {
  /// Places of the second session, at least half a metre apart along its path, that must lead to
  /// the same frame of the first.
  int min_places = 10;
  /// Share of the places where the maps overlap whose views must match: shelves that are built
  /// similar match here and there, but not along a whole path.
  double min_confirmed = 0.7;
  /// Any other frame must explain fewer places by this factor.
  double distinctness = 2.0;
  /// Drift of both maps, in metres for each metre between two places.
  double max_drift = 0.1;
};
void visit_options(SessionAlignmentOptions& options, OptionVisitor& visitor);

/// The relative pose of the maps of two sessions, with its evidence.
struct SessionAlignment {
  Pose2 first_from_second;  ///< transforms the second map into the frame of the first
  /// Places that lead to this frame: `earlier` is a node of the first session, `later` one of the
  /// second, by their numbers there.
  std::vector<LoopClosure> matches;
  int places = 0;        ///< of the matches, at least half a metre apart
  int other_places = 0;  ///< the same of the next best frame
  /// Places of the second session near a view of the first, at least half a metre apart.
  int expected_places = 0;
  int confirmed_places = 0;  ///< those of them with a match
  std::size_t refuted = 0;   ///< matches that lead elsewhere
};

/// Finds the places that two sessions have in common, by appearance alone: for each view of the
/// second in turn, closures are searched among those of the first. Each gives the frame of the
/// second map in the first; the largest set that agrees counts. nullopt if they are too few, or
/// others nearly as many. All nodes of a map are in one frame. `memory` holds the views of both; a
/// view that is in both is a place in common. Throws OptionError, ContractError on a map that
/// `validate` refuses or whose views are not in the memory. Cost: two searches and some home
/// vectors of 0.3 ms for each node of the second.
[[nodiscard]] std::optional<SessionAlignment> align_sessions(
    const VisualMemory& memory, const TopologicalMap& first, const TopologicalMap& second,
    const SessionAlignmentOptions& options = {});

/// Joins both maps in the frame of the first by the matches, and optimises them as a pose graph, in
/// which both may change. The nodes of the first keep their frame on the whole; its first node is
/// fixed.
[[nodiscard]] TopologicalMap join_sessions(const TopologicalMap& first,
                                           const TopologicalMap& second,
                                           const SessionAlignment& alignment,
                                           const PoseGraphOptions& graph = {});

}  // namespace panonav
