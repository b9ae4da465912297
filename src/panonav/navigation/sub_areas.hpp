#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/navigation/navigation_graph.hpp"

namespace panonav {

/// Options of areas: their size and the effort for finding cuts.
struct SubAreaOptions {
  int views_per_area = 200;  ///< intended number
  int iterations = 300;      ///< relaxation steps for each cut
};
void visit_options(SubAreaOptions& options, OptionVisitor& visitor);

/// The views of a graph in areas. Every area is connected within itself.
struct SubAreas {
  std::vector<std::size_t> area_of;             ///< by node
  std::vector<std::size_t> index_in_area;       ///< by node: its index in `nodes` of its area
  std::vector<std::vector<std::size_t>> nodes;  ///< of each area, ascending
  std::vector<std::size_t> gates;               ///< edges between two areas, ascending
};

/// Puts all views into one area, connected or not.
[[nodiscard]] SubAreas make_single_area(const NavigationGraph& graph);

/// Divides the views at bottlenecks of the graph, such as doors, into connected areas of similar
/// size: the outlook of [M04 section 3.5]. Bisects components repeatedly: sorts the views of a
/// component by the second eigenvector of its normalised Laplacian (Shi and Malik 2000),
/// approximated by relaxation from the distances to its outermost view, and cuts where the
/// normalised cut is smallest; the smaller side has at least a third of the views. Fragments of a
/// side move to the other side. Unconnected components become separate areas, however small.
/// Deterministic. Throws OptionError. Cost: O(iterations edges log(areas)); half a second for
/// 10,000 views with 12 links each.
[[nodiscard]] SubAreas divide_into_areas(const NavigationGraph& graph,
                                         const SubAreaOptions& options = {});

/// Returns 1 for each node at most `links` edges away from a narrow gate, as doors are; 0 for the
/// others. A border of two areas is narrow if it has at most sqrt(n) edges, where n is the
/// number of views of the smaller area. In open space, a border is about sqrt(n) views long and has
/// three times as many edges.
[[nodiscard]] std::vector<std::uint8_t> find_bottlenecks(const NavigationGraph& graph,
                                                         const SubAreas& areas, int links);

}  // namespace panonav
