#include "panonav/kernels/internal/vector.hpp"

namespace panonav::kernels {
namespace {

constexpr int columns = matched_reference_columns;
constexpr int quarter = columns / 4;

template <int lanes>
typename Vectors<lanes>::Floats load(const float* from) {
  return *reinterpret_cast<const typename Vectors<lanes>::UnalignedFloats*>(from);
}

template <int lanes>
void store(float* to, typename Vectors<lanes>::Floats values) {
  *reinterpret_cast<typename Vectors<lanes>::UnalignedFloats*>(to) = values;
}

template <int lanes>
typename Vectors<lanes>::Floats reverse(typename Vectors<lanes>::Floats a) {
  if constexpr (lanes == 4) return __builtin_shufflevector(a, a, 3, 2, 1, 0);
  if constexpr (lanes == 8) return __builtin_shufflevector(a, a, 7, 6, 5, 4, 3, 2, 1, 0);
  if constexpr (lanes == 16) {
    return __builtin_shufflevector(a, a, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
  }
}

// The values of a view at the azimuths x, -x, pi - x and pi + x.
template <class Floats>
struct FourAzimuths {
  Floats ahead, ahead_mirrored, behind_mirrored, behind;
};

// Adds up waves. `wave(k)` returns the products of component k: of the real part and the cosines,
// and of the imaginary part and the sines.
template <class Floats, class Wave>
FourAzimuths<Floats> add_waves(int components, const Wave& wave) {
  Floats even_cosines = {};
  Floats even_sines = {};
  Floats odd_cosines = {};
  Floats odd_sines = {};
  int k = 0;
  for (; k + 1 < components; k += 2) {
    const auto even = wave(k);
    const auto odd = wave(k + 1);
    even_cosines += even.cosines;
    even_sines += even.sines;
    odd_cosines += odd.cosines;
    odd_sines += odd.sines;
  }
  if (k < components) {
    const auto even = wave(k);
    even_cosines += even.cosines;
    even_sines += even.sines;
  }
  // cos k(pi +- x) = +-cos kx and sin k(pi +- x) = +-sin kx, the sign also being that of (-1)^k.
  const Floats cosines_ahead = even_cosines + odd_cosines;
  const Floats cosines_behind = even_cosines - odd_cosines;
  const Floats sines_ahead = even_sines + odd_sines;
  const Floats sines_behind = even_sines - odd_sines;
  return {cosines_ahead - sines_ahead, cosines_ahead + sines_ahead, cosines_behind + sines_behind,
          cosines_behind - sines_behind};
}

template <class Floats>
struct Wave {
  Floats cosines, sines;
};

// Writes the columns of one band, except those at a quarter and three quarters of a turn.
template <int lanes>
void reconstruct_band(const BandWaves& waves, int band, float* row) {
  using Floats = typename Vectors<lanes>::Floats;
  for (int first = 0; first < quarter; first += lanes) {
    const auto sums = add_waves<Floats>(waves.components, [&](int k) {
      const float real = waves.real[k * matched_bands + band];
      const float imaginary = waves.imaginary[k * matched_bands + band];
      const int at = k * profile_wave_stride + first;
      return Wave<Floats>{real * load<lanes>(waves.cosines + at),
                          imaginary * load<lanes>(waves.sines + at)};
    });
    constexpr int last = lanes - 1;
    store<lanes>(row + first, sums.ahead);
    store<lanes>(row + columns - first - last, reverse<lanes>(sums.ahead_mirrored));
    store<lanes>(row + columns / 2 - first - last, reverse<lanes>(sums.behind_mirrored));
    store<lanes>(row + columns / 2 + first, sums.behind);
  }
  row[0] = row[columns];  // a whole turn
}

// Writes the columns at a quarter and three quarters of a turn, of all bands.
template <int lanes>
void reconstruct_quarters(const BandWaves& waves, float* view) {
  using Floats = typename Vectors<lanes>::Floats;
  for (int first = 0; first < waves.bands; first += lanes) {
    const auto sums = add_waves<Floats>(waves.components, [&](int k) {
      const int at = k * matched_bands + first;
      return Wave<Floats>{
          load<lanes>(waves.real + at) * waves.cosines[k * profile_wave_stride + quarter],
          load<lanes>(waves.imaginary + at) * waves.sines[k * profile_wave_stride + quarter]};
    });
    for (int lane = 0; lane < lanes; ++lane) {
      float* const row = view + (first + lane) * profile_view_stride;
      row[quarter] = sums.behind_mirrored[lane];
      row[3 * quarter] = sums.behind[lane];
    }
  }
}

/// Loads two pairs of floats, from any addresses.
inline Vectors<4>::Floats load_two_pairs(const float* first, const float* second) {
  typedef double Pairs __attribute__((vector_size(16)));
  double pairs[2];
  __builtin_memcpy(pairs, first, sizeof pairs[0]);
  __builtin_memcpy(pairs + 1, second, sizeof pairs[1]);
  return reinterpret_cast<Vectors<4>::Floats>(Pairs{pairs[0], pairs[1]});
}

}  // namespace

// Two components at a time, each with its real and imaginary part: four lanes.
template <Instructions set>
void ColumnProfilesBody<set>::average_bands(const BandsJob& job, float* __restrict real,
                                            float* __restrict imaginary) {
  using Floats = Vectors<4>::Floats;
  const auto bands = static_cast<size_t>(job.bands);
  for (int k = 0; k < job.components; k += 2) {
    const bool has_next = k + 1 < job.components;
    const size_t next = has_next ? job.rows : 0;
    const size_t component = static_cast<size_t>(k) * job.rows;
    for (size_t band = 0; band < bands; ++band) {
      const size_t begin = band * job.used_count / bands;
      const size_t end = (band + 1) * job.used_count / bands;
      Floats sums = {};
      for (size_t i = begin; i < end; ++i) {
        const size_t at = component + job.used_rows[i];
        const auto magnitudes =
            load_two_pairs(job.magnitude_pairs + size_t{2} * job.magnitudes[at],
                           job.magnitude_pairs + size_t{2} * job.magnitudes[at + next]);
        sums += magnitudes * load_two_pairs(job.directions + size_t{2} * job.phases[at],
                                            job.directions + size_t{2} * job.phases[at + next]);
      }
      // I(phi) = a_0 / 2 + sum_k a_k cos(k phi) + b_k sin(k phi) [S06 eq. 10].
      const float share = 1.0F / static_cast<float>(end - begin);
      const float scale = k == 0 ? 0.5F / static_cast<float>(end - begin) : share;
      const size_t to = static_cast<size_t>(k) * matched_bands + band;
      real[to] = sums[0] * scale;
      imaginary[to] = sums[1] * scale;
      if (!has_next) continue;
      real[to + matched_bands] = sums[2] * share;
      imaginary[to + matched_bands] = sums[3] * share;
    }
  }
}

// All bands at a time. Most weights are 0, but choosing costs more than multiplying.
template <Instructions set>
void ColumnProfilesBody<set>::blur_bands(const BandsJob& job, const float* __restrict weights,
                                         const float* __restrict damping, float* __restrict real,
                                         float* __restrict imaginary) {
  constexpr int lanes = lanes_of<set>;
  constexpr int parts = matched_bands / lanes;
  using Floats = typename Vectors<lanes>::Floats;
  for (int k = 0; k < job.components; ++k) {
    Floats reals[parts] = {};
    Floats imaginaries[parts] = {};
    for (size_t y = 0; y < job.rows; ++y) {
      const size_t at = static_cast<size_t>(k) * job.rows + y;
      const float magnitude = job.magnitude_pairs[size_t{2} * job.magnitudes[at]];
      const float* const direction = job.directions + size_t{2} * job.phases[at];
      const float row_real = magnitude * direction[0];
      const float row_imaginary = magnitude * direction[1];
      for (int i = 0; i < parts; ++i) {
        const Floats shares = load<lanes>(weights + y * matched_bands + i * lanes);
        reals[i] += shares * row_real;
        imaginaries[i] += shares * row_imaginary;
      }
    }
    const float scale = (k == 0 ? 0.5F : 1.0F) * damping[k];
    for (int i = 0; i < parts; ++i) {
      store<lanes>(real + k * matched_bands + i * lanes, reals[i] * scale);
      store<lanes>(imaginary + k * matched_bands + i * lanes, imaginaries[i] * scale);
    }
  }
}

template <Instructions set>
void ColumnProfilesBody<set>::reconstruct_bands(const BandWaves& waves, float* view) {
  constexpr int lanes = lanes_of<set>;
  for (int band = 0; band < waves.bands; ++band)
    reconstruct_band<lanes>(waves, band, view + band * profile_view_stride);
  reconstruct_quarters<lanes>(waves, view);
}

template <Instructions set>
void ColumnProfilesBody<set>::subtract_column_means(float* __restrict view, int bands) {
  float means[columns] = {};
  for (int b = 0; b < bands; ++b) {
    const float* const row = view + b * profile_view_stride;
    for (int c = 0; c < columns; ++c) means[c] += row[c];
  }
  for (int c = 0; c < columns; ++c) means[c] /= static_cast<float>(bands);
  for (int b = 0; b < bands; ++b) {
    float* const row = view + b * profile_view_stride;
    for (int c = 0; c < columns; ++c) row[c] -= means[c];
  }
}

template <Instructions set>
bool ColumnProfilesBody<set>::quantise_columns(const float* __restrict view, int bands,
                                               const ColumnContrast& contrast,
                                               uint8_t* __restrict values) {
  float contrasts[columns] = {};
  for (int b = 0; b < bands; ++b) {
    const float* const row = view + b * profile_view_stride;
    for (int c = 0; c < columns; ++c) contrasts[c] += row[c] * row[c];
  }
  for (int c = 0; c < columns; ++c) contrasts[c] /= static_cast<float>(bands);
  float mean_contrast = 0.0F;
  for (int c = 0; c < columns; ++c) mean_contrast += contrasts[c] / columns;
  mean_contrast = __builtin_sqrtf(mean_contrast);
  if (!(mean_contrast > 0.0F)) return false;
  if (contrast.is_of_each_column) {
    const float added = contrast.mean_share * mean_contrast;
    for (int c = 0; c < columns; ++c) contrasts[c] = __builtin_sqrtf(contrasts[c]) + added;
  } else {
    for (int c = 0; c < columns; ++c) contrasts[c] = mean_contrast;
  }
  for (int b = 0; b < bands; ++b) {
    const float* const row = view + b * profile_view_stride;
    for (int c = 0; c < columns; ++c) {
      constexpr float largest = 127.0F;
      const float value = contrast.steps * row[c] / contrasts[c];
      const float at_least = value < -largest ? -largest : value;
      const float clamped = at_least > largest ? largest : at_least;
      values[b * columns + c] = static_cast<uint8_t>(static_cast<int>(clamped + 128.5F));
    }
  }
  return true;
}

template struct ColumnProfilesBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
