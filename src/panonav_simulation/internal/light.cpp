#include "panonav_simulation/internal/light.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

namespace panonav::simulation {

namespace {

using Float3 = std::array<float, 3>;

Float3 operator-(const Float3& a, const Float3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Float3 operator+(const Float3& a, const Float3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Float3 operator*(float s, const Float3& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
float dot(const Float3& a, const Float3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Float3 cross(const Float3& a, const Float3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
float length(const Float3& a) {
  return std::sqrt(dot(a, a));
}

struct Corner {
  Float3 position;
  std::array<float, 2> uv;
};
using Corners = std::array<Corner, 3>;

Corner compute_middle(const Corner& a, const Corner& b) {
  return {0.5F * (a.position + b.position),
          {0.5F * (a.uv[0] + b.uv[0]), 0.5F * (a.uv[1] + b.uv[1])}};
}

// Spacing of the points at which light is computed: `spacing_m` on the floor, and an eighth of the
// distance from it if that is larger.
class LightSpacing {
 public:
  LightSpacing(const Scene& scene, double spacing_m)
      : low_{static_cast<float>(scene.floor_low.x_m), static_cast<float>(scene.floor_low.y_m)},
        high_{static_cast<float>(scene.floor_high.x_m), static_cast<float>(scene.floor_high.y_m)},
        spacing_m_(static_cast<float>(spacing_m)) {}

  [[nodiscard]] float at(const Float3& point) const {
    const float dx = std::max({low_[0] - point[0], 0.0F, point[0] - high_[0]});
    const float dy = std::max({low_[1] - point[1], 0.0F, point[1] - high_[1]});
    return std::max(spacing_m_, 0.125F * std::hypot(dx, dy));
  }

 private:
  std::array<float, 2> low_, high_;
  float spacing_m_;
};

// Halves the longest side of a triangle until all sides are at most as long as the spacing.
void split_triangle(const Corners& corners, const LightSpacing& spacing,
                    std::vector<Corners>& out) {
  std::vector<Corners> stack{corners};
  while (!stack.empty()) {
    const Corners t = stack.back();
    stack.pop_back();
    std::size_t side = 0;
    float side_length = 0.0F;
    for (std::size_t i = 0; i < 3; ++i) {
      const float l = length(t[(i + 1) % 3].position - t[i].position);
      if (l > side_length) {
        side_length = l;
        side = i;
      }
    }
    const Float3 centre = (1.0F / 3.0F) * (t[0].position + t[1].position + t[2].position);
    if (side_length <= spacing.at(centre)) {
      out.push_back(t);
      continue;
    }
    const Corner m = compute_middle(t[side], t[(side + 1) % 3]);
    const Corner& opposite = t[(side + 2) % 3];
    stack.push_back({m, t[(side + 1) % 3], opposite});
    stack.push_back({t[side], m, opposite});
  }
}

// Largest distance, in spacings, at which an obstacle darkens a surface.
constexpr double occlusion_spacings = 5.0;

// A point a little above one side of a surface, where light is computed.
struct LightPoint {
  Float3 position;
  Float3 normal;
  Float3 centre_offset_sum{};  ///< sum of vectors to the centres of adjacent triangles
  float triangle_count = 0.0F;
  float light = 0.0F;
};

struct PointKey {
  std::array<std::int32_t, 6> cells{};
  bool operator==(const PointKey&) const = default;
};
struct PointKeyHash {
  std::size_t operator()(const PointKey& key) const {
    std::uint64_t hash = 0xcbf29ce484222325ULL;
    for (const std::int32_t cell : key.cells) {
      hash = (hash ^ static_cast<std::uint32_t>(cell)) * 0x100000001b3ULL;
      hash ^= hash >> 29U;
    }
    return hash;
  }
};

// Returns the key of a point. Points in the same cell, a tenth of the spacing wide, on surfaces of
// the same direction share their light.
PointKey make_key(const Float3& position, const Float3& normal, float spacing_m) {
  PointKey key;
  for (int i = 0; i < 3; ++i) {
    key.cells[i] = static_cast<std::int32_t>(std::lround(position[i] * 10.0F / spacing_m));
    key.cells[3 + i] = static_cast<std::int32_t>(std::lround(normal[i] * 10.0F));
  }
  return key;
}

// Returns directions of a hemisphere about z with cosine-weighted density, so that each has the
// same weight for ambient light.
std::vector<Float3> make_hemisphere_directions(int count) {
  std::vector<Float3> directions;
  for (int i = 0; i < count; ++i) {
    const double r2 = (i + 0.5) / count;
    const double angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));  // golden angle
    const double r = std::sqrt(r2);
    directions.push_back({static_cast<float>(r * std::cos(angle)),
                          static_cast<float>(r * std::sin(angle)),
                          static_cast<float>(std::sqrt(1.0 - r2))});
  }
  return directions;
}

class LightProbe {
 public:
  LightProbe(const Scene& scene, const RayTracer& tracer, const LitTriangles& lit, bool shadows,
             double spacing_m)
      : scene_(scene),
        tracer_(tracer),
        lit_(lit),
        shadows_(shadows),
        reach_m_(static_cast<float>(occlusion_spacings * spacing_m)),
        spacing_(scene, spacing_m),
        directions_(make_hemisphere_directions(24)) {}

  [[nodiscard]] float light_at(const Float3& surface, const Float3& normal) const {
    // Lift the point above pictures that hang close to their wall, which must not shadow it.
    const float surface_offset_m = 0.08F * spacing_.at(surface);
    const Float3 position = surface + surface_offset_m * normal;
    float sum = scene_.ambient * compute_openness(position, normal);
    for (const PointLight& lamp : scene_.lights) {
      const Float3 to_lamp =
          Float3{static_cast<float>(lamp.position.x_m), static_cast<float>(lamp.position.y_m),
                 static_cast<float>(lamp.position.z_m)} -
          position;
      const float distance = std::max(length(to_lamp), 1e-6F);
      const Float3 direction = (1.0F / distance) * to_lamp;
      const float strength = lamp.intensity / (distance * distance + lamp.radius_m * lamp.radius_m);
      sum += strength * visible_cosine(position, normal, direction, 0.97F * distance);
    }
    for (const DirectionalLight& light : scene_.directional_lights) {
      const Float3 towards{static_cast<float>(light.towards_light.x),
                           static_cast<float>(light.towards_light.y),
                           static_cast<float>(light.towards_light.z)};
      sum += light.intensity *
             visible_cosine(position, normal, (1.0F / length(towards)) * towards, 1e6F);
    }
    return sum;
  }

 private:
  [[nodiscard]] float visible_cosine(const Float3& position, const Float3& normal,
                                     const Float3& direction, float distance_m) const {
    const float cosine = dot(normal, direction);
    if (cosine <= 0.0F) return 0.0F;
    if (shadows_ && !is_unblocked({position, direction}, distance_m)) return 0.0F;
    return cosine;
  }

  // True if only lamps and skies, which cast no shadows, are within the distance along the ray.
  [[nodiscard]] bool is_unblocked(Ray ray, float distance_m) const {
    for (int surfaces = 0; surfaces < 4; ++surfaces) {
      const RayHit hit = tracer_.first_hit(ray);
      if (hit.triangle == RayHit::no_triangle || hit.distance_m >= distance_m) return true;
      if (emission_of(hit) < 0.5F) return false;
      const float step = hit.distance_m + 1e-3F * reach_m_;
      ray.origin = ray.origin + step * ray.direction;
      distance_m -= step;
    }
    return false;
  }

  [[nodiscard]] float emission_of(const RayHit& hit) const {
    return scene_.materials[lit_.triangles[hit.triangle].material].emission;
  }

  [[nodiscard]] float compute_openness(const Float3& position, const Float3& normal) const {
    if (!shadows_) return 1.0F;
    const Float3 helper = std::fabs(normal[2]) < 0.9F ? Float3{0, 0, 1} : Float3{1, 0, 0};
    Float3 tangent = cross(helper, normal);
    tangent = (1.0F / length(tangent)) * tangent;
    const Float3 bitangent = cross(normal, tangent);
    float sum = 0.0F;
    for (const Float3& d : directions_) {
      const Float3 direction = d[0] * tangent + d[1] * bitangent + d[2] * normal;
      const RayHit hit = tracer_.first_hit({position, direction});
      const bool open = hit.triangle == RayHit::no_triangle || hit.distance_m >= reach_m_ ||
                        emission_of(hit) > 0.5F;
      sum += open ? 1.0F : hit.distance_m / reach_m_;
    }
    return sum / static_cast<float>(directions_.size());
  }

  const Scene& scene_;
  const RayTracer& tracer_;
  const LitTriangles& lit_;
  bool shadows_;
  float reach_m_;
  LightSpacing spacing_;
  std::vector<Float3> directions_;
};

}  // namespace

double light_spacing_m(const Scene& scene) {
  const double diagonal_m = distance(scene.floor_low, scene.floor_high);
  // A street of hundreds of metres would take minutes at the spacing of a hall.
  return std::max(std::clamp(diagonal_m / 25.0, 0.03, 1.0), diagonal_m / 200.0);
}

LitTriangles subdivide(const Scene& scene, double spacing_m) {
  LitTriangles lit;
  const LightSpacing spacing(scene, spacing_m);
  std::vector<Corners> pieces;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    const Mesh& mesh = scene.meshes[m];
    const bool is_emissive = scene.materials[mesh.material].emission >= 1.0F;
    for (const auto& index : mesh.triangles) {
      Corners corners;
      for (int i = 0; i < 3; ++i) {
        const Vector3& p = mesh.vertices[index[i]];
        corners[i].position = {static_cast<float>(p.x_m), static_cast<float>(p.y_m),
                               static_cast<float>(p.z_m)};
        corners[i].uv = mesh.texture_coordinates.empty() ? std::array<float, 2>{}
                                                         : mesh.texture_coordinates[index[i]];
      }
      const Float3 e1 = corners[1].position - corners[0].position;
      const Float3 e2 = corners[2].position - corners[0].position;
      const Float3 normal = cross(e1, e2);
      const float area = length(normal);
      if (!(area > 1e-12F)) continue;
      LitTriangles::Triangle triangle;
      triangle.normal = (1.0F / area) * normal;
      triangle.material = mesh.material;
      triangle.mesh = static_cast<int>(m);
      const float uv_area =
          std::fabs((corners[1].uv[0] - corners[0].uv[0]) * (corners[2].uv[1] - corners[0].uv[1]) -
                    (corners[2].uv[0] - corners[0].uv[0]) * (corners[1].uv[1] - corners[0].uv[1]));
      triangle.texture_density = std::sqrt(uv_area / area);
      pieces.clear();
      if (is_emissive) {
        pieces.push_back(corners);
      } else {
        split_triangle(corners, spacing, pieces);
      }
      for (const Corners& piece : pieces) {
        const auto first = static_cast<std::uint32_t>(lit.vertices.size());
        for (int i = 0; i < 3; ++i) {
          lit.vertices.push_back(piece[i].position);
          triangle.uv[i] = piece[i].uv;
        }
        lit.indices.push_back({first, first + 1, first + 2});
        lit.triangles.push_back(triangle);
      }
    }
  }
  return lit;
}

void bake_light(const Scene& scene, const RayTracer& tracer, bool shadows, double spacing_m,
                LitTriangles& lit, Executor& executor) {
  const LightSpacing spacing(scene, spacing_m);
  std::vector<LightPoint> points;
  std::unordered_map<PointKey, std::uint32_t, PointKeyHash> known;
  std::vector<std::array<std::uint32_t, 6>> points_of(lit.triangles.size());
  const auto point_index = [&](const Float3& position, const Float3& normal) {
    const auto [entry, fresh] = known.try_emplace(make_key(position, normal, spacing.at(position)),
                                                  static_cast<std::uint32_t>(points.size()));
    if (fresh) points.push_back({position, normal});
    return entry->second;
  };
  const auto add_triangle_centre = [&](std::uint32_t index, const Float3& centre) {
    LightPoint& point = points[index];
    point.centre_offset_sum = point.centre_offset_sum + (centre - point.position);
    point.triangle_count += 1.0F;
  };
  for (std::size_t t = 0; t < lit.triangles.size(); ++t) {
    if (scene.materials[lit.triangles[t].material].emission >= 1.0F) continue;
    const Float3& normal = lit.triangles[t].normal;
    const auto& index = lit.indices[t];
    const Float3 centre =
        (1.0F / 3.0F) * (lit.vertices[index[0]] + lit.vertices[index[1]] + lit.vertices[index[2]]);
    for (int i = 0; i < 3; ++i) {
      const Float3& corner = lit.vertices[lit.indices[t][i]];
      points_of[t][i] = point_index(corner, normal);
      points_of[t][3 + i] = point_index(corner, -1.0F * normal);
      add_triangle_centre(points_of[t][i], centre);
      add_triangle_centre(points_of[t][3 + i], centre);
    }
  }
  const LightProbe probe(scene, tracer, lit, shadows, spacing_m);
  executor.for_each_chunk(points.size(), 256, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      // A point on the border of a surface is often inside an adjacent body, where it is dark. Move
      // it by a third of the mean vector to its triangles' centres; within a surface these vectors
      // cancel.
      const LightPoint& point = points[i];
      const Float3 position =
          point.position + (0.33F / point.triangle_count) * point.centre_offset_sum;
      points[i].light = probe.light_at(position, point.normal);
    }
  });
  for (std::size_t t = 0; t < lit.triangles.size(); ++t) {
    if (scene.materials[lit.triangles[t].material].emission >= 1.0F) continue;
    for (int i = 0; i < 3; ++i) {
      lit.triangles[t].light[0][i] = points[points_of[t][i]].light;
      lit.triangles[t].light[1][i] = points[points_of[t][3 + i]].light;
    }
  }
}

}  // namespace panonav::simulation
