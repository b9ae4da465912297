#pragma once

#include <cstddef>
#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::lab {

/// Returns the number of products that `compute_rotation_products` writes per row: `columns`
/// rounded up to a multiple of 16.
[[nodiscard]] std::size_t rotation_products_stride(std::size_t columns) noexcept;

/// Correlates many rows with one row at all turns:
///   products[r * stride + t] = sum_i rows[r * columns + i] * periodic[t + i], t = 0 .. stride - 1,
/// and writes the largest of each row. `periodic` holds columns + stride values, value i + columns
/// the same as value i: turns from `columns` on repeat the first ones. Rounding: a few units of
/// 1e-7 times the sum of the absolute terms. Throws ContractError on other sizes. Cost: rows *
/// columns * stride multiplications and additions, in registers of `instructions`; the baseline
/// is as fast as this machine allows, so the comparison of run times is fair.
void compute_rotation_products(std::span<const float> rows, std::size_t columns,
                               std::span<const float> periodic, std::span<float> products,
                               std::span<float> largest,
                               kernels::Instructions instructions = kernels::chosen_instructions());

}  // namespace panonav::lab
