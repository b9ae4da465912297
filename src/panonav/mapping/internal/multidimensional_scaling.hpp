#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Finds points in the plane that fit these distances best (classical scaling, Torgerson 1952, from
/// landmarks: de Silva & Tenenbaum 2004). `landmarks`: distinct indices below `count`, at least
/// one; `distances`: row-major, one row for each landmark with its distance to all `count` points,
/// finite and >= 0, symmetric among the landmarks up to rounding. With all points as landmarks this
/// is the plain classical scaling. The result is centred on the landmarks with the longest extent
/// along x; signs follow from the points themselves, so the same distances give the same points. It
/// may be a mirror image, which distances cannot distinguish. All points coincide when all
/// distances are 0. Throws ContractError. Cost: landmarks^3 + landmarks * count.
[[nodiscard]] std::vector<Point2> multidimensional_scaling(std::span<const std::size_t> landmarks,
                                                           std::size_t count,
                                                           std::span<const double> distances);

}  // namespace panonav
