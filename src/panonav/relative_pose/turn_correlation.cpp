#include "panonav/relative_pose/turn_correlation.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "panonav/core/portable_math.hpp"
#include "panonav/relative_pose/internal/turn_bound.hpp"
#include "panonav/signature/correlation_point.hpp"

namespace panonav {

namespace {

/// Points of the grid: 8 for each of 62 frequencies, rounded up to a power of two.
constexpr std::size_t max_points = 512;

CorrelationPoint<float> evaluate(const TurnCorrelation& correlation, float turn_rad) noexcept {
  const std::size_t count = static_cast<std::size_t>(correlation.highest) + 1;
  return correlation_at<float>(std::span(correlation.real).first(count),
                               std::span(correlation.imaginary).first(count), turn_rad);
}

// Returns the maximum next to a point of the grid (Newton's rule).
float refine_peak(const TurnCorrelation& correlation, float turn_rad,
                  float half_step_rad) noexcept {
  float turn = turn_rad;
  for (int i = 0; i < 3; ++i) {
    const auto point = evaluate(correlation, turn);
    if (!(point.curvature < 0.0F)) break;
    const float next = std::clamp(turn - point.slope / point.curvature,
                                  turn_rad - 2.0F * half_step_rad, turn_rad + 2.0F * half_step_rad);
    const bool done = std::abs(next - turn) < 1e-6F;
    turn = next;
    if (done) break;
  }
  return turn;
}

/// Cosines and sines of the grids of all sizes: that of n points, a power of two, begins at n.
struct CircleTable {
  std::array<float, 2 * max_points> cosine, sine;
};

const CircleTable& unit_circle() {
  static const CircleTable made = [] {
    CircleTable table{};
    for (std::size_t count = 16; count <= max_points; count *= 2) {
      for (std::size_t i = 0; i < count; ++i) {
        const double angle = 2.0 * std::numbers::pi *
                             static_cast<double>(i * (max_points / count)) /
                             static_cast<double>(max_points);
        const auto [cosine, sine] = portable::cosine_sine(angle);
        table.cosine[count + i] = static_cast<float>(cosine);
        table.sine[count + i] = static_cast<float>(sine);
      }
    }
    return table;
  }();
  return made;
}

// Computes the correlation at turns from 0 on, and returns their number: at least 8 for each period
// of the highest frequency.
std::size_t evaluate_on_grid(const TurnCorrelation& correlation,
                             std::array<float, max_points>& values) noexcept {
  std::size_t count = 16;
  while (count < 8 * static_cast<std::size_t>(correlation.highest)) count *= 2;
  const CircleTable& table = unit_circle();
  const float* const cosine = table.cosine.data() + count;
  const float* const sine = table.sine.data() + count;
  std::array<float, max_points> imaginary;
  std::fill_n(values.begin(), count, 0.0F);
  std::fill_n(imaginary.begin(), count, 0.0F);
  // Horner's rule for all points at once: (sum + term) exp(-j sigma).
  for (int k = correlation.highest; k >= 1; --k) {
    const float term_real = correlation.real[static_cast<std::size_t>(k)];
    const float term_imaginary = correlation.imaginary[static_cast<std::size_t>(k)];
    for (std::size_t i = 0; i < count; ++i) {
      const float a = values[i] + term_real;
      const float b = imaginary[i] + term_imaginary;
      values[i] = a * cosine[i] + b * sine[i];
      imaginary[i] = b * cosine[i] - a * sine[i];
    }
  }
  return count;
}

}  // namespace

float TurnCorrelation::at(float turn_rad) const noexcept {
  return evaluate(*this, turn_rad).value;
}

float sequential_heading(const TurnCorrelation& correlation) noexcept {
  std::array<float, TurnCorrelation::max_frequencies + 1> differences{};
  std::array<float, TurnCorrelation::max_frequencies + 1> weights{};
  float all = 0.0F;
  for (int k = 1; k <= correlation.highest; ++k) {
    const auto i = static_cast<std::size_t>(k);
    differences[i] = static_cast<float>(portable::atan2(
        static_cast<double>(correlation.imaginary[i]), static_cast<double>(correlation.real[i])));
    const auto frequency = static_cast<float>(k);
    weights[i] = frequency * frequency *
                 std::sqrt(correlation.real[i] * correlation.real[i] +
                           correlation.imaginary[i] * correlation.imaginary[i]);
    all += weights[i];
  }
  const auto refine_from = [&](float first_rad) {
    float turn = first_rad;
    float sum = weights[1];
    for (int k = 2; k <= correlation.highest; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (!(weights[i] > 0.0F)) continue;
      const auto frequency = static_cast<float>(k);
      const float turns =
          std::nearbyint((frequency * turn - differences[i]) / (2.0F * std::numbers::pi_v<float>));
      const float estimate =
          (differences[i] + 2.0F * std::numbers::pi_v<float> * turns) / frequency;
      turn = (sum * turn + weights[i] * estimate) / (sum + weights[i]);
      sum += weights[i];
    }
    return turn;
  };
  const float first = refine_from(differences[1]);
  if (weights[1] >= 0.1F * all / static_cast<float>(correlation.highest)) return first;
  const float opposite = refine_from(differences[1] + std::numbers::pi_v<float>);
  return correlation.at(opposite) > correlation.at(first) ? opposite : first;
}

float bound_maximum(const TurnCorrelation& correlation) noexcept {
  std::array<float, max_points> values;
  const std::size_t count = evaluate_on_grid(correlation, values);
  const float highest =
      *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
  float max_curvature = 0.0F;
  for (int k = 1; k <= correlation.highest; ++k) {
    const auto i = static_cast<std::size_t>(k);
    max_curvature +=
        static_cast<float>(k * k) * std::sqrt(correlation.real[i] * correlation.real[i] +
                                              correlation.imaginary[i] * correlation.imaginary[i]);
  }
  // The slope is 0 at the maximum, which is at most half a step from a point of the grid.
  const float half_step_rad = std::numbers::pi_v<float> / static_cast<float>(count);
  return highest + 0.5F * half_step_rad * half_step_rad * max_curvature;
}

int find_highest_peaks(const TurnCorrelation& correlation, std::span<float> turns,
                       const HeadingWindow& window) noexcept {
  std::array<float, max_points> values;
  const std::size_t count = evaluate_on_grid(correlation, values);
  struct Peak {
    float value;
    float turn_rad;
  };
  // The highest maximum may be between two grid points, so more maxima are refined than returned.
  std::array<Peak, max_points / 2> peaks;
  std::size_t found = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float value = values[i];
    if (!(value > values[(i + count - 1) % count] && value >= values[(i + 1) % count])) continue;
    const float turn_rad =
        2.0F * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(count);
    if (window.contains(turn_rad)) peaks[found++] = {value, turn_rad};
  }
  const auto by_value = [](const Peak& a, const Peak& b) {
    return a.value != b.value ? a.value > b.value : a.turn_rad < b.turn_rad;
  };
  const std::size_t refined = std::min({found, std::size_t{8}, turns.size() + 2});
  std::partial_sort(peaks.begin(), peaks.begin() + static_cast<std::ptrdiff_t>(refined),
                    peaks.begin() + static_cast<std::ptrdiff_t>(found), by_value);
  const float half_step_rad = std::numbers::pi_v<float> / static_cast<float>(count);
  for (std::size_t i = 0; i < refined; ++i) {
    peaks[i].turn_rad = refine_peak(correlation, peaks[i].turn_rad, half_step_rad);
    peaks[i].value = correlation.at(peaks[i].turn_rad);
  }
  // Insertion keeps the order of equal values and needs no memory.
  for (std::size_t i = 1; i < refined; ++i) {
    for (std::size_t j = i; j > 0 && peaks[j].value > peaks[j - 1].value; --j) {
      std::swap(peaks[j], peaks[j - 1]);
    }
  }
  const std::size_t filled = std::min(refined, turns.size());
  for (std::size_t i = 0; i < filled; ++i) turns[i] = peaks[i].turn_rad;
  return static_cast<int>(filled);
}

}  // namespace panonav
