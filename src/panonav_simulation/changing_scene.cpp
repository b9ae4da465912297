#include "panonav_simulation/changing_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "panonav/core/text.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav::simulation {

namespace {

bool is_building_part(std::string name) {
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name.find("wall") != std::string::npos || name.find("floor") != std::string::npos ||
         name.find("ground") != std::string::npos;
}

struct Extent {
  double low_m[3] = {1e30, 1e30, 1e30};
  double high_m[3] = {-1e30, -1e30, -1e30};
  void add(const Vector3& v) {
    const double values[3] = {v.x_m, v.y_m, v.z_m};
    for (int i = 0; i < 3; ++i) {
      low_m[i] = std::min(low_m[i], values[i]);
      high_m[i] = std::max(high_m[i], values[i]);
    }
  }
  [[nodiscard]] double size_m(int i) const { return high_m[i] - low_m[i]; }
};

bool is_movable(const Extent& extent) {
  const auto fits = [](double width_m) { return width_m >= 0.05 && width_m <= 4.0; };
  return fits(extent.size_m(0)) && fits(extent.size_m(1)) && extent.low_m[2] < 0.3 &&
         extent.high_m[2] > 0.1 && extent.high_m[2] <= 3.0;
}

}  // namespace

ChangingScene::ChangingScene(Scene scene, std::uint64_t seed)
    : scene_(std::move(scene)), random_(seed, 13) {
  Extent all;
  for (const Mesh& mesh : scene_.meshes) {
    for (const Vector3& v : mesh.vertices) all.add(v);
  }
  floor_area_ = {scene_.floor_low, scene_.floor_high};
  scene_extent_ = {{all.low_m[0], all.low_m[1]}, {all.high_m[0], all.high_m[1]}};
  std::map<std::string, std::vector<std::size_t>> meshes_by_object;
  for (std::size_t i = 0; i < scene_.meshes.size(); ++i) {
    meshes_by_object[scene_.meshes[i].object].push_back(i);
  }
  for (auto& [name, meshes] : meshes_by_object) {
    if (name.empty() || is_building_part(name)) continue;
    Extent extent;
    for (const std::size_t i : meshes) {
      for (const Vector3& v : scene_.meshes[i].vertices) extent.add(v);
    }
    if (!is_movable(extent)) continue;
    const Point2 centre{0.5 * (extent.low_m[0] + extent.high_m[0]),
                        0.5 * (extent.low_m[1] + extent.high_m[1])};
    objects_.push_back({std::move(meshes), centre,
                        0.5 * std::max(extent.size_m(0), extent.size_m(1)), centre, 0.0});
  }
}

std::size_t ChangingScene::moved() const noexcept {
  return static_cast<std::size_t>(std::ranges::count_if(
      objects_, [](const Object& object) { return object.centre != object.first_centre; }));
}

bool ChangingScene::is_valid_position(const Object& object, Point2 centre) const {
  const double r = object.radius_m;
  // In built-in scenes furniture is around the drivable floor areas, so the whole extent of the
  // scene is allowed.
  const FloorArea& room = scene_.drivable.empty() ? floor_area_ : scene_extent_;
  if (distance_to_area_m(room, centre) > distance_to_area_m(room, object.centre)) return false;
  // An object that already overlaps a drivable area may move, but not farther into the area.
  for (const FloorArea& area : scene_.drivable) {
    if (distance_to_area_m(area, centre) < std::min(r, distance_to_area_m(area, object.centre)))
      return false;
  }
  for (const Point2 corner : scene_.tour) {
    if (distance(corner, centre) < r + 1.5 * scene_.robot_radius_m) return false;
  }
  return true;
}

void ChangingScene::simulate_day(double share) {
  for (Object& object : objects_) {
    // Draw the same random numbers for every object, so that its motion does not depend on other
    // objects.
    const bool moves = random_.uniform() < share;
    bool placed = false;
    for (int attempt = 0; attempt < 40; ++attempt) {
      const double angle = random_.uniform(-std::numbers::pi, std::numbers::pi);
      const double step = random_.uniform(1.5, 4.0) * scene_.robot_radius_m;
      const double turn = random_.uniform(-0.6, 0.6);
      if (!moves || placed) continue;
      const Point2 centre{object.centre.x_m + step * std::cos(angle),
                          object.centre.y_m + step * std::sin(angle)};
      if (!is_valid_position(object, centre)) continue;
      object.centre = centre;
      object.turn_rad += turn;
      placed = true;
    }
  }
}

Scene ChangingScene::scene(double light) const {
  Scene now = scene_;
  for (const Object& object : objects_) {
    const double c = std::cos(object.turn_rad);
    const double s = std::sin(object.turn_rad);
    for (const std::size_t i : object.meshes) {
      for (Vector3& v : now.meshes[i].vertices) {
        const double x_m = v.x_m - object.first_centre.x_m;
        const double y_m = v.y_m - object.first_centre.y_m;
        v.x_m = object.centre.x_m + c * x_m - s * y_m;
        v.y_m = object.centre.y_m + s * x_m + c * y_m;
      }
    }
  }
  scale_light(now, light);
  return now;
}

}  // namespace panonav::simulation
