#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Computes the components of bands of rows: the means of magnitude * (cosine, sine of the phase)
/// over nearly equal numbers of `used_rows`, half of it for component 0; real[16 * k + b] of band
/// b. `magnitudes`, `phases`: packed, index k * rows + row. All instruction sets give the same
/// bits. Throws ContractError unless 1 <= bands <= 16, bands <= used rows, all used rows exist and
/// the sizes of the spans fit.
void average_bands(std::span<const std::uint8_t> magnitudes, std::span<const std::uint8_t> phases,
                   std::size_t rows, std::span<const std::uint32_t> used_rows, int bands,
                   std::span<float> real, std::span<float> imaginary, Instructions instructions);

/// Computes the components of bands of a blurred view: sums over all rows, weighted by
/// weights[16 * row + b] and damping[k]. Otherwise as `average_bands`; also throws unless there are
/// weights for all rows and dampings for all components.
void blur_bands(std::span<const std::uint8_t> magnitudes, std::span<const std::uint8_t> phases,
                std::span<const float> weights, std::span<const float> damping,
                std::span<float> real, std::span<float> imaginary, Instructions instructions);

/// Computes the brightness of `waves.bands` bands at 128 azimuths: view[b][c] = sum over k of
/// real[k][b] cos(2 pi k c / 128) - imaginary[k][b] sin(2 pi k c / 128). Even and odd components
/// are added up separately. `view` has 16 rows of `profile_view_stride` values, of which the first
/// 128 are written. All instruction sets give the same bits. Throws ContractError on another size
/// of `view`, or more than 16 bands.
void reconstruct_bands(const BandWaves& waves, std::span<float> view, Instructions instructions);

/// Subtracts from each of the 128 columns of a view its mean over the first `bands` rows. All
/// instruction sets give the same bits. Throws ContractError like `reconstruct_bands`.
void subtract_column_means(std::span<float> view, int bands, Instructions instructions);

/// Converts a view to bytes: divides each column by its contrast (`ColumnContrast`), multiplies by
/// `steps` and adds 128. `values` has 16 rows of 128 bytes, of which the first `bands` are written.
/// Returns false, without writing any byte, if the view has no contrast. All instruction sets give
/// the same bytes. Throws ContractError like `reconstruct_bands`, and on another size of `values`.
[[nodiscard]] bool quantise_columns(std::span<const float> view, int bands,
                                    const ColumnContrast& contrast, std::span<std::uint8_t> values,
                                    Instructions instructions);

}  // namespace panonav::kernels
