#include "panonav/mapping/internal/lattice_growth.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>

#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/internal/join_evidence.hpp"
#include "panonav/mapping/internal/lattice_graph.hpp"
#include "panonav/mapping/internal/lattice_springs.hpp"

namespace panonav {

namespace {

/// Smallest odds to attach a single remaining view, which can misplace nothing but itself.
constexpr double min_odds_of_single_views = 1.0;
/// Number of final averages of each component; further ones change positions by less than the
/// resolution of phases.
constexpr int final_average_rounds = 3;
/// Largest number of pairs of views that are proposed for two components that may be adjacent; each
/// costs one phase reading.
constexpr std::size_t max_proposals = 50;
/// Largest errors of directions and lengths in the final layout. They are wide, as lengths from
/// phases are in units of the distance of the things around, which varies.
constexpr double direction_tolerance_rad = 3.0 * turn_tolerance_rad;
constexpr double length_tolerance_factor = 3.0;

class Grower {
 public:
  Grower(std::size_t nodes, std::span<const Lattice::Spring> springs, double unit,
         const LatticeLayout& start, const LatticeStepCallback& step_callback)
      : step_callback_(step_callback), layout_(nodes, make_links(nodes, springs, unit), start) {}

  GrownLayout grow() {
    push_all_joins();
    join_most_certain_first();
    attach_single_views();
    GrownLayout result{.proposals = propose_pairs()};
    for (std::size_t p = 0; p < layout_.size(); ++p) {
      for (int i = 0; i < final_average_rounds && layout_.members(p).size() > 1; ++i)
        layout_.average(p);
    }
    set_weights_and_energy(result);
    fill_layout(result.layout);
    result.iterations = layout_.iterations();
    return result;
  }

 private:
  struct Join {
    double evidence;
    std::size_t p, q;
    Pose2 p_from_q;
    bool operator<(const Join& other) const {
      return std::tie(evidence, other.p, other.q) < std::tie(other.evidence, p, q);
    }
  };

  /// Returns the join of two components; nullopt where the evidence is too weak.
  [[nodiscard]] std::optional<Join> find_join(std::size_t p, std::size_t q) const {
    const auto size = [&](std::size_t component) { return layout_.members(component).size(); };
    if (std::pair(size(p), q) < std::pair(size(q), p)) std::swap(p, q);
    const JoinHypothesis best = find_best_hypothesis(layout_, p, q);
    const auto misplaced = static_cast<double>(size(q));
    if (best.evidence < std::log(min_join_odds * misplaced)) return std::nullopt;
    return Join{best.evidence, p, q, best.p_from_q};
  }
  void push_join_if_likely(std::size_t p, std::size_t q) {
    if (const auto found = find_join(p, q)) open_.push(*found);
  }
  void push_all_joins() {
    for (std::size_t p = 0; p < layout_.size(); ++p) {
      for (const auto& [q, links] : layout_.neighbours(p)) {
        if (q > p) push_join_if_likely(p, q);
      }
    }
  }

  void join_most_certain_first() {
    while (!open_.empty()) {
      const Join next = open_.top();
      open_.pop();
      // Later joins and averages may have changed the evidence.
      if (!layout_.neighbours(next.p).contains(next.q)) continue;
      const auto found = find_join(next.p, next.q);
      if (!found) continue;
      if (found->evidence < next.evidence) {
        open_.push(*found);
        continue;
      }
      const auto changed = layout_.join(found->p, found->q, found->p_from_q);
      if (step_callback_) step_callback_(layout_.poses(), layout_.components());
      for (const std::size_t other : changed) push_join_if_likely(found->p, other);
    }
  }

  /// Attaches remaining single views where the evidence is positive.
  void attach_single_views() {
    std::vector<Join> found;
    for (std::size_t view = 0; view < layout_.size(); ++view) {
      if (layout_.members(view).size() != 1) continue;
      std::optional<Join> best;
      for (const auto& [p, unused] : layout_.neighbours(view)) {
        if (layout_.members(p).size() < 2) continue;
        const JoinHypothesis here = find_best_hypothesis(layout_, p, view);
        if (here.evidence < std::log(min_odds_of_single_views)) continue;
        if (!best || here.evidence > best->evidence) {
          best = Join{here.evidence, p, view, here.p_from_q};
        }
      }
      if (best) found.push_back(*best);
    }
    for (const Join& each : found) layout_.attach(each.p, each.q, each.p_from_q);
  }

  /// Returns pairs of views that would be near each other if the best relative pose of their
  /// components were right, where the evidence for it is positive.
  [[nodiscard]] std::vector<NodePair> propose_pairs() const {
    std::vector<NodePair> proposals;
    for (std::size_t p = 0; p < layout_.size(); ++p) {
      for (const auto& [q, unused] : layout_.neighbours(p)) {
        if (q < p) continue;
        const JoinHypothesis best = find_best_hypothesis(layout_, p, q);
        if (!(best.evidence > 0.0)) continue;
        const auto near = find_near_pairs(p, q, best.p_from_q);
        for (std::size_t i = 0; i < std::min(max_proposals, near.size()); ++i) {
          proposals.push_back(near[i].second);
        }
      }
    }
    return proposals;
  }
  /// Returns distances and pairs of views of both components, the nearest first.
  [[nodiscard]] std::vector<std::pair<double, NodePair>> find_near_pairs(
      std::size_t p, std::size_t q, const Pose2& p_from_q) const {
    std::vector<std::pair<double, NodePair>> near;
    for (const std::size_t b : layout_.members(q)) {
      const Point2 at = (p_from_q * layout_.poses()[b]).position();
      for (const std::size_t a : layout_.members(p)) {
        const double apart = distance(at, layout_.poses()[a].position());
        if (apart < near_distance_in_links * layout_.typical_length()) {
          near.emplace_back(apart, std::minmax(a, b));
        }
      }
    }
    std::ranges::sort(near);
    return near;
  }

  void set_weights_and_energy(GrownLayout& result) const {
    const auto poses = layout_.poses();
    for (const LatticeLink& link : layout_.links()) {
      if (!layout_.is_inside(link)) continue;
      const Point2 read = (poses[link.a] * link.step).position();
      const double gap =
          distance(read, poses[link.b].position()) / (position_tolerance * link.length);
      const double weight = 1.0 / ((1.0 + gap * gap) * (1.0 + gap * gap));
      result.weights.emplace(NodePair{link.a, link.b}, weight);
      result.energy += weight * gap * gap;
    }
  }

  void fill_layout(LatticeLayout& layout) const {
    std::vector<GraphEdge> edges;
    for (std::size_t p = 0; p < layout_.size(); ++p) {
      for (const std::size_t view : layout_.members(p)) {
        if (view != p) edges.push_back({p, view, 1.0});
      }
    }
    layout.components = LatticeGraph(layout_.size(), edges).components();
    layout.poses.assign(layout_.poses().begin(), layout_.poses().end());
    layout.handedness_known.assign(layout_.size(), 0);
    for (const GraphEdge& edge : edges) layout.handedness_known[layout.components[edge.a]] = 1;
  }

  const LatticeStepCallback& step_callback_;
  ComponentLayout layout_;
  std::priority_queue<Join> open_;
};

}  // namespace

bool fits_layout(const Lattice::Spring& spring, double unit, const Pose2& a, const Pose2& b) {
  if (!spring.phases || !has_agreeing_views(spring)) return false;
  const Pose2 read = spring.phases->a_from_b(unit);
  const Pose2 layout = inverse(a) * b;
  if (std::abs(angle_difference(read.heading_rad, layout.heading_rad)) > turn_tolerance_rad) {
    return false;
  }
  if (!spring.phases->has_direction) return true;
  const double direction_rad = std::atan2(read.y_m, read.x_m);
  const double apart = std::hypot(layout.x_m, layout.y_m);
  const double length = unit * spring.phases->length;
  return std::abs(angle_difference(direction_rad, std::atan2(layout.y_m, layout.x_m))) <=
             direction_tolerance_rad &&
         apart <= length_tolerance_factor * length && length <= length_tolerance_factor * apart;
}

GrownLayout grow_components(std::size_t nodes, std::span<const Lattice::Spring> springs,
                            double unit, const LatticeLayout& start,
                            const LatticeStepCallback& step_callback) {
  return Grower(nodes, springs, unit, start, step_callback).grow();
}

}  // namespace panonav
