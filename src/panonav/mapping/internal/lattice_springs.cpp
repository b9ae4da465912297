#include "panonav/mapping/internal/lattice_springs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/internal/lattice_graph.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/relative_pose/pair_evidence.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {

namespace {

/// Largest disagreement of two views on direction or turn. Unrelated views agree on both by chance
/// once in 16 times.
constexpr double max_disagreement_rad = 0.25 * std::numbers::pi;
/// Largest sum of the turns around a closing triangle, as turns from phases err by about 5 degrees
/// each.
constexpr double turn_closure_tolerance_rad = 10.0 * std::numbers::pi / 180.0;
/// Largest gap after the displacements around a closing triangle, as a share of the longest one:
/// lengths err by a quarter.
constexpr double displacement_closure_tolerance = 0.5;
/// Relative error of a length before the curve is known: that of lengths by phases.
constexpr double default_length_error = 0.25;
/// Smallest standard deviation of an angle, 0.2 degrees. Packed phases have steps of 0.025 rad,
/// whose rounding error of 0.4 degrees is averaged over the components.
constexpr double min_angle_deviation_rad = 0.0035;

/// Returns the motion along the spring from its node `from` to its other node.
Pose2 step_from(std::size_t from, const Lattice::Spring& spring) {
  const PhaseReading phases = read_phases_from(from, spring);
  return {spring.length * std::cos(phases.direction_a_rad),
          spring.length * std::sin(phases.direction_a_rad), phases.turn_rad};
}

bool has_direction(const Lattice::Spring& spring) {
  return spring.phases && spring.phases->has_direction;
}

}  // namespace

SpringViews::SpringViews(const VisualMemory& memory, const LatticeOptions& options)
    : memory_(&memory), components_(options.components) {
  std::map<std::string, std::size_t> first;  // by the bytes of the signature
  for (const ViewId view : memory.views()) {
    packed_.push_back(memory.packed(view));
    const PackedSignature& packed = packed_.back();
    std::string bytes(packed.magnitudes.begin(), packed.magnitudes.end());
    bytes.append(packed.phases.begin(), packed.phases.end());
    first_equal_.push_back(first.try_emplace(std::move(bytes), first_equal_.size()).first->second);
    if (!options.phases) continue;
    const HomingView coefficients = homing_view(memory, view);
    homing_.push_back(components_ > 0 ? first_components(coefficients, components_) : coefficients);
  }
}

std::vector<NodePair> SpringViews::find_most_similar_pairs(const LatticeOptions& options,
                                                           Executor& executor) const {
  const auto views = memory_->views();
  return find_pairs(options.neighbours, executor,
                    [&](std::size_t i) { return std::vector<ViewId>{views[i]}; });
}

std::vector<NodePair> SpringViews::find_similar_pairs_across(
    std::span<const std::size_t> components, int count, Executor& executor) const {
  const auto views = memory_->views();
  std::map<std::size_t, std::vector<ViewId>> members;
  for (std::size_t i = 0; i < components.size(); ++i) members[components[i]].push_back(views[i]);
  if (members.size() < 2) return {};
  const std::size_t largest =
      std::ranges::max_element(members, {}, [](const auto& p) { return p.second.size(); })->first;
  return find_pairs(count, executor, [&](std::size_t i) {
    // All views are excluded for a view of the largest component.
    return components[i] == largest ? std::vector<ViewId>(views.begin(), views.end())
                                    : members.at(components[i]);
  });
}

template <class Excluded>
std::vector<NodePair> SpringViews::find_pairs(int count, Executor& executor,
                                              const Excluded& excluded) const {
  const auto views = memory_->views();
  std::vector<std::vector<NodePair>> found(views.size());
  executor.for_each_chunk(views.size(), 16, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::vector<ViewId> left_out = excluded(i);
      if (left_out.size() == views.size()) continue;
      const auto answer =
          memory_->search(packed_[i], {count, components_}, {.excluded_views = left_out});
      for (const Match& match : answer.matches) {
        if (!are_on_one_floor(*memory_, match.view, views[i])) continue;
        const auto j =
            static_cast<std::size_t>(std::ranges::lower_bound(views, match.view) - views.begin());
        found[i].push_back(std::minmax(i, j));
      }
    }
  });
  std::vector<NodePair> pairs;
  for (const auto& of_view : found) pairs.insert(pairs.end(), of_view.begin(), of_view.end());
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

double SpringViews::dissimilarity(NodePair pair) const {
  return dissimilarity_packed(packed_[pair.first], packed_[pair.second], components_);
}

Lattice::Spring SpringViews::measure(NodePair pair,
                                     const std::optional<HeadingWindow>& window) const {
  Lattice::Spring spring{.a = pair.first, .b = pair.second, .dissimilarity = dissimilarity(pair)};
  if (!homing_.empty()) spring.phases = read_phases(homing_[spring.a], homing_[spring.b], window);
  if (spring.phases) {
    spring.excess_over_mirror = compute_excess_over_mirror(homing_[spring.b], homing_[spring.a],
                                                           spring.phases->correlation);
  }
  return spring;
}

double SpringViews::direction_probability(NodePair pair) const {
  const PairFeatures features = compute_pair_features(homing_[pair.second], homing_[pair.first]);
  return features.is_related() ? features.direction_probability() : 0.0;
}

bool has_agreeing_views(const Lattice::Spring& spring) {
  if (!spring.phases) return true;
  return spring.phases->disagreement_rad <= max_disagreement_rad &&
         spring.phases->turn_disagreement_rad <= max_disagreement_rad;
}

void learn_errors(std::span<const Lattice::Spring> springs, const DissimilarityCurve& curve,
                  Lattice::Errors& errors) {
  std::vector<double> lengths;
  std::vector<double> disagreements;
  std::vector<double> turn_disagreements;
  for (const auto& spring : springs) {
    lengths.push_back(spring.length);
    if (!spring.phases) continue;
    disagreements.push_back(spring.phases->disagreement_rad);
    turn_disagreements.push_back(spring.phases->turn_disagreement_rad);
  }
  // The median spring has the error E; the errors of the others follow from their stiffness [M04
  // eq. 5].
  const double middle = lengths.empty() ? 1.0 : upper_median(lengths);
  double error = curve.error(middle);
  if (!(error > 0.0)) error = default_length_error * (middle > 0.0 ? middle : 1.0);
  errors.length = error * std::sqrt(curve.stiffness(middle));
  // Two readings of deviation s differ by sqrt(2) s; their mean errs by s / sqrt(2).
  const auto deviation = [](const std::vector<double>& differences) {
    if (differences.empty()) return min_angle_deviation_rad;
    return std::max(min_angle_deviation_rad, 0.5 * sigma_over_mad * upper_median(differences));
  };
  errors.direction_rad = deviation(disagreements);
  errors.turn_rad = deviation(turn_disagreements);
}

SpringTerm make_spring_term(const Lattice::Spring& spring, const Lattice::Errors& errors,
                            bool phase_lengths) {
  SpringTerm term{.a = spring.a,
                  .b = spring.b,
                  .length = spring.length,
                  .length_deviation = errors.length / std::sqrt(spring.stiffness)};
  if (!spring.phases) return term;
  const PhaseReading& phases = *spring.phases;
  term.turn =
      SpringTurn{phases.turn_rad, std::hypot(errors.turn_rad, 0.5 * phases.turn_disagreement_rad)};
  if (!phases.has_direction) return term;
  term.direction = SpringDirection{phases.direction_a_rad, phases.direction_b_rad,
                                   std::hypot(errors.direction_rad, 0.5 * phases.disagreement_rad)};
  if (phase_lengths) {
    const double length = errors.phase_unit * phases.length;
    term.along_direction = SpringLength{length, errors.phase_length * length};
  }
  return term;
}

std::vector<double> closing_triangle_shares(std::size_t nodes,
                                            std::span<const Lattice::Spring> springs) {
  std::vector<GraphEdge> edges;
  for (const auto& spring : springs) edges.push_back({spring.a, spring.b, spring.length});
  std::vector<double> all(springs.size());
  std::vector<double> closing(springs.size());
  LatticeGraph(nodes, edges)
      .visit_triangles(
          [&](std::size_t a, const auto& to_b) {  // each triangle once
            return to_b.node >= a && has_direction(springs[to_b.edge]);
          },
          [&](std::size_t a, const auto& to_b, const auto& to_c, std::size_t ac) {
            if (to_c.node < to_b.node) return;
            const std::array numbers{to_b.edge, to_c.edge, ac};
            double longest = 0.0;
            for (const std::size_t number : numbers) {
              if (!has_direction(springs[number])) return;
              longest = std::max(longest, springs[number].length);
            }
            const Pose2 by_b =
                step_from(a, springs[to_b.edge]) * step_from(to_b.node, springs[to_c.edge]);
            const Pose2 straight = step_from(a, springs[ac]);
            const bool closes =
                std::abs(angle_difference(by_b.heading_rad, straight.heading_rad)) <=
                    turn_closure_tolerance_rad &&
                distance(by_b.position(), straight.position()) <=
                    displacement_closure_tolerance * longest;
            for (const std::size_t number : numbers) {
              all[number] += 1.0;
              closing[number] += closes ? 1.0 : 0.0;
            }
          });
  for (std::size_t s = 0; s < springs.size(); ++s) {
    if (all[s] > 0.0) closing[s] /= all[s];
  }
  return closing;
}

void drop_unconfirmed_springs(std::size_t nodes, double min_closing,
                              std::vector<Lattice::Spring>& springs) {
  const auto closes = closing_triangle_shares(nodes, springs);
  std::vector<GraphEdge> confirmed;
  std::vector<unsigned char> has_support(nodes);
  for (std::size_t s = 0; s < springs.size(); ++s) {
    if (!(closes[s] > min_closing)) continue;
    confirmed.push_back({springs[s].a, springs[s].b, 1.0});
    has_support[springs[s].a] = 1;
    has_support[springs[s].b] = 1;
  }
  const auto components = LatticeGraph(nodes, confirmed).components();
  std::vector<std::map<std::size_t, std::size_t>> links_to_component(nodes);
  for (const Lattice::Spring& spring : springs) {
    if (has_support[spring.b] != 0) ++links_to_component[spring.a][components[spring.b]];
    if (has_support[spring.a] != 0) ++links_to_component[spring.b][components[spring.a]];
  }
  const auto main_component = [&](std::size_t node) -> std::optional<std::size_t> {
    if (links_to_component[node].empty()) return std::nullopt;
    return std::ranges::max_element(links_to_component[node], {},
                                    [](const auto& p) { return p.second; })
        ->first;
  };
  std::vector<Lattice::Spring> kept;
  for (std::size_t s = 0; s < springs.size(); ++s) {
    const auto [a, b] = std::pair{springs[s].a, springs[s].b};
    const bool supported_a = has_support[a] != 0;
    const bool supported_b = has_support[b] != 0;
    const bool is_kept = closes[s] > min_closing ||
                         (!supported_a && supported_b && main_component(a) == components[b]) ||
                         (supported_a && !supported_b && main_component(b) == components[a]) ||
                         (!supported_a && !supported_b && !main_component(a) && !main_component(b));
    if (is_kept) kept.push_back(springs[s]);
  }
  springs = std::move(kept);
}

}  // namespace panonav
