#include "panonav/mapping/internal/ground_displacement.hpp"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/least_squares.hpp"

namespace panonav {

namespace {

using Pixels = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Azimuths of the later view: two for each period of 32 frequencies.
constexpr int coarse_columns = 64;
/// Azimuths of the earlier view, between which it is interpolated linearly.
constexpr int fine_columns = 256;
constexpr int iterations = 4;  ///< Gauss-Newton steps from a start within a quarter camera height
constexpr int min_bands = 4;   ///< fewest bands that are compared
/// Highest elevation that is used as ground: above it the ground is far away and walls begin.
constexpr double highest_elevation_rad = -10.0 * std::numbers::pi / 180.0;
/// Height of a band in elevation, so small that the distances of the ground in adjacent bands
/// differ by less than the ground moves.
constexpr double band_height_rad = 1.75 * std::numbers::pi / 180.0;

/// Rows below the horizon, averaged to bands.
struct GroundBands {
  int begin = 0;  // rows
  int bands = 0;
  int rows_per_band = 1;
  double first_rad = 0.0;  // middle of the first band
  double step_rad = 0.0;   // downwards
};

std::optional<GroundBands> find_ground_bands(const HomingView& view) {
  if (!view.elevations()) return std::nullopt;
  const ElevationBand& band = *view.elevations();
  const double row_rad = (band.top_rad - band.bottom_rad) / view.rows();
  GroundBands made;
  made.rows_per_band = std::max(1, static_cast<int>(std::lround(band_height_rad / row_rad)));
  made.begin = std::max(
      0, static_cast<int>(std::ceil((band.top_rad - highest_elevation_rad) / row_rad - 1e-9)));
  made.bands = (view.rows() - made.begin) / made.rows_per_band;
  if (made.bands < min_bands) return std::nullopt;
  made.step_rad = made.rows_per_band * row_rad;
  made.first_rad = band.top_rad - made.begin * row_rad - 0.5 * made.step_rad;
  return made;
}

// Returns the values of bands x columns, with the mean of each row, as the ground moves from row to
// row.
Pixels sample_ground(const HomingView& view, const GroundBands& ground, int count) {
  const int highest = std::min(view.components(), coarse_columns / 2) - 1;
  Pixels cosines = Pixels::Zero(ground.bands, highest);
  Pixels sines = Pixels::Zero(ground.bands, highest);
  const float share = 1.0F / static_cast<float>(ground.rows_per_band);
  for (int k = 1; k <= highest; ++k) {
    for (int row = 0; row < ground.bands * ground.rows_per_band; ++row) {
      cosines(row / ground.rows_per_band, k - 1) += share * view.a(ground.begin + row, k);
      sines(row / ground.rows_per_band, k - 1) += share * view.b(ground.begin + row, k);
    }
  }
  std::vector<float> cosine(static_cast<std::size_t>(count));
  std::vector<float> sine(static_cast<std::size_t>(count));
  for (int c = 0; c < count; ++c) {
    const double angle = 2.0 * std::numbers::pi * c / count;
    cosine[static_cast<std::size_t>(c)] = static_cast<float>(std::cos(angle));
    sine[static_cast<std::size_t>(c)] = static_cast<float>(std::sin(angle));
  }
  Pixels waves(2 * highest, count);
  for (int k = 1; k <= highest; ++k) {
    for (int c = 0; c < count; ++c) {
      const auto at = static_cast<std::size_t>(k * c % count);
      waves(k - 1, c) = cosine[at];
      waves(highest + k - 1, c) = sine[at];
    }
  }
  Eigen::VectorXf means = Eigen::VectorXf::Zero(ground.bands);
  for (int row = 0; row < ground.bands * ground.rows_per_band; ++row) {
    means[row / ground.rows_per_band] += 0.5F * share * view.a(ground.begin + row, 0);
  }
  Pixels values = cosines * waves.topRows(highest) + sines * waves.bottomRows(highest);
  values.colwise() += means;
  return values;
}

/// The residual of a pixel of the later view whose point of the ground the earlier one shows, too.
struct Equation {
  double difference = 0.0;
  Eigen::Vector2d slopes = Eigen::Vector2d::Zero();  // over x, y
};

class Ground {
 public:
  Ground(const HomingView& before, const HomingView& after, const GroundBands& bands)
      : bands_(bands),
        later_(sample_ground(after, bands, coarse_columns)),
        earlier_(sample_ground(before, bands, fine_columns)) {}

  [[nodiscard]] std::size_t pixels() const {
    return static_cast<std::size_t>(bands_.bands) * coarse_columns;
  }

  // Collects the equations of the pixels whose ground point both views show.
  void linearise(const Pose2& motion, std::vector<Equation>& equations) const {
    equations.clear();
    for (int c = 0; c < coarse_columns; ++c) {
      const double azimuth = 2.0 * std::numbers::pi * c / coarse_columns + motion.heading_rad;
      const Eigen::Vector2d direction(std::cos(azimuth), std::sin(azimuth));
      for (int band = 0; band < bands_.bands; ++band) {
        const double away = -1.0 / std::tan(bands_.first_rad - band * bands_.step_rad);
        const Eigen::Vector2d point = away * direction + Eigen::Vector2d(motion.x_m, motion.y_m);
        if (const auto equation = compare(point, later_(band, c))) equations.push_back(*equation);
      }
    }
  }

 private:
  // Compares a point of the ground in the frame of the earlier view with its `value` in the later
  // one.
  [[nodiscard]] std::optional<Equation> compare(const Eigen::Vector2d& point, double value) const {
    const double distance = point.norm();
    if (!(distance > 1e-3)) return std::nullopt;
    const double row = (bands_.first_rad + std::atan(1.0 / distance)) / bands_.step_rad;
    if (!(row >= 0.0) || row > bands_.bands - 1) return std::nullopt;
    double column = std::atan2(point.y(), point.x()) / (2.0 * std::numbers::pi) * fine_columns;
    if (column < 0.0) column += fine_columns;
    // Between four pixels.
    const int r = std::min(static_cast<int>(row), bands_.bands - 2);
    const int left = static_cast<int>(column) % fine_columns;
    const int right = (left + 1) % fine_columns;
    const double down = row - r;
    const double along = column - std::floor(column);
    const double upper = (1.0 - along) * earlier_(r, left) + along * earlier_(r, right);
    const double lower = (1.0 - along) * earlier_(r + 1, left) + along * earlier_(r + 1, right);
    const double over_azimuth = ((1.0 - down) * (earlier_(r, right) - earlier_(r, left)) +
                                 down * (earlier_(r + 1, right) - earlier_(r + 1, left))) *
                                (fine_columns / (2.0 * std::numbers::pi));
    const double over_elevation = (upper - lower) / bands_.step_rad;
    const double squared = distance * distance;
    return Equation{.difference = value - (1.0 - down) * upper - down * lower,
                    .slopes = over_azimuth / squared * Eigen::Vector2d(-point.y(), point.x()) +
                              over_elevation / (1.0 + squared) / distance * point};
  }

  GroundBands bands_;
  Pixels later_;
  Pixels earlier_;
};

/// The estimate of the motion over the ground as a problem for `minimise`.
class GroundProblem {
 public:
  using Equations = DenseEquations<2>;

  GroundProblem(const Ground& ground, const Pose2& start) : ground_(ground), motion_(start) {}

  /// False where both views have too little in common, or no pixel changes with the motion.
  bool linearise(Equations& normal) {
    ground_.linearise(motion_, equations_);
    if (equations_.size() < ground_.pixels() / 4) return false;
    absolute_differences_.clear();
    for (const Equation& equation : equations_)
      absolute_differences_.push_back(std::abs(equation.difference));
    median_difference_ = upper_median_in_place(std::span(absolute_differences_));
    const double scale = 1.4826 * median_difference_ + 1e-9;
    normal.set_zero();
    double left = 0.0;
    double weights = 0.0;
    for (const Equation& equation : equations_) {
      const double relative = equation.difference / scale;
      const double weight = cauchy_weight(relative * relative);
      normal.matrix += weight * equation.slopes * equation.slopes.transpose();
      normal.right += weight * equation.difference * equation.slopes;
      left += weight * equation.difference * equation.difference;
      weights += weight;
    }
    const double trace = normal.matrix.trace();
    if (!(trace > 0.0)) return false;
    normal.matrix.diagonal().array() += 1e-9 * trace;
    // Four adjacent columns are not independent, as the shortest wave of 15 components covers them.
    variance_ = 4.0 * left / weights;
    return true;
  }

  bool move(const Eigen::Vector2d& change) {
    motion_.x_m += change.x();
    motion_.y_m += change.y();
    return false;
  }

  /// Returns the motion with the deviation of the last `linearise`.
  [[nodiscard]] GroundDisplacement result(const Equations& normal) const {
    const double length = std::hypot(motion_.x_m, motion_.y_m);
    const Eigen::Vector2d along = length > 0.0
                                      ? Eigen::Vector2d(motion_.x_m / length, motion_.y_m / length)
                                      : Eigen::Vector2d(1.0, 0.0);
    const double spread = along.dot(normal.matrix.inverse() * along);
    return {motion_.x_m, motion_.y_m, std::sqrt(variance_ * spread), median_difference_};
  }

 private:
  const Ground& ground_;
  Pose2 motion_;
  std::vector<Equation> equations_;
  std::vector<double> absolute_differences_;
  double median_difference_ = 0.0;  // median absolute difference
  double variance_ = 0.0;           // of a difference
};

std::optional<GroundDisplacement> solve(const Ground& ground, const Pose2& start) {
  GroundProblem problem(ground, start);
  GroundProblem::Equations normal;
  const auto solved = minimise(problem, normal, {.max_steps = iterations});
  if (!solved.solvable || !problem.linearise(normal)) return std::nullopt;
  return problem.result(normal);
}

}  // namespace

std::optional<GroundDisplacement> ground_displacement(const HomingView& before,
                                                      const HomingView& after, const Pose2& start) {
  require(before.rows() == after.rows(), "rows of the view before", before.rows(),
          "those of the view after");
  const auto bands = find_ground_bands(after);
  if (!bands || before.elevations() != after.elevations()) return std::nullopt;
  return solve(Ground(before, after, *bands), start);
}

}  // namespace panonav
