#include "panonav/signature/compass.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/signature/correlation_point.hpp"

namespace panonav {

namespace {

/// Coefficients of C(sigma), see `CorrelationPoint`; entry 0 is 0.
struct CrossSpectrum {
  std::vector<double> real, imaginary;
  double norm = 0.0;  ///< geometric mean of the energies of both views

  explicit CrossSpectrum(int components)
      : real(static_cast<std::size_t>(components)), imaginary(real.size()) {}
  [[nodiscard]] int max_frequency() const { return static_cast<int>(real.size()) - 1; }
  [[nodiscard]] std::complex<double> term(int k) const { return {real[k], imaginary[k]}; }
};

int resolve_common_components(SignatureShape query, SignatureShape reference, int components) {
  require(query.rows == reference.rows, "rows of the query", query.rows,
          std::to_string(reference.rows) + " (as the reference)");
  const int common = std::min(query.components, reference.components);
  require(components == 0 || (components >= 2 && components <= common), "components", components,
          "0 (all) or 2 .. " + std::to_string(common));
  return components == 0 ? common : components;
}

struct SineCosine {
  float sine, cosine;
};

/// |angle| <= 4 pi; absolute error below 1e-6. Branch-free, so that the compiler can do several at
/// once.
inline SineCosine approximate_sine_cosine(float angle_rad) {
  const float quarters = angle_rad * static_cast<float>(2.0 / std::numbers::pi);
  const int quadrant = static_cast<int>(quarters + 8.5F) - 8;
  const float x =
      (quarters - static_cast<float>(quadrant)) * static_cast<float>(std::numbers::pi / 2.0);
  const float z = x * x;
  const float s = x * (1.0F + z * (-1.0F / 6 + z * (1.0F / 120 + z * (-1.0F / 5040))));
  const float c = 1.0F + z * (-0.5F + z * (1.0F / 24 + z * (-1.0F / 720 + z * (1.0F / 40320))));
  const float sine = (quadrant & 1) != 0 ? c : s;
  const float cosine = (quadrant & 1) != 0 ? s : c;
  return {(quadrant & 2) != 0 ? -sine : sine, ((quadrant + 1) & 2) != 0 ? -cosine : cosine};
}

std::optional<CrossSpectrum> cross_spectrum(const FourierSignature& query,
                                            const FourierSignature& reference, int components) {
  components = resolve_common_components(query.shape(), reference.shape(), components);
  const auto rows = static_cast<std::size_t>(query.rows());
  CrossSpectrum spectrum(components);
  std::vector<float> cosines(rows);
  std::vector<float> sines(rows);
  double query_energy = 0.0;
  double reference_energy = 0.0;
  for (int k = 1; k < components; ++k) {
    const float* const query_magnitudes = query.magnitudes().data() + k * rows;
    const float* const reference_magnitudes = reference.magnitudes().data() + k * rows;
    const float* const query_phases = query.phases_rad().data() + k * rows;
    const float* const reference_phases = reference.phases_rad().data() + k * rows;
    for (std::size_t y = 0; y < rows; ++y) {
      const float weight = query_magnitudes[y] * reference_magnitudes[y];
      const SineCosine turn = approximate_sine_cosine(query_phases[y] - reference_phases[y]);
      cosines[y] = weight * turn.cosine;
      sines[y] = weight * turn.sine;
    }
    double real = 0.0;
    double imaginary = 0.0;
    for (std::size_t y = 0; y < rows; ++y) {
      real += cosines[y];
      imaginary += sines[y];
      query_energy += static_cast<double>(query_magnitudes[y]) * query_magnitudes[y];
      reference_energy += static_cast<double>(reference_magnitudes[y]) * reference_magnitudes[y];
    }
    spectrum.real[k] = real;
    spectrum.imaginary[k] = imaginary;
  }
  // Bound of the rounding errors of a single-precision transform of values of the order of 1;
  // weaker structure is treated as none.
  constexpr double rounding = 1e-6;
  const double min_energy = rounding * rounding * static_cast<double>(rows);
  if (!(query_energy > min_energy && reference_energy > min_energy)) return {};
  spectrum.norm = std::sqrt(query_energy) * std::sqrt(reference_energy);
  return spectrum;
}

std::optional<CrossSpectrum> cross_spectrum(const PackedSignature& query,
                                            const PackedSignature& reference, int components) {
  components = resolve_common_components(query.shape, reference.shape, components);
  for (const PackedSignature* packed : {&query, &reference}) {
    require(packed->magnitudes.size() == packed->shape.size() &&
                packed->phases.size() == packed->shape.size(),
            "bytes of a packed signature", static_cast<double>(packed->phases.size()),
            to_text(static_cast<double>(packed->shape.size())));
  }
  // Integer sums are exact in any order of addition. Sines and cosines have 14 bits, so that a term
  // fits into 32 bits.
  struct Turn {
    std::int32_t cosine, sine;
  };
  static const auto turns = [] {
    std::array<Turn, 256> table{};
    for (int i = 0; i < 256; ++i) {
      table[i] = {
          static_cast<std::int32_t>(std::lround(16384.0 * std::cos(std::numbers::pi * i / 128.0))),
          static_cast<std::int32_t>(std::lround(16384.0 * std::sin(std::numbers::pi * i / 128.0)))};
    }
    return table;
  }();
  const auto rows = static_cast<std::size_t>(query.shape.rows);
  CrossSpectrum spectrum(components);
  std::uint64_t query_energy = 0;
  std::uint64_t reference_energy = 0;
  for (int k = 1; k < components; ++k) {
    std::int64_t real = 0;
    std::int64_t imaginary = 0;
    for (std::size_t i = k * rows; i < (k + 1) * rows; ++i) {
      const std::int32_t a = query.magnitudes[i];
      const std::int32_t b = reference.magnitudes[i];
      const Turn turn = turns[static_cast<std::uint8_t>(query.phases[i] - reference.phases[i])];
      real += a * b * turn.cosine;
      imaginary += a * b * turn.sine;
      query_energy += static_cast<std::uint64_t>(a * a);
      reference_energy += static_cast<std::uint64_t>(b * b);
    }
    spectrum.real[k] = static_cast<double>(real) / 16384.0;
    spectrum.imaginary[k] = static_cast<double>(imaginary) / 16384.0;
  }
  if (query_energy == 0 || reference_energy == 0) return {};
  spectrum.norm = std::sqrt(static_cast<double>(query_energy)) *
                  std::sqrt(static_cast<double>(reference_energy));
  return spectrum;
}

using Point = CorrelationPoint<double>;

Point evaluate(const CrossSpectrum& spectrum, double heading_rad) {
  return correlation_at<double>(spectrum.real, spectrum.imaginary, heading_rad);
}

struct Peak {
  double heading_rad = 0.0;
  double value = 0.0;
};

/// Finds the maximum between `low` and `high`, where the slope changes from rising to falling:
/// Newton's rule, halving the interval where that would leave it.
Peak refine_peak(const CrossSpectrum& spectrum, double low, double high) {
  double heading = 0.5 * (low + high);
  Point point = evaluate(spectrum, heading);
  for (int iteration = 0; iteration < 60; ++iteration) {
    (point.slope > 0.0 ? low : high) = heading;
    double next = point.curvature < 0.0 ? heading - point.slope / point.curvature : low;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    const double change = std::abs(next - heading);
    heading = next;
    point = evaluate(spectrum, heading);
    if (change < 1e-9) break;
  }
  return {wrap_angle(heading), point.value};
}

/// Finds all maxima of C that may be its highest or second highest; returns them highest first.
std::vector<Peak> find_highest_peaks(const CrossSpectrum& spectrum) {
  const int max_frequency = spectrum.max_frequency();
  int count = 16;
  while (count < 8 * max_frequency) count *= 2;

  // Evaluates C at all points of the grid by Horner's rule. Single precision suffices, because the
  // maxima are refined below.
  const auto size = static_cast<std::size_t>(count);
  std::vector<float> buffer(4 * size);
  float* const cosine = buffer.data();
  float* const sine = cosine + size;
  float* const real = sine + size;
  float* const imaginary = real + size;
  const std::complex<double> step = std::polar(1.0, 2.0 * std::numbers::pi / count);
  std::complex<double> turn = 1.0;
  for (std::size_t i = 0; i < size; ++i) {
    cosine[i] = static_cast<float>(turn.real());
    sine[i] = static_cast<float>(turn.imag());
    turn = {turn.real() * step.real() - turn.imag() * step.imag(),
            turn.real() * step.imag() + turn.imag() * step.real()};
  }
  const double scale = 1.0 / spectrum.norm;
  for (int k = max_frequency; k >= 1; --k) {
    const auto term_real = static_cast<float>(spectrum.real[k] * scale);
    const auto term_imaginary = static_cast<float>(spectrum.imaginary[k] * scale);
    for (std::size_t i = 0; i < size; ++i) {
      // (sum + term) * exp(-j sigma)
      const float a = real[i] + term_real;
      const float b = imaginary[i] + term_imaginary;
      real[i] = a * cosine[i] + b * sine[i];
      imaginary[i] = b * cosine[i] - a * sine[i];
    }
  }

  struct Candidate {
    float value;
    std::size_t index;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < size; ++i) {
    const float before = real[(i + size - 1) % size];
    const float after = real[(i + 1) % size];
    if (real[i] > before && real[i] >= after) candidates.push_back({real[i], i});
  }
  std::ranges::sort(candidates, [](const Candidate& a, const Candidate& b) {
    return a.value != b.value ? a.value > b.value : a.index < b.index;
  });
  // Bernstein's inequality: from a maximum to the nearest point of the grid, C decreases by at most
  // (max_frequency * half a step)^2 / 2 <= 0.08 of its maximum.
  std::vector<Peak> peaks;
  const double grid_step = 2.0 * std::numbers::pi / count;
  const float margin = candidates.empty() ? 0.0F : 0.1F * candidates.front().value;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i >= 2 && candidates[i].value + margin < candidates[1].value) break;
    const double centre = grid_step * static_cast<double>(candidates[i].index);
    peaks.push_back(refine_peak(spectrum, centre - grid_step, centre + grid_step));
  }
  std::ranges::stable_sort(peaks, [](const Peak& a, const Peak& b) { return a.value > b.value; });
  return peaks;
}

double compute_distinctness(double value, double other) {
  return value > 0.0 ? std::clamp((value - other) / value, 0.0, 1.0) : 0.0;
}

std::optional<CompassReading> read_compass(const std::optional<CrossSpectrum>& spectrum) {
  if (!spectrum) return {};
  const std::vector<Peak> peaks = find_highest_peaks(*spectrum);
  if (peaks.empty()) return {};  // the views have no component in common
  const double other = peaks.size() > 1 ? peaks[1].value : 0.0;
  return CompassReading{peaks[0].heading_rad,
                        std::clamp(peaks[0].value / spectrum->norm, -1.0, 1.0),
                        compute_distinctness(peaks[0].value, other)};
}

}  // namespace

std::optional<CompassReading> compass(const FourierSignature& query,
                                      const FourierSignature& reference, int components) {
  return read_compass(cross_spectrum(query, reference, components));
}

std::optional<CompassReading> compass(const PackedSignature& query,
                                      const PackedSignature& reference, int components) {
  return read_compass(cross_spectrum(query, reference, components));
}

std::optional<CompassReading> compass_near(const PackedSignature& query,
                                           const PackedSignature& reference, double heading_rad,
                                           double within_rad, int components) {
  require(within_rad > 0.0 && within_rad <= std::numbers::pi, "within_rad", within_rad,
          "above 0 .. pi");
  const auto spectrum = cross_spectrum(query, reference, components);
  if (!spectrum) return {};
  // Eight points per period of the highest frequency, as in `find_highest_peaks`.
  const int steps =
      1 +
      static_cast<int>(std::ceil(within_rad * 8.0 * spectrum->max_frequency() / std::numbers::pi));
  const double step = 2.0 * within_rad / steps;
  const double first = heading_rad - within_rad;
  std::vector<Point> points;
  points.reserve(static_cast<std::size_t>(steps) + 1);
  Peak best{first, -std::numeric_limits<double>::infinity()};
  for (int i = 0; i <= steps; ++i) {
    const double heading = first + i * step;
    points.push_back(evaluate(*spectrum, heading));
    if (points.back().value > best.value) best = {heading, points.back().value};
  }
  // Bernstein's inequality: between two points, C rises by at most (max_frequency * half a step)^2
  // / 2 <= 0.08 of its bound.
  double bound = 0.0;
  for (int k = 1; k <= spectrum->max_frequency(); ++k) bound += std::abs(spectrum->term(k));
  const double min_value = best.value - 0.08 * bound;
  for (int i = 0; i < steps; ++i) {
    const Point& low = points[i];
    const Point& high = points[static_cast<std::size_t>(i) + 1];
    if (!(low.slope > 0.0 && high.slope < 0.0 && std::max(low.value, high.value) >= min_value)) {
      continue;
    }
    const Peak peak = refine_peak(*spectrum, first + i * step, first + (i + 1) * step);
    if (peak.value > best.value) best = peak;
  }
  return CompassReading{wrap_angle(best.heading_rad),
                        std::clamp(best.value / spectrum->norm, -1.0, 1.0), 1.0};
}

}  // namespace panonav
