#include "panonav/route/snapshot_code.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "panonav/core/portable_math.hpp"
#include "panonav/route/internal/snapshot_bits.hpp"

namespace panonav {

namespace {

constexpr int min_snapshot_bits = 3;
// Steps of the uniform quantiser of least squared error for a normal distribution of deviation 1,
// for 3 .. 8 bits [Max 1960 table II; 7 and 8 bits by the same minimisation].
constexpr std::array<double, 6> normal_steps{0.5860, 0.3352, 0.1881, 0.1041, 0.0569, 0.0308};

// Deviation of code 1 of the first byte; code 255 is 2^31.75 times larger.
constexpr double min_deviation = 1e-6;
constexpr int codes_per_octave = 8;
// A ratio of 15 is an amplitude of 2^-7.5, less than a step of the largest component.
constexpr int ratios_per_octave = 2;
constexpr double inverse_ln2 = 1.44269504088896338700;

// Returns the deviation of a code and a ratio.
double decode_deviation(int code, int ratio) {
  // Powers of two of 0 .. 7 eighths.
  constexpr std::array<double, codes_per_octave> eighths{1.0,
                                                         1.0905077326652576592,
                                                         1.1892071150027210667,
                                                         1.2968395546510096659,
                                                         1.4142135623730950488,
                                                         1.5422108254079408236,
                                                         1.6817928305074290861,
                                                         1.8340080864093424635};
  if (code == 0) return 0.0;
  const int exponent = code - 1 - ratio * (codes_per_octave / ratios_per_octave);
  constexpr int bias = 1 << 10;  // keeps the dividend positive
  const int octave = (exponent + bias) / codes_per_octave - bias / codes_per_octave;
  return min_deviation * eighths[static_cast<std::size_t>(exponent - octave * codes_per_octave)] *
         portable::power_of_two(octave);
}

double coefficient_deviation(const CoefficientView& view, int k) {
  double sum = 0.0;
  for (std::size_t y = 0; y < static_cast<std::size_t>(view.rows); ++y) {
    const auto a = static_cast<double>(view.cosines(k)[y]);
    const auto b = static_cast<double>(view.sines(k)[y]);
    sum += a * a + b * b;
  }
  return std::sqrt(sum / ((k == 0 ? 1 : 2) * view.rows));
}

double compute_octaves(double ratio) {
  return portable::log(ratio) * inverse_ln2;
}

double unit_step(int bits) {
  return normal_steps[static_cast<std::size_t>(bits - min_snapshot_bits)];
}

unsigned quantise(float value, double step, int bits) {
  const double half = portable::power_of_two(bits - 1);
  return static_cast<unsigned>(
      std::clamp(std::floor(static_cast<double>(value) / step), -half, half - 1.0) + half);
}

}  // namespace

std::size_t SnapshotShape::bytes() const noexcept {
  return scale_bytes(components) + (coefficients() * static_cast<std::size_t>(bits) + 7) / 8;
}

void encode_snapshot(const CoefficientView& view, const SnapshotShape& shape,
                     std::span<std::uint8_t> bytes) noexcept {
  std::fill(bytes.begin(), bytes.end(), std::uint8_t{0});
  double largest = 0.0;
  for (int k = 0; k < shape.components; ++k) {
    largest = std::max(largest, coefficient_deviation(view, k));
  }
  // Rounding errors of a view without structure have no scale.
  constexpr double min_scale = 1e-30;
  const double code = std::round(
      1.0 + codes_per_octave * compute_octaves(std::max(largest, min_scale) / min_deviation));
  if (code < 1.0) return;
  bytes[0] = static_cast<std::uint8_t>(std::min(code, 255.0));
  std::size_t position = 8;
  std::size_t code_position = 8 * scale_bytes(shape.components);
  for (int k = 0; k < shape.components; ++k) {
    const double deviation = std::max(coefficient_deviation(view, k), min_scale);
    const double ratio = std::round(ratios_per_octave * compute_octaves(largest / deviation));
    const int ratio_code = static_cast<int>(std::min(ratio, 15.0));
    write_bits(bytes, position, ratio_bits, static_cast<unsigned>(ratio_code));
    const double step = unit_step(shape.bits) * decode_deviation(bytes[0], ratio_code);
    for (const float a : view.cosines(k)) {
      write_bits(bytes, code_position, shape.bits, quantise(a, step, shape.bits));
    }
    if (k == 0) continue;
    for (const float b : view.sines(k)) {
      write_bits(bytes, code_position, shape.bits, quantise(b, step, shape.bits));
    }
  }
}

float decode_step(std::span<const std::uint8_t> bytes, const SnapshotShape& shape, int k) noexcept {
  std::size_t position = 8 + static_cast<std::size_t>(k * ratio_bits);
  const unsigned ratio = read_bits(bytes, position, ratio_bits);
  return static_cast<float>(unit_step(shape.bits) *
                            decode_deviation(bytes[0], static_cast<int>(ratio)));
}

void decode_snapshot(std::span<const std::uint8_t> bytes, const SnapshotShape& shape,
                     std::span<float> cosines, std::span<float> sines) noexcept {
  std::size_t position = 8 * scale_bytes(shape.components);
  const auto rows = static_cast<std::size_t>(shape.rows);
  const auto half = static_cast<float>(1 << (shape.bits - 1));
  for (int k = 0; k < shape.components; ++k) {
    const float step = decode_step(bytes, shape, k);
    const auto read = [&](std::span<float> values) {
      for (float& value : values.subspan(static_cast<std::size_t>(k) * rows, rows)) {
        const auto code = static_cast<float>(read_bits(bytes, position, shape.bits));
        value = (code - half + 0.5F) * step;
      }
    };
    read(cosines);
    if (k > 0) {
      read(sines);
    } else {
      std::fill(sines.begin(), sines.begin() + static_cast<std::ptrdiff_t>(rows), 0.0F);
    }
  }
}

}  // namespace panonav
