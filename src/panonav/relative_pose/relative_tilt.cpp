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
constexpr int tilt_iterations = 3;  ///< Gauss-Newton steps at each stage
constexpr int tilt_columns = 48;    ///< four for each period of the highest frequency
/// Margin at the top and bottom, of which a levelled view shows only parts.
constexpr double tilt_margin_rad = radians(5.0);
// Standard deviations of the prior.
constexpr double tilt_deviation_rad = 0.06;     ///< two views tilted by some 3 degrees each
constexpr double displacement_deviation = 0.3;  ///< in units of the distance of things
constexpr double turn_deviation_rad = 0.2;      ///< headings known to 10 degrees

/// Makes the panorama of the first frequencies.
Panorama synthesise(const HomingView& view, int frequencies, int columns) {
  Panorama panorama(view.rows(), columns, view.elevations());
  for (int k = 0; k < std::min(frequencies, view.components()); ++k) {
    for (int c = 0; c < columns; ++c) {
      const double phase = 2.0 * std::numbers::pi * k * c / columns;
      const auto cosine = static_cast<float>(k == 0 ? 0.5 : std::cos(phase));
      const auto sine = static_cast<float>(std::sin(phase));
      for (int y = 0; y < view.rows(); ++y)
        panorama.at(y, c) += view.a(y, k) * cosine + view.b(y, k) * sine;
    }
  }
  return panorama;
}

Panorama smooth_rows(const Panorama& panorama, double sigma_rows) {
  const std::vector<float> weights = gaussian_weights(sigma_rows);
  const int reach = static_cast<int>(weights.size()) / 2;
  Panorama result(panorama.rows(), panorama.columns(), panorama.elevations());
  for (int y = 0; y < panorama.rows(); ++y) {
    for (int d = -reach; d <= reach; ++d) {
      const int from = std::clamp(y + d, 0, panorama.rows() - 1);
      const float weight = weights[static_cast<std::size_t>(d + reach)];
      for (int c = 0; c < panorama.columns(); ++c) result.at(y, c) += weight * panorama.at(from, c);
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
      : home_(home), current_(current), margin_(margin), tilt_(tilt) {}

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
    const double across = columns / (4.0 * std::numbers::pi);
    const double down = level.rows() / (2.0 * (band.top_rad - band.bottom_rad));
    double energy = 0.0;
    for (int y = margin_; y < level.rows() - margin_; ++y) {
      const double elevation = level.elevation_rad(y);
      const double tangent = std::tan(elevation);
      const double approach = std::sin(elevation) * std::cos(elevation);
      for (int c = 0; c < columns; ++c) {
        const int left = c == 0 ? columns - 1 : c - 1;
        const int right = c + 1 == columns ? 0 : c + 1;
        const double cosine = std::cos(2.0 * std::numbers::pi * c / columns);
        const double sine = std::sin(2.0 * std::numbers::pi * c / columns);
        const double aside = across * static_cast<double>(level.at(y, right) - level.at(y, left));
        const double up = down * static_cast<double>(level.at(y - 1, c) - level.at(y + 1, c));
        const Equations::Vector slopes(
            aside, aside * sine + up * approach * cosine, -aside * cosine + up * approach * sine,
            up * cosine + aside * tangent * sine, -up * sine + aside * tangent * cosine);
        const auto residual = static_cast<double>(home_.at(y, c) - level.at(y, c));
        equations.matrix += slopes * slopes.transpose();
        equations.right += residual * slopes;
        energy += residual * residual;
      }
    }
    return energy;
  }

  const Panorama& home_;
  const Panorama& current_;
  int margin_;  // ignored rows at the top and the bottom
  Tilt& tilt_;
};

}  // namespace

Tilt relative_tilt(const HomingView& home, const HomingView& current, double heading_rad) {
  constexpr int min_rows = 10;
  Tilt tilt;
  if (!home.elevations() || home.elevations() != current.elevations() ||
      home.rows() != current.rows() || home.rows() < min_rows) {
    return tilt;
  }
  const auto& band = *home.elevations();
  const double row_rad = (band.top_rad - band.bottom_rad) / home.rows();
  const int margin =
      std::clamp(static_cast<int>(std::ceil(tilt_margin_rad / row_rad)), 1, (home.rows() - 2) / 3);
  const HomingView aligned = rotate(home, -heading_rad);
  for (const TiltStage& stage : tilt_stages) {
    const double sigma_rows = stage.smoothing_rad / row_rad;
    const Panorama smooth_home =
        smooth_rows(synthesise(aligned, stage.frequencies, tilt_columns), sigma_rows);
    const Panorama smooth_current =
        smooth_rows(synthesise(current, stage.frequencies, tilt_columns), sigma_rows);
    TiltProblem problem(smooth_home, smooth_current, margin, tilt);
    TiltProblem::Equations equations;
    if (!minimise(problem, equations, {.max_steps = tilt_iterations}).solvable) return tilt;
  }
  return tilt;
}

HomingView level_view(const HomingView& view, const Tilt& tilt) {
  // At least four columns per period, so that interpolation hardly damps the highest frequency.
  const int columns = 4 * view.components();
  return homing_view(compute_signature(
      level_panorama(synthesise(view, view.components(), columns), tilt), view.components()));
}

}  // namespace panonav
