#pragma once

#include "panonav/mapping/lattice.hpp"
#include "panonav/mapping/topological_map.hpp"

namespace panonav {

/// The arrangement as a map that can be stored and exported: its views with their poses and
/// components, and its springs as edges of kind `neighbour` with the motion that the poses give and
/// the weight that the spring kept. Lengths are in the lattice's unit.
[[nodiscard]] TopologicalMap map_of(const Lattice& lattice);

}  // namespace panonav
