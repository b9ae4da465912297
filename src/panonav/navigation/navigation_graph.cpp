#include "panonav/navigation/navigation_graph.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "panonav/core/disjoint_sets.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/relative_pose/view_pair.hpp"

namespace panonav {

namespace {

// Of the median length: what an edge between pictures of one place costs at least, and what one
// costs of which nothing is known.
constexpr double min_length_share = 0.1;
constexpr double unknown_length_share = 3.0;

void require_valid(const NavigationEdge& edge) {
  require(edge.a != edge.b, "view of an edge", static_cast<double>(edge.a.value),
          "two different views");
  require(std::isfinite(edge.length) && edge.length > 0.0, "length of an edge", edge.length,
          "> 0 and finite");
  if (edge.a_from_b && !is_finite(*edge.a_from_b)) {
    throw ContractError("motion of an edge", "not finite", "finite");
  }
}

void scale_way(Pose2& motion, double factor) {
  motion.x_m *= factor;
  motion.y_m *= factor;
}

double length_of(const Pose2& motion) {
  return std::hypot(motion.x_m, motion.y_m);
}

// The motion that two readings tell: they are averaged, as each has its own error.
std::optional<Pose2> motion_of(const PhaseReading& reading) {
  if (!reading.points) return Pose2{0.0, 0.0, reading.turn_rad};
  if (reading.disagreement_rad > max_disagreement_rad) return std::nullopt;
  const double from_b = reading.direction_b_rad + reading.turn_rad - std::numbers::pi;
  const double direction =
      reading.direction_a_rad + 0.5 * angle_difference(from_b, reading.direction_a_rad);
  return Pose2{reading.length * std::cos(direction), reading.length * std::sin(direction),
               wrap_angle(reading.turn_rad)};
}

// Edges of which neither length nor motion is known get their length from the others, and those
// between pictures of one place a least one.
void complete_lengths(std::vector<NavigationEdge>& edges) {
  std::vector<double> lengths;
  for (const NavigationEdge& edge : edges) {
    if (edge.length > 0.0) lengths.push_back(edge.length);
  }
  const double typical = lengths.empty() ? 1.0 : upper_median(lengths);
  for (NavigationEdge& edge : edges) {
    const bool known = edge.a_from_b || edge.length > 0.0;
    edge.length =
        known ? std::max(edge.length, min_length_share * typical) : unknown_length_share * typical;
  }
}

bool agree(const Pose2& a, const Pose2& b) {
  const double turned = angle_difference(a.heading_rad, b.heading_rad);
  const double aside = angle_difference(std::atan2(a.y_m, a.x_m), std::atan2(b.y_m, b.x_m));
  return std::abs(turned) <= max_disagreement_rad && std::abs(aside) <= max_disagreement_rad;
}

// Whether most triangles with a third view that tell anything say the same of an edge, as
// `arrange` asks; true where there is no triangle at all, and false where none of them tells
// anything.
bool is_supported(const NavigationGraph& graph, const NavigationEdge& edge) {
  const std::size_t a = *graph.node_of(edge.a);
  const std::size_t b = *graph.node_of(edge.b);
  int triangles = 0;
  int telling = 0;
  int closed = 0;
  for (const NavigationGraph::Exit& first : graph.exits(a)) {
    const auto exits = graph.exits(first.node);
    const auto second = std::ranges::lower_bound(exits, b, {}, &NavigationGraph::Exit::node);
    if (second == exits.end() || second->node != b) continue;
    ++triangles;
    const auto a_from_c = graph.motion_from(a, first.edge);
    const auto c_from_b = graph.motion_from(first.node, second->edge);
    if (!a_from_c || !c_from_b) continue;
    ++telling;
    closed += static_cast<int>(agree(*edge.a_from_b, *a_from_c * *c_from_b));
  }
  return triangles == 0 || 2 * closed > telling;
}

// Reads some edges from the phases of their views, which are all held at once.
void read_some_edges(const ViewSource& source, std::span<const Link> links,
                     std::span<NavigationEdge> edges, Executor& executor) {
  std::set<ViewId> wanted;
  for (const Link& link : links) wanted.insert({link.a, link.b});
  const VisualMemory memory = source.load(std::vector<ViewId>(wanted.begin(), wanted.end()));
  constexpr std::size_t links_per_chunk = 64;
  executor.for_chunks(
      links.size(), links_per_chunk, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t i = begin; i < end; ++i) {
          edges[i] = {links[i].a, links[i].b, 0.0, std::nullopt};
          const auto reading = read_phases(homing_view(memory.signature(links[i].a)),
                                           homing_view(memory.signature(links[i].b)));
          if (!reading) continue;
          edges[i].a_from_b = motion_of(*reading);
          if (edges[i].a_from_b) edges[i].length = reading->length;
        }
      });
}

// Length 0 and no motion where nothing tells.
std::vector<NavigationEdge> read_edges(const ViewSource& source, std::span<const Link> links,
                                       Executor& executor) {
  std::vector<NavigationEdge> edges(links.size());
  constexpr std::size_t links_at_once = 2048;
  for (std::size_t first = 0; first < links.size(); first += links_at_once) {
    const std::size_t count = std::min(links_at_once, links.size() - first);
    read_some_edges(source, links.subspan(first, count), std::span(edges).subspan(first, count),
                    executor);
  }
  return edges;
}

}  // namespace

NavigationGraph::NavigationGraph(std::vector<ViewId> views, std::vector<NavigationEdge> edges)
    : views_(std::move(views)), begins_(views_.size() + 1) {
  for (std::size_t i = 1; i < views_.size(); ++i) {
    require(views_[i - 1] < views_[i], "views", static_cast<double>(views_[i].value), "ascending");
  }
  struct Ends {
    std::size_t low, high, edge;
  };
  std::vector<Ends> ends;
  for (const NavigationEdge& edge : edges) {
    require_valid(edge);
    const auto a = node_of(edge.a);
    const auto b = node_of(edge.b);
    require(a && b, "view of an edge", static_cast<double>((a ? edge.b : edge.a).value),
            "a view of the graph");
    ends.push_back({std::min(*a, *b), std::max(*a, *b), ends.size()});
  }
  std::ranges::sort(ends, {}, [](const Ends& e) { return std::tuple(e.low, e.high, e.edge); });
  ends.erase(
      std::unique(ends.begin(), ends.end(),
                  [](const Ends& x, const Ends& y) { return x.low == y.low && x.high == y.high; }),
      ends.end());
  for (const Ends& e : ends) {
    ++begins_[e.low + 1];
    ++begins_[e.high + 1];
  }
  std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
  exits_.resize(begins_.back());
  std::vector<std::size_t> next(begins_.begin(), begins_.end() - 1);
  // In this order the lower ends of a node come before its higher ones, both ascending.
  for (const Ends& e : ends) {
    exits_[next[e.high]++] = {e.low, edges_.size()};
    edges_.push_back(edges[e.edge]);
  }
  for (std::size_t p = 0; p < ends.size(); ++p) exits_[next[ends[p].low]++] = {ends[p].high, p};
}

std::optional<std::size_t> NavigationGraph::node_of(ViewId view) const {
  const auto found = std::ranges::lower_bound(views_, view);
  if (found == views_.end() || *found != view) return std::nullopt;
  return static_cast<std::size_t>(found - views_.begin());
}

std::optional<Pose2> NavigationGraph::motion_from(std::size_t node, std::size_t edge) const {
  const NavigationEdge& p = edges_.at(edge);
  if (!p.a_from_b || views_.at(node) == p.a) return p.a_from_b;
  return inverse(*p.a_from_b);
}

std::vector<std::size_t> nodes_around(const NavigationGraph& graph,
                                      std::span<const std::size_t> from, int links) {
  std::set<std::size_t> found(from.begin(), from.end());
  std::vector<std::size_t> front(found.begin(), found.end());
  for (int i = 0; i < links && !front.empty(); ++i) {
    std::vector<std::size_t> next;
    for (const std::size_t node : front) {
      for (const NavigationGraph::Exit& exit : graph.exits(node)) {
        if (found.insert(exit.node).second) next.push_back(exit.node);
      }
    }
    front.swap(next);
  }
  return {found.begin(), found.end()};
}

NavigationGraph graph_of_links(const ViewSource& source, std::span<const Link> links,
                               Executor& executor) {
  const std::span<const ViewId> views = source.views();
  std::vector<NavigationEdge> edges = read_edges(source, links, executor);
  std::vector<NavigationEdge> read = edges;
  complete_lengths(read);
  const NavigationGraph graph({views.begin(), views.end()}, std::move(read));
  for (NavigationEdge& edge : edges) {
    if (edge.a_from_b && !is_supported(graph, edge)) {
      edge = {edge.a, edge.b, 0.0, std::nullopt};
    }
  }
  complete_lengths(edges);
  return {{views.begin(), views.end()}, std::move(edges)};
}

NavigationGraph graph_of_map(const TopologicalMap& map, double min_weight) {
  validate(map);
  std::vector<ViewId> views;
  for (const MapNode& node : map.nodes) views.push_back(node.view);
  std::vector<NavigationEdge> edges;
  for (const MapEdge& edge : map.edges) {
    if (edge.weight < min_weight) continue;
    const MapNode& a = *std::ranges::lower_bound(map.nodes, edge.a, {}, &MapNode::view);
    const MapNode& b = *std::ranges::lower_bound(map.nodes, edge.b, {}, &MapNode::view);
    if (a.component != b.component) continue;
    const Pose2 a_from_b = inverse(a.pose) * b.pose;
    edges.push_back({edge.a, edge.b, length_of(a_from_b), a_from_b});
  }
  complete_lengths(edges);
  return {std::move(views), std::move(edges)};
}

namespace {

struct NodePair {
  std::size_t a = 0;
  std::size_t b = 0;
};

// Nodes of one component of a map within `reach` of each other, without those that have an edge.
std::vector<NodePair> near_pairs(const TopologicalMap& map, double reach) {
  std::set<std::pair<ViewId, ViewId>> known;
  for (const MapEdge& edge : map.edges) known.insert(std::minmax(edge.a, edge.b));
  // From west to east, so that those too far to the east need not be looked at.
  std::vector<std::size_t> order(map.nodes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return map.nodes[i].pose.x_m; });
  std::vector<NodePair> pairs;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const MapNode& node = map.nodes[order[i]];
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const MapNode& other = map.nodes[order[j]];
      if (other.pose.x_m - node.pose.x_m > reach) break;
      if (other.component != node.component ||
          distance(node.pose.position(), other.pose.position()) > reach ||
          known.contains(std::minmax(node.view, other.view))) {
        continue;
      }
      pairs.push_back({std::min(order[i], order[j]), std::max(order[i], order[j])});
    }
  }
  std::ranges::sort(pairs, {}, [](const NodePair& p) { return std::pair(p.a, p.b); });
  return pairs;
}

}  // namespace

NavigationGraph graph_of_map_and_neighbours(const TopologicalMap& map, const VisualMemory& memory,
                                            Executor& executor, double min_weight) {
  const NavigationGraph mapped = graph_of_map(map, min_weight);
  if (mapped.edges().empty()) return mapped;
  std::vector<double> lengths;
  std::vector<double> differences;
  for (const NavigationEdge& edge : mapped.edges()) {
    lengths.push_back(edge.length);
    differences.push_back(image_difference(homing_view(memory.signature(edge.a)),
                                           homing_view(memory.signature(edge.b))));
  }
  // What a grid's diagonal is to its spacing; as different as nearly all edges are.
  const double reach = 1.5 * upper_median(lengths);
  const double max_difference = quantile(differences, 0.9);
  const std::vector<NodePair> pairs = near_pairs(map, reach);
  std::vector<std::optional<NavigationEdge>> found(pairs.size());
  constexpr std::size_t pairs_per_chunk = 64;
  executor.for_chunks(
      pairs.size(), pairs_per_chunk, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t i = begin; i < end; ++i) {
          const MapNode& a = map.nodes[pairs[i].a];
          const MapNode& b = map.nodes[pairs[i].b];
          const HomingView view_a = homing_view(memory.signature(a.view));
          const HomingView view_b = homing_view(memory.signature(b.view));
          if (image_difference(view_a, view_b) > max_difference) continue;
          const Pose2 laid_out = inverse(a.pose) * b.pose;
          const auto reading =
              read_phases(view_a, view_b, TurnHint{.turn_rad = laid_out.heading_rad});
          if (!reading || reading->disagreement_rad > max_disagreement_rad) continue;
          auto motion = motion_of(*reading);
          if (!motion) continue;
          const double length = length_of(laid_out);
          const double read = length_of(*motion);
          if (read > 0.0) scale_way(*motion, length / read);
          found[i] = NavigationEdge{a.view, b.view, length, motion};
        }
      });
  std::vector<NavigationEdge> edges(mapped.edges().begin(), mapped.edges().end());
  for (const auto& edge : found) {
    if (edge) edges.push_back(*edge);
  }
  complete_lengths(edges);
  return {{mapped.views().begin(), mapped.views().end()}, std::move(edges)};
}

namespace {

// A spring as navigation sees it.
struct Spring {
  NodePair ends;
  std::optional<Pose2> motion;  // a_from_b by the phases; unit R
  double length = 0.0;          // in the arrangement
  double weight = 0.0;
  bool one_component = false;
  int support = 0;  // third views that confirm it
};

// Counts for each spring the third views that tell the same motion. Those of one place confirm the
// turn alone.
void count_support(std::size_t views, std::vector<Spring>& springs) {
  // A third view joins two readings, each with the error of one.
  constexpr double max_turn_rad = 0.35;
  constexpr double max_off = 0.4;  // of the motion's length
  struct Way {
    std::size_t to;
    Pose2 motion;
  };
  std::vector<std::vector<Way>> ways(views);
  for (const Spring& spring : springs) {
    if (!spring.motion) continue;
    ways[spring.ends.a].push_back({spring.ends.b, *spring.motion});
    ways[spring.ends.b].push_back({spring.ends.a, inverse(*spring.motion)});
  }
  for (auto& list : ways) std::ranges::sort(list, {}, &Way::to);
  for (Spring& spring : springs) {
    if (!spring.motion) continue;
    for (const Way& first : ways[spring.ends.a]) {
      const auto& onward = ways[first.to];
      const auto second = std::ranges::lower_bound(onward, spring.ends.b, {}, &Way::to);
      if (second == onward.end() || second->to != spring.ends.b) continue;
      const Pose2 around = first.motion * second->motion;
      const double off = distance(around.position(), spring.motion->position());
      const double turned = angle_difference(around.heading_rad, spring.motion->heading_rad);
      spring.support += static_cast<int>(std::abs(turned) <= max_turn_rad &&
                                         off <= max_off * length_of(*spring.motion));
    }
  }
}

// By view: how far apart references are around it, in the unit of `lengths`, which are by spring:
// the median distance to the nearest one, of the view and those that springs join to it. Infinite
// where nothing is told.
std::vector<double> spacings_around(std::size_t views, const std::vector<Spring>& springs,
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

// An edge that may be kept.
struct Candidate {
  NavigationEdge edge;
  NodePair ends;
  double far = 0.0;         // in spacings of the references around
  bool joins_only = false;  // kept only where without it two components would not be joined
};

// How long the edges of springs are, in spacings of the references around: similarity falls faster
// with distance where things are near, so that the unit of phases and of the arrangement changes
// from place to place. What the arrangement kept it laid out by the directions of all springs
// around; of what it gave up the phases alone tell how far it leads.
std::vector<Candidate> candidates_of(const std::vector<ViewId>& views,
                                     const std::vector<Spring>& springs, double min_weight) {
  // The distance to the nearest of several views, each with an error, is a tenth below the spacing,
  // so this means two spacings: views of a square grid have others at 1.41 and 2.
  constexpr double max_spacings = 2.3;
  // An arrangement that is torn gives right springs up; so many third views speak for one then,
  // and it must be as short as those to nearest views are.
  constexpr int enough_support = 3;
  constexpr double max_spacings_of_rejected = 1.5;
  const auto is_rejected = [&](const Spring& spring) {
    return spring.weight < min_weight || !spring.one_component;
  };
  std::vector<double> laid_out;
  std::vector<double> seen;
  for (const Spring& spring : springs) {
    laid_out.push_back(is_rejected(spring) ? 0.0 : spring.length);
    seen.push_back(spring.motion ? length_of(*spring.motion) : 0.0);
  }
  const std::vector<double> spacings_laid_out = spacings_around(views.size(), springs, laid_out);
  const std::vector<double> spacings_seen = spacings_around(views.size(), springs, seen);
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const Spring& spring = springs[i];
    const auto [a, b] = spring.ends;
    const bool rejected = is_rejected(spring);
    const std::vector<double>& spacings = rejected ? spacings_seen : spacings_laid_out;
    const double spacing = 0.5 * (spacings[a] + spacings[b]);
    const double length = rejected ? seen[i] : laid_out[i];
    Candidate candidate{
        {views[a], views[b], 0.0, spring.motion}, spring.ends, unknown_length_share};
    if (std::isfinite(spacing) && (length > 0.0 || spring.motion)) {
      candidate.far = candidate.edge.length = length / spacing;
    }
    if (seen[i] > 0.0) scale_way(*candidate.edge.a_from_b, candidate.far / seen[i]);
    candidate.joins_only = candidate.far > (rejected ? max_spacings_of_rejected : max_spacings) ||
                           (rejected && spring.support < enough_support);
    candidates.push_back(candidate);
  }
  return candidates;
}

// An edge whose ends have hardly any neighbour in common leads to another place that looks alike:
// ways would be planned through it as through a hole in the wall.
void doubt_lonely_edges(std::size_t views, std::vector<Candidate>& candidates) {
  // On an open square grid with edges up to two spacings nearest neighbours have half of theirs
  // in common, views two spacings apart a quarter. One of these may be missing.
  constexpr double min_common = 0.25;
  std::vector<std::vector<std::size_t>> around(views);
  for (const Candidate& candidate : candidates) {
    if (candidate.joins_only) continue;
    around[candidate.ends.a].push_back(candidate.ends.b);
    around[candidate.ends.b].push_back(candidate.ends.a);
  }
  for (auto& list : around) std::ranges::sort(list);
  for (Candidate& candidate : candidates) {
    if (candidate.joins_only) continue;
    const auto& a = around[candidate.ends.a];
    const auto& b = around[candidate.ends.b];
    const auto common = std::ranges::count_if(
        a, [&](std::size_t node) { return std::ranges::binary_search(b, node); });
    const auto others = static_cast<double>(std::max(a.size(), b.size()) - 1);
    candidate.joins_only = static_cast<double>(common + 1) < min_common * others;
  }
}

// The edges of the springs that may be kept.
std::vector<NavigationEdge> edges_of(const std::vector<ViewId>& views, std::vector<Spring> springs,
                                     double min_weight) {
  count_support(views.size(), springs);
  std::erase_if(springs, [&](const Spring& spring) {
    return (spring.weight < min_weight || !spring.one_component) && spring.support == 0;
  });
  std::vector<Candidate> candidates = candidates_of(views, springs, min_weight);
  doubt_lonely_edges(views.size(), candidates);
  // Those in doubt last, and the nearest first: so they are left out where others lead there, too.
  std::ranges::stable_sort(candidates, {}, [](const Candidate& candidate) {
    return std::pair(candidate.joins_only, candidate.far);
  });
  DisjointSets groups(views.size());
  std::vector<NavigationEdge> kept;
  for (const Candidate& candidate : candidates) {
    const bool joins = groups.join(candidate.ends.a, candidate.ends.b);
    if (joins || !candidate.joins_only) kept.push_back(candidate.edge);
  }
  complete_lengths(kept);
  return kept;
}

}  // namespace

NavigationGraph graph_of_lattice(const Lattice& lattice, double min_weight) {
  std::vector<ViewId> views;
  for (const LatticeNode& node : lattice.nodes) views.push_back(node.view);
  std::vector<Spring> springs;
  for (const LatticeSpring& spring : lattice.springs) {
    const LatticeNode& a = lattice.nodes.at(spring.a);
    const LatticeNode& b = lattice.nodes.at(spring.b);
    // Without phases the arrangement knows no headings, and so no direction in the frame of a view.
    springs.push_back({{spring.a, spring.b},
                       spring.phases ? motion_of(*spring.phases) : std::nullopt,
                       distance(a.pose.position(), b.pose.position()),
                       spring.weight,
                       a.component == b.component});
  }
  std::vector<NavigationEdge> edges = edges_of(views, std::move(springs), min_weight);
  return {std::move(views), std::move(edges)};
}

NavigationGraph graph_of_stored_lattice(const TopologicalMap& arrangement, const ViewSource& source,
                                        Executor& executor, double min_weight) {
  validate(arrangement);
  std::vector<ViewId> views;
  for (const MapNode& node : arrangement.nodes) views.push_back(node.view);
  const auto number_of = [&](ViewId view) {
    return static_cast<std::size_t>(std::ranges::lower_bound(views, view) - views.begin());
  };
  std::vector<Link> links;
  std::vector<Spring> springs;
  for (const MapEdge& edge : arrangement.edges) {
    const NodePair ends{number_of(edge.a), number_of(edge.b)};
    const MapNode& a = arrangement.nodes[ends.a];
    const MapNode& b = arrangement.nodes[ends.b];
    links.push_back({edge.a, edge.b, edge.kind});
    springs.push_back({ends, std::nullopt, distance(a.pose.position(), b.pose.position()),
                       edge.weight, a.component == b.component});
  }
  const std::vector<NavigationEdge> read = read_edges(source, links, executor);
  for (std::size_t i = 0; i < springs.size(); ++i) springs[i].motion = read[i].a_from_b;
  std::vector<NavigationEdge> edges = edges_of(views, std::move(springs), min_weight);
  return {std::move(views), std::move(edges)};
}

}  // namespace panonav
