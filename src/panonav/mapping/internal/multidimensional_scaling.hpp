#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Points in the plane whose distances are as near as can be to those given (classical scaling,
/// Torgerson 1952, from landmarks: de Silva & Tenenbaum 2004). `landmarks`: distinct indices below
/// `count`, at least one; `distances`: row-major, one row for each landmark with its distance to
/// all `count` points, finite and >= 0, symmetric among the landmarks up to rounding. With all
/// points as landmarks this is the plain classical scaling. The result is centred on the landmarks
/// and turned so that x is the longest extent; signs are fixed by the points themselves, so the
/// same distances give the same points. It may be a mirror image: distances alone cannot tell. All
/// points coincide when all distances are 0. Throws ContractError. Cost: landmarks^3 + landmarks *
/// count.
[[nodiscard]] std::vector<Point2> multidimensional_scaling(std::span<const std::size_t> landmarks,
                                                           std::size_t count,
                                                           std::span<const double> distances);

}  // namespace panonav
