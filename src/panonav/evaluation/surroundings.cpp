#include "panonav/evaluation/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

namespace panonav {

namespace {

constexpr double kSectorRad = 2.0 * std::numbers::pi / shape_directions;

}  // namespace

std::size_t sector_of(double azimuth_rad) {
  const auto steps = std::lround(azimuth_rad / kSectorRad);
  constexpr long count = shape_directions;
  return static_cast<std::size_t>(((steps % count) + count) % count);
}

Surroundings surroundings_of(const PlaceRecording& place, Point2 position) {
  constexpr std::size_t kRays = 120;
  constexpr std::array kHeightsM{0.3, 0.6, 0.9};
  Surroundings result;
  Directional nearness{};
  Directional rays{};
  Directional shift{};
  for (std::size_t ray = 0; ray < kRays; ++ray) {
    const double azimuth = 2.0 * std::numbers::pi * static_cast<double>(ray) / kRays;
    for (const double height : kHeightsM) {
      const double free_m = place.renderer->distance_along({position.x_m, position.y_m, height},
                                                           Direction3::from_angles(azimuth, 0.0));
      const double near = std::isfinite(free_m) ? 1.0 / std::max(free_m, 0.01) : 0.0;
      const std::size_t sector = sector_of(azimuth);
      nearness[sector] += near;
      rays[sector] += 1.0;
      for (std::size_t direction = 0; direction < shape_directions; ++direction) {
        const double theta = kSectorRad * static_cast<double>(direction);
        shift[direction] += std::abs(std::sin(azimuth - theta)) * near;
      }
    }
  }
  for (std::size_t i = 0; i < shape_directions; ++i) {
    // Nothing all around, as outdoors: farther than any room.
    constexpr double kFarM = 1000.0;
    result.free_m[i] = nearness[i] > 0.0 ? rays[i] / nearness[i] : kFarM;
    result.parallax_m[i] =
        shift[i] > 0.0 ? static_cast<double>(kRays * kHeightsM.size()) / shift[i] : kFarM;
  }
  return result;
}

std::vector<MapLayer> furniture_layers(const Scene& scene) {
  struct Box {
    Vector3 low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                std::numeric_limits<double>::infinity()};
    Vector3 high{-low.x_m, -low.y_m, -low.z_m};
  };
  std::map<std::string, Box> boxes;
  for (const Mesh& mesh : scene.meshes) {
    Box& box = boxes[mesh.object];
    for (const Vector3& v : mesh.vertices) {
      box.low = {std::min(box.low.x_m, v.x_m), std::min(box.low.y_m, v.y_m),
                 std::min(box.low.z_m, v.z_m)};
      box.high = {std::max(box.high.x_m, v.x_m), std::max(box.high.y_m, v.y_m),
                  std::max(box.high.z_m, v.z_m)};
    }
  }
  MapLayer lower{.label = "lower than the camera", .colour = "#e69f00"};
  MapLayer higher{.label = "higher", .colour = "#5b3a00"};
  for (const auto& [name, box] : boxes) {
    const double width = box.high.x_m - box.low.x_m;
    const double depth = box.high.y_m - box.low.y_m;
    // Furniture stands on the floor and is neither flat nor as large as the room.
    const bool stands = box.low.z_m < 0.1 && box.high.z_m > 0.2;
    if (!stands || std::min(width, depth) < 0.1 || std::max(width, depth) > 4.0) continue;
    MapLayer& layer = box.high.z_m < scene.camera_height_m ? lower : higher;
    layer.filled_polygons.push_back({{box.low.x_m, box.low.y_m},
                                     {box.high.x_m, box.low.y_m},
                                     {box.high.x_m, box.high.y_m},
                                     {box.low.x_m, box.high.y_m}});
  }
  return {lower, higher};
}

}  // namespace panonav
