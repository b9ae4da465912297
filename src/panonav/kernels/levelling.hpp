#pragma once

#include <span>

#include "panonav/kernels/dispatch.hpp"

// Levelling of tilted panoramas, row by row. All instruction sets give the same bits.

namespace panonav::kernels {

/// Computes where a tilted panorama shows directions of one elevation: their rows, and the
/// differences of their columns from those in the level panorama, at most half a turn. `cosines`,
/// `sines`: of the azimuth of each direction. Exact to the last bits of a double before the
/// conversion to floats. Throws ContractError unless all spans have one size.
void tilted_positions(const TiltedDirections& directions, std::span<const double> cosines,
                      std::span<const double> sines, std::span<float> rows,
                      std::span<float> columns, Instructions instructions);

/// Samples one row of a level panorama: value c is that of `seen` at row `rows[c]` (clamped to
/// those it has) and column c + shifts[c], linearly between four values. Throws ContractError
/// unless all spans have one size, of which `seen` has a multiple. The caller guarantees shifts of
/// at most half a row, and fewer than 2^22 columns.
void sample_tilted_row(std::span<const float> seen, std::span<const float> rows,
                       std::span<const float> shifts, std::span<float> values,
                       Instructions instructions);

}  // namespace panonav::kernels
