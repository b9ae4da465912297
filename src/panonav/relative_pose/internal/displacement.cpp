#include "panonav/relative_pose/internal/displacement.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

#include "panonav/core/portable_math.hpp"
#include "panonav/relative_pose/internal/turn_bound.hpp"
#include "panonav/relative_pose/internal/turn_coefficients.hpp"

namespace panonav {

namespace {

/// Frequencies of the tables, 0 included.
constexpr std::size_t size = max_displaced_frequency + 1;

/// Relative penalty on the difference of displacements at the first ring; at ring n it is n^2
/// times as large. Chosen between 0, 1 and 3 % on the arena (seed 501), the lab and the office
/// (seed 901).
constexpr float far_penalty = 0.01F;

double ring_radius(int ring) {
  return ring / 6.0;
}

/// The effect of a displacement straight ahead on the cosine and on the sine coefficients. As the
/// expected image is symmetric about the direction of the displacement, cosines and sines do not
/// mix. Row k, column m: the part of frequency k of the view in frequency m of the expected image.
struct DisplacementMatrix {
  std::array<float, size * size> cosines{};
  std::array<float, size * size> sines{};
};

struct Tables {
  std::array<DisplacementMatrix, Displacement::rings> matrices;
  // Cosine and sine of k times each direction.
  std::array<std::array<float, size>, Displacement::directions> cosines{};
  std::array<std::array<float, size>, Displacement::directions> sines{};
};

// Integrates the matrix of a displacement by rho [S06 eq. 3].
void fill_matrix(DisplacementMatrix& matrix, double rho) {
  constexpr std::size_t points = 256;  // nearly exact for products of two frequencies
  const float share = 2.0F / static_cast<float>(points);
  std::array<float, size> to_cosine;
  std::array<float, size> to_sine;
  for (std::size_t i = 0; i < points; ++i) {
    const double phi =
        2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(points);
    const double source = phi - portable::asin(rho * portable::sin(phi));
    for (std::size_t m = 1; m < size; ++m) {
      const auto [cosine, sine] = portable::cosine_sine(static_cast<double>(m) * phi);
      to_cosine[m] = static_cast<float>(cosine);
      to_sine[m] = static_cast<float>(sine);
    }
    // Frequency 0 of a view shows no structure.
    for (std::size_t k = 1; k < size; ++k) {
      const auto [cosine, sine] = portable::cosine_sine(static_cast<double>(k) * source);
      const auto c = static_cast<float>(cosine);
      const auto s = static_cast<float>(sine);
      float* const cosines = matrix.cosines.data() + k * size;
      float* const sines = matrix.sines.data() + k * size;
      for (std::size_t m = 1; m < size; ++m) {
        cosines[m] += share * to_cosine[m] * c;
        sines[m] += share * to_sine[m] * s;
      }
    }
  }
}

const Tables& tables() {
  static Tables made;
  static const bool is_filled [[maybe_unused]] = [](Tables& tables) {
    for (int ring = 1; ring <= Displacement::rings; ++ring) {
      fill_matrix(tables.matrices[static_cast<std::size_t>(ring - 1)], ring_radius(ring));
    }
    for (std::size_t d = 0; d < Displacement::directions; ++d) {
      for (std::size_t k = 0; k < size; ++k) {
        const double angle = 2.0 * std::numbers::pi * static_cast<double>(d * k) /
                             static_cast<double>(Displacement::directions);
        const auto [cosine, sine] = portable::cosine_sine(angle);
        tables.cosines[d][k] = static_cast<float>(cosine);
        tables.sines[d][k] = static_cast<float>(sine);
      }
    }
    return true;
  }(made);
  return made;
}

/// Coefficients of one row in the frame of a robot that faces a direction.
struct RowCoefficients {
  std::array<float, size> a, b;
};

void face(int direction, std::span<const float> from_a, std::span<const float> from_b,
          RowCoefficients& ahead) noexcept {
  const auto& cosine = tables().cosines[static_cast<std::size_t>(direction)];
  const auto& sine = tables().sines[static_cast<std::size_t>(direction)];
  for (std::size_t k = 0; k < std::min(from_a.size(), size); ++k) {
    ahead.a[k] = from_a[k] * cosine[k] + from_b[k] * sine[k];
    ahead.b[k] = from_b[k] * cosine[k] - from_a[k] * sine[k];
  }
}

/// Computes the expected image from the first `from` frequencies of `ahead`, which faces the
/// direction of the displacement, and turns it back. Leaves frequency 0 as it is.
void move_ahead(Displacement displacement, const RowCoefficients& ahead, std::size_t from,
                std::span<float> to_a, std::span<float> to_b) noexcept {
  const DisplacementMatrix& matrix =
      tables().matrices[static_cast<std::size_t>(displacement.ring - 1)];
  const auto& cosine = tables().cosines[static_cast<std::size_t>(displacement.direction)];
  const auto& sine = tables().sines[static_cast<std::size_t>(displacement.direction)];
  std::array<float, size> moved_a;
  std::array<float, size> moved_b;
  const std::size_t to = to_a.size();
  for (std::size_t m = 1; m < to; ++m) moved_a[m] = moved_b[m] = 0.0F;
  for (std::size_t k = 1; k < from; ++k) {
    const float* const cosines = matrix.cosines.data() + k * size;
    const float* const sines = matrix.sines.data() + k * size;
    for (std::size_t m = 1; m < to; ++m) {
      moved_a[m] += cosines[m] * ahead.a[k];
      moved_b[m] += sines[m] * ahead.b[k];
    }
  }
  for (std::size_t m = 1; m < to; ++m) {
    to_a[m] = moved_a[m] * cosine[m] - moved_b[m] * sine[m];
    to_b[m] = moved_b[m] * cosine[m] + moved_a[m] * sine[m];
  }
}

/// The expected image of one displacement, compared with the home view.
struct ExpectedImage {
  Displacement displacement;
  std::array<float, max_searched_frequency + 1> real{};
  std::array<float, max_searched_frequency + 1> imaginary{};
  float energy = 0.0F;

  void add_row(std::span<const float> home_a, std::span<const float> home_b,
               std::span<const float> a, std::span<const float> b) noexcept {
    for (std::size_t k = 1; k < home_a.size(); ++k) {
      real[k] += home_a[k] * a[k] + home_b[k] * b[k];
      imaginary[k] += home_a[k] * b[k] - home_b[k] * a[k];
      energy += a[k] * a[k] + b[k] * b[k];
    }
  }
  [[nodiscard]] TurnCorrelation correlation(int highest) const noexcept {
    TurnCorrelation correlation;
    correlation.highest = highest;
    std::copy(real.begin(), real.end(), correlation.real.begin());
    std::copy(imaginary.begin(), imaginary.end(), correlation.imaginary.begin());
    return correlation;
  }
  /// Returns the difference from the home view for a correlation. If two displacements explain the
  /// views equally, the nearer is more likely.
  [[nodiscard]] float difference(float home_energy, float value) const noexcept {
    const auto ring_square = static_cast<float>(displacement.ring * displacement.ring);
    return (home_energy + energy - 2.0F * value) * (1.0F + far_penalty * ring_square);
  }
};
using ExpectedImages =
    std::array<ExpectedImage, Displacement::rings * Displacement::directions + 1>;

/// Returns the displacement of the smallest difference, the first of equal ones. Searches turns
/// only of images that may differ least.
BestDisplacement choose_displacement(const ExpectedImages& images, int highest, float home_energy,
                                     const HeadingWindow& window) {
  constexpr float rounding = 1e-5F;  // relative error of sums of single precision
  // Lower bounds of the differences.
  std::array<std::pair<float, std::size_t>, std::tuple_size_v<ExpectedImages>> pending;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const float bound =
        bound_maximum(images[i].correlation(highest)) + rounding * (home_energy + images[i].energy);
    pending[i] = {images[i].difference(home_energy, bound), i};
  }
  std::ranges::sort(pending);
  BestDisplacement best;
  std::pair smallest(std::numeric_limits<float>::infinity(), images.size());
  for (const auto& [bound, i] : pending) {
    if (bound > smallest.first) break;
    std::array<float, 1> turn{};
    const TurnCorrelation correlation = images[i].correlation(highest);
    if (find_highest_peaks(correlation, turn, window) == 0) continue;
    const float value = correlation.at(turn[0]);
    const std::pair found(images[i].difference(home_energy, value), i);
    if (!(found < smallest)) continue;
    smallest = found;
    best = {images[i].displacement, turn[0]};
  }
  return best;
}

}  // namespace

double Displacement::length() const noexcept {
  return ring_radius(ring);
}

double Displacement::direction_rad() const noexcept {
  return 2.0 * std::numbers::pi * direction / directions;
}

void fill_displacement_tables() noexcept {
  (void)tables();
}

void displace(Displacement displacement, std::span<const float> from_a,
              std::span<const float> from_b, std::span<float> to_a,
              std::span<float> to_b) noexcept {
  const std::size_t from = std::min(from_a.size(), size);
  const std::size_t to = std::min(to_a.size(), size);
  if (displacement.ring == 0) {
    for (std::size_t k = 0; k < to; ++k) {
      to_a[k] = k < from ? from_a[k] : 0.0F;
      to_b[k] = k < from ? from_b[k] : 0.0F;
    }
    return;
  }
  RowCoefficients ahead;
  face(displacement.direction, from_a, from_b, ahead);
  move_ahead(displacement, ahead, from, to_a.first(to), to_b.first(to));
  if (to > 0) {
    to_a[0] = from > 0 ? from_a[0] : 0.0F;
    to_b[0] = 0.0F;
  }
}

BestDisplacement find_displacement(std::span<const float> home_a, std::span<const float> home_b,
                                   std::span<const float> current_a,
                                   std::span<const float> current_b, int rows, int frequencies,
                                   const HeadingWindow& window) {
  const auto stride = static_cast<std::size_t>(frequencies) + 1;
  const auto compared = static_cast<std::size_t>(std::min(frequencies, max_searched_frequency)) + 1;
  float home_energy = 0.0F;
  for (std::size_t row = 0; row < static_cast<std::size_t>(rows); ++row) {
    for (std::size_t k = 1; k < compared; ++k) {
      const float ha = home_a[row * stride + k];
      const float hb = home_b[row * stride + k];
      home_energy += ha * ha + hb * hb;
    }
  }
  ExpectedImages images;
  RowCoefficients ahead;
  std::array<float, size> a;
  std::array<float, size> b;
  for (std::size_t row = 0; row < static_cast<std::size_t>(rows); ++row) {
    const auto row_a = current_a.subspan(row * stride, stride);
    const auto row_b = current_b.subspan(row * stride, stride);
    const auto add_row = [&](ExpectedImage& image) {
      image.add_row(home_a.subspan(row * stride, compared), home_b.subspan(row * stride, compared),
                    a, b);
    };
    displace({}, row_a, row_b, std::span(a).first(compared), std::span(b).first(compared));
    add_row(images[0]);
    for (int direction = 0; direction < Displacement::directions; ++direction) {
      face(direction, row_a, row_b, ahead);
      for (int ring = 1; ring <= Displacement::rings; ++ring) {
        const Displacement displacement{ring, direction};
        move_ahead(displacement, ahead, std::min(stride, size), std::span(a).first(compared),
                   std::span(b).first(compared));
        ExpectedImage& image =
            images[static_cast<std::size_t>((ring - 1) * Displacement::directions + direction + 1)];
        image.displacement = displacement;
        add_row(image);
      }
    }
  }
  return choose_displacement(images, static_cast<int>(compared) - 1, home_energy, window);
}

DisplacementStart find_displacement_start(const CoefficientView& home,
                                          const CoefficientView& current, int known,
                                          const HeadingWindow& window) {
  constexpr std::size_t max_bands = 8;
  const auto rows = static_cast<std::size_t>(home.rows);
  // Expected images need more frequencies of the current view than are compared.
  const int frequencies = std::min(known, 2 * max_searched_frequency);
  const std::size_t bands = std::min(max_bands, rows);
  const auto stride = static_cast<std::size_t>(frequencies) + 1;
  std::array<float, 4 * max_bands*(2 * max_searched_frequency + 1)> values{};
  const auto part = [&](std::size_t i) {
    return std::span(values).subspan(i * bands * stride, bands * stride);
  };
  float ahead_a = 0.0F;
  float ahead_b = 0.0F;
  for (std::size_t band = 0; band < bands; ++band) {
    const std::size_t begin = band * rows / bands;
    const std::size_t end = (band + 1) * rows / bands;
    for (int k = 0; k <= frequencies; ++k) {
      const std::size_t at = band * stride + static_cast<std::size_t>(k);
      for (std::size_t y = begin; y < end; ++y) {
        part(0)[at] += home.cosines(k)[y];
        part(1)[at] += home.sines(k)[y];
        part(2)[at] += current.cosines(k)[y];
        part(3)[at] += current.sines(k)[y];
      }
    }
    ahead_a += part(2)[band * stride + 1];
    ahead_b += part(3)[band * stride + 1];
  }
  const double ahead_rad =
      portable::atan2(static_cast<double>(ahead_b), static_cast<double>(ahead_a));
  for (std::size_t band = 0; band < bands; ++band) {
    rotate_row(part(2).subspan(band * stride, stride), part(3).subspan(band * stride, stride),
               ahead_rad);
  }
  const BestDisplacement best =
      find_displacement(part(0), part(1), part(2), part(3), static_cast<int>(bands), frequencies,
                        {window.middle_rad - static_cast<float>(ahead_rad), window.half_width_rad});
  return {best.displacement, ahead_rad, static_cast<double>(best.turn_rad) + ahead_rad};
}

}  // namespace panonav
