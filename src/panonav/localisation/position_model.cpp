#include "panonav/localisation/position_model.hpp"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/voronoi.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

namespace {

// What the learning chooses from: neighbourhoods in spacings of the memory, exponents of the
// variogram. 1 is exact for signatures that move as a random walk, 2 would be for signatures that
// change linearly with the position but leaves the solution without a unique answer.
constexpr std::array<double, 6> neighbourhoods = {1.6, 2.3, 3.2, 4.5, 6.5, 9.0};
constexpr std::array<double, 3> exponents = {1.0, 1.25, 1.5};
// Share of the typical kriging variance that stays even where the query equals a reference: sensor
// noise.
constexpr double min_variance = 0.1;
constexpr double coverage = 0.95;
// Farther than any neighbourhood of a place on a grid.
constexpr double elsewhere_spacings = 3.0;
// The neighbours on a grid, diagonal ones included.
constexpr double beside_spacings = 1.5;
// Found for a view left out, of which the doubles are taken away.
constexpr int searched = 4 * PositionModel::candidates;
// Half of what the radius may miss.
constexpr double max_wrong = 0.5 * (1.0 - coverage);

// Posed views, the best match first.
struct Neighbours {
  std::vector<ViewId> views;
  std::vector<Point2> positions;
  Eigen::VectorXd to_query;
  /// (i, j): view j asked, view i the reference. Comparing columns is not quite symmetric, and only
  /// so is the answer to view j view j.
  Eigen::MatrixXd between;
};

// Differences are means of roots; their squares grow with the distance.
double squared(double difference) {
  return difference * difference;
}

Neighbours gather(const ColumnRanking& ranking, std::span<const RankedMatch> matches) {
  Neighbours n;
  std::vector<double> to_query;
  std::vector<ColumnProfiles> profiles;
  for (const RankedMatch& ranked : matches) {
    if (n.views.size() == PositionModel::candidates) break;
    const ViewId view = ranked.match.view;
    const auto& pose = ranking.memory().info(view).pose;
    if (!pose) continue;
    n.views.push_back(view);
    n.positions.push_back(pose->position());
    to_query.push_back(squared(ranked.columns.difference));
    profiles.push_back(ranking.profiles(view));
  }
  const auto size = static_cast<Eigen::Index>(n.views.size());
  n.to_query = Eigen::Map<const Eigen::VectorXd>(to_query.data(), size);
  n.between = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      if (i == j) continue;
      n.between(i, j) = squared(match_columns(profiles[static_cast<std::size_t>(j)],
                                              profiles[static_cast<std::size_t>(i)])
                                    .difference);
    }
  }
  return n;
}

// Of the best match's difference to that of the best match elsewhere; 0 where there is no other.
double ratio_to_elsewhere(const Neighbours& n, double spacing_m) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < n.views.size(); ++i) {
    if (distance(n.positions[i], n.positions[0]) <= elsewhere_spacings * spacing_m) continue;
    least = std::min(least, n.to_query(static_cast<Eigen::Index>(i)));
  }
  if (!(least < std::numeric_limits<double>::infinity())) return 0.0;
  return least > 0.0 ? std::sqrt(n.to_query(0) / least) : 1.0;
}

// Whether those of the references beside the nearest one that look like the query stand all around
// it.
bool is_surrounded(const Neighbours& n, double spacing_m) {
  std::vector<double> directions;
  for (const Point2& position : n.positions) {
    const double distance_m = distance(position, n.positions[0]);
    if (distance_m == 0.0 || distance_m > beside_spacings * spacing_m) continue;
    directions.push_back(
        std::atan2(position.y_m - n.positions[0].y_m, position.x_m - n.positions[0].x_m));
  }
  if (directions.empty()) return false;
  std::ranges::sort(directions);
  double gap = directions.front() + 2.0 * std::numbers::pi - directions.back();
  for (std::size_t i = 1; i < directions.size(); ++i) {
    gap = std::max(gap, directions[i] - directions[i - 1]);
  }
  return gap < std::numbers::pi - radians(1.0);  // a straight edge leaves half a turn
}

// Of what the search found for a view that was taken at `truth`, the best match of each other
// place.
std::vector<ViewId> doubles_of(const VisualMemory& memory, Point2 truth,
                               std::span<const RankedMatch> ranked, double spacing_m) {
  std::vector<Point2> places{truth};
  std::vector<ViewId> doubles;
  for (const RankedMatch& match : ranked) {
    const auto& pose = memory.info(match.match.view).pose;
    if (!pose || std::ranges::any_of(places, [&](Point2 place) {
          return distance(pose->position(), place) <= elsewhere_spacings * spacing_m;
        })) {
      continue;
    }
    places.push_back(pose->position());
    doubles.push_back(match.match.view);
  }
  return doubles;
}

struct Kriged {
  Point2 position;
  double variance = 0.0;  // in units of the variogram
  std::vector<std::size_t> used;
  std::vector<double> weights;
};

Kriged krige(const Neighbours& n, double neighbourhood_m, double exponent, double unit) {
  Kriged result;
  for (std::size_t i = 0; i < n.views.size(); ++i) {
    if (distance(n.positions[i], n.positions[0]) <= neighbourhood_m) result.used.push_back(i);
  }
  const auto size = static_cast<Eigen::Index>(result.used.size());
  const auto variogram = [&](double dissimilarity) {
    return std::pow(dissimilarity / unit, exponent);
  };
  // The last row and column hold the multiplier of "weights sum to 1".
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Ones(size + 1, size + 1);
  Eigen::VectorXd right = Eigen::VectorXd::Ones(size + 1);
  matrix(size, size) = 0.0;
  for (Eigen::Index i = 0; i < size; ++i) {
    const auto a = static_cast<Eigen::Index>(result.used[i]);
    right(i) = variogram(n.to_query(a));
    for (Eigen::Index j = 0; j < size; ++j) {
      matrix(i, j) = variogram(n.between(a, static_cast<Eigen::Index>(result.used[j])));
    }
  }
  // Of least norm: references with equal signatures share their weight.
  const Eigen::VectorXd solution = matrix.completeOrthogonalDecomposition().solve(right);
  double total = 0.0;
  for (Eigen::Index i = 0; i < size; ++i) total += solution(i);
  for (Eigen::Index i = 0; i < size; ++i) {
    const double weight = solution(i) / total;
    result.weights.push_back(weight);
    const Point2 p = n.positions[result.used[i]];
    result.position = {result.position.x_m + weight * p.x_m, result.position.y_m + weight * p.y_m};
  }
  result.variance = std::max(0.0, solution.dot(right));
  // dissimilarity^exponent above 1 need not be a valid variogram for the L1 distance; where it is
  // not, the solution can leave the neighbourhood, which no position between references does.
  if (!(distance(result.position, n.positions[0]) <= neighbourhood_m)) {
    result.position = n.positions[0];
    result.used = {0};
    result.weights = {1.0};
    result.variance = 2.0 * right(0);  // the variance of a single reference's error
  }
  return result;
}

}  // namespace

void visit_options(PositionModelOptions& options, OptionVisitor& visitor) {
  using T = PositionModelOptions;
  constexpr OptionTable table{
      option<&T::sampled_views>("views used for learning", 8, 1e6),
      option<&T::seed>("seed of the draw", 0),
  };
  table.visit(options, visitor);
}

PositionModel learn_position_model(const ColumnRanking& ranking,
                                   const PositionModelOptions& options) {
  validate(options);
  const VisualMemory& memory = ranking.memory();
  std::vector<ViewId> posed;
  std::vector<Point2> positions;
  for (const ViewId view : memory.views()) {
    if (const auto& pose = memory.info(view).pose) {
      posed.push_back(view);
      positions.push_back(pose->position());
    }
  }
  PositionModel model;
  model.components = ranking.components();
  const double spacing_m = VoronoiCells(positions).spacing_m();
  model.spacing_m = spacing_m;
  if (posed.size() < PositionModel::min_views || spacing_m == 0.0) return model;

  const std::vector<ViewId> sample =
      sample_views(posed, options.sampled_views, static_cast<std::uint64_t>(options.seed));
  const NeighbourSupport support(ranking);
  // How to interpolate is learnt from what the search finds, its doubles included, which decide
  // most where there are few views; how far the result is off, from what an answer is made of.
  std::vector<Neighbours> all_neighbours;
  std::vector<Neighbours> neighbours;
  std::vector<Point2> truths;
  std::vector<double> differences;
  for (const ViewId view : sample) {
    std::vector<ViewId> excluded{view};
    const PackedSignature own = memory.packed(view);
    const Point2 truth = memory.info(view).pose->position();
    const SearchResult found =
        memory.search(own, {.top = searched, .components = ranking.components()},
                      {.excluded_views = excluded, .allowed_rows = {}});
    std::vector<RankedMatch> ranked = ranking.rank(own, found.matches);
    const auto nearest =
        std::span(found.matches)
            .first(std::min<std::size_t>(found.matches.size(), PositionModel::candidates));
    const std::vector<RankedMatch> all = ranking.rank(own, nearest);
    for (const ViewId other : doubles_of(memory, truth, ranked, spacing_m)) {
      excluded.push_back(other);
      std::erase_if(ranked, [&](const RankedMatch& match) { return match.match.view == other; });
    }
    support.rank_by_support(ranking.profiles(view), ranked, excluded);
    // As in an answer, the nearest view must have a pose.
    const auto begins_posed = [&](std::span<const RankedMatch> matches) {
      return !matches.empty() && memory.info(matches[0].match.view).pose;
    };
    if (!begins_posed(ranked) || !begins_posed(all)) continue;
    all_neighbours.push_back(gather(ranking, all));
    neighbours.push_back(gather(ranking, ranked));
    truths.push_back(truth);
    differences.push_back(all_neighbours.back().to_query(0));
  }
  if (neighbours.size() < PositionModel::min_views) return model;
  model.sampled_views = static_cast<int>(neighbours.size());
  constexpr double min_unit = 1e-4;  // for memories of equal views
  model.difference_unit = std::max(min_unit, quantile(differences, 0.5));

  // Views whose nearest match only looks alike say nothing on how to interpolate; a wide
  // neighbourhood would then win because the middle of many wrong places is wrong by less.
  const auto is_near = [&](const Neighbours& n, std::size_t i) {
    return distance(n.positions[0], truths[i]) <= 2.0 * spacing_m;
  };
  double best_sum_m = std::numeric_limits<double>::infinity();
  for (const double spacings : neighbourhoods) {
    for (const double exponent : exponents) {
      double sum_m = 0.0;
      for (std::size_t i = 0; i < all_neighbours.size(); ++i) {
        const Kriged kriged =
            krige(all_neighbours[i], spacings * spacing_m, exponent, model.difference_unit);
        if (is_near(all_neighbours[i], i)) sum_m += distance(kriged.position, truths[i]);
      }
      if (sum_m < best_sum_m) {
        best_sum_m = sum_m;
        model.neighbourhood_m = spacings * spacing_m;
        model.exponent = exponent;
      }
    }
  }
  if (!std::isfinite(best_sum_m)) return model;
  std::vector<double> best_errors;
  std::vector<double> best_variances;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    const Kriged kriged =
        krige(neighbours[i], model.neighbourhood_m, model.exponent, model.difference_unit);
    best_errors.push_back(distance(kriged.position, truths[i]));
    best_variances.push_back(kriged.variance);
  }
  model.variance_unit = quantile(best_variances, 0.5);
  std::vector<double> ratios;
  std::vector<double> surrounded;
  std::vector<double> at_edge;
  for (std::size_t i = 0; i < best_errors.size(); ++i) {
    const double variance = best_variances[i] + min_variance * model.variance_unit;
    if (!(variance > 0.0) || !is_near(neighbours[i], i)) continue;
    ratios.push_back(best_errors[i] / std::sqrt(variance));
    (is_surrounded(neighbours[i], spacing_m) ? surrounded : at_edge).push_back(ratios.back());
  }
  model.median_error_m = quantile(best_errors, 0.5);
  model.error95_m = quantile(best_errors, coverage);
  // The largest share of views, from the clearest on, of which hardly any was found elsewhere.
  std::vector<std::pair<double, std::size_t>> by_ratio;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    by_ratio.emplace_back(ratio_to_elsewhere(neighbours[i], spacing_m), i);
  }
  std::ranges::sort(by_ratio);
  std::size_t clear = 0;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < by_ratio.size(); ++i) {
    wrong += is_near(neighbours[by_ratio[i].second], by_ratio[i].second) ? 0 : 1;
    if (static_cast<double>(wrong) <= max_wrong * static_cast<double>(i + 1)) clear = i + 1;
  }
  std::vector<double> ambiguous;
  for (std::size_t i = clear; i < by_ratio.size(); ++i) {
    ambiguous.push_back(best_errors[by_ratio[i].second]);
  }
  if (!ambiguous.empty()) {
    model.ambiguous_from = by_ratio[clear].first;
    model.ambiguous_radius_m = quantile(ambiguous, coverage);
  }
  // None near: then every answer is ambiguous.
  if (ratios.empty() && !ambiguous.empty()) ratios.push_back(0.0);
  if (ratios.empty()) return model;
  // The quantile of a sample of n that a further draw stays below with at least this probability;
  // of all where there are few of a kind.
  const auto bound = [&](const std::vector<double>& kind) {
    const auto& of = kind.size() < PositionModel::min_views ? ratios : kind;
    const double n = static_cast<double>(of.size());
    return quantile(of, std::min(1.0, coverage * (n + 1.0) / n));
  };
  model.radius_m_per_deviation = bound(surrounded);
  model.edge_radius_m_per_deviation = bound(at_edge);
  model.learnt = true;
  return model;
}

std::optional<PositionEstimate> interpolate_position(const ColumnRanking& ranking,
                                                     const PositionModel& model,
                                                     std::span<const RankedMatch> matches) {
  if (matches.empty()) return std::nullopt;
  const auto& nearest = ranking.memory().info(matches[0].match.view).pose;
  if (!nearest) return std::nullopt;
  PositionEstimate estimate;
  if (!model.learnt) {
    estimate.x_m = nearest->x_m;
    estimate.y_m = nearest->y_m;
    estimate.shares = {{matches[0].match.view, 1.0}};
    return estimate;
  }
  const Neighbours neighbours = gather(ranking, matches);
  const Kriged kriged =
      krige(neighbours, model.neighbourhood_m, model.exponent, model.difference_unit);
  estimate.x_m = kriged.position.x_m;
  estimate.y_m = kriged.position.y_m;
  estimate.radius_m =
      (is_surrounded(neighbours, model.spacing_m) ? model.radius_m_per_deviation
                                                  : model.edge_radius_m_per_deviation) *
      std::sqrt(kriged.variance + min_variance * model.variance_unit);
  if (model.ambiguous_from &&
      ratio_to_elsewhere(neighbours, model.spacing_m) >= *model.ambiguous_from) {
    estimate.radius_m = std::max(*estimate.radius_m, model.ambiguous_radius_m);
  }
  for (std::size_t i = 0; i < kriged.used.size(); ++i) {
    estimate.shares.push_back({neighbours.views[kriged.used[i]], kriged.weights[i]});
  }
  return estimate;
}

}  // namespace panonav
