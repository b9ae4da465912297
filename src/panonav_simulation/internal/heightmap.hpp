#pragma once

#include <span>
#include <vector>

#include "panonav/io/image_file.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// Largest number of points along a side of a terrain; larger images are reduced to it.
inline constexpr int max_heightmap_side = 1025;

/// Makes the surface of a terrain around the origin from the grey levels of an image, which spans
/// `size_m` in x and y; its first row is at the largest y. As in Gazebo, the largest level of the
/// image (not of its bit depth) has the height `size_m.z_m`, level 0 the height 0; if `size_m.z_m`
/// is negative, heights are 1 m minus those of its absolute value. `image` has at least 2 x 2
/// pixels.
[[nodiscard]] Mesh make_heightmap_mesh(const GreyLevels& image, const Vector3& size_m);

/// Splits a terrain at these ascending heights into one mesh for each range, from the lowest; a
/// triangle belongs to the range of its middle height. The texture of range i repeats every
/// `tiles_m[i]` metres. `tiles_m` has one entry more than `borders_m`. Ranges may be empty.
[[nodiscard]] std::vector<Mesh> split_at_heights(const Mesh& terrain,
                                                 std::span<const double> borders_m,
                                                 std::span<const double> tiles_m);

}  // namespace panonav::simulation
