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

/// Length assumed for an edge of unknown motion and length, relative to the median length.
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

/// Returns the motion averaged over both views of a reading; nullopt if the views disagree.
[[nodiscard]] std::optional<Pose2> to_motion(const PhaseReading& reading);

/// Sets edges of unknown length and motion to three times the median of the known lengths, and
/// raises lengths between images of one place to a tenth of the median.
void fill_missing_lengths(std::vector<NavigationGraph::Edge>& edges);

/// Computes the edges of the links from the phases of their views. An edge gets length 0 and no
/// motion if no motion can be computed.
[[nodiscard]] std::vector<NavigationGraph::Edge> read_edges(const ViewSource& source,
                                                            std::span<const Link> links,
                                                            Executor& executor);

}  // namespace panonav
