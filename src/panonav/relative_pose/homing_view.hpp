#pragma once

#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// A view in the form that homing needs: the Fourier coefficients a_k, b_k of every row [S06 eq.
/// 10, 12, 13],
///   I(phi) ~ a_0/2 + sum_k a_k cos(k phi) + b_k sin(k phi),   k = 0 .. components - 1.
/// One row for S06's horizon band, or all rows of a panorama. Stored component-major (k, then
/// row), so that loops over the rows of a component run over neighbouring numbers. Invariant: rows
/// >= 1, components >= 2, all finite, b_0 = 0.
class HomingView {
 public:
  /// Throws ContractError.
  HomingView(int rows, int components, std::vector<float> cosines, std::vector<float> sines,
             std::optional<ElevationBand> elevations = std::nullopt);

  /// Rows of the view, from the highest elevation to the lowest.
  [[nodiscard]] int rows() const noexcept { return rows_; }
  /// Frequencies k = 0 .. components - 1.
  [[nodiscard]] int components() const noexcept { return components_; }
  /// Elevations of the rows; nullopt: unknown, all rows are treated as on the horizon.
  [[nodiscard]] const std::optional<ElevationBand>& elevations() const noexcept {
    return elevations_;
  }
  /// The cosine coefficient a_k of a row. The caller guarantees that row and k are in the view.
  [[nodiscard]] float a(int row, int k) const noexcept { return cosines_[index(row, k)]; }
  /// The sine coefficient b_k of a row. The caller guarantees that row and k are in the view.
  [[nodiscard]] float b(int row, int k) const noexcept { return sines_[index(row, k)]; }
  /// a_k of all rows.
  [[nodiscard]] std::span<const float> cosines(int k) const noexcept {
    return std::span(cosines_).subspan(index(0, k), static_cast<std::size_t>(rows_));
  }
  /// b_k of all rows.
  [[nodiscard]] std::span<const float> sines(int k) const noexcept {
    return std::span(sines_).subspan(index(0, k), static_cast<std::size_t>(rows_));
  }
  friend bool operator==(const HomingView&, const HomingView&) = default;

 private:
  [[nodiscard]] std::size_t index(int row, int k) const noexcept {
    return static_cast<std::size_t>(k) * static_cast<std::size_t>(rows_) +
           static_cast<std::size_t>(row);
  }
  int rows_;
  int components_;
  std::vector<float> cosines_;
  std::vector<float> sines_;
  std::optional<ElevationBand> elevations_;
};

/// Converts all rows of a signature. Throws ContractError when it has fewer than two components.
[[nodiscard]] HomingView homing_view(const FourierSignature& signature);

/// Converts a view of a memory, with the same bits as from its signature, by a table of the packed
/// phases instead of a sine and a cosine per coefficient. Throws ContractError when there is no
/// such view. Cost: 1 microsecond for 40 rows and 15 components.
[[nodiscard]] HomingView homing_view(const VisualMemory& memory, ViewId view);

/// Returns S06's one-dimensional view: the mean of the rows whose middle lies within
/// `half_band_rad` of the horizon, or of all rows where elevations are unknown. The row nearest to
/// the horizon is always used. Throws ContractError when the signature has fewer than two
/// components or half_band_rad is not above 0.
[[nodiscard]] HomingView horizon_view(const FourierSignature& signature,
                                      double half_band_rad = 5.0 * std::numbers::pi / 180.0);

/// Returns the first `components` components of a view, such as a snapshot stores. Throws
/// ContractError unless 2 <= components <= those of the view.
[[nodiscard]] HomingView first_components(const HomingView& view, int components);

/// Returns the view after the robot turned by `turn_rad` counter-clockwise.
[[nodiscard]] HomingView rotate(const HomingView& view, double turn_rad);

}  // namespace panonav
