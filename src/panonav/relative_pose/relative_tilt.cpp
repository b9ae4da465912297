#include "panonav/relative_pose/relative_tilt.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/least_squares.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

namespace {

/// One stage of the estimation. The first stage uses coarse structure, which is larger than its
/// shift by the tilt.
struct TiltStage {
  int frequencies;
  double smoothing_rad;  // of the Gaussian over rows
};
constexpr std::array<TiltStage, 2> tilt_stages{{{6, radians(5.0)}, {12, radians(2.0)}}};
constexpr int tilt_iterations = 3;     ///< Gauss-Newton steps at each stage
constexpr int columns_per_period = 4;  ///< of the highest frequency
/// Margin at the top and bottom, of which a levelled view shows only parts.
constexpr double tilt_margin_rad = radians(5.0);
// Standard deviations of the prior.
constexpr double tilt_deviation_rad = 0.06;     ///< two views tilted by some 3 degrees each
constexpr double displacement_deviation = 0.3;  ///< in units of the distance of things
constexpr double turn_deviation_rad = 0.2;      ///< headings known to 10 degrees

/// Cosine and sine of the azimuth of each column.
struct ColumnDirections {
  explicit ColumnDirections(int columns) {
    for (int c = 0; c < columns; ++c) {
      const double azimuth = 2.0 * std::numbers::pi * c / columns;
      cosines.push_back(static_cast<float>(std::cos(azimuth)));
      sines.push_back(static_cast<float>(std::sin(azimuth)));
    }
  }
  std::vector<float> cosines, sines;
};

/// Makes the panorama of the first frequencies.
Panorama synthesise(const HomingView& view, int frequencies, int columns) {
  Panorama panorama(view.rows(), columns, view.elevations());
  const auto width = static_cast<std::size_t>(columns);
  const ColumnDirections directions(columns);
  std::vector<float> cosines(width);
  std::vector<float> sines(width);
  for (int k = 0; k < std::min(frequencies, view.components()); ++k) {
    for (std::size_t c = 0; c < width; ++c) {
      const std::size_t at = static_cast<std::size_t>(k) * c % width;
      cosines[c] = k == 0 ? 0.5F : directions.cosines[at];
      sines[c] = directions.sines[at];
    }
    for (int y = 0; y < view.rows(); ++y) {
      const float a = view.a(y, k);
      const float b = view.b(y, k);
      float* const row = &panorama.at(y, 0);
      for (std::size_t c = 0; c < width; ++c) row[c] += a * cosines[c] + b * sines[c];
    }
  }
  return panorama;
}

Panorama smooth_rows(const Panorama& panorama, double sigma_rows) {
  const std::vector<float> weights = gaussian_weights(sigma_rows);
  const int reach = static_cast<int>(weights.size()) / 2;
  const int columns = panorama.columns();
  Panorama result(panorama.rows(), columns, panorama.elevations());
  for (int y = 0; y < panorama.rows(); ++y) {
    float* const to = &result.at(y, 0);
    for (int d = -reach; d <= reach; ++d) {
      const float weight = weights[static_cast<std::size_t>(d + reach)];
      const float* const from =
          panorama.values().data() +
          static_cast<std::ptrdiff_t>(std::clamp(y + d, 0, panorama.rows() - 1)) * columns;
      for (int c = 0; c < columns; ++c) to[c] += weight * from[c];
    }
  }
  return result;
}

/// The tilt at one stage as a problem for `minimise`. Unknowns: turn, displacement in two
/// directions, pitch, roll; the first three are not kept from step to step.
class TiltProblem {
 public:
  using Equations = DenseEquations<5>;

  TiltProblem(const Panorama& home, const Panorama& current, int margin, Tilt& tilt)
      : home_(home),
        current_(current),
        directions_(current.columns()),
        margin_(margin),
        tilt_(tilt) {}

  /// False where no residual is left.
  bool linearise(Equations& equations) const {
    equations.set_zero();
    const Panorama level = level_panorama(current_, tilt_);
    const double values = static_cast<double>((level.rows() - 2 * margin_) * level.columns());
    const double noise = add_residuals(level, equations) / values;
    if (!(noise > 0.0)) return false;
    const double certainty = noise / (tilt_deviation_rad * tilt_deviation_rad);
    equations.matrix(0, 0) += noise / (turn_deviation_rad * turn_deviation_rad);
    equations.matrix(1, 1) += noise / (displacement_deviation * displacement_deviation);
    equations.matrix(2, 2) += noise / (displacement_deviation * displacement_deviation);
    equations.matrix(3, 3) += certainty;
    equations.matrix(4, 4) += certainty;
    equations.right[3] -= certainty * tilt_.pitch_rad;
    equations.right[4] -= certainty * tilt_.roll_rad;
    return true;
  }

  bool move(const Equations::Vector& change) {
    constexpr double max_rad = 0.2;  // two views tilted by 6 degrees each
    tilt_.pitch_rad = std::clamp(tilt_.pitch_rad + change[3], -max_rad, max_rad);
    tilt_.roll_rad = std::clamp(tilt_.roll_rad + change[4], -max_rad, max_rad);
    return false;
  }

 private:
  /// Adds the residuals of the home view against the levelled current one with their derivatives.
  /// Returns their energy.
  double add_residuals(const Panorama& level, Equations& equations) const {
    const int columns = level.columns();
    const auto& band = *level.elevations();
    const auto across = static_cast<float>(columns / (4.0 * std::numbers::pi));
    const auto down = static_cast<float>(level.rows() / (2.0 * (band.top_rad - band.bottom_rad)));
    // The derivatives of one row by the unknowns, and its residuals.
    using Row = Eigen::Array<float, 1, Eigen::Dynamic>;
    std::array<Row, 6> values;
    for (Row& row : values) row.resize(columns);
    const Eigen::Map<const Row> cosines(directions_.cosines.data(), columns);
    const Eigen::Map<const Row> sines(directions_.sines.data(), columns);
    const auto row_of = [&](const Panorama& view, int y) {
      return Eigen::Map<const Row>(view.values().data() + static_cast<std::ptrdiff_t>(y) * columns,
                                   columns);
    };
    Row aside(columns);
    Row up(columns);
    double energy = 0.0;
    for (int y = margin_; y < level.rows() - margin_; ++y) {
      const auto elevation = static_cast<float>(level.elevation_rad(y));
      const float tangent = std::tan(elevation);
      const float approach = std::sin(elevation) * std::cos(elevation);
      const auto middle = row_of(level, y);
      aside[0] = across * (middle[1] - middle[columns - 1]);
      aside.segment(1, columns - 2) =
          across * (middle.tail(columns - 2) - middle.head(columns - 2));
      aside[columns - 1] = across * (middle[0] - middle[columns - 2]);
      up = down * (row_of(level, y - 1) - row_of(level, y + 1));
      values[0] = aside;
      values[1] = aside * sines + approach * up * cosines;
      values[2] = approach * up * sines - aside * cosines;
      values[3] = up * cosines + tangent * aside * sines;
      values[4] = tangent * aside * cosines - up * sines;
      values[5] = row_of(home_, y) - middle;
      for (int i = 0; i < 5; ++i) {
        for (int j = 0; j <= i; ++j)
          equations.matrix(i, j) += static_cast<double>((values[i] * values[j]).sum());
        equations.right[i] += static_cast<double>((values[i] * values[5]).sum());
      }
      energy += static_cast<double>(values[5].square().sum());
    }
    const Equations::Matrix full = equations.matrix.selfadjointView<Eigen::Lower>();
    equations.matrix = full;
    return energy;
  }

  const Panorama& home_;
  const Panorama& current_;
  ColumnDirections directions_;
  int margin_;  // ignored rows at the top and the bottom
  Tilt& tilt_;
};

}  // namespace

/// The current view as each stage compares it.
struct TiltEstimator::Stages {
  int rows;
  ElevationBand band;
  std::array<Panorama, tilt_stages.size()> smooth;

  [[nodiscard]] double row_rad() const { return (band.top_rad - band.bottom_rad) / rows; }
  [[nodiscard]] static Panorama make_smooth(const HomingView& view, const TiltStage& stage,
                                            double row_rad) {
    return smooth_rows(synthesise(view, stage.frequencies, columns_per_period * stage.frequencies),
                       stage.smoothing_rad / row_rad);
  }
};

TiltEstimator::TiltEstimator(const HomingView& current) {
  constexpr int min_rows = 10;
  if (!current.elevations() || current.rows() < min_rows) return;
  const auto& band = *current.elevations();
  const double row_rad = (band.top_rad - band.bottom_rad) / current.rows();
  stages_ = std::make_unique<const Stages>(
      Stages{current.rows(),
             band,
             {Stages::make_smooth(current, tilt_stages[0], row_rad),
              Stages::make_smooth(current, tilt_stages[1], row_rad)}});
}

TiltEstimator::~TiltEstimator() = default;

Tilt TiltEstimator::tilt_from(const HomingView& home, double heading_rad) const {
  Tilt tilt;
  if (!stages_ || home.elevations() != stages_->band || home.rows() != stages_->rows) return tilt;
  const double row_rad = stages_->row_rad();
  const int margin =
      std::clamp(static_cast<int>(std::ceil(tilt_margin_rad / row_rad)), 1, (home.rows() - 2) / 3);
  const HomingView aligned = rotate(home, -heading_rad);
  for (std::size_t i = 0; i < tilt_stages.size(); ++i) {
    const Panorama smooth_home = Stages::make_smooth(aligned, tilt_stages[i], row_rad);
    TiltProblem problem(smooth_home, stages_->smooth[i], margin, tilt);
    TiltProblem::Equations equations;
    if (!minimise(problem, equations, {.max_steps = tilt_iterations}).solvable) return tilt;
  }
  return tilt;
}

Tilt relative_tilt(const HomingView& home, const HomingView& current, double heading_rad) {
  return TiltEstimator(current).tilt_from(home, heading_rad);
}

Panorama synthesise(const HomingView& view) {
  return synthesise(view, view.components(), columns_per_period * view.components());
}

HomingView level_view(const HomingView& view, const Tilt& tilt) {
  return homing_view(compute_signature(level_panorama(synthesise(view), tilt), view.components()));
}

}  // namespace panonav
