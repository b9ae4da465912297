#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "panonav/camera/camera.hpp"

namespace panonav {

/// The table that `Unwarper` computes once: positions and weights of the pixels, in repeatedly
/// halved images, that make up each value.
struct UnwarpTable {
  /// A part of the image after as many halvings as its index in `levels`. Level 0 is the image
  /// itself.
  struct Level {
    // The part that is computed by halving the previous level; right and bottom are exclusive.
    int left = 0,                   ///< in pixels of this level
        top = 0,                    ///< in pixels of this level
        right = 0,                  ///< one beyond the last column
        bottom = 0;                 ///< one beyond the last row
    std::size_t halved_offset = 0;  ///< offset in the buffer of halved images
    // The part of the level that taps read; empty where right <= left.
    int pair_left = 0,             ///< in pixels of this level
        pair_top = 0,              ///< in pixels of this level
        pair_right = 0,            ///< one beyond the last column
        pair_bottom = 0;           ///< one beyond the last row
    std::size_t pairs_offset = 0;  ///< offset in the buffer of pairs

    /// True if any tap reads this level.
    [[nodiscard]] bool has_pairs() const { return pair_right > pair_left; }
  };
  /// Taps of one row, the same number for every column: tap t of column c is entry first_entry + t
  /// * columns + c.
  struct Row {
    int taps_per_value = 1;       ///< number of taps whose mean each value of the row is, >= 1
    std::size_t first_entry = 0;  ///< of `positions` and `weights`
  };

  /// Levels from the image itself up to the coarsest one that a tap reads.
  std::vector<Level> levels;
  std::size_t halved_size = 0;           ///< bytes of all halved images
  std::size_t pairs_size = 0;            ///< pairs of all levels, 16 bit each
  std::vector<Row> rows;                 ///< from the highest elevation to the lowest
  std::vector<std::uint32_t> positions;  ///< for kernels::remap
  std::vector<std::uint32_t> weights;    ///< for kernels::remap, one for each position
  std::vector<std::uint8_t> visible;     ///< row-major, 1 if the camera sees that direction, else 0
};

/// Makes the table for any camera that is not equirectangular. Throws ContractError if the camera
/// sees nothing of the band.
[[nodiscard]] UnwarpTable make_unwarp_table(const Camera& camera, int rows, int columns,
                                            const ElevationBand& band);

}  // namespace panonav
