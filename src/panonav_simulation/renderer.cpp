#include "panonav_simulation/renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav_simulation/internal/light.hpp"
#include "panonav_simulation/internal/ray_tracer.hpp"
#include "panonav_simulation/internal/texture_sampler.hpp"
#include "panonav_simulation/mirror.hpp"

namespace panonav::simulation {

namespace {

constexpr float housing_brightness = 0.02F;
constexpr float body_brightness = 0.05F;
constexpr float lens_brightness = 0.01F;

// Position and rotation of the robot in the scene, precomputed to create many rays.
class RayFactory {
 public:
  RayFactory(const Viewpoint& viewpoint, const Renderer& renderer)
      : at_{viewpoint.pose.x_m, viewpoint.pose.y_m,
            renderer.ground_height_m(viewpoint.pose.position()) + viewpoint.height_m},
        x_(scene_from_robot(viewpoint, {1.0, 0.0, 0.0})),
        y_(scene_from_robot(viewpoint, {0.0, 1.0, 0.0})),
        z_(scene_from_robot(viewpoint, {0.0, 0.0, 1.0})) {}

  [[nodiscard]] Ray operator()(const Direction3& direction) const {
    const Direction3 d = rotate_to_scene(direction.x, direction.y, direction.z);
    return {to_floats(at_.x_m, at_.y_m, at_.z_m), to_floats(d.x, d.y, d.z)};
  }
  [[nodiscard]] Ray operator()(const Vector3& from_viewpoint, const Direction3& direction) const {
    const Direction3 o =
        rotate_to_scene(from_viewpoint.x_m, from_viewpoint.y_m, from_viewpoint.z_m);
    const Direction3 d = rotate_to_scene(direction.x, direction.y, direction.z);
    return {to_floats(at_.x_m + o.x, at_.y_m + o.y, at_.z_m + o.z), to_floats(d.x, d.y, d.z)};
  }

 private:
  static std::array<float, 3> to_floats(double x, double y, double z) {
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  }
  [[nodiscard]] Direction3 rotate_to_scene(double x, double y, double z) const {
    return {x * x_.x + y * y_.x + z * z_.x, x * x_.y + y * y_.y + z * z_.y,
            x * x_.z + y * y_.z + z * z_.z};
  }
  Vector3 at_;
  Direction3 x_, y_, z_;
};

void validate(const Viewpoint& viewpoint) {
  require(std::abs(viewpoint.pose.x_m) <= scene_reach_m, "x_m", viewpoint.pose.x_m, "-1e9 .. 1e9");
  require(std::abs(viewpoint.pose.y_m) <= scene_reach_m, "y_m", viewpoint.pose.y_m, "-1e9 .. 1e9");
  require(std::isfinite(viewpoint.pose.heading_rad), "heading_rad", viewpoint.pose.heading_rad,
          "finite");
  require(std::abs(viewpoint.height_m) <= scene_reach_m, "height_m", viewpoint.height_m,
          "-1e9 .. 1e9");
  require(std::isfinite(viewpoint.roll_rad), "roll_rad", viewpoint.roll_rad, "finite");
  require(std::isfinite(viewpoint.pitch_rad), "pitch_rad", viewpoint.pitch_rad, "finite");
}

constexpr int max_rays_per_axis = 8;

void require_rays(int rays_per_axis) {
  require(rays_per_axis >= 1 && rays_per_axis <= max_rays_per_axis, "rays_per_axis", rays_per_axis,
          "1 .. 8");
}

LitTriangles validate_and_subdivide(const Scene& scene) {
  validate(scene);
  return subdivide(scene, light_spacing_m(scene));
}

// Position of ray (i, j) of n x n in its pixel: a regular grid, sheared both ways so that all n^2
// rays differ in u and in v.
struct SubPixel {
  double u, v;
};
SubPixel sub_pixel(int i, int j, int n) {
  return {(i + (j + 0.5) / n) / n, (j + (i + 0.5) / n) / n};
}

float to_grey(const float* value, int channels) {
  return channels == 1 ? value[0] : 0.299F * value[0] + 0.587F * value[1] + 0.114F * value[2];
}

}  // namespace

struct Renderer::Implementation {
  Implementation(const Scene& scene, const RendererOptions& options, Executor& executor)
      : channels(options.channels),
        background(scene.background),
        ground(scene.ground),
        lit(validate_and_subdivide(scene)),
        tracer(lit.vertices, lit.indices, options.instructions) {
    bake_light(scene, tracer, options.shadows, light_spacing_m(scene), lit, executor);
    for (const Material& material : scene.materials) materials.emplace_back(material, channels);
    if (channels == 1) background[0] = to_grey(background.data(), 3);
  }

  void shade(const Ray& ray, const RayHit& hit, float spread_rad, float* colour) const {
    if (hit.triangle == RayHit::no_triangle) {
      std::copy_n(background.data(), channels, colour);
      return;
    }
    const LitTriangles::Triangle& triangle = lit.triangles[hit.triangle];
    const MaterialSampler& material = materials[static_cast<std::size_t>(triangle.material)];
    const float w = 1.0F - hit.u - hit.v;
    const float facing = triangle.normal[0] * ray.direction[0] +
                         triangle.normal[1] * ray.direction[1] +
                         triangle.normal[2] * ray.direction[2];
    if (material.textured()) {
      const auto& uv = triangle.uv;
      // The footprint of a pixel on a slanted surface is an ellipse; the square root is a
      // compromise between blur along its short axis and aliasing along its long axis.
      const float slant = 1.0F / std::sqrt(std::max(std::fabs(facing), 0.02F));
      const float footprint = spread_rad * hit.distance_m * slant * triangle.texture_density;
      material.sample(w * uv[0][0] + hit.u * uv[1][0] + hit.v * uv[2][0],
                      w * uv[0][1] + hit.u * uv[1][1] + hit.v * uv[2][1], footprint, colour);
    } else {
      material.sample(0.0F, 0.0F, 0.0F, colour);
    }
    const auto& corners = triangle.light[facing <= 0.0F ? 0 : 1];
    const float light = w * corners[0] + hit.u * corners[1] + hit.v * corners[2];
    const float emission = material.emission();
    const float factor = emission + (1.0F - emission) * light;
    for (int c = 0; c < channels; ++c) colour[c] *= factor;
  }

  // Adds the colours of the rays to the pixels; each `rays_per_pixel` consecutive rays belong to
  // one pixel.
  void shade(std::span<const Ray> rays, std::span<const RayHit> hits, float spread_rad,
             float weight, std::size_t rays_per_pixel, float* values) const {
    std::array<float, 3> colour{};
    for (std::size_t i = 0; i < rays.size(); ++i) {
      shade(rays[i], hits[i], spread_rad, colour.data());
      float* pixel = values + i / rays_per_pixel * static_cast<std::size_t>(channels);
      for (int c = 0; c < channels; ++c) pixel[c] += weight * colour[static_cast<std::size_t>(c)];
    }
  }

  int channels;
  std::array<float, 3> background;
  std::shared_ptr<const Ground> ground;
  LitTriangles lit;
  RayTracer tracer;
  std::vector<MaterialSampler> materials;
};

Renderer::Renderer(const Scene& scene, const RendererOptions& options, Executor& executor) {
  require(options.channels == 1 || options.channels == 3, "channels", options.channels, "1 or 3");
  implementation_ = std::make_unique<Implementation>(scene, options, executor);
}

Renderer::Renderer(const Scene& scene, const RendererOptions& options) {
  Executor here(1);
  *this = Renderer(scene, options, here);
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

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

namespace {

// Returns a ray whose direction is normalised to unit length.
Ray unit_ray(const Vector3& origin, const Direction3& direction) {
  if (!is_in_reach(origin)) {
    throw ContractError("origin", "not finite or too far", "coordinates of -1e9 .. 1e9 m");
  }
  const double length = std::hypot(direction.x, direction.y, direction.z);
  require(length > 0.0 && std::isfinite(length), "length of the direction", length,
          "> 0 and finite");
  const auto component = [length](double value) { return static_cast<float>(value / length); };
  return {{static_cast<float>(origin.x_m), static_cast<float>(origin.y_m),
           static_cast<float>(origin.z_m)},
          {component(direction.x), component(direction.y), component(direction.z)}};
}

}  // namespace

float Renderer::radiance_along(const Vector3& origin, const Direction3& direction,
                               double spread_rad) const {
  const Ray ray = unit_ray(origin, direction);
  std::array<float, 3> colour{};
  implementation_->shade(ray, implementation_->tracer.first_hit(ray),
                         static_cast<float>(spread_rad), colour.data());
  return std::clamp(to_grey(colour.data(), implementation_->channels), 0.0F, 1.0F);
}

double Renderer::ground_height_m(Point2 position) const noexcept {
  const Ground* const ground = implementation_->ground.get();
  return ground != nullptr ? ground->height_m(position) : 0.0;
}

double Renderer::distance_along(const Vector3& origin, const Direction3& direction) const {
  const RayHit hit = implementation_->tracer.first_hit(unit_ray(origin, direction));
  if (hit.triangle == RayHit::no_triangle) return std::numeric_limits<double>::infinity();
  return hit.distance_m;
}

Panorama Renderer::render_panorama(const Viewpoint& viewpoint, const PanoramaRendering& rendering,
                                   Executor& executor) const {
  validate(viewpoint);
  require_rays(rendering.rays_per_axis);
  if (rendering.unwarper != nullptr) {
    throw ContractError("unwarper", "set", "empty in a panorama that is rendered directly");
  }
  Panorama panorama(rendering.rows, rendering.columns, rendering.elevations);
  const int n = rendering.rays_per_axis;
  const auto channels = static_cast<std::size_t>(implementation_->channels);
  const auto columns = static_cast<std::size_t>(rendering.columns);
  const std::size_t rays_per_row = columns * static_cast<std::size_t>(n);
  const double column_rad = 2.0 * std::numbers::pi / rendering.columns;
  const double row_rad =
      (rendering.elevations.top_rad - rendering.elevations.bottom_rad) / rendering.rows;
  const auto spread_rad = static_cast<float>(std::sqrt(column_rad * row_rad) / n);
  const float weight = 1.0F / static_cast<float>(n * n);
  // Horizontal directions of all rays of a row of pixels, which are the same for every row.
  std::vector<std::array<double, 2>> azimuths(rays_per_row * static_cast<std::size_t>(n));
  for (int j = 0; j < n; ++j) {
    for (std::size_t ray = 0; ray < rays_per_row; ++ray) {
      const int i = static_cast<int>(ray) % n;
      const double column = static_cast<double>(ray / static_cast<std::size_t>(n));
      const double azimuth = (column + sub_pixel(i, j, n).u - 0.5) * column_rad;
      azimuths[static_cast<std::size_t>(j) * rays_per_row + ray] = {std::cos(azimuth),
                                                                    std::sin(azimuth)};
    }
  }
  const RayFactory make_ray(viewpoint, *this);
  const auto out = panorama.values();
  const auto draw_rows = [&](std::size_t begin, std::size_t end, std::size_t) {
    std::vector<Ray> rays(rays_per_row);
    std::vector<RayHit> hits(rays_per_row);
    std::vector<float> row(columns * channels);
    for (std::size_t y = begin; y < end; ++y) {
      std::fill(row.begin(), row.end(), 0.0F);
      for (int j = 0; j < n; ++j) {
        std::array<std::array<double, 2>, max_rays_per_axis> elevations{};
        for (int i = 0; i < n; ++i) {
          const double elevation = rendering.elevations.top_rad -
                                   (static_cast<double>(y) + sub_pixel(i, j, n).v) * row_rad;
          elevations[static_cast<std::size_t>(i)] = {std::cos(elevation), std::sin(elevation)};
        }
        const auto* const line = azimuths.data() + static_cast<std::size_t>(j) * rays_per_row;
        for (std::size_t ray = 0; ray < rays_per_row; ++ray) {
          const auto& [flat, up] = elevations[ray % static_cast<std::size_t>(n)];
          rays[ray] = make_ray({flat * line[ray][0], flat * line[ray][1], up});
        }
        implementation_->tracer.trace(rays, hits);
        implementation_->shade(rays, hits, spread_rad, weight, static_cast<std::size_t>(n),
                               row.data());
      }
      for (std::size_t c = 0; c < columns; ++c) {
        out[y * columns + c] =
            std::clamp(to_grey(row.data() + c * channels, implementation_->channels), 0.0F, 1.0F);
      }
    }
  };
  executor.for_each_chunk(static_cast<std::size_t>(rendering.rows), 4, draw_rows);
  return panorama;
}

namespace {

// Computes the rays through image points, by the lenses or the mirror.
class CameraRays {
 public:
  // A ray in the robot's frame, from the viewpoint of the camera.
  struct RobotRay {
    Vector3 origin;
    Direction3 direction;
  };
  // Target of a pixel: a ray into the scene, or a part of the camera with this brightness. Both are
  // nullopt outside the image circle.
  struct PixelTarget {
    std::optional<RobotRay> ray;
    std::optional<float> body;
  };

  explicit CameraRays(const Camera& camera)
      : camera_(camera), dual_(std::get_if<DualFisheyeModel>(&camera.model)) {
    if (std::holds_alternative<HyperboloidalModel>(camera.model)) mirror_.emplace(camera);
    for (std::size_t i = 0; dual_ && i < 2; ++i) {
      const double half_m = 0.5 * dual_->baseline_m;
      const Direction3 axis =
          FisheyeLens::Rotation(dual_->lenses[i]).robot_from_lens({1.0, 0.0, 0.0});
      viewpoints_[i] = {half_m * axis.x, half_m * axis.y, half_m * axis.z};
    }
  }

  [[nodiscard]] PixelTarget find_pixel_target(const PixelPoint& point) const {
    if (mirror_) {
      const MirrorRay ray = mirror_->trace(point);
      if (ray.target == MirrorTarget::world) return {RobotRay{ray.origin, ray.direction}, {}};
      const bool housing = ray.target == MirrorTarget::housing;
      return {{},
              housing                 ? housing_brightness
              : ray.body_radius < 0.3 ? lens_brightness
                                      : body_brightness};
    }
    const auto direction = unproject(camera_, point);
    if (!direction) return {};
    const Vector3 origin = dual_ ? viewpoints_[lens_at(camera_, point)] : Vector3{};
    return {RobotRay{origin, *direction}, {}};
  }

  // Returns the gain of the lens to which a column belongs.
  [[nodiscard]] float gain(std::size_t column) const {
    if (!dual_) return 1.0F;
    return static_cast<float>(
        dual_->lenses[lens_at(camera_, {static_cast<double>(column), 0.0})].gain);
  }

  // Returns the approximate angle between neighbouring pixels. One value serves for the whole
  // image, because the angle varies little. For a mirror it is the angle at two thirds of the rim
  // radius, which is near the horizon; for a rig that in the middle of its first camera.
  [[nodiscard]] double pixel_rad() const {
    if (const auto* rig = std::get_if<RigModel>(&camera_.model)) {
      return 1.0 / std::get<PinholeModel>(rig->cameras.front().model).focal_length_px;
    }
    const bool flat = std::holds_alternative<EquirectangularModel>(camera_.model);
    const double around_px = flat    ? camera_.image_size.width
                             : dual_ ? 2.0 * std::numbers::pi * dual_->lenses[0].focal_length_px
                                     : 2.0 * std::numbers::pi * camera_.rim_radius_px * 2.0 / 3.0;
    return 2.0 * std::numbers::pi / around_px;
  }

 private:
  const Camera& camera_;
  const DualFisheyeModel* dual_;
  std::optional<HyperboloidalMirror> mirror_;
  std::array<Vector3, 2> viewpoints_{};  // of the lenses, in the robot's frame
};

}  // namespace

Radiance Renderer::render_image(const Viewpoint& viewpoint, const Camera& camera, int rays_per_axis,
                                Executor& executor) const {
  validate(viewpoint);
  panonav::validate(camera);
  require_rays(rays_per_axis);
  const CameraRays camera_rays(camera);
  const RayFactory make_ray(viewpoint, *this);
  const int n = rays_per_axis;
  const auto channels = static_cast<std::size_t>(implementation_->channels);
  const auto width = static_cast<std::size_t>(camera.image_size.width);
  Radiance image{camera.image_size.width, camera.image_size.height, implementation_->channels, {}};
  image.values.resize(width * static_cast<std::size_t>(image.height) * channels);
  const float weight = 1.0F / static_cast<float>(n * n);
  const auto spread_rad = static_cast<float>(camera_rays.pixel_rad() / n);

  const auto draw_rows = [&](std::size_t begin, std::size_t end, std::size_t) {
    std::vector<Ray> rays;
    std::vector<std::size_t> pixel_of;
    std::vector<RayHit> hits;
    std::array<float, 3> colour{};
    const auto add = [&](std::size_t pixel, const float* values) {
      const float share = weight * camera_rays.gain(pixel % width);
      for (std::size_t c = 0; c < channels; ++c) {
        image.values[pixel * channels + c] += share * values[c];
      }
    };
    for (std::size_t line = begin * n; line < end * n; ++line) {
      rays.clear();
      pixel_of.clear();
      for (std::size_t i = 0; i < width * n; ++i) {
        const SubPixel at = sub_pixel(static_cast<int>(i % n), static_cast<int>(line % n), n);
        const std::size_t pixel = line / n * width + i / n;
        const auto seen = camera_rays.find_pixel_target(
            {static_cast<double>(i / n) + at.u, static_cast<double>(line / n) + at.v});
        if (seen.ray) {
          rays.push_back(make_ray(seen.ray->origin, seen.ray->direction));
          pixel_of.push_back(pixel);
        } else if (seen.body) {
          colour.fill(*seen.body);
          add(pixel, colour.data());
        }
      }
      hits.resize(rays.size());
      implementation_->tracer.trace(rays, hits);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        implementation_->shade(rays[i], hits[i], spread_rad, colour.data());
        add(pixel_of[i], colour.data());
      }
    }
  };
  executor.for_each_chunk(static_cast<std::size_t>(image.height), 8, draw_rows);
  return image;
}

PixelRays::PixelRays(const Camera& camera, std::span<const std::uint32_t> pixels, int rays_per_axis)
    : image_size_(camera.image_size), pixels_(pixels.begin(), pixels.end()) {
  panonav::validate(camera);
  require_rays(rays_per_axis);
  const CameraRays camera_rays(camera);
  const int n = rays_per_axis;
  const auto width = static_cast<std::uint32_t>(image_size_.width);
  spread_rad_ = static_cast<float>(camera_rays.pixel_rad() / n);
  const auto to_floats = [](double x, double y, double z) {
    return std::array{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  };
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    const std::uint32_t u = pixels_[i] % width;
    const std::uint32_t v = pixels_[i] / width;
    require(v < static_cast<std::uint32_t>(image_size_.height), "pixel", pixels_[i],
            "an offset within the image");
    float body = 0.0F;
    for (int ray = 0; ray < n * n; ++ray) {
      const SubPixel at = sub_pixel(ray % n, ray / n, n);
      const auto seen = camera_rays.find_pixel_target({u + at.u, v + at.v});
      body += seen.body.value_or(0.0F);
      if (!seen.ray) continue;
      const auto& [origin, direction] = *seen.ray;
      rays_.push_back({to_floats(origin.x_m, origin.y_m, origin.z_m),
                       to_floats(direction.x, direction.y, direction.z),
                       static_cast<std::uint32_t>(i)});
    }
    gains_.push_back(camera_rays.gain(u) / static_cast<float>(n * n));
    bodies_.push_back(gains_.back() * body);
  }
}

Radiance Renderer::render_image(const Viewpoint& viewpoint, const PixelRays& pixel_rays,
                                Executor& executor) const {
  validate(viewpoint);
  const RayFactory make_ray(viewpoint, *this);
  const auto channels = static_cast<std::size_t>(implementation_->channels);
  const ImageSize size = pixel_rays.image_size_;
  Radiance image{size.width, size.height, implementation_->channels, {}};
  image.values.resize(channels * static_cast<std::size_t>(size.width) * size.height);
  for (std::size_t i = 0; i < pixel_rays.pixels_.size(); ++i) {
    std::fill_n(
        image.values.begin() + static_cast<std::ptrdiff_t>(pixel_rays.pixels_[i] * channels),
        channels, pixel_rays.bodies_[i]);
  }
  // Chunks end between pixels, so that no two threads add to one.
  const std::vector<PixelRays::PixelRay>& all = pixel_rays.rays_;
  const auto find_first_ray = [&](std::size_t index) {
    return static_cast<std::size_t>(
        std::ranges::lower_bound(all, index, {}, &PixelRays::PixelRay::pixel) - all.begin());
  };
  const auto draw = [&](std::size_t begin, std::size_t end, std::size_t) {
    const std::span part =
        std::span(all).subspan(find_first_ray(begin), find_first_ray(end) - find_first_ray(begin));
    std::vector<Ray> rays;
    rays.reserve(part.size());
    for (const PixelRays::PixelRay& ray : part) {
      const auto& [ox, oy, oz] = ray.origin;
      const auto& [dx, dy, dz] = ray.direction;
      rays.push_back(make_ray(Vector3{ox, oy, oz}, Direction3{dx, dy, dz}));
    }
    std::vector<RayHit> hits(rays.size());
    implementation_->tracer.trace(rays, hits);
    std::array<float, 3> colour{};
    for (std::size_t i = 0; i < part.size(); ++i) {
      implementation_->shade(rays[i], hits[i], pixel_rays.spread_rad_, colour.data());
      const std::uint32_t index = part[i].pixel;
      float* const values = image.values.data() + pixel_rays.pixels_[index] * channels;
      for (std::size_t c = 0; c < channels; ++c) values[c] += pixel_rays.gains_[index] * colour[c];
    }
  };
  executor.for_each_chunk(pixel_rays.pixels_.size(), 4096, draw);
  return image;
}

Image to_image(const Radiance& radiance) {
  Image image(radiance.width, radiance.height, radiance.channels);
  for (std::size_t i = 0; i < radiance.values.size(); ++i) {
    const float value = std::clamp(radiance.values[i], 0.0F, 1.0F);
    image.pixels()[i] = static_cast<std::uint8_t>(255.0F * value + 0.5F);
  }
  return image;
}

}  // namespace panonav::simulation
