#pragma once

// A small world for tests: a room with textured walls, floor, ceiling and boxes, seen by casting
// one ray per pixel. It knows nothing of the library's renderer, so that tests of what robots see
// need none.

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::testing {

/// Waves of several lengths on top of blocks: something at every scale.
class Texture {
 public:
  Texture(Random& random, double contrast)
      : mean_(random.uniform(0.3, 0.7)), block_m_(random.uniform(0.3, 1.2)), contrast_(contrast) {
    const double scale_m = random.uniform(0.5, 1.5);
    for (Wave& wave : waves_) {
      wave = {random.normal(0.0, 1.0 / scale_m), random.normal(0.0, 1.0 / scale_m), random.normal(),
              random.uniform(0.0, 2.0 * std::numbers::pi)};
    }
    for (double& h : hash_) h = random.uniform(0.0, 1000.0);
  }
  [[nodiscard]] double at(double u_m, double v_m) const {
    double sum = 0.0;
    for (const Wave& w : waves_) {
      sum += w.amplitude * std::cos(2.0 * std::numbers::pi * (u_m * w.u + v_m * w.v) + w.phase_rad);
    }
    const double block = std::sin(std::floor(u_m / block_m_) * hash_[0] +
                                  std::floor(v_m / block_m_) * hash_[1] + hash_[2]);
    return mean_ +
           contrast_ * (sum / std::sqrt(0.5 * static_cast<double>(waves_.size())) + 0.7 * block);
  }

 private:
  struct Wave {
    double u = 0.0, v = 0.0, amplitude = 0.0, phase_rad = 0.0;
  };
  std::array<Wave, 12> waves_{};
  std::array<double, 3> hash_{};
  double mean_, block_m_, contrast_;
};

struct RoomKind {
  double width_m = 5.0;
  double depth_m = 4.0;
  int boxes = 4;
  double contrast = 0.15;
};

/// How a picture differs from the ideal one.
struct Disturbance {
  double light = 1.0;            ///< factor
  double noise_deviation = 0.0;  ///< of every pixel, white 1
};

class Room {
 public:
  static constexpr double camera_height_m = 0.6;
  static constexpr double height_m = 2.6;

  Room(std::uint64_t seed, const RoomKind& kind)
      : kind_(kind),
        random_(seed),
        floor_(random_, 0.3 * kind.contrast),
        ceiling_(random_, 0.3 * kind.contrast) {
    const double w = kind.width_m;
    const double d = kind.depth_m;
    const std::array<Point2, 4> corners = {Point2{0, 0}, Point2{w, 0}, Point2{w, d}, Point2{0, d}};
    for (std::size_t i = 0; i < 4; ++i) {
      add_wall(corners[i], corners[(i + 1) % 4], height_m, Texture(random_, kind.contrast));
    }
    for (int i = 0; i < kind.boxes; ++i) {
      const double bw = random_.uniform(0.2, 0.8);
      const double bd = random_.uniform(0.2, 0.8);
      const Point2 low{random_.uniform(0.0, w - bw), random_.uniform(0.0, d - bd)};
      const Point2 high{low.x_m + bw, low.y_m + bd};
      const double top_m = random_.uniform(0.4, 2.0);
      const Texture texture(random_, kind.contrast);
      boxes_.push_back({low, high});
      add_wall(low, {high.x_m, low.y_m}, top_m, texture);
      add_wall({high.x_m, low.y_m}, high, top_m, texture);
      add_wall(high, {low.x_m, high.y_m}, top_m, texture);
      add_wall({low.x_m, high.y_m}, low, top_m, texture);
    }
  }

  [[nodiscard]] bool is_free(Point2 p) const {
    constexpr double margin_m = 0.2;
    for (const Box& b : boxes_) {
      if (p.x_m > b.low.x_m - margin_m && p.x_m < b.high.x_m + margin_m &&
          p.y_m > b.low.y_m - margin_m && p.y_m < b.high.y_m + margin_m) {
        return false;
      }
    }
    return p.x_m > margin_m && p.y_m > margin_m && p.x_m < kind_.width_m - margin_m &&
           p.y_m < kind_.depth_m - margin_m;
  }

  [[nodiscard]] std::vector<Point2> grid(double step_m) const {
    std::vector<Point2> points;
    for (double x = 0.3; x < kind_.width_m; x += step_m) {
      for (double y = 0.3; y < kind_.depth_m; y += step_m) {
        if (is_free({x, y})) points.push_back({x, y});
      }
    }
    return points;
  }

  /// A free pose within half a step of a grid point.
  [[nodiscard]] Pose2 between(const std::vector<Point2>& grid, double step_m,
                              Random& random) const {
    for (;;) {
      const Point2 base = grid[random.index(grid.size())];
      const Point2 p{base.x_m + random.uniform(-0.5, 0.5) * step_m,
                     base.y_m + random.uniform(-0.5, 0.5) * step_m};
      if (is_free(p)) return {p.x_m, p.y_m, random.uniform(-std::numbers::pi, std::numbers::pi)};
    }
  }

  [[nodiscard]] Panorama see(const Pose2& pose, int rows = 16, int columns = 96,
                             const Disturbance& disturbance = {},
                             std::uint64_t noise_seed = 0) const {
    const ElevationBand band{radians(-30.0), radians(40.0)};
    Panorama panorama(rows, columns, band);
    Random noise(noise_seed);
    for (int c = 0; c < columns; ++c) {
      const double azimuth = pose.heading_rad + 2.0 * std::numbers::pi * c / columns;
      const Point2 direction{std::cos(azimuth), std::sin(azimuth)};
      for (int y = 0; y < rows; ++y) {
        const double tangent = std::tan(panorama.elevation_rad(y));
        const double value =
            disturbance.light * colour(pose.position(), direction, tangent) +
            (disturbance.noise_deviation > 0.0 ? disturbance.noise_deviation * noise.normal()
                                               : 0.0);
        panorama.at(y, c) = static_cast<float>(std::min(1.0, std::max(0.0, value)));
      }
    }
    return panorama;
  }

 private:
  struct Wall {
    Point2 from, to;
    double top_m;
    Texture texture;
    double shade;
  };
  struct Box {
    Point2 low, high;
  };

  void add_wall(Point2 from, Point2 to, double top_m, const Texture& texture) {
    walls_.push_back({from, to, top_m, texture,
                      0.75 + 0.25 * std::cos(1.3 * static_cast<double>(walls_.size()))});
  }

  [[nodiscard]] double colour(Point2 eye, Point2 direction, double tangent) const {
    double nearest = std::numeric_limits<double>::infinity();
    double value = 0.0;
    for (const Wall& wall : walls_) {
      const Point2 edge{wall.to.x_m - wall.from.x_m, wall.to.y_m - wall.from.y_m};
      const Point2 offset{wall.from.x_m - eye.x_m, wall.from.y_m - eye.y_m};
      const double cross = direction.x_m * edge.y_m - direction.y_m * edge.x_m;
      if (std::abs(cross) < 1e-12) continue;
      const double range_m = (offset.x_m * edge.y_m - offset.y_m * edge.x_m) / cross;
      const double share = (offset.x_m * direction.y_m - offset.y_m * direction.x_m) / cross;
      const double z_m = camera_height_m + range_m * tangent;
      if (range_m <= 1e-6 || range_m >= nearest || share < 0.0 || share > 1.0 || z_m < 0.0 ||
          z_m > wall.top_m)
        continue;
      nearest = range_m;
      value = wall.shade * wall.texture.at(share * std::hypot(edge.x_m, edge.y_m), z_m);
    }
    if (std::isfinite(nearest)) return value;
    const double range_m = tangent < 0.0 ? -camera_height_m / tangent
                                         : (height_m - camera_height_m) / std::max(tangent, 1e-9);
    return (tangent < 0.0 ? floor_ : ceiling_)
        .at(eye.x_m + range_m * direction.x_m, eye.y_m + range_m * direction.y_m);
  }

  RoomKind kind_;
  Random random_;
  Texture floor_, ceiling_;
  std::vector<Wall> walls_;
  std::vector<Box> boxes_;
};

/// A memory of the given signatures. Magnitudes up to the largest one are packed without
/// saturation.
inline VisualMemory make_memory(const std::vector<FourierSignature>& signatures,
                                const std::vector<std::optional<ReferencePose>>& poses) {
  float full_scale = 1e-6F;
  for (const auto& signature : signatures) {
    for (const float magnitude : signature.magnitudes())
      full_scale = std::max(full_scale, magnitude);
  }
  VisualMemory memory(signatures.at(0).shape(), full_scale, signatures.at(0).elevations());
  for (std::size_t i = 0; i < signatures.size(); ++i) {
    memory.append(signatures[i], {"view_" + std::to_string(i), poses[i], std::nullopt});
  }
  return memory;
}

/// A room and a memory of a grid in it, every view in a random heading.
struct RememberedRoom {
  Room room;
  double step_m;
  std::vector<Point2> grid;
  VisualMemory memory;

  RememberedRoom(std::uint64_t seed, const RoomKind& kind, double grid_step_m,
                 double noise_deviation = 0.01)
      : room(seed, kind),
        step_m(grid_step_m),
        grid(room.grid(grid_step_m)),
        memory(remember(seed, noise_deviation)) {}

 private:
  [[nodiscard]] VisualMemory remember(std::uint64_t seed, double noise_deviation) const {
    Random random(seed, 1);
    std::vector<FourierSignature> signatures;
    std::vector<std::optional<ReferencePose>> poses;
    for (const Point2 p : grid) {
      const double heading = random.uniform(-std::numbers::pi, std::numbers::pi);
      signatures.push_back(compute_signature(
          room.see({p.x_m, p.y_m, heading}, 16, 96, {1.0, noise_deviation}, random.next())));
      poses.push_back(ReferencePose{p.x_m, p.y_m, heading});
    }
    return make_memory(signatures, poses);
  }
};

}  // namespace panonav::testing
