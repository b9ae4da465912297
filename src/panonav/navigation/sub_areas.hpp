#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/navigation/navigation_graph.hpp"

namespace panonav {

/// Size of areas, and the effort of the cut.
struct SubAreaOptions {
  int views_per_area = 200;  ///< aimed at
  int iterations = 300;      ///< relaxation steps for each cut
};
void visit_options(SubAreaOptions& options, OptionVisitor& visitor);

/// The views of a graph in areas. Every area is connected within itself.
struct SubAreas {
  std::vector<std::size_t> area_of;             ///< by node
  std::vector<std::size_t> place_of;            ///< by node: its index among those of its area
  std::vector<std::vector<std::size_t>> nodes;  ///< of each area, ascending
  std::vector<std::size_t> gates;               ///< edges between two areas, ascending
};

/// Puts all views into one area, connected or not.
[[nodiscard]] SubAreas make_single_area(const NavigationGraph& graph);

/// Divides the views along the bottlenecks of the graph, as doors are, into connected areas of
/// similar size: the outlook of [M04 section 3.5]. Components are halved repeatedly. The views of a
/// component are put in order by the second eigenvector of its normalised Laplacian (Shi and Malik
/// 2000), relaxed from the distances to its outermost view, and cut where the normalised cut is
/// least, the smaller side having at least a third. Fragments go to the other side. Components that
/// nothing connects are areas of their own, however small. Deterministic. Throws OptionError. Cost:
/// O(iterations edges log(areas)); half a second for 10,000 views with 12 links each.
[[nodiscard]] SubAreas divide_into_areas(const NavigationGraph& graph,
                                         const SubAreaOptions& options = {});

/// Returns 1 for each node at most `links` edges away from a narrow gate, as doors are; 0 for the
/// others. In the open, an area of n views is about sqrt(n) of them across, and its border has
/// three times as many edges; a third of that, over the smaller area, is narrow.
[[nodiscard]] std::vector<std::uint8_t> find_bottlenecks(const NavigationGraph& graph,
                                                         const SubAreas& areas, int links);

}  // namespace panonav
