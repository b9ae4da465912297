#pragma once

#include <cmath>
#include <span>

namespace panonav {

/// Smallest noise: a grey level, as lines are bytes.
constexpr double min_noise = 1.0 / 255.0;
/// Standard deviation of a Gaussian over the median of its absolute values.
constexpr double sigma_over_mad = 1.4826;

/// An interpolated value of a closed line.
struct LineSample {
  float value = 0.0F;
  float slope = 0.0F;  ///< per column
};

/// Interpolates the line at any column by the cubic of Catmull and Rom.
[[nodiscard]] inline LineSample sample_line(std::span<const float> line, double column) {
  const double whole = std::floor(column);
  const auto f = static_cast<float>(column - whole);
  const auto size = static_cast<long long>(line.size());
  auto i = static_cast<long long>(whole);
  if (i < 0) i += size;
  if (i >= size) i -= size;
  if (i < 0 || i >= size)
    i = (i % size + size) % size;  // a division, which most columns do not need
  const auto at = [&](long long k) {
    long long c = i + k;
    if (c < 0) c += size;
    if (c >= size) c -= size;
    return line[static_cast<std::size_t>(c)];
  };
  const float p0 = at(-1);
  const float p1 = at(0);
  const float p2 = at(1);
  const float p3 = at(2);
  const float a = 0.5F * (-p0 + 3.0F * p1 - 3.0F * p2 + p3);
  const float b = 0.5F * (2.0F * p0 - 5.0F * p1 + 4.0F * p2 - p3);
  const float c = 0.5F * (p2 - p0);
  return {((a * f + b) * f + c) * f + p1, (3.0F * a * f + 2.0F * b) * f + c};
}

}  // namespace panonav
