#include "panonav/mapping/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/nearest_points.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/internal/lattice_curve.hpp"
#include "panonav/mapping/internal/lattice_graph.hpp"
#include "panonav/mapping/internal/lattice_growth.hpp"
#include "panonav/mapping/internal/lattice_solver.hpp"
#include "panonav/mapping/internal/lattice_springs.hpp"
#include "panonav/mapping/internal/lattice_start.hpp"
#include "panonav/mapping/internal/node_motions.hpp"
#include "panonav/mapping/internal/piece_joining.hpp"

namespace panonav {

namespace {

/// Smallest weight (`GrownLayout::weights`) of a spring that is kept without a direction: the
/// weight at the limit of agreement.
constexpr double min_grown_weight = 0.25;
/// Largest error of headings in a layout by motion and phases: 45 degrees, half of the rotation
/// after which symmetric rooms look similar.
constexpr double max_heading_error_rad = 0.25 * std::numbers::pi;
/// A spring is kept if more than this share of its triangles close, where no motion shows which
/// views are near (docs/decisions.md).
constexpr double min_closing_triangles = 0.5;
/// Smallest excess over the mirrored view of pairs between pieces whose probability is computed,
/// which costs as much as 40 readings.
constexpr double min_excess_of_cross_links = 0.1;

/// Returns the probability of a pair between two pieces. Such pairs are wrong more often than those
/// from which `PairFeatures` learnt, as the right ones are springs already. Read from pairs in
/// `loop` and `garden` (seeds 11 and 12): of those with 0.7 to 0.8 a quarter was right, of those
/// with 0.8 to 0.9 three quarters, above 0.9 all.
double cross_probability(double probability) {
  constexpr double slope = 4.0;
  constexpr double offset = -7.5;
  constexpr double max_probability = 0.999;
  const double p = std::clamp(probability, 1.0 - max_probability, max_probability);
  return 1.0 / (1.0 + std::exp(-(slope * std::log(p / (1.0 - p)) + offset)));
}

bool has_direction(const Lattice::Spring& spring) {
  return spring.phases && spring.phases->has_direction;
}

/// The measured pairs of views, each once, ascending.
class MeasuredPairs {
 public:
  MeasuredPairs(const SpringViews& views, Executor& executor)
      : views_(views), executor_(executor) {}

  [[nodiscard]] const std::vector<Lattice::Spring>& springs() const { return springs_; }

  /// Measures the pairs that are not measured yet, at the headings that `window(pair)` allows.
  template <class Window>
  void add(const std::vector<NodePair>& pairs, const Window& window) {
    std::vector<NodePair> added;
    for (const NodePair& pair : pairs) {
      if (known_.insert(pair).second) added.push_back(pair);
    }
    const std::size_t before = springs_.size();
    springs_.resize(before + added.size());
    executor_.for_each_chunk(added.size(), 16,
                             [&](std::size_t begin, std::size_t end, std::size_t) {
                               for (std::size_t i = begin; i < end; ++i) {
                                 springs_[before + i] = views_.measure(added[i], window(added[i]));
                               }
                             });
    std::ranges::sort(springs_, {}, [](const auto& s) { return NodePair{s.a, s.b}; });
  }
  void clear() {
    springs_.clear();
    known_.clear();
  }

 private:
  const SpringViews& views_;
  Executor& executor_;
  std::set<NodePair> known_;
  std::vector<Lattice::Spring> springs_;
};

class Arranger {
 public:
  Arranger(const VisualMemory& memory, const LatticeOptions& options,
           std::span<const CoarseMotion> motion, Executor& executor,
           const LatticeStepCallback& step_callback)
      : options_(options),
        executor_(executor),
        step_callback_(step_callback),
        views_(memory, options),
        motions_(memory, motion),
        measured_(views_, executor) {
    for (const ViewId view : memory.views()) lattice_.nodes.push_back({.view = view});
    by_motion_ = motions_.are_all_connected(size());
    lattice_.metric = !motions_.empty();
  }

  Lattice arrange() {
    if (size() == 0) return std::move(lattice_);
    measure_first_pairs();
    lattice_.curve = make_first_curve(measured_.springs(), motions_, views_, lattice_.errors);
    if (by_motion_) lay_out();  // [M04 section 3.4]
    for (int round = 0; round < options_.rounds; ++round) {
      if (!layout_.poses.empty()) {
        measure_near_views();
        fit_curve_to_layout();  // [M04 section 3.2, figure 12]
      }
      if (options_.phases && motions_.empty()) {
        std::vector<GraphEdge> edges = grow_from_most_certain();
        if (round + 1 == options_.rounds) join_remaining_pieces(edges);
      } else {
        choose_springs();  // [M04 eq. 5]
        lay_out_if_needed();
        relax();  // [M04 section 3.2]
      }
      rescale_layout();
      if (step_callback_) step_callback_(layout_.poses, layout_.components);
    }
    finish();
    return std::move(lattice_);
  }

 private:
  [[nodiscard]] std::size_t size() const { return lattice_.nodes.size(); }

  /// Returns the relative headings of two nodes that their motion or the layout allows; nullopt:
  /// all headings.
  [[nodiscard]] std::optional<HeadingWindow> heading_window(NodePair pair) const {
    if (!by_motion_) return std::nullopt;
    if (layout_.poses.empty()) return motions_.heading_between(pair);
    return HeadingWindow{
        static_cast<float>(angle_difference(layout_.poses[pair.second].heading_rad,
                                            layout_.poses[pair.first].heading_rad)),
        static_cast<float>(max_heading_error_rad)};
  }
  void measure(const std::vector<NodePair>& pairs) {
    measured_.add(pairs, [this](NodePair pair) { return heading_window(pair); });
  }

  /// Measures pairs along the motions and, unless these connect all views, the most similar ones.
  void measure_first_pairs() {
    std::vector<NodePair> pairs;
    for (const auto& step : motions_.all()) pairs.push_back(std::minmax(step.a, step.b));
    if (!by_motion_) {
      const auto similar = views_.find_most_similar_pairs(options_, executor_);
      pairs.insert(pairs.end(), similar.begin(), similar.end());
    }
    measure(pairs);
  }

  [[nodiscard]] std::vector<std::vector<std::size_t>> nearest_nodes(std::size_t count) const {
    return nearest_points(positions_of(layout_.poses), layout_.components, count);
  }

  void measure_near_views() {
    const auto near = nearest_nodes(static_cast<std::size_t>(options_.neighbours));
    std::vector<NodePair> pairs;
    for (std::size_t i = 0; i < near.size(); ++i) {
      for (const std::size_t j : near[i]) pairs.push_back(std::minmax(i, j));
    }
    if (by_motion_) {
      // All pairs are measured again: the headings of the layout select the right one of several
      // fits.
      for (const auto& spring : measured_.springs()) pairs.emplace_back(spring.a, spring.b);
      measured_.clear();
    }
    measure(pairs);
  }

  void fit_curve_to_layout() {
    const auto curve = fit_curve(measured_.springs(), lattice_.springs, views_, layout_);
    if (!curve) return;
    lattice_.curve = *curve;
    curve_is_fitted_ = true;
    fit_phase_unit(lattice_.springs, layout_.poses, lattice_.errors);
  }

  /// Grows the layout from the most certain springs. Keeps the springs that agree with the layout;
  /// views without such a spring leave their component. Returns the edges of these springs.
  std::vector<GraphEdge> grow_from_most_certain() {
    measure(proposals_);
    const double unit = lattice_.errors.phase_unit;
    auto grown = grow_components(size(), measured_.springs(), unit, layout_, step_callback_);
    layout_ = std::move(grown.layout);
    proposals_ = std::move(grown.proposals);
    lattice_.energy = grown.energy;
    lattice_.iterations += grown.iterations;
    lattice_.springs.clear();
    std::vector<GraphEdge> edges;
    for (const Lattice::Spring& spring : measured_.springs()) {
      const auto weight = grown.weights.find({spring.a, spring.b});
      if (weight == grown.weights.end() ||
          (!has_direction(spring) && weight->second < min_grown_weight) ||
          !fits_layout(spring, unit, layout_.poses[spring.a], layout_.poses[spring.b])) {
        continue;
      }
      add_spring(spring).weight = weight->second;
      edges.push_back({spring.a, spring.b, 1.0});
    }
    set_components(edges);
    return edges;
  }
  void set_components(const std::vector<GraphEdge>& edges) {
    layout_.components = LatticeGraph(size(), edges).components();
    layout_.handedness_known.assign(size(), 0);
    for (const GraphEdge& edge : edges) layout_.handedness_known[layout_.components[edge.a]] = 1;
  }

  /// Joins the pieces of the grown layout whose pairs of views agree on one relative pose, and adds
  /// springs for these pairs. A piece not larger than the neighbourhood of a view is one place,
  /// whose views all resemble the same wrong one; it is not joined. The most probable pairs between
  /// the pieces that remain become crossings. Only the last round does so: pieces that are bent
  /// would bend those that grow from them. `edges`: of the springs in the pieces.
  void join_remaining_pieces(std::vector<GraphEdge>& edges) {
    measure(views_.find_similar_pairs_across(layout_.components, options_.neighbours, executor_));
    std::vector<const Lattice::Spring*> across;
    const std::vector<CrossLink> links = find_cross_links(across);
    const auto min_views = static_cast<std::size_t>(options_.neighbours) + 1;
    for (const JoinedPieces& joined :
         join_pieces(links, layout_.poses, layout_.components, min_views)) {
      lattice_.joins.push_back({joined.smaller_views, joined.agreeing.size()});
      for (const std::size_t k : joined.agreeing) {
        add_spring(*across[k]).weight = links[k].probability;
        edges.push_back({links[k].in_p, links[k].in_q, 1.0});
      }
    }
    for (const std::size_t k : choose_crossings(links, layout_.poses, layout_.components)) {
      lattice_.crossings.push_back(
          {across[k]->a, across[k]->b, *across[k]->phases, links[k].probability});
    }
    std::ranges::sort(lattice_.springs, {}, [](const auto& s) { return NodePair{s.a, s.b}; });
    std::ranges::sort(lattice_.crossings, {}, [](const auto& s) { return NodePair{s.a, s.b}; });
    set_components(edges);
  }

  /// Returns the links between the pieces with their probabilities; sets `across` to the spring of
  /// each.
  std::vector<CrossLink> find_cross_links(std::vector<const Lattice::Spring*>& across) {
    for (const Lattice::Spring& spring : measured_.springs()) {
      if (layout_.components[spring.a] != layout_.components[spring.b] && has_direction(spring) &&
          has_agreeing_views(spring) && spring.excess_over_mirror > min_excess_of_cross_links) {
        across.push_back(&spring);
      }
    }
    const auto probabilities = compute_probabilities(across);
    const double unit = lattice_.errors.phase_unit;
    std::vector<CrossLink> links;
    std::vector<const Lattice::Spring*> kept;
    for (std::size_t i = 0; i < across.size(); ++i) {
      if (!(probabilities[i] > 0.0)) continue;  // the views seem unrelated
      const PhaseReading& phases = *across[i]->phases;
      kept.push_back(across[i]);
      links.push_back({across[i]->a, across[i]->b, phases.a_from_b(unit), unit * phases.length,
                       cross_probability(probabilities[i])});
    }
    across = std::move(kept);
    return links;
  }

  /// Returns the probability of the direction of each spring. Those between equal views, as of a
  /// simulated robot that stands still, are computed once.
  std::vector<double> compute_probabilities(std::span<const Lattice::Spring* const> springs) {
    std::map<NodePair, double> of_pairs;
    for (const Lattice::Spring* const spring : springs)
      of_pairs[views_.find_first_equal({spring->a, spring->b})] = 0.0;
    std::vector<std::pair<const NodePair, double>*> pending;
    for (auto& each : of_pairs) pending.push_back(&each);
    executor_.for_each_chunk(
        pending.size(), 4, [&](std::size_t begin, std::size_t end, std::size_t) {
          for (std::size_t i = begin; i < end; ++i)
            pending[i]->second = views_.direction_probability(pending[i]->first);
        });
    std::vector<double> probabilities;
    for (const Lattice::Spring* const spring : springs)
      probabilities.push_back(of_pairs.at(views_.find_first_equal({spring->a, spring->b})));
    return probabilities;
  }

  /// Chooses the springs within the curve's range whose views agree with each other and with a
  /// third one.
  void choose_springs() {
    lattice_.springs.clear();
    for (const Lattice::Spring& spring : measured_.springs()) {
      if (spring.dissimilarity > lattice_.curve.max_dissimilarity() || !has_agreeing_views(spring))
        continue;
      add_spring(spring);
    }
    if (options_.phases) {
      drop_unconfirmed_springs(size(), by_motion_ ? 0.0 : min_closing_triangles, lattice_.springs);
    }
  }

  Lattice::Spring& add_spring(const Lattice::Spring& measured) {
    Lattice::Spring& spring = lattice_.springs.emplace_back(measured);
    // Before the curve is fitted the phases show the distance better.
    spring.length = !curve_is_fitted_ && spring.phases
                        ? lattice_.errors.phase_unit * spring.phases->length
                        : lattice_.curve.distance(spring.dissimilarity);
    spring.stiffness = lattice_.curve.stiffness(spring.length);
    return spring;
  }

  /// Returns the springs and, as further springs, all motions.
  [[nodiscard]] std::vector<Lattice::Spring> springs_and_motions() const {
    std::vector<Lattice::Spring> all = lattice_.springs;
    for (const auto& step : motions_.all()) {
      const NodePair pair = std::minmax(step.a, step.b);
      all.push_back({.a = pair.first, .b = pair.second, .length = step_length(step)});
    }
    return all;
  }

  void lay_out() {
    layout_ = by_motion_ ? lay_out_by_motion(size(), motions_.all(), measured_.springs())
                         : lay_out_by_springs(size(), springs_and_motions(), options_.landmarks);
  }
  /// Lays out the nodes if there is no layout yet or the connected components have changed.
  void lay_out_if_needed() {
    if (by_motion_) return;
    std::vector<GraphEdge> edges;
    for (const auto& spring : springs_and_motions()) edges.push_back({spring.a, spring.b, 1.0});
    if (layout_.poses.empty() || LatticeGraph(size(), edges).components() != layout_.components) {
      lay_out();
    }
  }

  void relax() {
    learn_errors(lattice_.springs, lattice_.curve, lattice_.errors);
    std::vector<SpringTerm> terms;
    for (const auto& spring : lattice_.springs) {
      terms.push_back(make_spring_term(spring, lattice_.errors, curve_is_fitted_));
    }
    const auto motion_terms = motions_.spring_terms();
    terms.insert(terms.end(), motion_terms.begin(), motion_terms.end());
    const auto solution = solve_lattice(terms, layout_.poses, {}, [this] {
      if (step_callback_) step_callback_(layout_.poses, layout_.components);
    });
    for (std::size_t s = 0; s < lattice_.springs.size(); ++s) {
      lattice_.springs[s].weight = solution.weights[s];
    }
    lattice_.energy = solution.energy;
    lattice_.iterations += solution.iterations;
  }

  /// Scales the layout to metres where there is motion, else to a median distance of 1 between
  /// nearest positions.
  void rescale_layout() {
    const auto scale = lattice_.metric ? motions_.layout_scale(layout_.poses) : unit_scale();
    if (!scale) return;
    for (Pose2& pose : layout_.poses) {
      pose.x_m *= *scale;
      pose.y_m *= *scale;
    }
    for (auto& spring : lattice_.springs) spring.length *= *scale;
  }
  [[nodiscard]] std::optional<double> unit_scale() const {
    // Equal views are of one place, although the solver may leave them a little apart.
    std::vector<Point2> positions;
    std::vector<std::size_t> components;
    for (std::size_t i = 0; i < size(); ++i) {
      if (views_.find_first_equal({i, i}).first != i) continue;
      positions.push_back(layout_.poses[i].position());
      components.push_back(layout_.components[i]);
    }
    const std::vector<double> nearest = distances_between_nearest_positions(positions, components);
    if (nearest.empty()) return std::nullopt;
    return 1.0 / upper_median(nearest);
  }

  void finish() {
    lattice_.candidates = measured_.springs().size();
    fit_curve_to_layout();  // in the unit of the result
    learn_errors(lattice_.springs, lattice_.curve, lattice_.errors);
    auto& components = lattice_.components;
    for (const std::size_t component : layout_.components)
      components.resize(std::max(components.size(), component + 1));
    std::vector<std::optional<Pose2>> component_from_frame(components.size());
    for (std::size_t i = 0; i < size(); ++i) {
      const std::size_t component = layout_.components[i];
      if (!component_from_frame[component])
        component_from_frame[component] = inverse(layout_.poses[i]);
      lattice_.nodes[i].component = component;
      lattice_.nodes[i].pose = *component_from_frame[component] * layout_.poses[i];
      ++components[component].views;
      components[component].handedness_known = layout_.handedness_known[component] != 0;
    }
  }

  LatticeOptions options_;
  Executor& executor_;
  const LatticeStepCallback& step_callback_;
  SpringViews views_;
  NodeMotions motions_;
  bool by_motion_ = false;  // motion connects all views
  MeasuredPairs measured_;
  bool curve_is_fitted_ = false;
  LatticeLayout layout_;             // no poses before the first layout
  std::vector<NodePair> proposals_;  // pairs to measure in the next round
  Lattice lattice_;
};

}  // namespace

void visit_options(LatticeOptions& options, OptionVisitor& visitor) {
  using T = LatticeOptions;
  constexpr OptionTable table{
      option<&T::neighbours>("number of most similar views to which each view is connected", 1,
                             1000),
      option<&T::components>("number of Fourier components to compare; 0: all", 0),
      option<&T::phases>(
          "compute directions and headings from the phases of the Fourier components"),
      option<&T::landmarks>("number of views in the initial arrangement", 3, 2000),
      option<&T::rounds>(
          "number of times that the springs between views are recomputed from the arrangement", 1,
          20),
  };
  table.visit(options, visitor);
}

void visit_options(CoarseMotionOptions& options, OptionVisitor& visitor) {
  using T = CoarseMotionOptions;
  constexpr OptionTable table{
      option<&T::distance_deviation>(
          "standard deviation of a step's length, as a share of the length", above(0), 10),
      option<&T::direction_deviation_rad>("standard deviation of the direction of travel", above(0),
                                          std::numbers::pi),
      option<&T::turn_deviation_rad>("standard deviation of a step's rotation", above(0),
                                     std::numbers::pi),
  };
  table.visit(options, visitor);
}

CoarseMotion make_coarse_motion(ViewId from, ViewId to, const Pose2& step,
                                const CoarseMotionOptions& options) {
  validate(options);
  // The standard deviation of the distance is a share of the travel. This minimum keeps it above 0
  // when the robot turns on the spot.
  constexpr double min_travel_m = 0.01;
  const double travel_m = std::max(min_travel_m, std::hypot(step.x_m, step.y_m));
  return {.from = from,
          .to = to,
          .step = step,
          .distance_deviation_m = options.distance_deviation * travel_m,
          .direction_deviation_rad = options.direction_deviation_rad,
          .turn_deviation_rad = options.turn_deviation_rad};
}

Lattice arrange(const VisualMemory& memory, const LatticeOptions& options,
                std::span<const CoarseMotion> motion, Executor& executor,
                const LatticeStepCallback& step_callback) {
  validate(options);
  return Arranger(memory, options, motion, executor, step_callback).arrange();
}

TopologicalMap to_topological_map(const Lattice& lattice) {
  TopologicalMap map;
  for (const Lattice::Node& node : lattice.nodes)
    map.nodes.push_back({node.view, node.pose, node.component});
  for (const Lattice::Spring& spring : lattice.springs) {
    const Lattice::Node& a = lattice.nodes[spring.a];
    const Lattice::Node& b = lattice.nodes[spring.b];
    map.edges.push_back({.a = a.view,
                         .b = b.view,
                         .a_from_b = inverse(a.pose) * b.pose,
                         .kind = Link::Kind::neighbour,
                         .weight = spring.weight});
  }
  for (const Lattice::Crossing& crossing : lattice.crossings) {
    map.edges.push_back({.a = lattice.nodes[crossing.a].view,
                         .b = lattice.nodes[crossing.b].view,
                         .a_from_b = crossing.phases.a_from_b(lattice.errors.phase_unit),
                         .kind = Link::Kind::neighbour,
                         .weight = crossing.probability});
  }
  return map;
}

}  // namespace panonav
