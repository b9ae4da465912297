#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/kernels/row_transform.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav {

/// Rows and components of a signature; components are k = 0 .. components - 1 (the papers' "first
/// 15").
struct SignatureShape {
  int rows = 80;        ///< rows of the panorama, >= 1 [M04 section 2.1]
  int components = 15;  ///< >= 1 [M04 section 2.1]

  /// Number of coefficients: rows * components.
  [[nodiscard]] std::size_t size() const noexcept {
    return static_cast<std::size_t>(rows) * components;
  }
  friend bool operator==(const SignatureShape&, const SignatureShape&) = default;
};

/// The first Fourier components of every row of a panoramic cylinder [M04 section 2.1, S06 eq.
/// 10-13]: I_y(phi) ~ a_0/2 + sum_k A_k cos(k phi + psi_k). Magnitudes do not change when the robot
/// turns on the spot; phases psi_k change by k times the turn. Stored component-major (k, then
/// y), so that the first m components are a prefix. Invariant: rows, components >= 1; magnitudes
/// finite and >= 0; phases in [-pi, pi), 0 where the magnitude is 0.
class FourierSignature {
 public:
  /// Throws ContractError.
  FourierSignature(SignatureShape shape, std::vector<float> magnitudes,
                   std::vector<float> phases_rad, std::optional<ElevationBand> elevations);

  /// Rows and components.
  [[nodiscard]] SignatureShape shape() const noexcept { return shape_; }
  /// Number of rows, from the highest elevation to the lowest.
  [[nodiscard]] int rows() const noexcept { return shape_.rows; }
  /// Number of components: frequencies k = 0 .. components - 1.
  [[nodiscard]] int components() const noexcept { return shape_.components; }
  /// Elevations of the panorama's rows; nullopt: unknown.
  [[nodiscard]] const std::optional<ElevationBand>& elevations() const noexcept {
    return elevations_;
  }
  /// Magnitude A_k of a row, an amplitude of brightness. The caller guarantees that row and k are
  /// in the shape.
  [[nodiscard]] float magnitude(int row, int k) const noexcept {
    return magnitudes_[index(row, k)];
  }
  /// Phase psi_k of a row, in [-pi, pi). The caller guarantees that row and k are in the shape.
  [[nodiscard]] float phase_rad(int row, int k) const noexcept {
    return phases_rad_[index(row, k)];
  }
  /// Component-major: index k * rows + row.
  [[nodiscard]] std::span<const float> magnitudes() const& noexcept { return magnitudes_; }
  /// Phases in the order of the magnitudes.
  [[nodiscard]] std::span<const float> phases_rad() const& noexcept { return phases_rad_; }
  std::span<const float> magnitudes() const&& = delete;  // would dangle
  std::span<const float> phases_rad() const&& = delete;  // would dangle
  friend bool operator==(const FourierSignature&, const FourierSignature&) = default;

 private:
  [[nodiscard]] std::size_t index(int row, int k) const noexcept {
    return static_cast<std::size_t>(k) * shape_.rows + row;
  }
  SignatureShape shape_;
  std::vector<float> magnitudes_;
  std::vector<float> phases_rad_;
  std::optional<ElevationBand> elevations_;
};

/// Computes the signature of a panorama. Throws ContractError unless 1 <= components <= columns /
/// 2. Cost: rows * columns * components / 4 multiplications (an odd number of columns: / 2).
[[nodiscard]] FourierSignature compute_signature(const Panorama& panorama, int components = 15);

/// Computes the signature with existing tables of the transform, for many panoramas of the same
/// width. Throws ContractError if the panorama has another number of columns.
[[nodiscard]] FourierSignature compute_signature(const Panorama& panorama,
                                                 const kernels::RowTransform& transform);

/// Returns the signature of the same view after the robot turned by `turn_rad` counter-clockwise
/// (exact shift theorem [M04 eq. 1]).
[[nodiscard]] FourierSignature turn(const FourierSignature& signature, double turn_rad);

/// A signature in 8 + 8 bit per component and row: 19 kbit for 80 x 15 [M03 table 1]. Magnitudes
/// are quantised linearly up to `full_scale` (stored once per visual memory, not here), where they
/// saturate; below, the error is at most full_scale / 510. Phases are integers in steps of 2 pi /
/// 256, modulo 256: the error is at most pi / 256. A magnitude packed as 0 has phase 0.
/// Component-major like FourierSignature. Both vectors have shape.size() entries.
struct PackedSignature {
  SignatureShape shape;                  ///< rows and components of both vectors
  std::vector<std::uint8_t> magnitudes;  ///< 255 stands for `full_scale` and all above
  std::vector<std::uint8_t> phases;      ///< in steps of 2 pi / 256 from 0
  friend bool operator==(const PackedSignature&, const PackedSignature&) = default;
};

/// Packs a signature. Throws ContractError unless full_scale is finite and > 0.
[[nodiscard]] PackedSignature pack(const FourierSignature& signature, float full_scale);
/// Unpacks a signature; pack(unpack(p)) == p. Throws ContractError unless full_scale is finite and
/// > 0 and the vectors fit the shape.
[[nodiscard]] FourierSignature unpack(const PackedSignature& packed, float full_scale,
                                      std::optional<ElevationBand> elevations);

}  // namespace panonav
