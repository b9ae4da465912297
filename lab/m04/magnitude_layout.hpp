#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/dissimilarity_curve.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::lab {

/// Arranges views by the springs between all n (n - 1) / 2 pairs, as published [M04 eq. 4, 5]: rest
/// lengths and stiffnesses are those of `curve`. Classical scaling of the rest lengths is the
/// start; stress majorisation minimises the energy. The layout may be mirrored. `dissimilarities`:
/// symmetric, n values a row. Throws ContractError unless there are at least 3 views and n * n
/// values.
[[nodiscard]] std::vector<Point2> arrange_by_all_pairs(std::size_t views,
                                                       std::span<const double> dissimilarities,
                                                       const DissimilarityCurve& curve);

/// Arranges views by their magnitudes alone: a Gaussian process latent variable model (Lawrence
/// 2005), the positions at which the magnitudes of all views are most probable, if the covariance
/// of two views falls with their distance. Its scale, length, shape and noise are learnt from the
/// same views. Square roots of magnitudes are compared, whose changes depend less on the contrast
/// of near things. The most probable result from several starts is returned; it may be mirrored,
/// and its unit is arbitrary. Cost: n^3 for each of some thousand steps. Throws ContractError
/// unless there are at least 3 views of one shape, not all equal. Same bits on any number of
/// threads.
[[nodiscard]] std::vector<Point2> arrange_by_magnitudes(std::span<const FourierSignature> views,
                                                        Executor& executor);

}  // namespace panonav::lab
