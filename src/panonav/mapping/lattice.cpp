#include "panonav/mapping/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/positions.hpp"
#include "panonav/mapping/internal/lattice_growth.hpp"
#include "panonav/mapping/internal/lattice_solver.hpp"
#include "panonav/mapping/internal/lattice_springs.hpp"
#include "panonav/mapping/internal/lattice_start.hpp"
#include "panonav/mapping/lattice_graph.hpp"

namespace panonav {

namespace {

constexpr double kSmallestLengthError = 0.02;  // of the lengths that phases tell, relative
constexpr double kAgreeing = 0.25;             // of the weights that growing gives
constexpr double kGivenUp = 0.25;              // springs of less weight do not count for the curve
constexpr std::size_t kFarPairs = 2000;        // drawn for the level of far views
// Of headings laid out by motion and phases; below what symmetric rooms may turn places by.
constexpr double kLargestTurnError = 0.25 * std::numbers::pi;
// More than half of the triangles of a spring must close.
constexpr double kClosing = 0.5;

void check(const CoarseMotion& motion) {
  const double sum = motion.step.x_m + motion.step.y_m + motion.step.heading_rad;
  require(std::isfinite(sum), "step of a motion", sum, "finite");
  for (const double deviation :
       {motion.distance_deviation_m, motion.direction_deviation_rad, motion.turn_deviation_rad}) {
    require(std::isfinite(deviation) && deviation > 0.0, "deviation of a motion", deviation,
            "finite and > 0");
  }
}

class Arranger {
 public:
  Arranger(const VisualMemory& memory, const LatticeOptions& options,
           std::span<const CoarseMotion> motion, Executor& executor, const LatticeWatch& watch)
      : options_(options), executor_(executor), watch_(watch), views_(memory, options) {
    const auto ids = memory.views();
    for (const ViewId view : ids) lattice_.nodes.push_back({.view = view});
    for (const CoarseMotion& step : motion) {
      check(step);
      for (const ViewId view : {step.from, step.to}) {
        require(memory.contains(view), "view of a motion", view.value, "a view of the memory");
      }
      const auto node_of = [&](ViewId view) {
        return static_cast<std::size_t>(std::ranges::lower_bound(ids, view) - ids.begin());
      };
      // A robot that went nowhere says nothing.
      if (step.from == step.to) continue;
      motions_.push_back({node_of(step.from), node_of(step.to), step});
      motion_between_.try_emplace(std::minmax(motions_.back().a, motions_.back().b),
                                  motions_.size() - 1);
    }
    lattice_.metric = !motions_.empty();
  }

  Lattice arrange() {
    if (size() == 0) return std::move(lattice_);
    measure_first();
    first_curve();
    for (int round = 0; round < options_.rounds; ++round) {
      if (round > 0 || by_motion_) {
        if (by_motion_ && round == 0) start();
        link_near_views();
        fit_curve();
      }
      if (grows()) {
        grow();
      } else {
        choose_springs();
        start_where_needed();
        relax();
      }
      set_unit();
      if (watch_) watch_(start_.poses, start_.components);
    }
    finish();
    return std::move(lattice_);
  }

 private:
  [[nodiscard]] std::size_t size() const { return lattice_.nodes.size(); }

  /// What motion or the headings so far say of the turn between two nodes.
  [[nodiscard]] std::optional<TurnHint> hint(NodePair pair) const {
    if (!by_motion_) return std::nullopt;
    if (!start_.poses.empty()) {
      return TurnHint{angle_difference(start_.poses[pair.second].heading_rad,
                                       start_.poses[pair.first].heading_rad),
                      kLargestTurnError};
    }
    const auto moved = motion_between_.find(pair);
    if (moved != motion_between_.end()) {
      const auto& [a, b, motion] = motions_[moved->second];
      return TurnHint{a < b ? motion.step.heading_rad : -motion.step.heading_rad,
                      std::min(std::numbers::pi, 3.0 * motion.turn_deviation_rad)};
    }
    return std::nullopt;
  }

  void measure(const std::vector<NodePair>& pairs) {
    std::vector<NodePair> wanted;
    for (const NodePair& pair : pairs) {
      if (known_.insert(pair).second) wanted.push_back(pair);
    }
    const std::size_t before = measured_.size();
    measured_.resize(before + wanted.size());
    executor_.for_chunks(wanted.size(), 16, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t i = begin; i < end; ++i)
        measured_[before + i] = views_.measure(wanted[i], hint(wanted[i]));
    });
    std::ranges::sort(measured_, {}, [](const auto& s) { return NodePair{s.a, s.b}; });
  }

  void measure_first() {
    std::vector<NodePair> pairs;
    std::vector<GraphEdge> edges;
    for (const auto& step : motions_) {
      pairs.push_back(std::minmax(step.a, step.b));
      edges.push_back({step.a, step.b, 1.0});
    }
    // Where motion tells how all views hang together, similarity is asked only for views that it
    // brings near to each other.
    const auto components = LatticeGraph(size(), edges).components();
    by_motion_ =
        !motions_.empty() && std::ranges::count(components, 0U) == static_cast<long>(size());
    if (!by_motion_) {
      const auto alike = views_.most_similar(options_, executor_);
      pairs.insert(pairs.end(), alike.begin(), alike.end());
    }
    measure(pairs);
  }

  /// Proportional to the dissimilarity: in metres where there is motion, else in the unit that
  /// phases give, else so that the median view has its nearest one at 1.
  void first_curve() {
    std::vector<double> slopes;
    std::vector<double> units;
    for (const auto& spring : measured_) {
      if (!spring.phases || !spring.phases->points || !agrees(spring)) continue;
      const auto moved = motion_between_.find({spring.a, spring.b});
      if (moved != motion_between_.end()) {
        const Pose2& step = motions_[moved->second].motion.step;
        units.push_back(std::hypot(step.x_m, step.y_m) / spring.phases->length);
      }
      if (spring.dissimilarity > 0.0) {
        slopes.push_back(spring.phases->length / spring.dissimilarity);
      }
    }
    if (!units.empty()) lattice_.errors.phase_unit = upper_median(units);
    for (double& slope : slopes) slope *= lattice_.errors.phase_unit;
    if (!motions_.empty()) slopes.clear();
    for (const auto& step : motions_) {
      const double seen = views_.dissimilarity(std::minmax(step.a, step.b));
      const double travel = std::hypot(step.motion.step.x_m, step.motion.step.y_m);
      if (seen > 0.0 && travel > 0.0) slopes.push_back(travel / seen);
    }
    if (slopes.empty()) {
      std::vector<double> nearest(size(), INFINITY);
      for (const auto& spring : measured_) {
        nearest[spring.a] = std::min(nearest[spring.a], spring.dissimilarity);
        nearest[spring.b] = std::min(nearest[spring.b], spring.dissimilarity);
      }
      for (const double value : nearest) {
        if (std::isfinite(value) && value > 0.0) slopes.push_back(1.0 / value);
      }
    }
    lattice_.curve = DissimilarityCurve(slopes.empty() ? 1.0 : upper_median(slopes));
  }

  [[nodiscard]] std::vector<Point2> positions() const { return positions_of(start_.poses); }

  void link_near_views() {
    const auto near = nearest_points(positions(), start_.components,
                                     static_cast<std::size_t>(options_.neighbours));
    std::vector<NodePair> pairs;
    for (std::size_t i = 0; i < near.size(); ++i) {
      for (const std::size_t j : near[i]) pairs.push_back(std::minmax(i, j));
    }
    if (by_motion_) {
      // Headings are better known now, and so is which of several turns is meant.
      for (const auto& spring : measured_) pairs.emplace_back(spring.a, spring.b);
      measured_.clear();
      known_.clear();
    }
    measure(pairs);
  }

  [[nodiscard]] double laid_out(std::size_t a, std::size_t b) const {
    return distance(start_.poses[a].position(), start_.poses[b].position());
  }

  /// Dissimilarity of far views: the mean over the farther quarter of pairs drawn. Empty where no
  /// views are far from each other: when those lie no farther apart than twice `near`.
  [[nodiscard]] std::optional<double> level_of_far_views(double near) const {
    Random random(1);
    std::vector<DissimilarityAtDistance> drawn;
    for (std::size_t i = 0; i < kFarPairs; ++i) {
      const auto a = static_cast<std::size_t>(random.index(size()));
      const auto b = static_cast<std::size_t>(random.index(size()));
      if (a == b || start_.components[a] != start_.components[b]) continue;
      drawn.push_back({views_.dissimilarity(std::minmax(a, b)), laid_out(a, b)});
    }
    if (drawn.empty()) return std::nullopt;
    std::ranges::sort(drawn, [](const auto& a, const auto& b) {
      return a.distance != b.distance ? a.distance > b.distance : a.dissimilarity < b.dissimilarity;
    });
    drawn.resize(drawn.size() / 4 + 1);
    double dissimilarity = 0.0;
    double distance = 0.0;
    for (const auto& pair : drawn) {
      dissimilarity += pair.dissimilarity / static_cast<double>(drawn.size());
      distance += pair.distance / static_cast<double>(drawn.size());
    }
    if (distance <= 2.0 * near) return std::nullopt;
    return dissimilarity;
  }

  void fit_curve() {
    std::vector<DissimilarityAtDistance> pairs;
    if (lattice_.springs.empty()) {
      for (const auto& spring : measured_) {
        pairs.push_back({spring.dissimilarity, laid_out(spring.a, spring.b)});
      }
    }
    for (const auto& spring : lattice_.springs) {
      if (spring.weight < kGivenUp) continue;
      pairs.push_back({spring.dissimilarity, laid_out(spring.a, spring.b)});
    }
    if (pairs.empty()) return;
    std::vector<double> lengths;
    double most = 0.0;
    for (const auto& pair : pairs) {
      lengths.push_back(pair.distance);
      most = std::max(most, pair.dissimilarity);
    }
    // Where all views are near, correlation ends nowhere.
    lattice_.curve =
        DissimilarityCurve(pairs, level_of_far_views(upper_median(lengths)).value_or(2.0 * most));
    curve_is_fitted_ = true;
    fit_phase_unit();
  }

  /// How long the unit of phases is in the arrangement, and how far single lengths are off.
  void fit_phase_unit() {
    std::vector<double> ratios;
    for (const auto& spring : lattice_.springs) {
      if (spring.weight < kGivenUp || !spring.phases || !spring.phases->points) continue;
      ratios.push_back(laid_out(spring.a, spring.b) / spring.phases->length);
    }
    if (ratios.empty()) return;
    const double unit = upper_median(ratios);
    if (!(unit > 0.0)) return;
    for (double& ratio : ratios) ratio = std::abs(ratio / unit - 1.0);
    lattice_.errors.phase_unit = unit;
    lattice_.errors.phase_length =
        std::max(kSmallestLengthError, normal_over_median * upper_median(ratios));
  }

  /// Where motion tells nothing and phases are read, the layout grows from what is certain.
  [[nodiscard]] bool grows() const { return options_.phases && motions_.empty(); }

  /// The springs are those inside the components that agree with the layout. Views that none of
  /// these holds to their component leave it.
  void grow() {
    measure(proposals_);
    auto grown = grow_components(size(), measured_, lattice_.errors.phase_unit, start_, watch_);
    start_ = std::move(grown.start);
    proposals_ = std::move(grown.proposals);
    lattice_.energy = grown.energy;
    lattice_.iterations += grown.iterations;
    auto& springs = lattice_.springs;
    springs.clear();
    std::vector<GraphEdge> edges;
    for (const LatticeSpring& spring : measured_) {
      const auto weight = grown.weights.find({spring.a, spring.b});
      const bool points = spring.phases && spring.phases->points;
      if (weight == grown.weights.end() || (!points && weight->second < kAgreeing) ||
          !fits(spring, lattice_.errors.phase_unit, start_.poses[spring.a],
                start_.poses[spring.b])) {
        continue;
      }
      springs.push_back(spring);
      springs.back().length = rest_length(spring);
      springs.back().stiffness = lattice_.curve.stiffness(springs.back().length);
      springs.back().weight = weight->second;
      edges.push_back({spring.a, spring.b, 1.0});
    }
    start_.components = LatticeGraph(size(), edges).components();
    start_.handedness_known.assign(size(), 0);
    for (const GraphEdge& edge : edges) start_.handedness_known[start_.components[edge.a]] = 1;
  }

  /// Springs within the curve's range whose views agree with each other and with a third one.
  void choose_springs() {
    auto& springs = lattice_.springs;
    springs.clear();
    for (const LatticeSpring& spring : measured_) {
      if (spring.dissimilarity > lattice_.curve.max_dissimilarity() || !agrees(spring)) {
        continue;
      }
      springs.push_back(spring);
      springs.back().length = rest_length(spring);
      springs.back().stiffness = lattice_.curve.stiffness(springs.back().length);
    }
    if (options_.phases) keep_confirmed();
  }

  /// Leaves out springs most of whose triangles do not close, or, where motion has told which views
  /// are near, none. A view without any that does hangs on the one component
  /// to which most of its springs lead, so that it never joins two; or on others of its kind.
  void keep_confirmed() {
    auto& springs = lattice_.springs;
    const auto closes = closing_triangles(size(), springs);
    const double enough = by_motion_ ? 0.0 : kClosing;
    std::vector<GraphEdge> confirmed;
    std::vector<unsigned char> has_support(size());
    for (std::size_t s = 0; s < springs.size(); ++s) {
      if (!(closes[s] > enough)) continue;
      confirmed.push_back({springs[s].a, springs[s].b, 1.0});
      has_support[springs[s].a] = 1;
      has_support[springs[s].b] = 1;
    }
    const auto components = LatticeGraph(size(), confirmed).components();
    std::vector<std::map<std::size_t, std::size_t>> leads_to(size());
    for (const LatticeSpring& spring : springs) {
      if (has_support[spring.b] != 0) ++leads_to[spring.a][components[spring.b]];
      if (has_support[spring.a] != 0) ++leads_to[spring.b][components[spring.a]];
    }
    const auto hangs_on = [&](std::size_t node) -> std::optional<std::size_t> {
      if (leads_to[node].empty()) return std::nullopt;
      return std::ranges::max_element(leads_to[node], {}, [](const auto& p) { return p.second; })
          ->first;
    };
    std::vector<LatticeSpring> kept;
    for (std::size_t s = 0; s < springs.size(); ++s) {
      const auto [a, b] = std::pair{springs[s].a, springs[s].b};
      const bool supported_a = has_support[a] != 0;
      const bool supported_b = has_support[b] != 0;
      const bool keep = closes[s] > enough ||
                        (!supported_a && supported_b && hangs_on(a) == components[b]) ||
                        (supported_a && !supported_b && hangs_on(b) == components[a]) ||
                        (!supported_a && !supported_b && !hangs_on(a) && !hangs_on(b));
      if (keep) kept.push_back(springs[s]);
    }
    springs = std::move(kept);
  }

  /// Before the curve is known the views' own idea of the distance is the better one.
  [[nodiscard]] double rest_length(const LatticeSpring& spring) const {
    if (!curve_is_fitted_ && spring.phases)
      return lattice_.errors.phase_unit * spring.phases->length;
    return lattice_.curve.distance(spring.dissimilarity);
  }

  void start() {
    start_ = by_motion_ ? lay_out_by_motion(size(), motions_, measured_)
                        : lay_out_by_springs(size(), joined(), options_.landmarks);
  }

  /// The springs, and the motions where there is no spring.
  [[nodiscard]] std::vector<LatticeSpring> joined() const {
    std::vector<LatticeSpring> all = lattice_.springs;
    for (const auto& step : motions_) {
      const NodePair pair = std::minmax(step.a, step.b);
      all.push_back({.a = pair.first,
                     .b = pair.second,
                     .length = std::hypot(step.motion.step.x_m, step.motion.step.y_m)});
    }
    return all;
  }

  /// A new start when springs hold together other views than before.
  void start_where_needed() {
    if (by_motion_) return;
    std::vector<GraphEdge> edges;
    for (const auto& spring : joined()) edges.push_back({spring.a, spring.b, 1.0});
    if (start_.poses.empty() || LatticeGraph(size(), edges).components() != start_.components)
      start();
  }

  [[nodiscard]] std::vector<SpringTerm> terms() const {
    std::vector<SpringTerm> result;
    for (const auto& spring : lattice_.springs) {
      result.push_back(spring_term(spring, lattice_.errors, curve_is_fitted_));
    }
    for (const auto& [a, b, motion] : motions_) {
      const double travel = std::hypot(motion.step.x_m, motion.step.y_m);
      SpringTerm term{.a = a,
                      .b = b,
                      .length = travel,
                      .length_deviation = motion.distance_deviation_m,
                      .certain = true};
      if (travel > 0.0) {
        term.direction = SpringDirection{std::atan2(motion.step.y_m, motion.step.x_m), std::nullopt,
                                         motion.direction_deviation_rad};
      }
      term.turn = SpringTurn{motion.step.heading_rad, motion.turn_deviation_rad};
      result.push_back(term);
    }
    return result;
  }

  void relax() {
    learn_errors(lattice_.springs, lattice_.curve, lattice_.errors);
    const auto solution = solve_lattice(terms(), start_.poses, {}, [this] {
      if (watch_) watch_(start_.poses, start_.components);
    });
    for (std::size_t s = 0; s < lattice_.springs.size(); ++s) {
      lattice_.springs[s].weight = solution.weights[s];
    }
    lattice_.energy = solution.energy;
    lattice_.iterations += solution.iterations;
  }

  /// Makes the median distance of a view to its nearest one 1, or, where there is motion, its
  /// length a metre by least squares.
  void set_unit() {
    if (lattice_.metric) {
      double moved = 0.0;
      double laid = 0.0;
      for (const auto& [a, b, motion] : motions_) {
        const double certainty = 1.0 / (motion.distance_deviation_m * motion.distance_deviation_m);
        const double length = laid_out(a, b);
        moved += certainty * length * std::hypot(motion.step.x_m, motion.step.y_m);
        laid += certainty * length * length;
      }
      if (moved > 0.0) rescale(moved / laid);
      return;
    }
    std::vector<double> nearest;
    const auto near = nearest_points(positions(), start_.components, 1);
    for (std::size_t i = 0; i < near.size(); ++i) {
      if (near[i].empty()) continue;
      const double length = laid_out(i, near[i].front());
      if (length > 0.0) nearest.push_back(length);
    }
    if (nearest.empty()) return;
    rescale(1.0 / upper_median(nearest));
  }

  void rescale(double scale) {
    for (Pose2& pose : start_.poses) {
      pose.x_m *= scale;
      pose.y_m *= scale;
    }
    for (auto& spring : lattice_.springs) spring.length *= scale;
  }

  void finish() {
    lattice_.candidates = measured_.size();
    // In the unit of the result.
    fit_curve();
    learn_errors(lattice_.springs, lattice_.curve, lattice_.errors);
    auto& components = lattice_.components;
    for (const std::size_t component : start_.components)
      components.resize(std::max(components.size(), component + 1));
    std::vector<std::optional<Pose2>> component_from_frame(components.size());
    for (std::size_t i = 0; i < size(); ++i) {
      const std::size_t component = start_.components[i];
      if (!component_from_frame[component])
        component_from_frame[component] = inverse(start_.poses[i]);
      lattice_.nodes[i].component = component;
      lattice_.nodes[i].pose = *component_from_frame[component] * start_.poses[i];
      ++components[component].views;
      components[component].handedness_known = start_.handedness_known[component] != 0;
    }
  }

  LatticeOptions options_;
  Executor& executor_;
  const LatticeWatch& watch_;
  SpringViews views_;
  std::vector<NodeMotion> motions_;
  std::map<NodePair, std::size_t> motion_between_;  // the first motion of two nodes
  bool by_motion_ = false;                          // motion connects all views
  std::set<NodePair> known_;
  std::vector<LatticeSpring> measured_;  // ascending (a, b)
  bool curve_is_fitted_ = false;
  LatticeStart start_;
  std::vector<NodePair> proposals_;  // worth measuring in the next round
  Lattice lattice_;
};

}  // namespace

void visit_options(LatticeOptions& options, OptionVisitor& visitor) {
  using T = LatticeOptions;
  constexpr OptionTable table{
      option<&T::neighbours>("springs of each view to the most similar views", 1, 1000),
      option<&T::components>("Fourier components compared, 0 for all", 0),
      option<&T::phases>("take directions and headings from phases"),
      option<&T::landmarks>("views from which the initial arrangement is made", 3, 2000),
      option<&T::rounds>("times that curve and springs are made anew from the arrangement", 1, 20),
  };
  table.visit(options, visitor);
}

void visit_options(CoarseMotionOptions& options, OptionVisitor& visitor) {
  using T = CoarseMotionOptions;
  constexpr OptionTable table{
      option<&T::distance_deviation>("standard deviation of a step's length, as a share of it",
                                     above(0), 10),
      option<&T::direction_deviation_rad>("standard deviation of the direction of travel", above(0),
                                          std::numbers::pi),
      option<&T::turn_deviation_rad>("standard deviation of a step's turn", above(0),
                                     std::numbers::pi),
  };
  table.visit(options, visitor);
}

CoarseMotion coarse_motion(ViewId from, ViewId to, const Pose2& step,
                           const CoarseMotionOptions& options) {
  validate(options);
  constexpr double kSmallestTravelM = 0.01;
  const double travel_m = std::max(kSmallestTravelM, std::hypot(step.x_m, step.y_m));
  return {.from = from,
          .to = to,
          .step = step,
          .distance_deviation_m = options.distance_deviation * travel_m,
          .direction_deviation_rad = options.direction_deviation_rad,
          .turn_deviation_rad = options.turn_deviation_rad};
}

Lattice arrange(const VisualMemory& memory, const LatticeOptions& options,
                std::span<const CoarseMotion> motion, Executor& executor,
                const LatticeWatch& watch) {
  validate(options);
  return Arranger(memory, options, motion, executor, watch).arrange();
}

}  // namespace panonav
