#include "panonav/mapping/internal/node_motions.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/mapping/internal/lattice_graph.hpp"

namespace panonav {

namespace {

/// Number of standard deviations of a motion's rotation within which phases are searched: normal
/// errors exceed it once in 370 times.
constexpr double max_heading_deviations = 3.0;

void check(const CoarseMotion& motion, const VisualMemory& memory) {
  const double sum = motion.step.x_m + motion.step.y_m + motion.step.heading_rad;
  require(std::isfinite(sum), "step of a motion", sum, "finite");
  for (const double deviation :
       {motion.distance_deviation_m, motion.direction_deviation_rad, motion.turn_deviation_rad}) {
    require(std::isfinite(deviation) && deviation > 0.0, "deviation of a motion", deviation,
            "finite and > 0");
  }
  for (const ViewId view : {motion.from, motion.to}) {
    require(memory.contains(view), "view of a motion", view.value, "a view of the memory");
  }
}

}  // namespace

NodeMotions::NodeMotions(const VisualMemory& memory, std::span<const CoarseMotion> motions) {
  const auto ids = memory.views();
  const auto node_of = [&](ViewId view) {
    return static_cast<std::size_t>(std::ranges::lower_bound(ids, view) - ids.begin());
  };
  for (const CoarseMotion& step : motions) {
    check(step, memory);
    if (step.from == step.to) continue;
    motions_.push_back({node_of(step.from), node_of(step.to), step});
    first_.try_emplace(std::minmax(motions_.back().a, motions_.back().b), motions_.size() - 1);
  }
}

const NodeMotion* NodeMotions::find(NodePair pair) const {
  const auto found = first_.find(pair);
  return found == first_.end() ? nullptr : &motions_[found->second];
}

bool NodeMotions::are_all_connected(std::size_t nodes) const {
  if (motions_.empty()) return false;
  std::vector<GraphEdge> edges;
  for (const NodeMotion& motion : motions_) edges.push_back({motion.a, motion.b, 1.0});
  const auto components = LatticeGraph(nodes, edges).components();
  return std::ranges::count(components, 0U) == static_cast<long>(nodes);
}

std::optional<HeadingWindow> NodeMotions::heading_between(NodePair pair) const {
  const NodeMotion* moved = find(pair);
  if (moved == nullptr) return std::nullopt;
  const double turn_rad = moved->motion.step.heading_rad;
  return HeadingWindow{
      static_cast<float>(moved->a < moved->b ? turn_rad : -turn_rad),
      static_cast<float>(
          std::min(std::numbers::pi, max_heading_deviations * moved->motion.turn_deviation_rad))};
}

std::vector<SpringTerm> NodeMotions::spring_terms() const {
  std::vector<SpringTerm> terms;
  for (const NodeMotion& moved : motions_) {
    const CoarseMotion& motion = moved.motion;
    SpringTerm term{.a = moved.a,
                    .b = moved.b,
                    .length = step_length(moved),
                    .length_deviation = motion.distance_deviation_m,
                    .turn = SpringTurn{motion.step.heading_rad, motion.turn_deviation_rad},
                    .is_certain = true};
    if (term.length > 0.0) {
      term.direction = SpringDirection{std::atan2(motion.step.y_m, motion.step.x_m), std::nullopt,
                                       motion.direction_deviation_rad};
    }
    terms.push_back(term);
  }
  return terms;
}

std::optional<double> NodeMotions::layout_scale(std::span<const Pose2> poses) const {
  double moved = 0.0;
  double laid = 0.0;
  for (const NodeMotion& motion : motions_) {
    const double deviation_m = motion.motion.distance_deviation_m;
    const double certainty = 1.0 / (deviation_m * deviation_m);
    const double length = distance(poses[motion.a].position(), poses[motion.b].position());
    moved += certainty * length * step_length(motion);
    laid += certainty * length * length;
  }
  if (!(moved > 0.0)) return std::nullopt;
  return moved / laid;
}

double step_length(const NodeMotion& motion) {
  return std::hypot(motion.motion.step.x_m, motion.motion.step.y_m);
}

}  // namespace panonav
