#include "panonav/mapping/internal/lattice_links.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/internal/lattice_graph.hpp"
#include "panonav/mapping/internal/lattice_springs.hpp"

namespace panonav {

namespace {

// Values without another source were chosen on simulated worlds.

/// Rank below which links form the triangles that support others: half of a view's 12 springs.
constexpr std::size_t low_rank = 6;
/// Largest gap of a triangle that closes, as a share of its longest side.
constexpr double max_triangle_gap = 0.5;
/// Bounds of probabilities: by the rank alone, and with the triangles. Springs of the lowest ranks
/// are right in 97 of 100 cases (docs/decisions.md).
constexpr double min_probability = 0.01;
constexpr double max_probability_by_rank = 0.985;
constexpr double max_probability = 0.999;
/// Number of links of the lowest ranks from which the closing share of right links is estimated: a
/// constant, and an addition for each view.
constexpr double min_reference_links = 20.0;
constexpr double reference_links_per_node = 0.1;
/// Bounds of the share of links whose triangles close: of right links, and of wrong ones by chance.
constexpr double min_closing_share = 0.3;
constexpr double max_closing_share = 0.98;
constexpr double min_chance_share = 0.02;
constexpr double max_chance_share = 0.5;
/// Share of the difference of a spacing from the median that is attributed to the unit of phases.
/// In the world `garden` 0 leaves a shape difference of 0.042, 0.5 of 0.027, 1 of 0.033.
constexpr double spacing_share = 0.5;
/// Smallest number of links of known length from which the spacing around a view, the second
/// shortest length, is read.
constexpr std::size_t min_spacing_links = 3;

/// Returns for each link the larger one of its ranks by residual at its two views.
std::vector<std::size_t> mutual_ranks(std::size_t nodes, std::span<const LatticeLink> links) {
  auto of = links_by_node(nodes, links);
  std::vector<std::size_t> ranks(links.size(), 0);
  for (auto& own : of) {
    std::ranges::sort(own, {}, [&](std::size_t k) { return std::pair(links[k].residual, k); });
    for (std::size_t r = 0; r < own.size(); ++r) ranks[own[r]] = std::max(ranks[own[r]], r);
  }
  return ranks;
}

/// Returns 1 for each link that closes a triangle with two links of low rank, else 0.
std::vector<unsigned char> find_supported(std::size_t nodes, std::span<const LatticeLink> links,
                                          std::span<const std::size_t> ranks) {
  std::vector<GraphEdge> edges;
  for (const LatticeLink& link : links) edges.push_back({link.a, link.b, 1.0});
  std::vector<unsigned char> supported(links.size());
  const auto step_from = [&](std::size_t node, const LatticeLink& link) {
    return node == link.a ? link.step : inverse(link.step);
  };
  LatticeGraph(nodes, edges)
      .visit_triangles([&](std::size_t, const auto& to_b) { return ranks[to_b.edge] < low_rank; },
                       [&](std::size_t a, const auto& to_b, const auto& to_c, std::size_t ac) {
                         if (to_c.node <= a || ranks[to_c.edge] >= low_rank) return;
                         const double longest = std::max(
                             {links[to_b.edge].length, links[to_c.edge].length, links[ac].length});
                         const Pose2 around = step_from(a, links[to_b.edge]) *
                                              step_from(to_b.node, links[to_c.edge]);
                         if (is_near(around, step_from(a, links[ac]), max_triangle_gap * longest))
                           supported[ac] = 1;
                       });
  return supported;
}

/// The links of one rank, or of several pooled ones.
struct RankPool {
  double closing, count;
  std::size_t ranks = 1;
  [[nodiscard]] double share() const { return count > 0.0 ? closing / count : 0.0; }
};

/// Returns the number of links of each rank, and of the supported ones among them.
std::vector<RankPool> count_ranks(std::span<const std::size_t> ranks,
                                  std::span<const unsigned char> supported) {
  std::vector<RankPool> counts(ranks.empty() ? 0 : *std::ranges::max_element(ranks) + 1);
  for (std::size_t k = 0; k < ranks.size(); ++k) {
    counts[ranks[k]].count += 1.0;
    counts[ranks[k]].closing += supported[k] != 0 ? 1.0 : 0.0;
  }
  return counts;
}

/// Returns the share of right links that close a triangle, estimated from the links of the lowest
/// ranks. It is below 1, as a right link may have no triangle.
double estimate_closing_share(std::span<const RankPool> counts, std::size_t nodes) {
  const double min_count =
      min_reference_links + reference_links_per_node * static_cast<double>(nodes);
  RankPool lowest{0.0, 0.0};
  for (std::size_t r = 0; r < counts.size() && lowest.count < min_count; ++r) {
    lowest.count += counts[r].count;
    lowest.closing += counts[r].closing;
  }
  return std::clamp(lowest.share(), min_closing_share, max_closing_share);
}

/// Pools neighbouring ranks until no rank is more certain than those below it (isotonic
/// regression).
std::vector<RankPool> pool_ranks(std::span<const RankPool> counts, double reference) {
  std::vector<RankPool> pools;
  for (const RankPool& rank : counts) {
    pools.push_back({rank.closing / reference, rank.count});
    while (pools.size() > 1 && pools[pools.size() - 2].share() <= pools.back().share()) {
      const RankPool last = pools.back();
      pools.pop_back();
      pools.back() = {pools.back().closing + last.closing, pools.back().count + last.count,
                      pools.back().ranks + last.ranks};
    }
  }
  return pools;
}

/// Sets the probability of each link by its rank and updates it (Bayes) if the link closes a
/// triangle or not. Wrong links close a triangle by chance as often as those of the least certain
/// rank. With two views there are no triangles.
void learn_probabilities(std::size_t nodes, std::vector<LatticeLink>& links) {
  const auto ranks = mutual_ranks(nodes, links);
  const auto supported = find_supported(nodes, links, ranks);
  const auto counts = count_ranks(ranks, supported);
  const double reference = estimate_closing_share(counts, nodes);
  const auto pools = pool_ranks(counts, reference);
  std::vector<double> probability;
  for (const RankPool& pool : pools) {
    probability.insert(probability.end(), pool.ranks,
                       std::clamp(pool.share(), min_probability, max_probability_by_rank));
  }
  const double by_chance = pools.empty()
                               ? max_chance_share
                               : std::clamp(pools.back().share() * reference, min_chance_share,
                                            max_chance_share * reference);
  for (std::size_t k = 0; k < links.size(); ++k) {
    const double right = probability[ranks[k]];
    const double as_right = supported[k] != 0 ? reference : 1.0 - reference;
    const double as_wrong = supported[k] != 0 ? by_chance : 1.0 - by_chance;
    const double share = as_right * right / (as_right * right + as_wrong * (1.0 - right));
    links[k].probability =
        nodes < 3 ? max_probability_by_rank : std::clamp(share, min_probability, max_probability);
  }
}

/// Updates the probability of each link by the excess of its correlation over that with a mirrored
/// view. Ranks and triangles alone take links along similar shelves for certain.
void weigh_against_mirror(std::span<const double> excess, std::vector<LatticeLink>& links) {
  // Logistic regression on the links of five arrangements (`loop` twice, `garden`,
  // `small_warehouse`, `small_house`, 0.5 m). Held out by world, the area under the curve rises
  // from 0.83 .. 0.97 to 0.92 .. 0.98.
  constexpr double of_prior = 0.3;
  constexpr double of_excess = 8.2;
  constexpr double offset = -2.2;
  for (std::size_t k = 0; k < links.size(); ++k) {
    const double prior = links[k].probability;
    const double log_odds =
        of_prior * std::log(prior / (1.0 - prior)) + of_excess * excess[k] + offset;
    links[k].probability =
        std::clamp(1.0 / (1.0 + std::exp(-log_odds)), min_probability, max_probability);
  }
}

/// Rescales links by the local spacing of views. The unit of phases is the distance of the things
/// around, which is large in halls and small in corridors; but spacings may differ, too. So half of
/// the difference of a spacing (in that unit) from the median is attributed to the unit.
void rescale_to_spacings(std::size_t nodes, std::vector<LatticeLink>& links) {
  const auto of = links_by_node(nodes, links);
  std::vector<double> spacings(nodes, 0.0);
  std::vector<double> known;
  for (std::size_t i = 0; i < nodes; ++i) {
    std::vector<double> own;
    for (const std::size_t k : of[i]) {
      if (links[k].probability > 0.5 && links[k].length > 0.0) own.push_back(links[k].length);
    }
    if (own.size() < min_spacing_links) continue;
    std::ranges::nth_element(own, own.begin() + 1);
    spacings[i] = own[1];
    known.push_back(own[1]);
  }
  if (known.empty()) return;
  const double median = upper_median(known);
  for (LatticeLink& link : links) {
    const auto excess = [&](std::size_t view) {
      return spacings[view] > 0.0 ? std::log(spacings[view] / median) : 0.0;
    };
    const double factor = std::exp(-spacing_share * 0.5 * (excess(link.a) + excess(link.b)));
    link.length *= factor;
    link.step.x_m *= factor;
    link.step.y_m *= factor;
  }
}

}  // namespace

bool is_near(const Pose2& a, const Pose2& b, double max_distance) {
  return std::abs(angle_difference(a.heading_rad, b.heading_rad)) <= turn_tolerance_rad &&
         distance(a.position(), b.position()) <= max_distance;
}

std::vector<LatticeLink> make_links(std::size_t nodes, std::span<const Lattice::Spring> springs,
                                    double unit) {
  std::vector<LatticeLink> links;
  std::vector<double> excess;
  for (const Lattice::Spring& spring : springs) {
    if (!spring.phases || !has_agreeing_views(spring)) continue;
    links.push_back({spring.a, spring.b, spring.phases->a_from_b(unit),
                     unit * spring.phases->length, spring.phases->residual, 0.0});
    excess.push_back(spring.excess_over_mirror);
  }
  learn_probabilities(nodes, links);
  if (nodes > 2) weigh_against_mirror(excess, links);
  rescale_to_spacings(nodes, links);
  return links;
}

std::vector<std::vector<std::size_t>> links_by_node(std::size_t nodes,
                                                    std::span<const LatticeLink> links) {
  std::vector<std::vector<std::size_t>> of(nodes);
  for (std::size_t k = 0; k < links.size(); ++k) {
    of[links[k].a].push_back(k);
    of[links[k].b].push_back(k);
  }
  return of;
}

}  // namespace panonav
