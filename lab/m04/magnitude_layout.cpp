#include "lab/m04/magnitude_layout.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <numeric>

#include "panonav/core/error.hpp"

namespace panonav::lab {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Classical multidimensional scaling to two dimensions.
MatrixXd scale_classically(const MatrixXd& distances) {
  const Index n = distances.rows();
  const MatrixXd squares = distances.array().square();
  const VectorXd mean = squares.rowwise().mean();
  MatrixXd inner = (squares.colwise() - mean).rowwise() - mean.transpose();
  inner = -0.5 * (inner.array() + mean.mean()).matrix();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(inner);
  MatrixXd points(n, 2);
  for (Index axis = 0; axis < 2; ++axis) {
    const Index column = n - 1 - axis;
    points.col(axis) =
        solver.eigenvectors().col(column) * std::sqrt(std::max(0.0, solver.eigenvalues()(column)));
  }
  return points;
}

MatrixXd compute_distances(const MatrixXd& points) {
  MatrixXd distances(points.rows(), points.rows());
  for (Index i = 0; i < points.rows(); ++i)
    distances.col(i) = (points.rowwise() - points.row(i)).rowwise().norm();
  return distances;
}

std::vector<Point2> to_points(const MatrixXd& positions) {
  std::vector<Point2> points;
  for (Index i = 0; i < positions.rows(); ++i) points.push_back({positions(i, 0), positions(i, 1)});
  return points;
}

/// Returns the lengths of the shortest paths between nodes that are joined to their `neighbours`
/// nearest ones [Isomap]. Pieces that these do not connect get infinite distances.
MatrixXd compute_geodesics(const MatrixXd& distances, Index neighbours) {
  const Index n = distances.rows();
  MatrixXd paths = MatrixXd::Constant(n, n, std::numeric_limits<double>::infinity());
  std::vector<Index> order(static_cast<std::size_t>(n));
  for (Index i = 0; i < n; ++i) {
    std::iota(order.begin(), order.end(), Index{0});
    std::ranges::stable_sort(order, {}, [&](Index j) { return j == i ? -1.0 : distances(i, j); });
    for (Index rank = 0; rank <= std::min(neighbours, n - 1); ++rank) {
      const Index j = order[static_cast<std::size_t>(rank)];
      paths(i, j) = paths(j, i) = distances(i, j);
    }
  }
  for (Index via = 0; via < n; ++via) {
    for (Index i = 0; i < n; ++i)
      paths.col(i) = paths.col(i).cwiseMin((paths.col(via).array() + paths(via, i)).matrix());
  }
  return paths;
}

/// Minimises `function(x, gradient)`, which returns its value and writes its gradient, from `x` by
/// limited-memory BFGS with backtracking. Returns the last value.
template <class Function>
double minimise(const Function& function, VectorXd& x, int max_steps) {
  constexpr std::size_t memory = 15;     // pairs of steps that estimate the curvature
  constexpr double sufficient = 1e-4;    // share of the predicted decrease (Armijo)
  constexpr double min_decrease = 1e-7;  // relative; less ends the search
  constexpr int max_halvings = 25;
  std::deque<VectorXd> moves;
  std::deque<VectorXd> changes;
  VectorXd gradient(x.size());
  double value = function(x, gradient);
  for (int step = 0; step < max_steps; ++step) {
    VectorXd direction = -gradient;
    std::vector<double> shares(moves.size());
    for (std::size_t i = moves.size(); i-- > 0;) {
      shares[i] = moves[i].dot(direction) / moves[i].dot(changes[i]);
      direction -= shares[i] * changes[i];
    }
    direction *= moves.empty() ? 0.1 / std::max(1e-9, gradient.norm())
                               : moves.back().dot(changes.back()) / changes.back().squaredNorm();
    for (std::size_t i = 0; i < moves.size(); ++i)
      direction += (shares[i] - changes[i].dot(direction) / moves[i].dot(changes[i])) * moves[i];
    const double slope = direction.dot(gradient);
    double length = 1.0 / std::max(1.0, direction.cwiseAbs().maxCoeff());
    VectorXd next;
    VectorXd next_gradient(x.size());
    double next_value = 0.0;
    bool is_lower = false;
    for (int halving = 0; halving < max_halvings && slope < 0.0 && !is_lower; ++halving) {
      next = x + length * direction;
      next_value = function(next, next_gradient);
      is_lower = next_value <= value + sufficient * length * slope;
      length *= 0.5;
    }
    if (!is_lower) {
      if (moves.empty()) break;
      moves.clear();  // the estimated curvature is wrong: steepest descent
      changes.clear();
      continue;
    }
    moves.push_back(next - x);
    changes.push_back(next_gradient - gradient);
    const bool is_convex =
        moves.back().dot(changes.back()) > 1e-10 * moves.back().norm() * changes.back().norm();
    if (!is_convex) {
      moves.pop_back();
      changes.pop_back();
    } else if (moves.size() > memory) {
      moves.pop_front();
      changes.pop_front();
    }
    const double decrease = value - next_value;
    x = next;
    gradient = next_gradient;
    value = next_value;
    if (decrease < min_decrease * std::abs(value)) break;
  }
  return value;
}

/// Negative log-likelihood of features under a Gaussian process over positions. Covariance of two
/// views at distance r: s (1 + r^2 / (2 a l^2))^-a, a mixture of Gaussians of many lengths, as near
/// and far things change at different distances; plus noise. Parameters: x of all views, y of all
/// views, then the logarithms of l, s, noise and a.
class CovarianceModel {
 public:
  /// `features`: one row per view.
  explicit CovarianceModel(MatrixXd features) : count_(static_cast<double>(features.cols())) {
    features.rowwise() -= features.colwise().mean().eval();
    products_ = features * features.transpose();
    variance_ = products_.trace() / static_cast<double>(features.rows()) / count_;
  }

  /// Moves the positions to more probable ones, in at most `max_steps` steps, and returns their
  /// negative log-likelihood.
  double fit(MatrixXd& positions, int max_steps) const {
    constexpr int scale_steps = 40;
    const Index n = positions.rows();
    positions.rowwise() -= positions.colwise().mean().eval();
    if (!(positions.squaredNorm() > 0.0)) return std::numeric_limits<double>::infinity();
    positions /= std::sqrt(positions.squaredNorm() / static_cast<double>(n));
    VectorXd x(2 * n + 4);
    x << Eigen::Map<const VectorXd>(positions.data(), 2 * n), std::log(first_length),
        std::log(variance_), std::log(usual_noise * variance_), 0.0;
    VectorXd scales = x.tail(4);
    minimise(
        [&](const VectorXd& tried, VectorXd& gradient) {
          VectorXd all = x;
          all.tail(4) = tried;
          VectorXd all_gradient(x.size());
          const double value = evaluate(all, all_gradient);
          gradient = all_gradient.tail(4);
          return value;
        },
        scales, scale_steps);
    x.tail(4) = scales;
    const double value = minimise(
        [&](const VectorXd& tried, VectorXd& gradient) { return evaluate(tried, gradient); }, x,
        max_steps);
    positions = Eigen::Map<const MatrixXd>(x.data(), n, 2);
    return value;
  }

 private:
  static constexpr double first_length = 0.7;  // in root mean square distances from the centre
  static constexpr double usual_noise = 0.05;  // share of the variance
  // Precisions of weak priors: on the logarithms of noise and shape, and on the unit of length.
  static constexpr double noise_precision = 0.04;
  static constexpr double shape_precision = 1.0;
  static constexpr double unit_precision = 10.0;
  // Variance of the unknown mean, in variances of the features.
  static constexpr double mean_variance = 10.0;

  double evaluate(const VectorXd& x, VectorXd& gradient) const {
    const Index n = products_.rows();
    const Eigen::Map<const MatrixXd> positions(x.data(), n, 2);
    const double length = std::exp(x(2 * n));
    const double scale = std::exp(x(2 * n + 1));
    const double noise = std::exp(x(2 * n + 2));
    const double shape = std::exp(x(2 * n + 3));
    const MatrixXd squares = compute_distances(positions).array().square() / (length * length);
    const Eigen::ArrayXXd base = 1.0 + squares.array() / (2.0 * shape);
    const MatrixXd similarity = scale * base.pow(-shape);
    const MatrixXd slope = -0.5 * similarity.array() / base;  // over squared distances
    MatrixXd covariance = similarity;
    covariance.diagonal().array() += noise;
    covariance.array() += mean_variance * variance_;
    const Eigen::LLT<MatrixXd> factor(covariance);
    if (factor.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
    const MatrixXd inverse = factor.solve(MatrixXd::Identity(n, n));
    const MatrixXd explained = inverse * products_;
    double value =
        count_ * factor.matrixLLT().diagonal().array().log().sum() + 0.5 * explained.trace();
    const MatrixXd by_covariance = 0.5 * (count_ * inverse - explained * inverse);
    const MatrixXd by_square = by_covariance.cwiseProduct(slope);
    const MatrixXd pull = by_square / (length * length);
    Eigen::Map<MatrixXd> by_position(gradient.data(), n, 2);
    by_position = 4.0 * (pull.rowwise().sum().asDiagonal() * positions - pull * positions);
    gradient(2 * n) = -2.0 * by_square.cwiseProduct(squares).sum();
    gradient(2 * n + 1) = by_covariance.cwiseProduct(similarity).sum();
    gradient(2 * n + 2) = noise * by_covariance.trace();
    gradient(2 * n + 3) = (by_covariance.array() * similarity.array() *
                           (squares.array() / (2.0 * base) - shape * base.log()))
                              .sum();
    // Priors.
    const double excess = positions.squaredNorm() / static_cast<double>(n) - 1.0;
    const double log_noise = x(2 * n + 2) - std::log(usual_noise * variance_);
    const double log_shape = x(2 * n + 3);
    value +=
        0.5 * (unit_precision * static_cast<double>(n) * excess * excess +
               noise_precision * log_noise * log_noise + shape_precision * log_shape * log_shape);
    by_position += 2.0 * unit_precision * excess * positions;
    gradient(2 * n + 2) += noise_precision * log_noise;
    gradient(2 * n + 3) += shape_precision * log_shape;
    return std::isfinite(value) ? value : std::numeric_limits<double>::infinity();
  }

  double count_ = 0.0;     // features of a view
  MatrixXd products_;      // features of two views, less their mean
  double variance_ = 0.0;  // mean over features
};

/// Returns square roots of magnitudes, one row per view, in the order of the components.
MatrixXd compute_features(std::span<const FourierSignature> views) {
  MatrixXd features(static_cast<Index>(views.size()),
                    static_cast<Index>(views.front().shape().size()));
  for (std::size_t i = 0; i < views.size(); ++i) {
    require(views[i].shape() == views.front().shape(), "rows of a view", views[i].rows(),
            "those of the other views");
    for (Index j = 0; j < features.cols(); ++j) {
      features(static_cast<Index>(i), j) =
          std::sqrt(static_cast<double>(views[i].magnitudes()[static_cast<std::size_t>(j)]));
    }
  }
  return features;
}

/// A start of the search: the first components that are compared, and the neighbours to which
/// shortest paths are found.
struct Start {
  int components = 0;
  Index neighbours = 0;
};

/// Returns the starts for views with this number of components. Low components change slowly and
/// show the coarse order; near neighbours avoid paths across folds.
std::vector<Start> make_starts(int components) {
  std::vector<Start> starts;
  for (const int few : {2, 3, 5, 8, components}) {
    if (few > components) continue;
    for (const Index neighbours : {4, 5, 6, 8, 10, 12}) starts.push_back({few, neighbours});
  }
  return starts;
}

/// Steps of each start, number of most probable results that are continued, and their steps.
constexpr int first_steps = 50;
constexpr std::size_t finished_layouts = 6;
constexpr int last_steps = 300;

/// Positions with their negative log-likelihood.
struct Layout {
  MatrixXd positions;
  double cost = std::numeric_limits<double>::infinity();
};

MatrixXd start_layout(const MatrixXd& features, const Start& start, SignatureShape shape) {
  const MatrixXd first = features.leftCols(static_cast<Index>(start.components) * shape.rows);
  const MatrixXd distances = compute_distances(first);
  Index neighbours = std::min(start.neighbours, features.rows() - 1);
  MatrixXd paths = compute_geodesics(distances, neighbours);
  while (!std::isfinite(paths.maxCoeff())) {
    neighbours = std::min(2 * neighbours, features.rows() - 1);
    paths = compute_geodesics(distances, neighbours);
  }
  MatrixXd positions = scale_classically(paths);
  if (start.components < shape.components) CovarianceModel(first).fit(positions, first_steps);
  return positions;
}

}  // namespace

std::vector<Point2> arrange_by_all_pairs(std::size_t views, std::span<const double> dissimilarities,
                                         const DissimilarityCurve& curve) {
  require(views >= 3, "views", static_cast<double>(views), ">= 3");
  require(dissimilarities.size() == views * views, "dissimilarities",
          static_cast<double>(dissimilarities.size()), "one for each two views");
  constexpr int max_steps = 1000;
  constexpr double min_decrease = 1e-8;
  const auto n = static_cast<Index>(views);
  MatrixXd lengths = MatrixXd::Zero(n, n);
  MatrixXd stiffnesses = MatrixXd::Zero(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      if (i == j) continue;
      lengths(i, j) = curve.distance(dissimilarities[static_cast<std::size_t>(i * n + j)]);
      stiffnesses(i, j) = curve.stiffness(lengths(i, j));
    }
  }
  MatrixXd positions = scale_classically(lengths);
  // The common translation is free; it is fixed by adding 1 to all entries.
  MatrixXd laplacian = -stiffnesses;
  laplacian.diagonal() = stiffnesses.rowwise().sum();
  const Eigen::LDLT<MatrixXd> solver((laplacian.array() + 1.0).matrix());
  double last = std::numeric_limits<double>::infinity();
  for (int step = 0; step < max_steps; ++step) {
    const MatrixXd distances = compute_distances(positions);
    const double energy = (stiffnesses.array() * (distances - lengths).array().square()).sum();
    if (!(last - energy > min_decrease * last) && step > 0) break;
    last = energy;
    MatrixXd forces = -(stiffnesses.array() * lengths.array() /
                        distances.array().max(std::numeric_limits<double>::min()))
                           .matrix();
    forces.diagonal().setZero();
    forces.diagonal() = -forces.rowwise().sum();
    positions = solver.solve(forces * positions);
  }
  return to_points(positions);
}

std::vector<Point2> arrange_by_magnitudes(std::span<const FourierSignature> views,
                                          Executor& executor) {
  require(views.size() >= 3, "views", static_cast<double>(views.size()), ">= 3");
  const MatrixXd features = compute_features(views);
  require((features.rowwise() - features.row(0)).cwiseAbs().maxCoeff() > 0.0,
          "difference of the views", 0.0, "above 0");
  const CovarianceModel model(features);
  const std::vector<Start> starts = make_starts(views.front().components());
  std::vector<Layout> layouts(starts.size());
  executor.for_each_chunk(starts.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
    layouts[i].positions = start_layout(features, starts[i], views.front().shape());
    layouts[i].cost = model.fit(layouts[i].positions, first_steps);
  });
  std::ranges::stable_sort(layouts, {}, &Layout::cost);
  layouts.resize(std::min(layouts.size(), finished_layouts));
  executor.for_each_chunk(layouts.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
    layouts[i].cost = model.fit(layouts[i].positions, last_steps);
  });
  return to_points(std::ranges::min_element(layouts, {}, &Layout::cost)->positions);
}

}  // namespace panonav::lab
