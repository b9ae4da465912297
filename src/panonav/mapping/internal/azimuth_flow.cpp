#include "panonav/mapping/internal/azimuth_flow.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

namespace panonav {

namespace {

constexpr int columns = 64;
constexpr int max_bands = 40;
constexpr int unknowns = 5;

// A column and its harmonics.
struct Azimuth {
  double phi = 0.0;
  double c1 = 1.0;
  double s1 = 0.0;
  double c2 = 1.0;
  double s2 = 0.0;
};

std::array<Azimuth, columns> all_azimuths() {
  std::array<Azimuth, columns> azimuths;
  for (int c = 0; c < columns; ++c) {
    const double phi = 2.0 * std::numbers::pi * c / columns;
    azimuths[static_cast<std::size_t>(c)] = {phi, std::cos(phi), std::sin(phi), std::cos(2.0 * phi),
                                             std::sin(2.0 * phi)};
  }
  return azimuths;
}

// Rows averaged to bands; frequencies 1 .. highest, band-major.
struct Bands {
  int bands = 0;
  int highest = 0;
  std::vector<float> cosines;
  std::vector<float> sines;
};

Bands bands_of(const HomingView& view, int bands, int highest) {
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

struct Sampled {
  Pixels values;  // bands x columns
  Pixels slopes;  // over azimuth
};

// The bands at one azimuth for each column.
Sampled sample(const Bands& view, const std::array<double, columns>& azimuths) {
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
  Sampled sampled;
  sampled.values = a * cosines + b * sines;
  sampled.slopes =
      (b * frequencies.asDiagonal()) * cosines - (a * frequencies.asDiagonal()) * sines;
  return sampled;
}

// Change over elevation, upwards, by the difference of the bands around.
Pixels elevation_slopes(const Pixels& values, double band_height_rad) {
  Pixels slopes = Pixels::Zero(values.rows(), values.cols());
  const auto step = static_cast<float>(2.0 * band_height_rad);
  for (Eigen::Index r = 1; r + 1 < values.rows(); ++r) {
    slopes.row(r) = (values.row(r - 1) - values.row(r + 1)) / step;
  }
  return slopes;
}

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
  const int bands = std::min(max_bands, after.rows());
  const int highest = std::min({before.components(), after.components(), columns / 2}) - 1;
  const Bands earlier = bands_of(before, bands, highest);
  const Bands later = bands_of(after, bands, highest);
  const auto azimuths = all_azimuths();
  std::array<double, columns> unmoved{};
  for (int c = 0; c < columns; ++c) {
    unmoved[static_cast<std::size_t>(c)] = azimuths[static_cast<std::size_t>(c)].phi;
  }
  const Sampled now = sample(later, unmoved);
  // How much a band moves up for each unit of way ahead: sin e cos e.
  Eigen::VectorXf rise = Eigen::VectorXf::Zero(bands);
  double band_height_rad = 1.0;
  if (after.elevations()) {
    const double height = after.elevations()->top_rad - after.elevations()->bottom_rad;
    band_height_rad = height / bands;
    for (int band = 0; band < bands; ++band) {
      const double elevation = after.elevations()->top_rad - (band + 0.5) * band_height_rad;
      rise[band] = static_cast<float>(std::sin(elevation) * std::cos(elevation));
    }
  }
  AzimuthFlow flow = start;
  const Pixels now_up = elevation_slopes(now.values, band_height_rad);
  for (int iteration = 0;; ++iteration) {
    std::array<double, columns> moved{};
    for (int c = 0; c < columns; ++c) {
      const Azimuth& at = azimuths[static_cast<std::size_t>(c)];
      moved[static_cast<std::size_t>(c)] =
          at.phi + flow.g0 + flow.a1 * at.c1 + flow.b1 * at.s1 + flow.a2 * at.c2 + flow.b2 * at.s2;
    }
    const Sampled then = sample(earlier, moved);
    const Pixels then_up = elevation_slopes(then.values, band_height_rad);
    const Pixels across = 0.5F * (now.slopes + then.slopes);
    const Pixels up = rise.asDiagonal() * (0.5F * (now_up + then_up));
    Pixels difference = now.values - then.values;
    for (int c = 0; c < columns; ++c) {
      const Azimuth& at = azimuths[static_cast<std::size_t>(c)];
      // The way ahead in this direction, of the flow so far.
      difference.col(c) += static_cast<float>(flow.a1 * at.s1 - flow.b1 * at.c1) * up.col(c);
    }
    const double left = static_cast<double>(difference.squaredNorm());
    const double energy = static_cast<double>(now.values.squaredNorm() + then.values.squaredNorm());
    flow.residual = energy > 0.0 ? std::min(1.0, left / energy) : 1.0;
    if (iteration >= iterations) return flow;
    Eigen::Matrix<double, unknowns, unknowns> normal =
        Eigen::Matrix<double, unknowns, unknowns>::Zero();
    Eigen::Matrix<double, unknowns, 1> right = Eigen::Matrix<double, unknowns, 1>::Zero();
    const auto sums_of = [](const Pixels& x, const Pixels& y) -> Eigen::RowVectorXd {
      return x.cwiseProduct(y).colwise().sum().cast<double>();
    };
    const Eigen::RowVectorXd across_across = sums_of(across, across);
    const Eigen::RowVectorXd across_up = sums_of(across, up);
    const Eigen::RowVectorXd up_up = sums_of(up, up);
    const Eigen::RowVectorXd across_difference = sums_of(across, difference);
    const Eigen::RowVectorXd up_difference = sums_of(up, difference);
    for (int c = 0; c < columns; ++c) {
      const Azimuth& at = azimuths[static_cast<std::size_t>(c)];
      // A pixel's equation is across * turns + up * rises.
      const Eigen::Matrix<double, unknowns, 1> turns(1.0, at.c1, at.s1, at.c2, at.s2);
      const Eigen::Matrix<double, unknowns, 1> rises(0.0, -at.s1, at.c1, 0.0, 0.0);
      const Eigen::Matrix<double, unknowns, unknowns> mixed = turns * rises.transpose();
      normal += across_across[c] * turns * turns.transpose() +
                up_up[c] * rises * rises.transpose() + across_up[c] * (mixed + mixed.transpose());
      right += across_difference[c] * turns + up_difference[c] * rises;
    }
    const double damping = 1e-6 * normal.trace() + 1e-12;
    normal.diagonal().array() += damping;
    const Eigen::Matrix<double, unknowns, 1> change = normal.ldlt().solve(right);
    flow.g0 += change[0];
    flow.a1 += change[1];
    flow.b1 += change[2];
    flow.a2 += change[3];
    flow.b2 += change[4];
  }
}

}  // namespace panonav
