#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/route/route_panorama.hpp"

namespace panonav {

/// Lines `first` .. `first + count` of a route and their poses as packed bytes, without loss
/// (docs/formats.md, route_blocks): what a line differs by from a guess. The guess knows the line
/// before, rotated with the robot, and the columns of the line itself up to there.
[[nodiscard]] std::vector<std::uint8_t> pack_route_lines(const RoutePanorama& route,
                                                         std::size_t first, std::size_t count);

/// Largest number of bytes to which one packed byte unpacks, so that the size of a file bounds the
/// memory it takes. Images of real places are far below.
inline constexpr std::size_t max_unpacked_for_each_byte = 100;

/// Appends `count` lines that `pack_route_lines` packed. False where `bytes` are anything else; the
/// route may then hold some of them.
[[nodiscard]] bool unpack_route_lines(std::span<const std::uint8_t> bytes, std::size_t count,
                                      RoutePanorama& route);

}  // namespace panonav
