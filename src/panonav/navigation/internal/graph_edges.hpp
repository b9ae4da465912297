#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/relative_pose/view_pair.hpp"

namespace panonav {

/// Length of an edge of which nothing is known, over the median length.
inline constexpr double unknown_length_share = 3.0;

/// The two nodes of an edge of a graph or a map.
struct EdgeEnds {
  std::size_t a = 0;
  std::size_t b = 0;
};

/// Multiplies the displacement of a motion.
inline void scale_displacement(Pose2& motion, double factor) {
  motion.x_m *= factor;
  motion.y_m *= factor;
}

/// Returns the length of a motion's displacement.
[[nodiscard]] inline double get_length(const Pose2& motion) {
  return std::hypot(motion.x_m, motion.y_m);
}

/// Returns the mean motion that both views of a reading show; nullopt where they disagree.
[[nodiscard]] std::optional<Pose2> to_motion(const PhaseReading& reading);

/// Sets the length of edges of which neither length nor motion is known from that of the others,
/// and raises those between images of one place to a minimum.
void fill_missing_lengths(std::vector<NavigationGraph::Edge>& edges);

/// Reads edges from the phases of their views; length 0 and no motion where nothing is read.
[[nodiscard]] std::vector<NavigationGraph::Edge> read_edges(const ViewSource& source,
                                                            std::span<const Link> links,
                                                            Executor& executor);

}  // namespace panonav
