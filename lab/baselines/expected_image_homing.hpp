#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav::lab {

/// Homing by expected images (hs_ei, Franz et al. 1998), as [S06 section 2.2] tells it: what the
/// current view, one row of pixels, would look like from P positions around it if all things were
/// equally far [S06 eq. 9, nearest pixels from a table of P x N], compared with the home view at
/// all N turns by whole pixels [S06 eq. 8]. The baseline for Fourier homing: nothing is left out
/// and nothing approximated; only the sum of squared differences is written as energies less twice
/// a correlation, which are computed for blocks of positions and turns at once.
class ExpectedImageHoming {
 public:
  struct Position {
    float xi = 0.0F;
    float eta = 0.0F;
  };

  /// Prepares rows of `columns` pixels, with the positions of the finest square lattice around (0,
  /// 0) that has at most `max_positions` within 2/3 R (200 gives 197): beyond R the image would
  /// fold over. Throws ContractError unless 4 <= columns <= 65536 and 5 <= max_positions <= 10000.
  explicit ExpectedImageHoming(int columns, int max_positions = 200);

  [[nodiscard]] int columns() const noexcept { return columns_; }
  /// Returns the positions in order of their distance from (0, 0).
  [[nodiscard]] std::span<const Position> positions() const noexcept { return positions_; }
  /// Returns the side of a square of the lattice, in units of R.
  [[nodiscard]] double spacing() const noexcept { return spacing_; }

  /// Returns the view from a position: entry i is the pixel of `current` that is seen at pixel i.
  [[nodiscard]] std::span<const std::uint16_t> pixels(std::size_t position) const noexcept {
    return std::span(table_).subspan(position * static_cast<std::size_t>(columns_),
                                     static_cast<std::size_t>(columns_));
  }

  /// Conventions as `panonav::home_vector`. `residual` is the smallest sum of squared differences
  /// over the energy of home and expected view; `confidence` knows the spacing of the positions
  /// only. Of equal differences the position nearest to (0, 0) counts; views without structure give
  /// zeros and residual 1. Throws ContractError unless both rows have `columns` finite values.
  /// Safe to call from several threads. Cost: P N^2 multiplications and additions.
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
