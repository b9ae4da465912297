#include "panonav_simulation/internal/solids.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <string>
#include <unordered_map>

namespace panonav::simulation {

namespace {

// Position of a corner in steps of 0.1 mm, and its object: corners with the same key are one.
struct CornerKey {
  std::int64_t x = 0;
  std::int64_t y = 0;
  std::int64_t z = 0;
  std::size_t object = 0;
  friend bool operator==(const CornerKey&, const CornerKey&) = default;
};

struct HashCorner {
  std::size_t operator()(const CornerKey& key) const noexcept {
    std::uint64_t hash = key.object;
    for (const std::int64_t value : {key.x, key.y, key.z}) {
      hash = (hash ^ static_cast<std::uint64_t>(value)) * 0x9E3779B97F4A7C15ULL;
      hash ^= hash >> 29U;
    }
    return hash;
  }
};

CornerKey make_key(const Vector3& v, std::size_t object) {
  constexpr double steps_per_m = 1e4;
  return {std::llround(v.x_m * steps_per_m), std::llround(v.y_m * steps_per_m),
          std::llround(v.z_m * steps_per_m), object};
}

// Sets of corners that are connected, by union and find.
class ConnectedCorners {
 public:
  explicit ConnectedCorners(std::size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), std::size_t{0});
  }
  std::size_t find(std::size_t corner) {
    while (parents_[corner] != corner) {
      parents_[corner] = parents_[parents_[corner]];
      corner = parents_[corner];
    }
    return corner;
  }
  void connect(std::size_t a, std::size_t b) { parents_[find(a)] = find(b); }

 private:
  std::vector<std::size_t> parents_;
};

Vector3 difference(const Vector3& a, const Vector3& b) {
  return {a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m};
}
double dot(const Vector3& a, const Vector3& b) {
  return a.x_m * b.x_m + a.y_m * b.y_m + a.z_m * b.z_m;
}
double length(const Vector3& a) {
  return std::sqrt(dot(a, a));
}

// Returns half the signed solid angle of a triangle with the corners a, b, c seen from the origin
// [Van Oosterom and Strackee 1983, eq. 8].
double half_solid_angle(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 cross{b.y_m * c.z_m - b.z_m * c.y_m, b.z_m * c.x_m - b.x_m * c.z_m,
                      b.x_m * c.y_m - b.y_m * c.x_m};
  const double la = length(a);
  const double lb = length(b);
  const double lc = length(c);
  return std::atan2(dot(a, cross), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

}  // namespace

bool Solids::Box::contains(const Vector3& point) const {
  return point.x_m >= low.x_m && point.x_m <= high.x_m && point.y_m >= low.y_m &&
         point.y_m <= high.y_m && point.z_m >= low.z_m && point.z_m <= high.z_m;
}

Solids::Solids(const Scene& scene) : scene_(scene) {
  std::map<std::string, std::size_t> object_numbers;
  std::unordered_map<CornerKey, std::size_t, HashCorner> corner_numbers;
  std::vector<std::vector<std::size_t>> corners;  // number of each vertex of each mesh
  for (const Mesh& mesh : scene.meshes) {
    const std::size_t object =
        object_numbers.try_emplace(mesh.object, object_numbers.size()).first->second;
    auto& numbers = corners.emplace_back();
    numbers.reserve(mesh.vertices.size());
    for (const Vector3& vertex : mesh.vertices) {
      numbers.push_back(corner_numbers.try_emplace(make_key(vertex, object), corner_numbers.size())
                            .first->second);
    }
  }
  ConnectedCorners connected(corner_numbers.size());
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    for (const auto& t : scene.meshes[m].triangles) {
      connected.connect(corners[m][t[0]], corners[m][t[1]]);
      connected.connect(corners[m][t[0]], corners[m][t[2]]);
    }
  }
  std::unordered_map<std::size_t, std::size_t> surface_numbers;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    const Mesh& mesh = scene.meshes[m];
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& triangle = mesh.triangles[i];
      const auto [number, is_new] =
          surface_numbers.try_emplace(connected.find(corners[m][triangle[0]]), surfaces_.size());
      if (is_new) {
        const Vector3& first = mesh.vertices[triangle[0]];
        surfaces_.push_back({{first, first}, {}});
      }
      Surface& surface = surfaces_[number->second];
      surface.triangles.push_back({static_cast<std::uint32_t>(m), static_cast<std::uint32_t>(i)});
      for (const std::uint32_t vertex : triangle) {
        const Vector3& v = mesh.vertices[vertex];
        Vector3& low = surface.box.low;
        Vector3& high = surface.box.high;
        low = {std::min(low.x_m, v.x_m), std::min(low.y_m, v.y_m), std::min(low.z_m, v.z_m)};
        high = {std::max(high.x_m, v.x_m), std::max(high.y_m, v.y_m), std::max(high.z_m, v.z_m)};
      }
    }
  }
}

double Solids::winding_number(const Surface& surface, const Vector3& point) const {
  double sum = 0.0;
  for (const auto& [m, i] : surface.triangles) {
    const Mesh& mesh = scene_.meshes[m];
    const auto& t = mesh.triangles[i];
    sum += half_solid_angle(difference(mesh.vertices[t[0]], point),
                            difference(mesh.vertices[t[1]], point),
                            difference(mesh.vertices[t[2]], point));
  }
  return sum / (2.0 * std::numbers::pi);
}

bool Solids::contains_everything(std::size_t surface) const {
  const Box& box = surfaces_.at(surface).box;
  return std::ranges::all_of(surfaces_, [&](const Surface& other) {
    return box.contains(other.box.low) && box.contains(other.box.high);
  });
}

std::size_t Solids::count_around(const Vector3& point) const {
  std::vector<Box> bodies;
  std::vector<Box> hollows;
  for (const Surface& surface : surfaces_) {
    if (!surface.box.contains(point)) continue;
    const double winding = winding_number(surface, point);
    if (winding > 0.5) bodies.push_back(surface.box);
    if (winding < -0.5) hollows.push_back(surface.box);
  }
  for (const Box& hollow : hollows) {
    const auto around = std::ranges::find_if(bodies, [&](const Box& body) {
      return body.contains(hollow.low) && body.contains(hollow.high);
    });
    if (around != bodies.end()) bodies.erase(around);
  }
  return bodies.size();
}

}  // namespace panonav::simulation
