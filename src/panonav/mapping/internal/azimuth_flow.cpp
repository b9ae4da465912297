#include "panonav/mapping/internal/azimuth_flow.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

#include "panonav/geometry/least_squares.hpp"

namespace panonav {

namespace {

/// Number of azimuths at which views are compared: two per period of frequency 32.
constexpr int columns = 64;
/// Number of rows to which those of taller views are averaged.
constexpr int max_bands = 40;
constexpr int unknowns = 5;  // of AzimuthFlow

/// The azimuth of a column and its harmonics.
struct Azimuth {
  double phi = 0.0;
  double c1 = 1.0;
  double s1 = 0.0;
  double c2 = 1.0;
  double s2 = 0.0;
};

std::array<Azimuth, columns> make_azimuths() {
  std::array<Azimuth, columns> azimuths;
  for (int c = 0; c < columns; ++c) {
    const double phi = 2.0 * std::numbers::pi * c / columns;
    azimuths[static_cast<std::size_t>(c)] = {phi, std::cos(phi), std::sin(phi), std::cos(2.0 * phi),
                                             std::sin(2.0 * phi)};
  }
  return azimuths;
}

/// A view with rows averaged to bands; frequencies 1 .. highest, band-major.
struct Bands {
  int bands = 0;
  int highest = 0;
  std::vector<float> cosines;
  std::vector<float> sines;
};

Bands average_to_bands(const HomingView& view, int bands, int highest) {
  Bands made{bands, highest, {}, {}};
  const auto size = static_cast<std::size_t>(bands) * static_cast<std::size_t>(highest);
  made.cosines.assign(size, 0.0F);
  made.sines.assign(size, 0.0F);
  for (int band = 0; band < bands; ++band) {
    const int begin = band * view.rows() / bands;
    const int end = (band + 1) * view.rows() / bands;
    const float share = 1.0F / static_cast<float>(end - begin);
    for (int k = 1; k <= highest; ++k) {
      const auto at = static_cast<std::size_t>(band * highest + k - 1);
      for (int row = begin; row < end; ++row) {
        made.cosines[at] += share * view.a(row, k);
        made.sines[at] += share * view.b(row, k);
      }
    }
  }
  return made;
}

using Pixels = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct SampledBands {
  Pixels values;  // bands x columns
  Pixels slopes;  // over azimuth
};

// Samples the bands at one azimuth for each column.
SampledBands sample_bands(const Bands& view, const std::array<double, columns>& azimuths) {
  Pixels cosines(view.highest, columns);
  Pixels sines(view.highest, columns);
  for (int c = 0; c < columns; ++c) {
    const std::complex<double> once = std::polar(1.0, azimuths[static_cast<std::size_t>(c)]);
    std::complex<double> turned = once;
    for (int k = 1; k <= view.highest; ++k) {
      cosines(k - 1, c) = static_cast<float>(turned.real());
      sines(k - 1, c) = static_cast<float>(turned.imag());
      turned *= once;
    }
  }
  const Eigen::Map<const Pixels> a(view.cosines.data(), view.bands, view.highest);
  const Eigen::Map<const Pixels> b(view.sines.data(), view.bands, view.highest);
  const Eigen::VectorXf frequencies =
      Eigen::VectorXf::LinSpaced(view.highest, 1.0F, static_cast<float>(view.highest));
  SampledBands sampled;
  sampled.values = a * cosines + b * sines;
  sampled.slopes =
      (b * frequencies.asDiagonal()) * cosines - (a * frequencies.asDiagonal()) * sines;
  return sampled;
}

// Returns the derivative of each band by elevation, from the difference of its adjacent bands.
Pixels compute_elevation_gradients(const Pixels& values, double band_height_rad) {
  Pixels slopes = Pixels::Zero(values.rows(), values.cols());
  const auto step = static_cast<float>(2.0 * band_height_rad);
  for (Eigen::Index r = 1; r + 1 < values.rows(); ++r) {
    slopes.row(r) = (values.row(r - 1) - values.row(r + 1)) / step;
  }
  return slopes;
}

/// The fit of a flow to two views as a problem for `minimise`.
class FlowProblem {
 public:
  using Equations = DenseEquations<unknowns>;

  FlowProblem(const HomingView& before, const HomingView& after, const AzimuthFlow& start)
      : flow_(start) {
    const int bands = std::min(max_bands, after.rows());
    const int highest = std::min({before.components(), after.components(), columns / 2}) - 1;
    earlier_ = average_to_bands(before, bands, highest);
    std::array<double, columns> unmoved{};
    for (std::size_t c = 0; c < columns; ++c) unmoved[c] = azimuths_[c].phi;
    now_ = sample_bands(average_to_bands(after, bands, highest), unmoved);
    rise_ = Eigen::VectorXf::Zero(bands);
    if (after.elevations()) {
      const double height = after.elevations()->top_rad - after.elevations()->bottom_rad;
      band_height_rad_ = height / bands;
      for (int band = 0; band < bands; ++band) {
        const double elevation = after.elevations()->top_rad - (band + 0.5) * band_height_rad_;
        rise_[band] = static_cast<float>(std::sin(elevation) * std::cos(elevation));
      }
    }
    now_up_ = compute_elevation_gradients(now_.values, band_height_rad_);
    update_residuals();
  }

  [[nodiscard]] const AzimuthFlow& flow() const { return flow_; }

  [[nodiscard]] bool linearise(Equations& equations) const {
    equations.set_zero();
    const auto sums_of = [](const Pixels& x, const Pixels& y) -> Eigen::RowVectorXd {
      return x.cwiseProduct(y).colwise().sum().cast<double>();
    };
    const Eigen::RowVectorXd across_across = sums_of(across_, across_);
    const Eigen::RowVectorXd across_up = sums_of(across_, up_);
    const Eigen::RowVectorXd up_up = sums_of(up_, up_);
    const Eigen::RowVectorXd across_difference = sums_of(across_, difference_);
    const Eigen::RowVectorXd up_difference = sums_of(up_, difference_);
    for (int c = 0; c < columns; ++c) {
      const Azimuth& at = azimuths_[static_cast<std::size_t>(c)];
      // A pixel's equation is across * turns + up * rises.
      const Equations::Vector turns(1.0, at.c1, at.s1, at.c2, at.s2);
      const Equations::Vector rises(0.0, -at.s1, at.c1, 0.0, 0.0);
      const Equations::Matrix mixed = turns * rises.transpose();
      equations.matrix += across_across[c] * turns * turns.transpose() +
                          up_up[c] * rises * rises.transpose() +
                          across_up[c] * (mixed + mixed.transpose());
      equations.right += across_difference[c] * turns + up_difference[c] * rises;
    }
    // A weak prior: unknowns on which no pixel depends stay 0.
    const double prior = 1e-6 * equations.matrix.trace() + 1e-12;
    equations.matrix.diagonal().array() += prior;
    return true;
  }

  bool move(const Equations::Vector& change) {
    flow_.g0 += change[0];
    flow_.a1 += change[1];
    flow_.b1 += change[2];
    flow_.a2 += change[3];
    flow_.b2 += change[4];
    update_residuals();
    return false;
  }

 private:
  /// Updates the residuals of the flow and the derivatives of pixels.
  void update_residuals() {
    std::array<double, columns> moved{};
    for (std::size_t c = 0; c < columns; ++c) {
      const Azimuth& at = azimuths_[c];
      moved[c] = at.phi + flow_.g0 + flow_.a1 * at.c1 + flow_.b1 * at.s1 + flow_.a2 * at.c2 +
                 flow_.b2 * at.s2;
    }
    const SampledBands then = sample_bands(earlier_, moved);
    const Pixels then_up = compute_elevation_gradients(then.values, band_height_rad_);
    across_ = 0.5F * (now_.slopes + then.slopes);
    up_ = rise_.asDiagonal() * (0.5F * (now_up_ + then_up));
    difference_ = now_.values - then.values;
    for (int c = 0; c < columns; ++c) {
      const Azimuth& at = azimuths_[static_cast<std::size_t>(c)];
      // The vertical motion by the displacement so far.
      difference_.col(c) += static_cast<float>(flow_.a1 * at.s1 - flow_.b1 * at.c1) * up_.col(c);
    }
    const double left = static_cast<double>(difference_.squaredNorm());
    const double energy =
        static_cast<double>(now_.values.squaredNorm() + then.values.squaredNorm());
    flow_.residual = energy > 0.0 ? std::min(1.0, left / energy) : 1.0;
  }

  std::array<Azimuth, columns> azimuths_ = make_azimuths();
  AzimuthFlow flow_;
  Bands earlier_;
  SampledBands now_;
  Eigen::VectorXf rise_;  // how much a band moves up for each unit ahead: sin e cos e
  double band_height_rad_ = 1.0;
  Pixels now_up_, across_, up_, difference_;
};

}  // namespace

double AzimuthFlow::direction_rad() const noexcept {
  return std::atan2(a1, -b1);
}

double AzimuthFlow::length() const noexcept {
  return std::hypot(a1, b1);
}

double AzimuthFlow::turn_rad() const noexcept {
  const double nearer_side = std::atan2(a2, -b2) - 2.0 * direction_rad();
  return g0 + std::hypot(a2, b2) * std::sin(nearer_side);
}

AzimuthFlow refine_flow(const HomingView& before, const HomingView& after, const AzimuthFlow& start,
                        int iterations) {
  FlowProblem problem(before, after, start);
  FlowProblem::Equations equations;
  static_cast<void>(minimise(problem, equations, {.max_steps = iterations}));
  return problem.flow();
}

}  // namespace panonav
