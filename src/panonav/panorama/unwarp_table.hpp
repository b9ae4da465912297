#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "panonav/camera/camera.hpp"

namespace panonav {

/// What `Unwarper` computes once: which pixels of which halved image each value is made of.
struct UnwarpTable {
  /// A part of the image halved `level` times (its place in `levels`). Level 0 is the image itself.
  struct Level {
    // The part that is computed by halving the level before; the end is one beyond the last.
    int left = 0, top = 0, right = 0, bottom = 0;
    std::size_t halved_at = 0;  ///< in the buffer of halved images
    // The part of it that taps look up; empty where right <= left.
    int pair_left = 0, pair_top = 0, pair_right = 0, pair_bottom = 0;
    std::size_t pairs_at = 0;  ///< in the buffer of pairs

    [[nodiscard]] bool has_pairs() const { return pair_right > pair_left; }
  };
  /// Each row has the same number of taps for all its columns: entry t * columns + c of its part of
  /// the table.
  struct Row {
    int taps = 1;
    std::size_t first_entry = 0;
  };

  std::vector<Level> levels;
  std::size_t halved_size = 0;  ///< bytes of all halved images
  std::size_t pairs_size = 0;
  std::vector<Row> rows;
  std::vector<std::uint32_t> positions;  ///< for kernels::remap
  std::vector<std::uint32_t> weights;
  std::vector<std::uint8_t> seen;  ///< row-major, 0: the camera does not see that direction
};

/// For all cameras but equirectangular ones. Throws ContractError when nothing of the band is seen.
[[nodiscard]] UnwarpTable make_unwarp_table(const Camera& camera, int rows, int columns,
                                            const ElevationBand& band);

}  // namespace panonav
