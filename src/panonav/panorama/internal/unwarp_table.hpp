#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "panonav/camera/camera.hpp"

namespace panonav {

/// The table that `Unwarper` computes once: the pixels of halved images that make each value.
struct UnwarpTable {
  /// A part of the image halved `level` times (its place in `levels`). Level 0 is the image itself.
  struct Level {
    // The part that is computed by halving the level before; the end is one beyond the last.
    int left = 0,               ///< in pixels of this level
        top = 0,                ///< in pixels of this level
        right = 0,              ///< one beyond the last column
        bottom = 0;             ///< one beyond the last row
    std::size_t halved_at = 0;  ///< in the buffer of halved images
    // The part of the level that taps read; empty where right <= left.
    int pair_left = 0,         ///< in pixels of this level
        pair_top = 0,          ///< in pixels of this level
        pair_right = 0,        ///< one beyond the last column
        pair_bottom = 0;       ///< one beyond the last row
    std::size_t pairs_at = 0;  ///< in the buffer of pairs

    /// True if any tap reads this level.
    [[nodiscard]] bool has_pairs() const { return pair_right > pair_left; }
  };
  /// Each row has the same number of taps for all its columns: entry t * columns + c of its part of
  /// the table.
  struct Row {
    int taps = 1;  ///< places of the image that each value of the row is the mean of, >= 1
    std::size_t first_entry = 0;  ///< of `positions` and `weights`
  };

  /// Levels that some tap needs, directly or through the next one.
  std::vector<Level> levels;
  std::size_t halved_size = 0;           ///< bytes of all halved images
  std::size_t pairs_size = 0;            ///< pairs of all levels, 16 bit each
  std::vector<Row> rows;                 ///< from the highest elevation to the lowest
  std::vector<std::uint32_t> positions;  ///< for kernels::remap
  std::vector<std::uint32_t> weights;    ///< for kernels::remap, one for each position
  std::vector<std::uint8_t> seen;        ///< row-major, 0: the camera does not see that direction
};

/// Makes the table for any camera that is not equirectangular. Throws ContractError if the camera
/// sees nothing of the band.
[[nodiscard]] UnwarpTable make_unwarp_table(const Camera& camera, int rows, int columns,
                                            const ElevationBand& band);

}  // namespace panonav
