#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/mapping/lattice.hpp"

namespace panonav {

/// A coarse motion between two nodes.
struct NodeMotion {
  std::size_t a = 0;
  std::size_t b = 0;
  CoarseMotion motion;
};

/// The poses from which relaxation starts.
struct LatticeStart {
  std::vector<Pose2> poses;
  std::vector<std::size_t> components;          ///< number of each node's component
  std::vector<unsigned char> handedness_known;  ///< of each component
};

/// Lays out `nodes` views by the rest lengths of the springs: multidimensional scaling of the
/// shortest paths, component by component; headings along the springs whose views agree best; the
/// mirror image that fits the directions better. Cost: landmarks * (springs log n) + landmarks^3.
[[nodiscard]] LatticeStart lay_out_by_springs(std::size_t nodes,
                                              std::span<const Lattice::Spring> springs,
                                              int landmarks);

/// Follows the motions from node to node, component by component; a spring between the same two
/// nodes gives turn and direction where its phases are compatible with the motion.
[[nodiscard]] LatticeStart lay_out_by_motion(std::size_t nodes, std::span<const NodeMotion> motions,
                                             std::span<const Lattice::Spring> springs);

/// True if the phases are within three standard deviations of the motion.
[[nodiscard]] bool is_compatible(const PhaseReading& phases, const CoarseMotion& motion);

}  // namespace panonav
