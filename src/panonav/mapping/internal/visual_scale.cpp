#include "panonav/mapping/internal/visual_scale.hpp"

#include <algorithm>
#include <vector>

#include "panonav/mapping/visual_odometry.hpp"

namespace panonav {

std::optional<double> estimate_visual_scale_m(const VisualMemory& memory,
                                              const TopologicalMap& map) {
  constexpr std::size_t max_edges = 200;  // the median of 200 ratios errs by a few percent
  const auto pose_of = [&](ViewId view) {
    return std::ranges::lower_bound(map.nodes, view, {}, &TopologicalMap::Node::view)->pose;
  };
  std::vector<KnownLength> lengths;
  for (std::size_t i = 0; i < std::min(max_edges, map.edges.size()); ++i) {
    const TopologicalMap::Edge& edge = map.edges[i];
    const auto step =
        visual_step(OdometryView(memory.signature(edge.a)), OdometryView(memory.signature(edge.b)));
    if (!step) continue;
    lengths.push_back(
        {step->length_in_views, distance(pose_of(edge.a).position(), pose_of(edge.b).position())});
  }
  return length_scale_m(lengths);
}

}  // namespace panonav
