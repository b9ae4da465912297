#include "panonav_simulation/internal/heightmap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace panonav::simulation {

Mesh make_heightmap_mesh(const GreyLevels& image, const Vector3& size_m) {
  const int columns = std::min(image.width, max_heightmap_side);
  const int rows = std::min(image.height, max_heightmap_side);
  const std::uint16_t largest = *std::ranges::max_element(image.values);
  const double metres_per_level = largest == 0 ? 0.0 : std::abs(size_m.z_m) / largest;
  Mesh mesh;
  mesh.vertices.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (int j = 0; j < rows; ++j) {
    const double south = static_cast<double>(j) / (rows - 1);
    const auto v = static_cast<std::size_t>(std::lround(south * (image.height - 1)));
    for (int i = 0; i < columns; ++i) {
      const double east = static_cast<double>(i) / (columns - 1);
      const auto u = static_cast<std::size_t>(std::lround(east * (image.width - 1)));
      const double height_m =
          metres_per_level * image.values[v * static_cast<std::size_t>(image.width) + u];
      mesh.vertices.push_back({size_m.x_m * (east - 0.5), size_m.y_m * (0.5 - south),
                               size_m.z_m < 0.0 ? 1.0 - height_m : height_m});
    }
  }
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i + 1 < columns; ++i) {
      const auto north_west = static_cast<std::uint32_t>(j * columns + i);
      const std::uint32_t south_west = north_west + static_cast<std::uint32_t>(columns);
      mesh.triangles.push_back({north_west, south_west, south_west + 1});
      mesh.triangles.push_back({north_west, south_west + 1, north_west + 1});
    }
  }
  return mesh;
}

std::vector<Mesh> split_at_heights(const Mesh& terrain, std::span<const double> borders_m,
                                   std::span<const double> tiles_m) {
  constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
  std::vector<Mesh> ranges(tiles_m.size());
  std::vector<std::vector<std::uint32_t>> new_indices(
      ranges.size(), std::vector<std::uint32_t>(terrain.vertices.size(), unused));
  for (const auto& triangle : terrain.triangles) {
    double middle_m = 0.0;
    for (const std::uint32_t vertex : triangle) middle_m += terrain.vertices[vertex].z_m / 3.0;
    const auto range =
        static_cast<std::size_t>(std::ranges::upper_bound(borders_m, middle_m) - borders_m.begin());
    Mesh& mesh = ranges[range];
    auto& added = mesh.triangles.emplace_back();
    for (std::size_t corner = 0; corner < triangle.size(); ++corner) {
      std::uint32_t& index = new_indices[range][triangle[corner]];
      if (index == unused) {
        index = static_cast<std::uint32_t>(mesh.vertices.size());
        const Vector3& vertex = terrain.vertices[triangle[corner]];
        mesh.vertices.push_back(vertex);
        mesh.texture_coordinates.push_back({static_cast<float>(vertex.x_m / tiles_m[range]),
                                            static_cast<float>(vertex.y_m / tiles_m[range])});
      }
      added[corner] = index;
    }
  }
  return ranges;
}

}  // namespace panonav::simulation
