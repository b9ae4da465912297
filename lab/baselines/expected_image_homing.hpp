#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav::lab {

/// Homing by expected images (hs_ei, Franz et al. 1998), as described in [S06 section 2.2]:
/// predicts the current view, one row of pixels, from P positions around the robot, assuming that
/// all things are equally far [S06 eq. 9, nearest pixels from a table of P x N], and compares each
/// prediction with the home view at all N rotations by whole pixels [S06 eq. 8]. The baseline for
/// Fourier homing: an exact, exhaustive search. The sum of squared differences is computed as the
/// energies minus twice a correlation, for blocks of positions and rotations at once.
class ExpectedImageHoming {
 public:
  struct Position {
    float xi = 0.0F;
    float eta = 0.0F;
  };

  /// Builds the table for rows of `columns` pixels and the positions of the finest square lattice
  /// around (0, 0) that has at most `max_positions` points within 2/3 R (200 gives 197). R is the
  /// assumed distance of all things; from positions beyond R the expected image would fold over.
  /// Throws ContractError unless 4 <= columns <= 65536 and 5 <= max_positions <= 10000.
  explicit ExpectedImageHoming(int columns, int max_positions = 200);

  [[nodiscard]] int columns() const noexcept { return columns_; }
  /// Returns the positions in order of their distance from (0, 0).
  [[nodiscard]] std::span<const Position> positions() const noexcept { return positions_; }
  /// Returns the distance between neighbouring lattice positions, in units of R.
  [[nodiscard]] double spacing() const noexcept { return spacing_; }

  /// Returns the table row of a position: entry i is the pixel of `current` that pixel i of the
  /// expected view shows.
  [[nodiscard]] std::span<const std::uint16_t> expected_pixel_indices(
      std::size_t position) const noexcept {
    return std::span(table_).subspan(position * static_cast<std::size_t>(columns_),
                                     static_cast<std::size_t>(columns_));
  }

  /// Conventions as `panonav::home_vector`. `residual` is the smallest sum of squared differences
  /// over the energy of home and expected view; `covariance` accounts for the spacing of
  /// the positions and columns only. Of equal differences the position nearest to (0, 0) wins;
  /// views without structure give zeros and residual 1. Throws ContractError unless both rows have
  /// `columns` finite values. Safe to call from several threads. Cost: P N^2 multiplications and
  /// additions.
  [[nodiscard]] HomeVector home_vector(std::span<const float> home,
                                       std::span<const float> current) const;

 private:
  void require_row(std::span<const float> row) const;

  int columns_;
  double spacing_;
  std::vector<Position> positions_;
  std::vector<std::uint16_t> table_;
};

}  // namespace panonav::lab
