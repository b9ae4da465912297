#include "panonav/simulation/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#if PANONAV_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

// Grey texture in halved copies, finest first, so that a far surface is sampled without aliasing.
class MipTexture {
 public:
  explicit MipTexture(const Image& image, const std::array<float, 3>& colour) {
    Level finest{image.width(), image.height(), {}};
    finest.values.resize(static_cast<std::size_t>(finest.width) * finest.height);
    for (int v = 0; v < finest.height; ++v) {
      for (int u = 0; u < finest.width; ++u) {
        float value = 0.0F;
        for (int c = 0; c < 3; ++c) {
          const int channel = image.channels() == 3 ? c : 0;
          value += kWeights[static_cast<std::size_t>(c)] * colour[static_cast<std::size_t>(c)] *
                   static_cast<float>(image.at(u, v, channel));
        }
        finest.values[static_cast<std::size_t>(v) * finest.width + u] = value / 255.0F;
      }
    }
    levels_.push_back(std::move(finest));
    while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(halved());
  }

  [[nodiscard]] int width() const noexcept { return levels_[0].width; }
  [[nodiscard]] int height() const noexcept { return levels_[0].height; }

  /// Trilinear; `texels` is the width of the footprint in texels of the finest level.
  [[nodiscard]] float sample(float s, float t, float texels) const noexcept {
    const float level =
        std::clamp(std::log2(std::max(texels, 1.0F)), 0.0F, static_cast<float>(levels_.size() - 1));
    const auto below = static_cast<std::size_t>(level);
    const std::size_t above = std::min(below + 1, levels_.size() - 1);
    const float share = level - static_cast<float>(below);
    return (1.0F - share) * bilinear(levels_[below], s, t) + share * bilinear(levels_[above], s, t);
  }

  static constexpr std::array<float, 3> kWeights{0.299F, 0.587F, 0.114F};

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<float> values;
  };

  [[nodiscard]] Level halved() const {
    const Level& fine = levels_.back();
    Level coarse{std::max(1, fine.width / 2), std::max(1, fine.height / 2), {}};
    coarse.values.resize(static_cast<std::size_t>(coarse.width) * coarse.height);
    for (int v = 0; v < coarse.height; ++v) {
      for (int u = 0; u < coarse.width; ++u) {
        float sum = 0.0F;
        for (int j = 0; j < 2; ++j) {
          for (int i = 0; i < 2; ++i) {
            const int uu = std::min(2 * u + i, fine.width - 1);
            const int vv = std::min(2 * v + j, fine.height - 1);
            sum += fine.values[static_cast<std::size_t>(vv) * fine.width + uu];
          }
        }
        coarse.values[static_cast<std::size_t>(v) * coarse.width + u] = 0.25F * sum;
      }
    }
    return coarse;
  }

  static float bilinear(const Level& level, float s, float t) noexcept {
    // (0, 0) is the lower left corner, rows are stored from the top; textures repeat.
    const float u = (s - std::floor(s)) * static_cast<float>(level.width) - 0.5F;
    const float v = (1.0F - (t - std::floor(t))) * static_cast<float>(level.height) - 0.5F;
    const float u_floor = std::floor(u);
    const float v_floor = std::floor(v);
    const auto wrap = [](int i, int n) { return ((i % n) + n) % n; };
    const int u0 = wrap(static_cast<int>(u_floor), level.width);
    const int v0 = wrap(static_cast<int>(v_floor), level.height);
    const int u1 = wrap(u0 + 1, level.width);
    const int v1 = wrap(v0 + 1, level.height);
    const float fu = u - u_floor;
    const float fv = v - v_floor;
    const auto at = [&](int uu, int vv) {
      return level.values[static_cast<std::size_t>(vv) * level.width + uu];
    };
    return (1.0F - fv) * ((1.0F - fu) * at(u0, v0) + fu * at(u1, v0)) +
           fv * ((1.0F - fu) * at(u0, v1) + fu * at(u1, v1));
  }

  std::vector<Level> levels_;
};

struct ShadedMaterial {
  float grey = 0.0F;  ///< of the plain colour
  std::optional<MipTexture> texture;
  float emission = 0.0F;
};

struct ShadedTriangle {
  std::uint32_t material = 0;
  std::array<float, 3> normal{};             ///< unit length
  std::array<std::array<float, 2>, 3> st{};  ///< texture coordinates
  float texels_per_metre = 0.0F;
};

float grey_of(const std::array<float, 3>& colour) {
  float value = 0.0F;
  for (std::size_t c = 0; c < 3; ++c) value += MipTexture::kWeights[c] * colour[c];
  return value;
}

std::array<float, 3> as_floats(const Vector3& v) {
  return {static_cast<float>(v.x_m), static_cast<float>(v.y_m), static_cast<float>(v.z_m)};
}

std::array<float, 3> cross_of(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

float dot_of(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

std::array<float, 3> minus(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

void intersect(RTCScene scene, RTCRayHit& ray) {
#if PANONAV_EMBREE_MAJOR >= 4
  rtcIntersect1(scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray);
#endif
}

RTCRayHit ray_from(const Vector3& origin, const Direction3& direction) {
  RTCRayHit ray{};
  ray.ray.org_x = static_cast<float>(origin.x_m);
  ray.ray.org_y = static_cast<float>(origin.y_m);
  ray.ray.org_z = static_cast<float>(origin.z_m);
  ray.ray.dir_x = static_cast<float>(direction.x);
  ray.ray.dir_y = static_cast<float>(direction.y);
  ray.ray.dir_z = static_cast<float>(direction.z);
  ray.ray.tnear = 0.0F;
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.mask = 0xFFFFFFFFU;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return ray;
}

}  // namespace

struct Renderer::Implementation {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<ShadedMaterial> materials;
  std::vector<ShadedTriangle> triangles;
  std::vector<PointLight> lights;
  std::vector<DirectionalLight> directional_lights;
  float ambient = 0.0F;
  float background = 0.0F;

  Implementation() = default;
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;
  ~Implementation() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  void add_materials(const Scene& from) {
    for (const auto& material : from.materials) {
      ShadedMaterial shaded{grey_of(material.colour), std::nullopt, material.emission};
      if (material.texture) shaded.texture.emplace(*material.texture, material.colour);
      materials.push_back(std::move(shaded));
    }
  }

  // All meshes become one geometry, so that the number of a hit is the index of its triangle.
  void add_triangles(const Scene& from) {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    for (const auto& mesh : from.meshes) {
      const auto base = static_cast<std::uint32_t>(positions.size() / 3);
      for (const auto& vertex : mesh.vertices) {
        for (const float value : as_floats(vertex)) positions.push_back(value);
      }
      for (const auto& triangle : mesh.triangles) {
        ShadedTriangle shaded;
        shaded.material = static_cast<std::uint32_t>(mesh.material);
        const auto a = as_floats(mesh.vertices[triangle[0]]);
        const auto b = as_floats(mesh.vertices[triangle[1]]);
        const auto c = as_floats(mesh.vertices[triangle[2]]);
        const auto normal = cross_of(minus(b, a), minus(c, a));
        const float twice_area = std::sqrt(dot_of(normal, normal));
        if (twice_area > 0.0F) {
          shaded.normal = {normal[0] / twice_area, normal[1] / twice_area, normal[2] / twice_area};
        }
        if (!mesh.texture_coordinates.empty()) {
          for (std::size_t i = 0; i < 3; ++i) {
            shaded.st[i] = mesh.texture_coordinates[triangle[i]];
          }
          const auto& texture = materials[shaded.material].texture;
          if (texture && twice_area > 0.0F) {
            const float s1 = shaded.st[1][0] - shaded.st[0][0];
            const float t1 = shaded.st[1][1] - shaded.st[0][1];
            const float s2 = shaded.st[2][0] - shaded.st[0][0];
            const float t2 = shaded.st[2][1] - shaded.st[0][1];
            const float texels = std::abs(s1 * t2 - s2 * t1) *
                                 static_cast<float>(texture->width()) *
                                 static_cast<float>(texture->height());
            shaded.texels_per_metre = std::sqrt(texels / twice_area);
          }
        }
        triangles.push_back(shaded);
        for (const std::uint32_t index : triangle) indices.push_back(base + index);
      }
    }
    if (triangles.empty()) return;
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertex_buffer = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), positions.size() / 3));
    auto* index_buffer = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), indices.size() / 3));
    if (vertex_buffer == nullptr || index_buffer == nullptr) {
      rtcReleaseGeometry(geometry);
      throw Error("Embree has no memory for the triangles of this scene");
    }
    std::copy(positions.begin(), positions.end(), vertex_buffer);
    std::copy(indices.begin(), indices.end(), index_buffer);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }

  [[nodiscard]] float light_at(const std::array<float, 3>& point,
                               const std::array<float, 3>& normal) const {
    // Light from everywhere is a little weaker on surfaces that look down.
    float light = ambient * (0.85F + 0.15F * normal[2]);
    for (const auto& lamp : lights) {
      const auto towards = minus(as_floats(lamp.position), point);
      const float squared = std::max(dot_of(towards, towards), 1e-4F);
      const float cosine = dot_of(towards, normal) / std::sqrt(squared);
      if (cosine > 0.0F) light += lamp.intensity * cosine / squared;
    }
    for (const auto& sun : directional_lights) {
      const std::array<float, 3> towards{static_cast<float>(sun.towards_light.x),
                                         static_cast<float>(sun.towards_light.y),
                                         static_cast<float>(sun.towards_light.z)};
      const float cosine = dot_of(towards, normal) / std::sqrt(dot_of(towards, towards));
      if (cosine > 0.0F) light += sun.intensity * cosine;
    }
    return light;
  }

  [[nodiscard]] float shade(const RTCRayHit& ray, float spread_rad) const {
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return background;
    const ShadedTriangle& triangle = triangles[ray.hit.primID];
    const ShadedMaterial& material = materials[triangle.material];
    const std::array<float, 3> direction{ray.ray.dir_x, ray.ray.dir_y, ray.ray.dir_z};
    const float facing = dot_of(direction, triangle.normal);
    float albedo = material.grey;
    if (material.texture) {
      const float u = ray.hit.u;
      const float v = ray.hit.v;
      const float w = 1.0F - u - v;
      const float s = w * triangle.st[0][0] + u * triangle.st[1][0] + v * triangle.st[2][0];
      const float t = w * triangle.st[0][1] + u * triangle.st[1][1] + v * triangle.st[2][1];
      // A slanted surface shows more of itself in one direction; the square root is a compromise
      // between blur across and aliasing along it.
      const float slant = 1.0F / std::sqrt(std::max(std::abs(facing), 0.05F));
      const float texels = spread_rad * ray.ray.tfar * slant * triangle.texels_per_metre;
      albedo = material.texture->sample(s, t, texels);
    }
    std::array<float, 3> normal = triangle.normal;
    if (facing > 0.0F) normal = {-normal[0], -normal[1], -normal[2]};
    const std::array<float, 3> point{ray.ray.org_x + ray.ray.tfar * direction[0],
                                     ray.ray.org_y + ray.ray.tfar * direction[1],
                                     ray.ray.org_z + ray.ray.tfar * direction[2]};
    const float light = (1.0F - material.emission) * light_at(point, normal) + material.emission;
    return std::clamp(albedo * light, 0.0F, 1.0F);
  }
};

Renderer::Renderer(const Scene& scene, const RendererOptions& options)
    : implementation_(std::make_unique<Implementation>()) {
  validate(scene);
  // One thread for building: the caller's executor is the only source of threads.
  std::string configuration = "threads=1,set_affinity=0";
  if (!options.instructions.empty()) configuration += ",isa=" + options.instructions;
  implementation_->device = rtcNewDevice(configuration.c_str());
  if (implementation_->device == nullptr) {
    throw Error("Embree cannot start with the instruction set '" + options.instructions + "'");
  }
  implementation_->scene = rtcNewScene(implementation_->device);
  rtcSetSceneFlags(implementation_->scene, RTC_SCENE_FLAG_ROBUST);
  implementation_->lights = scene.lights;
  implementation_->directional_lights = scene.directional_lights;
  implementation_->ambient = scene.ambient;
  implementation_->background = grey_of(scene.background);
  implementation_->add_materials(scene);
  implementation_->add_triangles(scene);
  rtcCommitScene(implementation_->scene);
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

float Renderer::radiance_along(const Vector3& origin, const Direction3& direction,
                               double spread_rad) const {
  RTCRayHit ray = ray_from(origin, direction);
  intersect(implementation_->scene, ray);
  return implementation_->shade(ray, static_cast<float>(spread_rad));
}

double Renderer::distance_along(const Vector3& origin, const Direction3& direction) const {
  RTCRayHit ray = ray_from(origin, direction);
  intersect(implementation_->scene, ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::numeric_limits<double>::infinity();
  return static_cast<double>(ray.ray.tfar) *
         std::sqrt(direction.x * direction.x + direction.y * direction.y +
                   direction.z * direction.z);
}

Direction3 scene_from_robot(const Viewpoint& viewpoint, const Direction3& in_robot) {
  // Roll about x, then pitch about y, then heading about z.
  const double cr = std::cos(viewpoint.roll_rad);
  const double sr = std::sin(viewpoint.roll_rad);
  const double cp = std::cos(viewpoint.pitch_rad);
  const double sp = std::sin(viewpoint.pitch_rad);
  const double ch = std::cos(viewpoint.pose.heading_rad);
  const double sh = std::sin(viewpoint.pose.heading_rad);
  const double y1 = cr * in_robot.y - sr * in_robot.z;
  const double z1 = sr * in_robot.y + cr * in_robot.z;
  const double x2 = cp * in_robot.x + sp * z1;
  const double z2 = -sp * in_robot.x + cp * z1;
  return {ch * x2 - sh * y1, sh * x2 + ch * y1, z2};
}

float Renderer::radiance(const Viewpoint& viewpoint, const Direction3& direction,
                         double spread_rad) const {
  return radiance_along({viewpoint.pose.x_m, viewpoint.pose.y_m, viewpoint.height_m},
                        scene_from_robot(viewpoint, direction), spread_rad);
}

Panorama Renderer::render_panorama(const Viewpoint& viewpoint, const PanoramaRendering& rendering,
                                   Executor& executor) const {
  require(rendering.rays_per_axis >= 1 && rendering.rays_per_axis <= 8, "rays_per_axis",
          rendering.rays_per_axis, "1 .. 8");
  Panorama panorama(rendering.rows, rendering.columns, rendering.elevations);
  const int n = rendering.rays_per_axis;
  const double column_rad = 2.0 * std::numbers::pi / rendering.columns;
  const double row_rad =
      (rendering.elevations.top_rad - rendering.elevations.bottom_rad) / rendering.rows;
  const double spread_rad = std::max(column_rad, row_rad) / n;
  const auto values = panorama.values();
  executor.for_chunks(
      static_cast<std::size_t>(rendering.rows), 4,
      [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t y = begin; y < end; ++y) {
          for (int c = 0; c < rendering.columns; ++c) {
            float sum = 0.0F;
            for (int j = 0; j < n; ++j) {
              const double elevation =
                  rendering.elevations.top_rad - (static_cast<double>(y) + (j + 0.5) / n) * row_rad;
              for (int i = 0; i < n; ++i) {
                const double azimuth = (c + (i + 0.5) / n - 0.5) * column_rad;
                sum += radiance(viewpoint, Direction3::from_angles(azimuth, elevation), spread_rad);
              }
            }
            values[y * static_cast<std::size_t>(rendering.columns) + static_cast<std::size_t>(c)] =
                sum / static_cast<float>(n * n);
          }
        }
      });
  return panorama;
}

}  // namespace panonav
