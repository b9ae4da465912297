#include "panonav/mapping/internal/lattice_growth.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <queue>
#include <set>
#include <tuple>
#include <utility>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/least_squares.hpp"
#include "panonav/mapping/internal/lattice_springs.hpp"
#include "panonav/mapping/lattice_graph.hpp"

namespace panonav {

namespace {

constexpr double kTurnFits = 15.0 * std::numbers::pi / 180.0;
constexpr double kPositionFits = 0.6;  // of the length of a spring
// The same once lengths have been learnt from the layout, which differ from those of the phases as
// near things from far ones.
constexpr double kDirectionFits = 3.0 * kTurnFits;
constexpr double kLengthFits = 3.0;
// Places that look alike agree by chance on a relative pose that other springs told: once in five
// times, as rooms and shelves stand parallel to each other.
constexpr double kChance = 0.2;
// Of two springs of a view the longer one looks more alike: seldom when both are right, as often as
// not when one is wrong.
constexpr double kDiscordant = 0.15;
constexpr double kClearlyLonger = 1.2;
constexpr double kOdds = 19.0;
constexpr double kOddsOfSingleViews = 1.0;
constexpr double kCertain = 0.985;
constexpr double kMostCertain = 0.999;
constexpr std::size_t kLowRank = 6;
constexpr std::size_t kHypotheses = 8;
constexpr double kBeside = 0.8;  // of the length of a typical spring
// Views beside each other agree on their relative pose.
constexpr double kAgreesBeside = 0.7;
constexpr double kNear = 3.0;  // typical springs
constexpr double kGrown = 1.25;
constexpr int kLastAverages = 3;
constexpr double kShareOfUnit = 0.5;
// Pairs of views that are proposed for each of two components that may touch.
constexpr std::size_t kProposals = 50;

struct Link {
  std::size_t a, b;
  Pose2 step;  // a_from_b
  double length, residual, probability;
};

Pose2 step_of(const LatticeSpring& spring, double unit) {
  const PhaseReading& phases = *spring.phases;
  if (!phases.points) return {0.0, 0.0, phases.turn_rad};
  const double from_b = phases.direction_b_rad + phases.turn_rad - std::numbers::pi;
  const double direction =
      phases.direction_a_rad + 0.5 * angle_difference(from_b, phases.direction_a_rad);
  return {unit * phases.length * std::cos(direction), unit * phases.length * std::sin(direction),
          phases.turn_rad};
}

bool is_near(const Pose2& told, const Pose2& laid_out, double within) {
  return std::abs(angle_difference(told.heading_rad, laid_out.heading_rad)) <= kTurnFits &&
         distance(told.position(), laid_out.position()) <= within;
}

/// For each link the larger one of its ranks at its two views by residual.
std::vector<std::size_t> mutual_ranks(std::size_t nodes, std::span<const Link> links) {
  std::vector<std::vector<std::size_t>> of(nodes);
  for (std::size_t k = 0; k < links.size(); ++k) {
    of[links[k].a].push_back(k);
    of[links[k].b].push_back(k);
  }
  std::vector<std::size_t> ranks(links.size(), 0);
  for (auto& own : of) {
    std::ranges::sort(own, {}, [&](std::size_t k) { return std::pair(links[k].residual, k); });
    for (std::size_t r = 0; r < own.size(); ++r) ranks[own[r]] = std::max(ranks[own[r]], r);
  }
  return ranks;
}

/// Sets the probability of each link by its rank.
void learn_probabilities(std::size_t nodes, std::vector<Link>& links) {
  const auto ranks = mutual_ranks(nodes, links);
  std::vector<GraphEdge> edges;
  for (const Link& link : links) edges.push_back({link.a, link.b, 1.0});
  const LatticeGraph graph(nodes, edges);
  std::vector<std::size_t> link_to(nodes, links.size());
  std::vector<unsigned char> supported(links.size());
  const auto from = [&](std::size_t node, const Link& link) {
    return node == link.a ? link.step : inverse(link.step);
  };
  for (std::size_t a = 0; a < nodes; ++a) {
    for (const auto& n : graph.neighbours(a)) link_to[n.node] = n.edge;
    for (const auto& n : graph.neighbours(a)) {
      if (ranks[n.edge] >= kLowRank) continue;
      for (const auto& m : graph.neighbours(n.node)) {
        const std::size_t across = link_to[m.node];
        if (m.node <= a || across == links.size() || ranks[m.edge] >= kLowRank) continue;
        const double longest =
            std::max({links[n.edge].length, links[m.edge].length, links[across].length});
        const Pose2 around = from(a, links[n.edge]) * from(n.node, links[m.edge]);
        if (is_near(around, from(a, links[across]), 0.5 * longest)) supported[across] = 1;
      }
    }
    for (const auto& n : graph.neighbours(a)) link_to[n.node] = links.size();
  }
  const std::size_t classes = ranks.empty() ? 0 : *std::ranges::max_element(ranks) + 1;
  std::vector<double> all(classes);
  std::vector<double> good(classes);
  for (std::size_t k = 0; k < links.size(); ++k) {
    all[ranks[k]] += 1.0;
    good[ranks[k]] += supported[k] != 0 ? 1.0 : 0.0;
  }
  // Links of the lowest ranks stand for right ones, which have no triangle everywhere either.
  double reference = 0.0;
  double count = 0.0;
  double closing = 0.0;
  for (std::size_t r = 0; r < classes && count < 20.0 + 0.1 * static_cast<double>(nodes); ++r) {
    count += all[r];
    closing += good[r];
    reference = closing / count;
  }
  reference = std::clamp(reference, 0.3, 0.98);
  // A rank is no more certain than those below it: neighbouring ones are pooled until that holds.
  struct Pool {
    double closing, count;
    std::size_t ranks;
    [[nodiscard]] double share() const { return count > 0.0 ? closing / count : 0.0; }
  };
  std::vector<Pool> pools;
  for (std::size_t r = 0; r < classes; ++r) {
    pools.push_back({good[r] / reference, all[r], 1});
    while (pools.size() > 1 && pools[pools.size() - 2].share() <= pools.back().share()) {
      const Pool last = pools.back();
      pools.pop_back();
      pools.back() = {pools.back().closing + last.closing, pools.back().count + last.count,
                      pools.back().ranks + last.ranks};
    }
  }
  std::vector<double> probability;
  for (const Pool& pool : pools) {
    probability.insert(probability.end(), pool.ranks, std::clamp(pool.share(), 0.01, kCertain));
  }
  // Then by whether a triangle closes (Bayes), which happens by chance as often as at the rank that
  // is least certain. Two views have no triangles.
  const double by_chance =
      pools.empty() ? 0.5 : std::clamp(pools.back().share() * reference, 0.02, 0.5 * reference);
  for (std::size_t k = 0; k < links.size(); ++k) {
    const double right = probability[ranks[k]];
    const double as_right = supported[k] != 0 ? reference : 1.0 - reference;
    const double as_wrong = supported[k] != 0 ? by_chance : 1.0 - by_chance;
    const double share = as_right * right / (as_right * right + as_wrong * (1.0 - right));
    links[k].probability = nodes < 3 ? kCertain : std::clamp(share, 0.01, kMostCertain);
  }
}

class Grower {
 public:
  Grower(std::size_t nodes, std::span<const LatticeSpring> springs, double unit,
         const LatticeStart& start, const LatticeWatch& watch)
      : watch_(watch),
        poses_(start.poses.empty() ? std::vector<Pose2>(nodes) : start.poses),
        component_(nodes),
        members_(nodes),
        links_of_(nodes),
        between_(nodes),
        averaged_at_(nodes, 1) {
    for (const LatticeSpring& spring : springs) {
      if (!spring.phases || !agrees(spring)) continue;
      links_.push_back({spring.a, spring.b, step_of(spring, unit), unit * spring.phases->length,
                        spring.phases->residual, 0.0});
    }
    learn_probabilities(nodes, links_);
    for (std::size_t k = 0; k < links_.size(); ++k) {
      links_of_[links_[k].a].push_back(k);
      links_of_[links_[k].b].push_back(k);
    }
    count_in_spacings(nodes);
    std::vector<double> lengths;
    for (const Link& link : links_) {
      if (link.probability > 0.5 && link.length > 0.0) lengths.push_back(link.length);
    }
    typical_ = lengths.empty() ? 1.0 : upper_median(lengths);
    // Pictures of one place: no direction, and no length to be measured by.
    for (Link& link : links_) {
      if (link.length == 0.0) link.length = kBeside * typical_;
    }
    begin(start);
  }

  GrownLayout grow() {
    for (std::size_t p = 0; p < between_.size(); ++p) {
      for (const auto& [q, links] : between_[p]) {
        if (q > p) consider(p, q);
      }
    }
    while (!open_.empty()) {
      const Join next = open_.top();
      open_.pop();
      // What has been joined or averaged since may have changed it.
      if (!between_[next.p].contains(next.q)) continue;
      const auto found = judge(next.p, next.q);
      if (!found) continue;
      if (found->evidence < next.evidence) {
        open_.push(*found);
      } else {
        join(*found);
      }
    }
    attach_single_views();
    return finish();
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
  struct Hypothesis {
    double evidence = -INFINITY;
    Pose2 p_from_q;
  };
  /// The ends of a link between two components.
  struct Ends {
    std::size_t in_p, in_q;
    Pose2 step;  // in_p_from_in_q
  };

  /// The phases count in the distance of the things around, which is large in halls and small in
  /// corridors. As little is known of how evenly the views lie: half of what the spacing of the
  /// views around (in that unit) differs from the median one is taken for a difference of the unit.
  void count_in_spacings(std::size_t nodes) {
    std::vector<double> spacings(nodes, 0.0);
    std::vector<double> known;
    for (std::size_t i = 0; i < nodes; ++i) {
      std::vector<double> own;
      for (const std::size_t k : links_of_[i]) {
        if (links_[k].probability > 0.5 && links_[k].length > 0.0) {
          own.push_back(links_[k].length);
        }
      }
      if (own.size() < 3) continue;
      std::ranges::nth_element(own, own.begin() + 1);
      spacings[i] = own[1];
      known.push_back(own[1]);
    }
    if (known.empty()) return;
    const double median = upper_median(known);
    for (Link& link : links_) {
      const auto excess = [&](std::size_t view) {
        return spacings[view] > 0.0 ? std::log(spacings[view] / median) : 0.0;
      };
      const double factor = std::exp(-kShareOfUnit * 0.5 * (excess(link.a) + excess(link.b)));
      link.length *= factor;
      link.step.x_m *= factor;
      link.step.y_m *= factor;
    }
  }

  void begin(const LatticeStart& start) {
    std::map<std::size_t, std::size_t> first;  // view of each component
    for (std::size_t i = 0; i < component_.size(); ++i) {
      const std::size_t given = start.components.empty() ? i : start.components[i];
      component_[i] = first.try_emplace(given, i).first->second;
      members_[component_[i]].push_back(i);
    }
    for (std::size_t i = 0; i < members_.size(); ++i) {
      averaged_at_[i] = std::max<std::size_t>(1, members_[i].size());
    }
    for (std::size_t k = 0; k < links_.size(); ++k) {
      const auto [p, q] = std::pair(component_[links_[k].a], component_[links_[k].b]);
      if (p == q) continue;
      between_[p][q].push_back(k);
      between_[q][p].push_back(k);
    }
  }

  [[nodiscard]] Ends ends_of(std::size_t k, std::size_t p) const {
    const Link& link = links_[k];
    if (component_[link.a] == p) return {link.a, link.b, link.step};
    return {link.b, link.a, inverse(link.step)};
  }
  [[nodiscard]] bool agrees_with(std::size_t k, const Ends& ends, const Pose2& p_from_q) const {
    return is_near(poses_[ends.in_p] * ends.step, p_from_q * poses_[ends.in_q],
                   kPositionFits * links_[k].length);
  }
  [[nodiscard]] bool agrees_inside(const Link& link) const {
    return is_near(poses_[link.a] * link.step, poses_[link.b], kPositionFits * link.length);
  }

  /// Log-likelihood ratio of how alike the views of a link look beside those of the links of the
  /// same views, inside their components, that are clearly longer in the layout.
  [[nodiscard]] double concordance(const Ends& ends, double laid_out, double residual) const {
    double longer = 0.0;
    double more_alike = 0.0;
    for (const std::size_t view : {ends.in_p, ends.in_q}) {
      for (const std::size_t k : links_of_[view]) {
        const Link& own = links_[k];
        if (component_[own.a] != component_[own.b] || !agrees_inside(own)) continue;
        const double length = distance(poses_[own.a].position(), poses_[own.b].position());
        if (length < kClearlyLonger * laid_out) continue;
        longer += 1.0;
        more_alike += own.residual < residual ? 1.0 : 0.0;
      }
    }
    if (longer == 0.0) return 0.0;
    const double share = more_alike / longer;
    // Of each of the two views.
    return 2.0 * (share * std::log(kDiscordant / 0.5) +
                  (1.0 - share) * std::log((1.0 - kDiscordant) / 0.5));
  }

  /// What the links say for a relative pose that link `first` told. Links that share a view share
  /// their errors: the n-th one of a view counts for 1/n.
  [[nodiscard]] double evidence_for(const Pose2& p_from_q, std::size_t p,
                                    std::span<const std::size_t> links, std::size_t first) const {
    std::map<std::size_t, int> used;
    const Ends told = ends_of(first, p);
    used[told.in_p] = used[told.in_q] = 1;
    const double prior = links_[first].probability;
    double evidence = std::log(prior / (1.0 - prior));
    for (const std::size_t k : links) {
      if (k == first) continue;
      const Ends ends = ends_of(k, p);
      if (!agrees_with(k, ends, p_from_q)) continue;
      const double right = links_[k].probability;
      const Point2 there = (p_from_q * poses_[ends.in_q]).position();
      const double ratio =
          std::log((right + (1.0 - right) * kChance) / kChance) +
          concordance(ends, distance(poses_[ends.in_p].position(), there), links_[k].residual);
      evidence += ratio / (1.0 + std::max(used[ends.in_p], used[ends.in_q]));
      ++used[ends.in_p];
      ++used[ends.in_q];
    }
    return evidence;
  }

  /// The mean of what the links tell that agree with a relative pose.
  [[nodiscard]] Pose2 mean_of_agreeing(const Pose2& p_from_q, std::size_t p,
                                       std::span<const std::size_t> links) const {
    std::vector<std::tuple<double, Point2, Pose2>> agreeing;  // weight, in q, told in p
    double weights = 0.0;
    double turned = 0.0;
    for (const std::size_t k : links) {
      const Ends ends = ends_of(k, p);
      if (!agrees_with(k, ends, p_from_q)) continue;
      const Pose2 told = poses_[ends.in_p] * ends.step;
      const double weight = links_[k].probability / (links_[k].length * links_[k].length);
      weights += weight;
      turned +=
          weight * angle_difference(told.heading_rad, (p_from_q * poses_[ends.in_q]).heading_rad);
      agreeing.emplace_back(weight, poses_[ends.in_q].position(), told);
    }
    if (agreeing.size() < 2) return p_from_q;
    Pose2 mean{0.0, 0.0, wrap_angle(p_from_q.heading_rad + turned / weights)};
    Point2 shift;
    for (const auto& [weight, in_q, told] : agreeing) {
      const Point2 at = mean * in_q;
      shift.x_m += weight / weights * (told.x_m - at.x_m);
      shift.y_m += weight / weights * (told.y_m - at.y_m);
    }
    mean.x_m = shift.x_m;
    mean.y_m = shift.y_m;
    return mean;
  }

  /// How many views of either component come to lie beside one of the other without any link that
  /// agrees: no wall fits between them. Only near where the two meet: farther off the layout may
  /// have drifted.
  [[nodiscard]] double contradictions(const Pose2& p_from_q, std::size_t p, std::size_t q,
                                      std::span<const std::size_t> links) const {
    std::vector<Point2> meeting;
    std::set<std::size_t> agreeing;
    for (const std::size_t k : links) {
      const Ends ends = ends_of(k, p);
      if (!agrees_with(k, ends, p_from_q)) continue;
      meeting.push_back(poses_[ends.in_p].position());
      agreeing.insert({ends.in_p, ends.in_q});
    }
    std::set<std::size_t> alone;
    for (const std::size_t b : members_[q]) {
      const Point2 at = (p_from_q * poses_[b]).position();
      if (std::ranges::none_of(meeting,
                               [&](Point2 m) { return distance(m, at) < kNear * typical_; })) {
        continue;
      }
      for (const std::size_t a : members_[p]) {
        if (distance(at, poses_[a].position()) >= kBeside * typical_) continue;
        if (!agreeing.contains(a)) alone.insert(a);
        if (!agreeing.contains(b)) alone.insert(b);
      }
    }
    return static_cast<double>(alone.size());
  }

  /// The relative pose of two components that their links tell best.
  [[nodiscard]] Hypothesis best_of(std::size_t p, std::size_t q) {
    auto& links = between_[p].at(q);
    std::ranges::sort(links, {}, [&](std::size_t k) {
      return std::tuple(-links_[k].probability, links_[k].residual, k);
    });
    std::vector<Hypothesis> all;
    for (std::size_t h = 0; h < std::min(kHypotheses, links.size()); ++h) {
      const Ends ends = ends_of(links[h], p);
      Hypothesis told{.p_from_q = poses_[ends.in_p] * ends.step * inverse(poses_[ends.in_q])};
      told.evidence = evidence_for(told.p_from_q, p, links, links[h]);
      const Pose2 mean = mean_of_agreeing(told.p_from_q, p, links);
      const double of_mean = evidence_for(mean, p, links, links[h]);
      if (of_mean > told.evidence) told = {of_mean, mean};
      all.push_back(told);
    }
    Hypothesis best = *std::ranges::max_element(all, {}, &Hypothesis::evidence);
    double other = 0.0;
    for (std::size_t h = 0; h < all.size(); ++h) {
      const Pose2& at = poses_[ends_of(links[h], p).in_q];
      const Pose2 here = best.p_from_q * at;
      const Pose2 there = all[h].p_from_q * at;
      if (std::abs(angle_difference(here.heading_rad, there.heading_rad)) > 2.0 * kTurnFits ||
          distance(here.position(), there.position()) > kNear * typical_) {
        other = std::max(other, all[h].evidence);
      }
    }
    best.evidence -= other;
    if (best.evidence > 0.0) {
      best.evidence += std::log((1.0 - kAgreesBeside) / (1.0 - kChance)) *
                       contradictions(best.p_from_q, p, q, links);
    }
    return best;
  }

  /// Empty: what is known does not suffice to join the two.
  [[nodiscard]] std::optional<Join> judge(std::size_t p, std::size_t q) {
    if (std::pair(members_[p].size(), q) < std::pair(members_[q].size(), p)) std::swap(p, q);
    const Hypothesis best = best_of(p, q);
    const auto misplaced = static_cast<double>(members_[q].size());
    if (best.evidence < std::log(kOdds * misplaced)) return std::nullopt;
    return Join{best.evidence, p, q, best.p_from_q};
  }
  void consider(std::size_t p, std::size_t q) {
    if (const auto found = judge(p, q)) open_.push(*found);
  }

  /// The smaller component q becomes part of p.
  void join(const Join& found) {
    const auto [p, q] = std::pair(found.p, found.q);
    for (const std::size_t view : members_[q]) {
      poses_[view] = found.p_from_q * poses_[view];
      component_[view] = p;
      members_[p].push_back(view);
    }
    members_[q].clear();
    between_[p].erase(q);
    between_[q].erase(p);
    std::vector<std::size_t> touched;
    for (const auto& [other, links] : between_[q]) {
      auto& all = between_[p][other];
      all.insert(all.end(), links.begin(), links.end());
      between_[other][p] = all;
      between_[other].erase(q);
      touched.push_back(other);
    }
    between_[q].clear();
    if (static_cast<double>(members_[p].size()) > kGrown * static_cast<double>(averaged_at_[p])) {
      average(p);
      touched.clear();
      for (const auto& [other, links] : between_[p]) touched.push_back(other);
    }
    if (watch_) watch_(poses_, component_);
    for (const std::size_t other : touched) consider(p, other);
  }

  /// Least absolute differences over the links inside a component, by reweighting: headings, then
  /// positions.
  void average(std::size_t p) {
    const auto& views = members_[p];
    averaged_at_[p] = views.size();
    std::map<std::size_t, int> unknown;  // the first view stays
    for (const std::size_t view : views)
      unknown.emplace(view, static_cast<int>(unknown.size()) - 1);
    std::vector<std::size_t> inside;
    for (const std::size_t view : views) {
      for (const std::size_t k : links_of_[view]) {
        if (links_[k].a == view && component_[links_[k].b] == p && agrees_inside(links_[k])) {
          inside.push_back(k);
        }
      }
    }
    SparseEquations equations;
    // `rest`: what link k lacks; `weight`: of its square.
    const auto solve = [&](const auto& rest, const auto& weight) -> std::optional<Eigen::VectorXd> {
      equations.begin(static_cast<int>(views.size()) - 1);
      for (int i = 0; i + 1 < static_cast<int>(views.size()); ++i) equations.add(i, i, 1e-9);
      for (const std::size_t k : inside) {
        const double w = weight(k);
        const double r = rest(k);
        const int a = unknown.at(links_[k].a);
        const int b = unknown.at(links_[k].b);
        if (a >= 0) {
          equations.add(a, a, w);
          equations.right(a) -= w * r;
        }
        if (b >= 0) {
          equations.add(b, b, w);
          equations.right(b) += w * r;
        }
        if (a >= 0 && b >= 0) equations.add(a, b, -w);
      }
      equations.assemble();
      return equations.solve();
    };
    constexpr int kRounds = 3;
    iterations_ += 2 * kRounds;
    constexpr double kSmallAngle = 0.03;
    constexpr double kSmallShare = 0.1;
    for (int round = 0; round < kRounds; ++round) {
      const auto rest = [&](std::size_t k) {
        const Link& link = links_[k];
        return angle_difference(link.step.heading_rad,
                                poses_[link.b].heading_rad - poses_[link.a].heading_rad);
      };
      const auto change = solve(rest, [&](std::size_t k) {
        return links_[k].probability / std::max(kSmallAngle, std::abs(rest(k)));
      });
      if (!change) return;
      for (const auto& [view, i] : unknown) {
        if (i >= 0) poses_[view].heading_rad = wrap_angle(poses_[view].heading_rad + (*change)(i));
      }
    }
    for (int round = 0; round < kRounds; ++round) {
      const auto lacks = [&](std::size_t k) {
        const Pose2 told = poses_[links_[k].a] * links_[k].step;
        const Pose2& b = poses_[links_[k].b];
        return Point2{told.x_m - b.x_m, told.y_m - b.y_m};
      };
      const auto weight = [&](std::size_t k) {
        const Link& link = links_[k];
        const Point2 lack = lacks(k);
        return link.probability /
               (link.length * std::max(kSmallShare * link.length, std::hypot(lack.x_m, lack.y_m)));
      };
      const auto dx = solve([&](std::size_t k) { return lacks(k).x_m; }, weight);
      const auto dy = solve([&](std::size_t k) { return lacks(k).y_m; }, weight);
      if (!dx || !dy) return;
      for (const auto& [view, i] : unknown) {
        if (i < 0) continue;
        poses_[view].x_m += (*dx)(i);
        poses_[view].y_m += (*dy)(i);
      }
    }
  }

  /// Views that are left over and can misplace nothing but themselves need no more
  /// for than against it, and nothing grows from them.
  void attach_single_views() {
    std::vector<Join> found;
    for (std::size_t view = 0; view < members_.size(); ++view) {
      if (members_[view].size() != 1) continue;
      std::optional<Join> best;
      for (const auto& [p, unused] : between_[view]) {
        if (members_[p].size() < 2) continue;
        const Hypothesis told = best_of(p, view);
        if (told.evidence < std::log(kOddsOfSingleViews)) continue;
        if (!best || told.evidence > best->evidence) {
          best = Join{told.evidence, p, view, told.p_from_q};
        }
      }
      if (best) found.push_back(*best);
    }
    for (const Join& each : found) {
      poses_[each.q] = each.p_from_q * poses_[each.q];
      component_[each.q] = each.p;
      members_[each.p].push_back(each.q);
      members_[each.q].clear();
      // What is left between components is only asked for proposals.
      for (const auto& [other, unused] : between_[each.q]) between_[other].erase(each.q);
      between_[each.q].clear();
    }
  }

  /// Pairs of views that would lie near each other if the best relative pose of their components
  /// were right, where there is more for than against it: to measure them will tell.
  [[nodiscard]] std::vector<NodePair> propose() {
    std::vector<NodePair> proposals;
    for (std::size_t p = 0; p < members_.size(); ++p) {
      for (const auto& [q, unused] : between_[p]) {
        if (q < p) continue;
        const Hypothesis best = best_of(p, q);
        if (!(best.evidence > 0.0)) continue;
        std::vector<std::pair<double, NodePair>> near;
        for (const std::size_t b : members_[q]) {
          const Point2 at = (best.p_from_q * poses_[b]).position();
          for (const std::size_t a : members_[p]) {
            const double way = distance(at, poses_[a].position());
            if (way < kNear * typical_) near.emplace_back(way, std::minmax(a, b));
          }
        }
        std::ranges::sort(near);
        for (std::size_t i = 0; i < std::min(kProposals, near.size()); ++i) {
          proposals.push_back(near[i].second);
        }
      }
    }
    return proposals;
  }

  GrownLayout finish() {
    GrownLayout result{.proposals = propose()};
    std::vector<GraphEdge> edges;
    for (std::size_t p = 0; p < members_.size(); ++p) {
      for (int i = 0; i < kLastAverages && members_[p].size() > 1; ++i) average(p);
      for (const std::size_t view : members_[p]) {
        if (view != p) edges.push_back({p, view, 1.0});
      }
    }
    for (const Link& link : links_) {
      if (component_[link.a] != component_[link.b]) continue;
      const Point2 told = (poses_[link.a] * link.step).position();
      const double gap = distance(told, poses_[link.b].position()) / (kPositionFits * link.length);
      const double weight = 1.0 / ((1.0 + gap * gap) * (1.0 + gap * gap));
      result.weights.emplace(NodePair{link.a, link.b}, weight);
      result.energy += weight * gap * gap;
    }
    result.iterations = iterations_;
    result.start.components = LatticeGraph(component_.size(), edges).components();
    result.start.poses = std::move(poses_);
    result.start.handedness_known.assign(component_.size(), 0);
    for (const GraphEdge& edge : edges) {
      result.start.handedness_known[result.start.components[edge.a]] = 1;
    }
    return result;
  }

  const LatticeWatch& watch_;
  std::vector<Link> links_;
  std::vector<Pose2> poses_;  // each in the frame of its component
  std::vector<std::size_t> component_;
  std::vector<std::vector<std::size_t>>
      members_;  // of each component, named after one of its views
  std::vector<std::vector<std::size_t>> links_of_;
  std::vector<std::map<std::size_t, std::vector<std::size_t>>> between_;
  std::vector<std::size_t> averaged_at_;  // number of views
  int iterations_ = 0;
  double typical_ = 1.0;  // length of a link
  std::priority_queue<Join> open_;
};

}  // namespace

bool fits(const LatticeSpring& spring, double unit, const Pose2& a, const Pose2& b) {
  if (!spring.phases || !agrees(spring)) return false;
  const Pose2 told = step_of(spring, unit);
  const Pose2 laid_out = inverse(a) * b;
  if (!spring.phases->points) {
    return std::abs(angle_difference(told.heading_rad, laid_out.heading_rad)) <= kTurnFits;
  }
  const double way = std::hypot(laid_out.x_m, laid_out.y_m);
  const double length = unit * spring.phases->length;
  return std::abs(angle_difference(told.heading_rad, laid_out.heading_rad)) <= kTurnFits &&
         std::abs(angle_difference(std::atan2(told.y_m, told.x_m),
                                   std::atan2(laid_out.y_m, laid_out.x_m))) <= kDirectionFits &&
         way <= kLengthFits * length && length <= kLengthFits * way;
}

GrownLayout grow_components(std::size_t nodes, std::span<const LatticeSpring> springs, double unit,
                            const LatticeStart& start, const LatticeWatch& watch) {
  return Grower(nodes, springs, unit, start, watch).grow();
}

}  // namespace panonav
