#include "panonav/relative_pose/internal/view_variants.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>

namespace panonav {

HomingView average_to_bands(const HomingView& view, int max_bands) {
  const int bands = std::min(max_bands, view.rows());
  std::vector<float> cosines;
  std::vector<float> sines;
  for (int k = 0; k < view.components(); ++k) {
    for (int band = 0; band < bands; ++band) {
      const int begin = band * view.rows() / bands;
      const int end = (band + 1) * view.rows() / bands;
      float a = 0.0F;
      float b = 0.0F;
      for (int y = begin; y < end; ++y) {
        a += view.a(y, k);
        b += view.b(y, k);
      }
      cosines.push_back(a / static_cast<float>(end - begin));
      sines.push_back(b / static_cast<float>(end - begin));
    }
  }
  return {bands, view.components(), std::move(cosines), std::move(sines), view.elevations()};
}

HomingView select_rows(const HomingView& view, int first, int last) {
  std::vector<float> cosines;
  std::vector<float> sines;
  const auto count = static_cast<std::size_t>(last - first);
  for (int k = 0; k < view.components(); ++k) {
    const auto a = view.cosines(k).subspan(static_cast<std::size_t>(first), count);
    const auto b = view.sines(k).subspan(static_cast<std::size_t>(first), count);
    cosines.insert(cosines.end(), a.begin(), a.end());
    sines.insert(sines.end(), b.begin(), b.end());
  }
  std::optional<ElevationBand> band = view.elevations();
  if (band) {
    const double row_rad = (band->top_rad - band->bottom_rad) / view.rows();
    band = ElevationBand{band->top_rad - last * row_rad, band->top_rad - first * row_rad};
  }
  return {last - first, view.components(), std::move(cosines), std::move(sines), band};
}

HomingView mirror(const HomingView& view) {
  std::vector<float> cosines;
  std::vector<float> sines;
  for (int k = 0; k < view.components(); ++k) {
    for (int y = 0; y < view.rows(); ++y) {
      cosines.push_back(view.a(y, k));
      sines.push_back(k == 0 ? 0.0F : -view.b(y, k));
    }
  }
  return {view.rows(), view.components(), std::move(cosines), std::move(sines), view.elevations()};
}

NoiseGenerator::NoiseGenerator(const HomingView& view)
    : view_(view), rows_(static_cast<std::size_t>(view.rows())), energy_(rows_, 0.0F) {
  const auto rows = static_cast<double>(rows_);
  for (std::size_t m = 0; m < rows_; ++m) {
    for (std::size_t y = 0; y < rows_; ++y) {
      const double angle =
          std::numbers::pi * (static_cast<double>(y) + 0.5) * static_cast<double>(m) / rows;
      patterns_.push_back(
          static_cast<float>(std::sqrt((m == 0 ? 1.0 : 2.0) / rows) * std::cos(angle)));
    }
  }
  for (int k = 1; k < view.components(); ++k) {
    const auto a = view.cosines(k);
    const auto b = view.sines(k);
    for (std::size_t y = 0; y < rows_; ++y) energy_[y] += a[y] * a[y] + b[y] * b[y];
    for (std::size_t m = 0; m < rows_; ++m) {
      std::complex<float> sum;
      for (std::size_t y = 0; y < rows_; ++y) {
        sum += patterns_[m * rows_ + y] * std::complex<float>(a[y], b[y]);
      }
      spectrum_.push_back(sum);
    }
  }
}

HomingView NoiseGenerator::sample_view(Random random) const {
  const std::size_t size = rows_ * static_cast<std::size_t>(view_.components());
  std::vector<float> cosines(size, 0.0F);
  std::vector<float> sines(size, 0.0F);
  std::vector<float> energy(rows_, 0.0F);
  for (std::size_t i = 0; i < spectrum_.size(); ++i) {
    const std::size_t first = rows_ + i / rows_ * rows_;  // frequency 0 does not count
    const std::size_t pattern = i % rows_ * rows_;
    const double rotation_rad = random.uniform(0.0, 2.0 * std::numbers::pi);
    const auto rotated =
        spectrum_[i] * std::complex<float>(static_cast<float>(std::cos(rotation_rad)),
                                           static_cast<float>(std::sin(rotation_rad)));
    for (std::size_t y = 0; y < rows_; ++y) {
      cosines[first + y] += patterns_[pattern + y] * rotated.real();
      sines[first + y] += patterns_[pattern + y] * rotated.imag();
    }
  }
  for (std::size_t i = rows_; i < size; ++i) {
    energy[i % rows_] += cosines[i] * cosines[i] + sines[i] * sines[i];
  }
  for (std::size_t i = rows_; i < size; ++i) {
    const std::size_t y = i % rows_;
    const float scale = energy[y] > 0.0F ? std::sqrt(energy_[y] / energy[y]) : 0.0F;
    cosines[i] *= scale;
    sines[i] *= scale;
  }
  return {view_.rows(), view_.components(), std::move(cosines), std::move(sines),
          view_.elevations()};
}

}  // namespace panonav
