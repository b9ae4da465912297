#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/route/route_panorama.hpp"

namespace panonav {

/// Packs the lines `first` .. `first + count` of a route and their poses without loss
/// (docs/formats.md, route_blocks), as differences from a prediction. It predicts a line from the
/// previous one, rotated with the robot, and from the line's own columns so far.
[[nodiscard]] std::vector<std::uint8_t> pack_route_lines(const RoutePanorama& route,
                                                         std::size_t first, std::size_t count);

/// Largest number of bytes that one packed byte can give, so that the size of a file limits the
/// memory it needs. Images of real places stay far below.
inline constexpr std::size_t max_compression_ratio = 100;

/// Unpacks `count` lines of `pack_route_lines` and appends them to the route. Returns false if the
/// bytes are not valid; the route may then have some of the lines.
[[nodiscard]] bool unpack_route_lines(std::span<const std::uint8_t> bytes, std::size_t count,
                                      RoutePanorama& route);

}  // namespace panonav
