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

/// Poses of all nodes, each in the frame of its connected component.
struct LatticeLayout {
  std::vector<Pose2> poses;
  std::vector<std::size_t> components;          ///< number of each node's component
  std::vector<unsigned char> handedness_known;  ///< of each component
};

/// Lays out `nodes` views by the rest lengths of the springs, component by component: positions by
/// multidimensional scaling of the shortest paths, headings along the springs whose views agree
/// best. Each component is mirrored if this fits the directions better. Cost: landmarks * (springs
/// log n) + landmarks^3.
[[nodiscard]] LatticeLayout lay_out_by_springs(std::size_t nodes,
                                               std::span<const Lattice::Spring> springs,
                                               int landmarks);

/// Lays out `nodes` views by following the motions from node to node. A spring between the same two
/// nodes replaces turn and direction of a motion if its phases are compatible with it.
[[nodiscard]] LatticeLayout lay_out_by_motion(std::size_t nodes,
                                              std::span<const NodeMotion> motions,
                                              std::span<const Lattice::Spring> springs);

/// True if the phases are within three standard deviations of the motion.
[[nodiscard]] bool is_compatible(const PhaseReading& phases, const CoarseMotion& motion);

}  // namespace panonav
