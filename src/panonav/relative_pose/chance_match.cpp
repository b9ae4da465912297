#include "panonav/relative_pose/chance_match.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/random.hpp"

namespace panonav {

namespace {

/// Rows to which views are averaged: enough vertical structure for noise of its spectrum.
constexpr int max_bands = 16;
/// Number of views of noise; the standard deviation of their matches then errs by 11 %.
constexpr int noise_view_count = 40;

HomingView average_to_bands(const HomingView& view) {
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

/// Noise with the spectrum of a view. A cosine transform over the rows splits each frequency into
/// vertical patterns, each of which is rotated by itself.
class NoiseGenerator {
 public:
  explicit NoiseGenerator(const HomingView& view)
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

  [[nodiscard]] HomingView sample_view(Random random) const {
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

 private:
  const HomingView& view_;
  std::size_t rows_;
  std::vector<float> patterns_;                // by pattern, then row
  std::vector<std::complex<float>> spectrum_;  // by frequency from 1 on, then pattern
  std::vector<float> energy_;                  // by row
};

double sum_correlation_both_ways(const HomingView& home, const HomingView& current,
                                 const FourierHomingOptions& options) {
  return home_vector(home, current, options).correlation +
         home_vector(current, home, options).correlation;
}

}  // namespace

bool ChanceMatch::is_beyond_chance() const noexcept {
  // 0.99 quantile of one more match when mean and deviation are estimated from 40: Student's t with
  // 39 degrees of freedom, times the square root of 1 + 1 / 40.
  constexpr double min_deviations = 2.426 * 1.0124;
  return deviation > 1e-6 && match - chance > min_deviations * deviation;
}

double ChanceMatch::direction_probability() const noexcept {
  if (deviation <= 1e-6) return 0.0;
  constexpr double max_deviations = 10.0;  // largest value in the training data
  const double deviations = std::min((match - chance) / deviation, max_deviations);
  return 1.0 / (1.0 + std::exp(2.301 - 1.074 * deviations));
}

ChanceMatch compare_with_chance(const HomingView& home, const HomingView& current,
                                const FourierHomingOptions& options) {
  const HomingView goal = average_to_bands(home);
  const HomingView here = average_to_bands(current);
  ChanceMatch result;
  result.match = sum_correlation_both_ways(goal, here, options);
  const NoiseGenerator noise(here);
  constexpr std::uint64_t seed = 1;
  std::vector<double> matches;
  for (std::uint64_t i = 0; i < noise_view_count; ++i) {
    matches.push_back(sum_correlation_both_ways(goal, noise.sample_view(Random(seed, i)), options));
    result.chance += matches.back() / noise_view_count;
  }
  double square = 0.0;
  for (const double match : matches) square += (match - result.chance) * (match - result.chance);
  result.deviation = std::sqrt(square / (noise_view_count - 1));
  return result;
}

}  // namespace panonav
