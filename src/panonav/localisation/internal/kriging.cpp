#include "panonav/localisation/internal/kriging.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "panonav/localisation/position_model.hpp"

namespace panonav {

namespace {

// Column differences are means of square roots, so their squares grow with distance.
double squared(double difference) {
  return difference * difference;
}

}  // namespace

ResemblingViews compare_with_each_other(const ColumnRanking& ranking,
                                        std::span<const RankedMatch> matches,
                                        double neighbourhood_m) {
  ResemblingViews near;
  std::vector<double> squared_query_differences;
  std::vector<std::shared_ptr<const ColumnProfiles>> profiles;
  for (const RankedMatch& ranked : matches) {
    if (near.views.size() == PositionModel::max_candidates) break;
    const ViewId view = ranked.match.view;
    const auto position = find_position(ranking.memory().info(view));
    if (!position) continue;
    near.views.push_back(view);
    near.positions.push_back(*position);
    squared_query_differences.push_back(squared(ranked.columns.difference));
    const bool is_compared = distance(*position, near.positions[0]) <= neighbourhood_m;
    profiles.push_back(is_compared ? ranking.profiles(view) : nullptr);
  }
  const auto size = static_cast<Eigen::Index>(near.views.size());
  near.squared_query_differences =
      Eigen::Map<const Eigen::VectorXd>(squared_query_differences.data(), size);
  near.squared_mutual_differences = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      const auto& query = profiles[static_cast<std::size_t>(j)];
      const auto& reference = profiles[static_cast<std::size_t>(i)];
      if (i == j || !query || !reference) continue;
      near.squared_mutual_differences(i, j) = squared(match_columns(*query, *reference).difference);
    }
  }
  return near;
}

double ratio_to_elsewhere(const ResemblingViews& near, double spacing_m) {
  double min_elsewhere = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < near.views.size(); ++i) {
    if (distance(near.positions[i], near.positions[0]) <= elsewhere_spacings * spacing_m) continue;
    min_elsewhere =
        std::min(min_elsewhere, near.squared_query_differences(static_cast<Eigen::Index>(i)));
  }
  if (!(min_elsewhere < std::numeric_limits<double>::infinity())) return 0.0;
  return min_elsewhere > 0.0 ? std::sqrt(near.squared_query_differences(0) / min_elsewhere) : 1.0;
}

KrigedPosition krige(const ResemblingViews& near, double neighbourhood_m, double exponent,
                     double unit) {
  KrigedPosition result;
  for (std::size_t i = 0; i < near.views.size(); ++i) {
    if (distance(near.positions[i], near.positions[0]) <= neighbourhood_m) result.used.push_back(i);
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
    right(i) = variogram(near.squared_query_differences(a));
    for (Eigen::Index j = 0; j < size; ++j) {
      matrix(i, j) =
          variogram(near.squared_mutual_differences(a, static_cast<Eigen::Index>(result.used[j])));
    }
  }
  // Takes the solution of smallest norm, so that references with equal signatures share their
  // weight.
  const Eigen::VectorXd solution = matrix.completeOrthogonalDecomposition().solve(right);
  double total = 0.0;
  for (Eigen::Index i = 0; i < size; ++i) total += solution(i);
  result.variance = std::max(0.0, solution.dot(right));
  for (Eigen::Index i = 0; i < size; ++i) {
    const double weight = solution(i) / total;
    result.weights.push_back(weight);
    const Point2 p = near.positions[result.used[i]].point;
    result.position = {result.position.x_m + weight * p.x_m, result.position.y_m + weight * p.y_m};
  }
  // With an exponent above 1 the variogram may be invalid for the L1 distance. The solution can
  // then leave the neighbourhood; the position of the best match replaces it.
  if (!(distance(result.position, near.positions[0].point) <= neighbourhood_m)) {
    result.position = near.positions[0].point;
    result.used = {0};
    result.weights = {1.0};
    result.variance = 2.0 * variogram(near.squared_query_differences(0));
  }
  return result;
}

}  // namespace panonav
