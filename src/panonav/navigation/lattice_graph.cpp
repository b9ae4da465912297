// Graphs of spring lattices: the edges that a robot can follow.

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "panonav/core/disjoint_sets.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/internal/graph_edges.hpp"
#include "panonav/navigation/navigation_graph.hpp"

namespace panonav {

namespace {

/// The part of a spring that navigation needs.
struct Spring {
  EdgeEnds ends;
  std::optional<Pose2> motion;  // a_from_b by the phases, in units of R
  double length = 0.0;          // in the arrangement
  double weight = 0.0;
  bool is_within_component = false;
  bool is_crossing = false;
  int support = 0;  // number of third views that confirm it
};

/// Largest disagreement between a spring's motion and the chain of two motions over a third view:
/// 20 degrees, and this share of the motion's length.
constexpr double max_rotation_error_rad = 0.35;
constexpr double max_position_error_share = 0.4;
/// Largest length of springs that become edges, in spacings. The spacing is estimated a tenth too
/// small (as the minimum of several noisy distances), so this means two spacings: on a square grid,
/// distances between views are 1, 1.41 and 2 spacings.
constexpr double max_edge_spacings = 2.3;
/// Limits for springs that were rejected, perhaps only because the arrangement is distorted: they
/// become edges if they are as short as springs to nearest views and confirmed by this number of
/// third views.
constexpr double max_rejected_edge_spacings = 1.5;
constexpr int min_rejected_edge_support = 3;
/// Smallest share of neighbours that the ends of an edge have in common. On an open square grid
/// with edges up to two spacings, the share is a half for nearest neighbours and a quarter for
/// views two spacings apart; one neighbour may be missing.
constexpr double min_common_share = 0.25;

// Counts for each spring the third views over which two chained motions give the same motion. If
// all three views are of one place, only rotations are compared.
void count_support(std::size_t views, std::vector<Spring>& springs) {
  struct Motion {
    std::size_t to;
    Pose2 motion;
  };
  std::vector<std::vector<Motion>> from(views);
  for (const Spring& spring : springs) {
    if (!spring.motion) continue;
    from[spring.ends.a].push_back({spring.ends.b, *spring.motion});
    from[spring.ends.b].push_back({spring.ends.a, inverse(*spring.motion)});
  }
  for (auto& motions : from) std::ranges::sort(motions, {}, &Motion::to);
  for (Spring& spring : springs) {
    if (!spring.motion) continue;
    for (const Motion& first : from[spring.ends.a]) {
      const auto& onward = from[first.to];
      const auto second = std::ranges::lower_bound(onward, spring.ends.b, {}, &Motion::to);
      if (second == onward.end() || second->to != spring.ends.b) continue;
      const Pose2 around = first.motion * second->motion;
      const double off = distance(around.position(), spring.motion->position());
      const double rotation = angle_difference(around.heading_rad, spring.motion->heading_rad);
      spring.support +=
          static_cast<int>(std::abs(rotation) <= max_rotation_error_rad &&
                           off <= max_position_error_share * get_length(*spring.motion));
    }
  }
}

// Returns for each view the spacing of the references around it, in the unit of `lengths` (one for
// each spring): the median, over the view and its neighbours by springs, of the distance to the
// nearest neighbour. Infinite if no length is known.
std::vector<double> compute_local_spacings(std::size_t views, const std::vector<Spring>& springs,
                                           const std::vector<double>& lengths) {
  constexpr double unknown = std::numeric_limits<double>::infinity();
  std::vector<double> nearest(views, unknown);
  for (std::size_t i = 0; i < springs.size(); ++i) {
    for (const std::size_t node : {springs[i].ends.a, springs[i].ends.b}) {
      if (lengths[i] > 0.0) nearest[node] = std::min(nearest[node], lengths[i]);
    }
  }
  std::vector<std::vector<double>> around(views);
  for (std::size_t node = 0; node < views; ++node) around[node].push_back(nearest[node]);
  for (const Spring& spring : springs) {
    around[spring.ends.a].push_back(nearest[spring.ends.b]);
    around[spring.ends.b].push_back(nearest[spring.ends.a]);
  }
  std::vector<double> spacings;
  for (auto& list : around) {
    std::erase_if(list, [](double length) { return !std::isfinite(length); });
    spacings.push_back(list.empty() ? unknown : upper_median(std::move(list)));
  }
  return spacings;
}

/// An edge that may be kept.
struct Candidate {
  NavigationGraph::Edge edge;
  EdgeEnds ends;
  double spacings = 0.0;        // its length in spacings of the references around
  bool is_bridge_only = false;  // kept only if it joins two components
};

// Makes edges with lengths in units of the local spacing of the references. The unit of phases
// and of the arrangement differs between places, because similarity falls faster with distance
// where objects are near. The length of a kept spring comes from the arrangement, which combines
// the directions of all springs around; that of a rejected spring from its phases.
std::vector<Candidate> make_candidates(const std::vector<ViewId>& views,
                                       const std::vector<Spring>& springs, double min_weight) {
  const auto is_rejected = [&](const Spring& spring) {
    return spring.weight < min_weight || !spring.is_within_component;
  };
  std::vector<double> laid_out;
  std::vector<double> read;
  for (const Spring& spring : springs) {
    laid_out.push_back(is_rejected(spring) ? 0.0 : spring.length);
    read.push_back(spring.motion ? get_length(*spring.motion) : 0.0);
  }
  const std::vector<double> spacings_laid_out =
      compute_local_spacings(views.size(), springs, laid_out);
  const std::vector<double> spacings_read = compute_local_spacings(views.size(), springs, read);
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const Spring& spring = springs[i];
    const auto [a, b] = spring.ends;
    const bool rejected = is_rejected(spring);
    const std::vector<double>& spacings = rejected ? spacings_read : spacings_laid_out;
    const double spacing = 0.5 * (spacings[a] + spacings[b]);
    const double length = rejected ? read[i] : laid_out[i];
    Candidate candidate{
        {views[a], views[b], 0.0, spring.motion}, spring.ends, unknown_length_share};
    if (std::isfinite(spacing) && (length > 0.0 || spring.motion)) {
      candidate.spacings = candidate.edge.length = length / spacing;
    }
    candidate.edge.is_crossing = spring.is_crossing;
    if (read[i] > 0.0) scale_displacement(*candidate.edge.a_from_b, candidate.spacings / read[i]);
    candidate.is_bridge_only =
        !spring.is_crossing &&
        (candidate.spacings > (rejected ? max_rejected_edge_spacings : max_edge_spacings) ||
         (rejected && spring.support < min_rejected_edge_support));
    candidates.push_back(candidate);
  }
  return candidates;
}

// Marks edges whose ends have hardly any neighbour in common. Such edges lead to another place that
// looks similar; a planned path would pass through the wall between the two places.
void mark_isolated_edges(std::size_t views, std::vector<Candidate>& candidates) {
  std::vector<std::vector<std::size_t>> around(views);
  for (const Candidate& candidate : candidates) {
    if (candidate.is_bridge_only) continue;
    around[candidate.ends.a].push_back(candidate.ends.b);
    around[candidate.ends.b].push_back(candidate.ends.a);
  }
  for (auto& list : around) std::ranges::sort(list);
  for (Candidate& candidate : candidates) {
    if (candidate.is_bridge_only || candidate.edge.is_crossing) continue;
    const auto& a = around[candidate.ends.a];
    const auto& b = around[candidate.ends.b];
    const auto common = std::ranges::count_if(
        a, [&](std::size_t node) { return std::ranges::binary_search(b, node); });
    const auto others = static_cast<double>(std::max(a.size(), b.size()) - 1);
    candidate.is_bridge_only = static_cast<double>(common + 1) < min_common_share * others;
  }
}

std::vector<NavigationGraph::Edge> choose_edges(const std::vector<ViewId>& views,
                                                std::vector<Spring> springs, double min_weight) {
  count_support(views.size(), springs);
  std::erase_if(springs, [&](const Spring& spring) {
    return !spring.is_crossing && (spring.weight < min_weight || !spring.is_within_component) &&
           spring.support == 0;
  });
  std::vector<Candidate> candidates = make_candidates(views, springs, min_weight);
  mark_isolated_edges(views.size(), candidates);
  // Sorts marked edges last, the shortest first, so that they are kept only if no other edges
  // connect the two components.
  std::ranges::stable_sort(candidates, {}, [](const Candidate& candidate) {
    return std::pair(candidate.is_bridge_only, candidate.spacings);
  });
  DisjointSets groups(views.size());
  std::vector<NavigationGraph::Edge> kept;
  for (const Candidate& candidate : candidates) {
    const bool joins = groups.join(candidate.ends.a, candidate.ends.b);
    if (joins || !candidate.is_bridge_only) kept.push_back(candidate.edge);
  }
  fill_missing_lengths(kept);
  return kept;
}

}  // namespace

NavigationGraph graph_from_lattice(const Lattice& lattice, double min_weight) {
  std::vector<ViewId> views;
  for (const Lattice::Node& node : lattice.nodes) views.push_back(node.view);
  std::vector<Spring> springs;
  for (const Lattice::Spring& spring : lattice.springs) {
    const Lattice::Node& a = lattice.nodes.at(spring.a);
    const Lattice::Node& b = lattice.nodes.at(spring.b);
    // An arrangement made without phases has no headings, so its edges have no directions.
    springs.push_back({{spring.a, spring.b},
                       spring.phases ? to_motion(*spring.phases) : std::nullopt,
                       distance(a.pose.position(), b.pose.position()),
                       spring.weight,
                       a.component == b.component});
  }
  for (const Lattice::Crossing& crossing : lattice.crossings) {
    springs.push_back({.ends = {crossing.a, crossing.b},
                       .motion = to_motion(crossing.phases),
                       .weight = crossing.probability,
                       .is_crossing = true});
  }
  std::vector<NavigationGraph::Edge> edges = choose_edges(views, std::move(springs), min_weight);
  return {std::move(views), std::move(edges)};
}

NavigationGraph graph_from_stored_lattice(const TopologicalMap& arrangement,
                                          const ViewSource& source, Executor& executor,
                                          double min_weight) {
  validate(arrangement);
  std::vector<ViewId> views;
  for (const TopologicalMap::Node& node : arrangement.nodes) views.push_back(node.view);
  const auto number_of = [&](ViewId view) {
    return static_cast<std::size_t>(std::ranges::lower_bound(views, view) - views.begin());
  };
  std::vector<Link> links;
  std::vector<Spring> springs;
  for (const TopologicalMap::Edge& edge : arrangement.edges) {
    const EdgeEnds ends{number_of(edge.a), number_of(edge.b)};
    const TopologicalMap::Node& a = arrangement.nodes[ends.a];
    const TopologicalMap::Node& b = arrangement.nodes[ends.b];
    links.push_back({edge.a, edge.b, edge.kind});
    springs.push_back({ends, std::nullopt, distance(a.pose.position(), b.pose.position()),
                       edge.weight, a.component == b.component, a.component != b.component});
  }
  const std::vector<NavigationGraph::Edge> read = read_edges(source, links, executor);
  for (std::size_t i = 0; i < springs.size(); ++i) springs[i].motion = read[i].a_from_b;
  std::vector<NavigationGraph::Edge> edges = choose_edges(views, std::move(springs), min_weight);
  return {std::move(views), std::move(edges)};
}

}  // namespace panonav
