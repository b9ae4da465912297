#pragma once

#include <array>
#include <cmath>
#include <span>

namespace panonav {

/// C(sigma) = sum_{k=1..K} Re(real[k] + j imaginary[k]) exp(-j k sigma): the correlation of two
/// views against the turn between them, all rows summed [S06 eq. 33]. Entry 0 is not used.
struct TurnCorrelation {
  static constexpr int max_frequencies = 62;      ///< capacity
  int highest = 0;                                ///< K, 1 .. max_frequencies
  std::array<float, max_frequencies + 1> real{};  ///< of each frequency, summed over the rows
  /// Of each frequency, summed over the rows.
  std::array<float, max_frequencies + 1> imaginary{};

  /// Returns C at one turn. Cost: a sine, a cosine and a few multiplications a frequency.
  [[nodiscard]] float at(float turn_rad) const noexcept;
};

/// Headings within `half_width_rad` of `middle_rad`; all by default.
struct HeadingWindow {
  float middle_rad = 0.0F;      ///< expected heading
  float half_width_rad = 4.0F;  ///< more than pi: all turns

  /// True if the heading is within the window.
  [[nodiscard]] bool contains(float turn_rad) const noexcept {
    return std::abs(std::remainder(turn_rad - middle_rad, 6.2831853F)) <= half_width_rad;
  }
};

/// Returns the heading of S06's sequential rule, as published [S06 eq. 40-43, sign of eq. 41
/// corrected]: each component refines the estimate of those before. If the weight of the first
/// component is below a tenth of the mean, a second estimate starts at the opposite heading, and
/// the one with the higher correlation is returned. In radians, not wrapped.
[[nodiscard]] float sequential_heading(const TurnCorrelation& correlation) noexcept;

/// Fills `turns` with the headings of the highest local maxima within the window, highest first,
/// and returns their number; 0 when the correlation is zero everywhere. Eight points per period of
/// the highest frequency are evaluated and the best refined by Newton's rule.
[[nodiscard]] int find_highest_peaks(const TurnCorrelation& correlation, std::span<float> turns,
                                     const HeadingWindow& window = {}) noexcept;

}  // namespace panonav
