#pragma once

// The world of all tests: walls, pillars and glowing posts between a floor and a ceiling, seen by
// casting one ray per pixel. It needs no renderer, so that tests of what robots see need none.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav::testing {

/// The grey level of a surface: metres along a wall (radians around a pillar), metres above the
/// floor, and the row of the picture as a share of its height, for patterns without perspective.
using Paint = std::function<double(double along, double up_m, double row)>;

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
  [[nodiscard]] double operator()(double u_m, double v_m, double /*row*/ = 0.0) const {
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

/// Differences of an image from the ideal one.
struct Disturbance {
  double light = 1.0;            ///< factor
  double noise_deviation = 0.0;  ///< of every pixel, white 1
};

class ToyWorld {
 public:
  static constexpr double camera_height_m = 0.6;
  static constexpr double height_m = 2.6;

  /// Nothing but grey; what is added has no top and no bottom.
  ToyWorld() = default;
  /// A textured floor and ceiling.
  ToyWorld(std::uint64_t seed, double contrast)
      : random_(seed), floor_(Texture(random_, contrast)), ceiling_(Texture(random_, contrast)) {}

  /// Returns the source of textures that are added later.
  [[nodiscard]] Random& random() noexcept { return random_; }

  /// Throughout the height, or up to `top_m`: things that one may look over.
  void add_wall(Point2 from, Point2 to, Paint paint, double top_m = height_m) {
    const double shade =
        shaded_ ? 0.75 + 0.25 * std::cos(1.3 * static_cast<double>(walls_.size())) : 1.0;
    walls_.push_back({from, to, top_m, shade, std::move(paint)});
  }
  void add_box(Point2 low, Point2 high, std::array<Paint, 4> sides, double top_m) {
    add_wall(low, {high.x_m, low.y_m}, std::move(sides[0]), top_m);
    add_wall({high.x_m, low.y_m}, high, std::move(sides[1]), top_m);
    add_wall(high, {low.x_m, high.y_m}, std::move(sides[2]), top_m);
    add_wall({low.x_m, high.y_m}, low, std::move(sides[3]), top_m);
    boxes_.emplace_back(low, high);
  }
  /// Seen from within it is the wall of a round room.
  void add_pillar(Point2 middle, double radius_m, Paint paint) {
    pillars_.push_back({middle, radius_m, std::move(paint)});
  }
  /// A post whose light adds to all that is behind it; its middle as a share of the rows.
  void add_glow(Point2 position, double radius_m, double brightness, double middle_row) {
    glows_.push_back({position, radius_m, brightness, middle_row});
  }
  /// All walls equally bright.
  void set_unshaded() { shaded_ = false; }
  [[nodiscard]] Point2 pillar(std::size_t i) const { return pillars_.at(i).middle; }
  void move_pillar(Point2 by, std::size_t i = 0) {
    pillars_.at(i).middle.x_m += by.x_m;
    pillars_.at(i).middle.y_m += by.y_m;
  }

  /// Returns the distance to the nearest wall; 0 within a box.
  [[nodiscard]] double clearance_m(Point2 p) const {
    double min_m = std::numeric_limits<double>::infinity();
    for (const auto& [low, high] : boxes_) {
      if (p.x_m > low.x_m && p.x_m < high.x_m && p.y_m > low.y_m && p.y_m < high.y_m) return 0.0;
    }
    for (const Wall& wall : walls_) {
      const double ex = wall.to.x_m - wall.from.x_m;
      const double ey = wall.to.y_m - wall.from.y_m;
      const double share = std::clamp(
          ((p.x_m - wall.from.x_m) * ex + (p.y_m - wall.from.y_m) * ey) / (ex * ex + ey * ey), 0.0,
          1.0);
      min_m =
          std::min(min_m, distance(p, {wall.from.x_m + share * ex, wall.from.y_m + share * ey}));
    }
    return min_m;
  }
  /// A room from (0, 0) to `size`: no wall and no box within 0.2 m in x and y.
  [[nodiscard]] bool is_free(Point2 p, Point2 size) const {
    constexpr double margin_m = 0.2;
    for (const auto& [low, high] : boxes_) {
      if (p.x_m > low.x_m - margin_m && p.x_m < high.x_m + margin_m && p.y_m > low.y_m - margin_m &&
          p.y_m < high.y_m + margin_m) {
        return false;
      }
    }
    return p.x_m > margin_m && p.y_m > margin_m && p.x_m < size.x_m - margin_m &&
           p.y_m < size.y_m - margin_m;
  }

  /// Renders the view of a robot at `pose`. Without elevations every ray is horizontal and a row's
  /// pattern is its own. Where there is a floor, values are clamped to 0 .. 1 as a camera does.
  [[nodiscard]] Panorama panorama(const Pose2& pose, int rows, int columns,
                                  std::optional<ElevationBand> elevations, Random& noise,
                                  const Disturbance& disturbance = {}) const {
    Panorama seen(rows, columns, elevations);
    std::vector<double> tangents(static_cast<std::size_t>(rows));
    for (int y = 0; elevations && y < rows; ++y) tangents[y] = std::tan(seen.elevation_rad(y));
    for (int c = 0; c < columns; ++c) {
      const double azimuth = pose.heading_rad + 2.0 * std::numbers::pi * c / columns;
      const auto values = column(pose.position(), azimuth, 0.0, tangents);
      for (int y = 0; y < rows; ++y) {
        double value = disturbance.light * values[y];
        if (disturbance.noise_deviation > 0.0)
          value += disturbance.noise_deviation * noise.normal();
        seen.at(y, c) = static_cast<float>(floor_ ? std::clamp(value, 0.0, 1.0) : value);
      }
    }
    return seen;
  }
  [[nodiscard]] Panorama panorama(const Pose2& pose, int rows, int columns,
                                  std::optional<ElevationBand> elevations = std::nullopt) const {
    Random none(0);
    return panorama(pose, rows, columns, elevations, none);
  }

  /// A line around the horizon: each value is the mean over its width and these elevations.
  [[nodiscard]] std::vector<float> line(const Pose2& pose, int columns = 360, int rays = 8,
                                        const std::vector<double>& elevations_rad = {0.0}) const {
    std::vector<double> tangents;
    for (const double elevation : elevations_rad) tangents.push_back(std::tan(elevation));
    std::vector<float> values;
    for (int c = 0; c < columns; ++c) {
      double sum = 0.0;
      for (int ray = 0; ray < rays; ++ray) {
        const double at = c + (ray + 0.5) / rays - 0.5;
        const double azimuth = pose.heading_rad + 2.0 * std::numbers::pi * at / columns;
        for (const double value : column(pose.position(), azimuth, 0.0, tangents)) sum += value;
      }
      values.push_back(static_cast<float>(sum / (rays * static_cast<double>(tangents.size()))));
    }
    return values;
  }

  /// A grey panorama as a 360 degree camera writes it: clockwise, forward in the middle.
  [[nodiscard]] Image picture(const Pose2& pose, int columns = 96, int rows = 12) const {
    Image image(columns, rows);
    const std::vector<double> tangents(static_cast<std::size_t>(rows));
    for (int c = 0; c < columns; ++c) {
      const double column_rad = 2.0 * std::numbers::pi * (0.5 - (c + 0.5) / columns);
      const auto values = column(pose.position(), pose.heading_rad, column_rad, tangents);
      for (int y = 0; y < rows; ++y) {
        image.at(c, y) =
            static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(values[y], 0.0, 1.0)));
      }
    }
    return image;
  }

 private:
  struct Wall {
    Point2 from, to;
    double top_m, shade;
    Paint paint;
  };
  struct Pillar {
    Point2 middle;
    double radius_m;
    Paint paint;
  };
  struct Glow {
    Point2 position;
    double radius_m, brightness, middle_row;
  };
  struct Hit {
    double range_m, along, top_m, shade;
    const Paint* paint;
  };

  /// All surfaces that a direction meets.
  [[nodiscard]] std::vector<Hit> hits(Point2 eye, double ux, double uy) const {
    std::vector<Hit> found;
    for (const Wall& wall : walls_) {
      const double ex = wall.to.x_m - wall.from.x_m;
      const double ey = wall.to.y_m - wall.from.y_m;
      const double ox = wall.from.x_m - eye.x_m;
      const double oy = wall.from.y_m - eye.y_m;
      const double cross = ux * ey - uy * ex;
      if (std::abs(cross) < 1e-12) continue;
      const double range_m = (ox * ey - oy * ex) / cross;
      const double share = (ox * uy - oy * ux) / cross;
      if (range_m <= 1e-6 || share < 0.0 || share > 1.0) continue;
      found.push_back({range_m, share * std::hypot(ex, ey), wall.top_m, wall.shade, &wall.paint});
    }
    for (const Pillar& pillar : pillars_) {
      const double cx = pillar.middle.x_m - eye.x_m;
      const double cy = pillar.middle.y_m - eye.y_m;
      const double foot = cx * ux + cy * uy;
      const double off = cx * uy - cy * ux;
      const double square = pillar.radius_m * pillar.radius_m - off * off;
      if (square <= 0.0) continue;
      double range_m = foot - std::sqrt(square);
      if (range_m <= 1e-9) range_m = foot + std::sqrt(square);
      if (range_m <= 1e-9) continue;
      const double angle = std::atan2(range_m * uy - cy, range_m * ux - cx);
      found.push_back({range_m, angle, height_m, 1.0, &pillar.paint});
    }
    return found;
  }

  /// The grey levels of one column, whose rows look up by these tangents. `turn_rad` is added to
  /// the azimuth.
  [[nodiscard]] std::vector<double> column(Point2 eye, double azimuth, double turn_rad,
                                           std::span<const double> tangents) const {
    const double ux = std::cos(azimuth + turn_rad);
    const double uy = std::sin(azimuth + turn_rad);
    const std::vector<Hit> met = hits(eye, ux, uy);
    std::vector<double> values;
    const auto rows = static_cast<double>(tangents.size());
    for (std::size_t y = 0; y < tangents.size(); ++y) {
      const double row = (static_cast<double>(y) + 0.5) / rows;
      const Hit* nearest = nullptr;
      for (const Hit& hit : met) {
        const double up_m = camera_height_m + hit.range_m * tangents[y];
        if (floor_ && (up_m < 0.0 || up_m > hit.top_m)) continue;
        if (nearest == nullptr || hit.range_m < nearest->range_m) nearest = &hit;
      }
      if (nearest != nullptr) {
        const double up_m = camera_height_m + nearest->range_m * tangents[y];
        values.push_back(nearest->shade * (*nearest->paint)(nearest->along, up_m, row));
      } else if (floor_) {
        const double range_m = tangents[y] < 0.0
                                   ? -camera_height_m / tangents[y]
                                   : (height_m - camera_height_m) / std::max(tangents[y], 1e-9);
        const Texture& plane = tangents[y] < 0.0 ? *floor_ : *ceiling_;
        values.push_back(plane(eye.x_m + range_m * ux, eye.y_m + range_m * uy));
      } else {
        values.push_back(0.5);
      }
    }
    for (const Glow& glow : glows_) {
      const double distance_m = std::max(0.2, distance(eye, glow.position));
      const double at =
          std::atan2(glow.position.y_m - eye.y_m, glow.position.x_m - eye.x_m) - azimuth;
      const double off = angle_difference(turn_rad, at) / std::atan(glow.radius_m / distance_m);
      const double light = glow.brightness * std::exp(-0.5 * off * off);
      for (std::size_t y = 0; y < values.size(); ++y) {
        const double row_off = ((static_cast<double>(y) + 0.5) / rows - glow.middle_row) / 0.3;
        values[y] += light * std::exp(-0.5 * row_off * row_off);
      }
    }
    return values;
  }

  Random random_{0};
  std::optional<Texture> floor_, ceiling_;
  std::vector<Wall> walls_;
  std::vector<Pillar> pillars_;
  std::vector<Glow> glows_;
  std::vector<std::pair<Point2, Point2>> boxes_;
  bool shaded_ = true;
};

/// A flat world of glowing posts, the simplest one in which near places look alike and far ones do
/// not.
inline ToyWorld landmark_world(std::uint64_t seed) {
  ToyWorld world;
  Random random(seed);
  for (int i = 0; i < 60; ++i) {
    const Point2 position{random.uniform(-4.0, 7.0), random.uniform(-4.0, 7.0)};
    const double radius_m = random.uniform(0.1, 0.6);
    const double brightness = random.uniform(-0.4, 0.4);
    world.add_glow(position, radius_m, brightness, random.uniform());
  }
  return world;
}

/// A round room around (0, 0) with a sum of waves on its wall, by azimuth and by metres above the
/// camera.
struct CylinderWave {
  int frequency;
  double height_rate, amplitude, phase;
};
inline ToyWorld waved_cylinder(double radius_m, std::vector<CylinderWave> waves) {
  ToyWorld world;
  world.add_pillar(
      {0, 0}, radius_m, [waves = std::move(waves)](double azimuth, double up_m, double) {
        const double height_m = up_m - ToyWorld::camera_height_m;
        double value = 0.5;
        for (const CylinderWave& w : waves) {
          value +=
              w.amplitude * std::cos(w.frequency * azimuth + w.height_rate * height_m + w.phase);
        }
        return value;
      });
  return world;
}

/// The same with one pattern for all heights, whose waves are the weaker the shorter they are.
inline ToyWorld striped_round_room(double radius_m, std::uint64_t seed) {
  Random random(seed);
  std::vector<CylinderWave> waves;
  for (int k = 1; k <= 12; ++k) {
    const double amplitude = 0.3 / k * random.uniform(0.5, 1.0);
    waves.push_back({k, 0.0, amplitude, random.uniform(-std::numbers::pi, std::numbers::pi)});
  }
  return waved_cylinder(radius_m, std::move(waves));
}

/// A round room around (0, 0) whose wall carries another pattern in each row of a picture, all
/// frequencies with the same amplitude, so that places are distinguished as in a furnished room.
inline ToyWorld round_room(double radius_m, std::uint64_t seed) {
  constexpr int rows = 12;
  constexpr int waves = 12;
  Random random(seed);
  std::vector<double> phases(static_cast<std::size_t>(rows * waves));
  for (double& phase : phases) phase = random.uniform(-std::numbers::pi, std::numbers::pi);
  ToyWorld world;
  world.add_pillar({0, 0}, radius_m, [phases](double azimuth, double, double row) {
    const int first = waves * static_cast<int>(row * rows);
    double value = 0.5;
    for (int k = 1; k <= waves; ++k) {
      value += 0.04 * std::cos(k * azimuth + phases[static_cast<std::size_t>(first + k - 1)]);
    }
    return value;
  });
  return world;
}

/// A room of 8 x 6 m around (0, 0) with four pillars, all with smooth random textures that change
/// along the horizon only. `finest`: their highest frequency, radians a metre.
inline ToyWorld pillared_room(std::uint64_t seed, double finest = 9.0) {
  struct Wave {
    double frequency, phase, height;
  };
  Random random(seed);
  std::vector<Wave> waves;
  for (int wave = 0; wave < 24; ++wave) {
    waves.push_back(
        {random.uniform(0.5, finest), random.uniform(0.0, 6.28), random.uniform(-1.0, 1.0)});
  }
  // `scale`: metres per unit along; `begin_m`: where it starts.
  const auto texture = [&waves](double scale, double begin_m, double offset) -> Paint {
    return [waves, scale, begin_m, offset](double along, double, double) {
      double value = 0.0;
      for (const Wave& wave : waves) {
        value += wave.height * std::sin(wave.frequency * (begin_m + scale * along) + wave.phase +
                                        offset * wave.frequency);
      }
      return 0.5 + 0.08 * value;
    };
  };
  ToyWorld world;
  world.set_unshaded();
  for (const int side : {-1, 1}) {
    world.add_wall({4.0 * side, -3.0}, {4.0 * side, 3.0}, texture(1.0, -3.0, 10.0 * side));
    world.add_wall({-4.0, 3.0 * side}, {4.0, 3.0 * side}, texture(1.0, -4.0, 20.0 * side));
  }
  for (int i = 0; i < 4; ++i) {
    const double x_m = random.uniform(-3.0, 3.0);
    const double y_m = random.uniform(1.5, 2.3) * (i % 2 == 0 ? 1 : -1);
    const double radius_m = random.uniform(0.15, 0.35);
    world.add_pillar({x_m, y_m}, radius_m, texture(radius_m, 0.0, 40.0 + 10.0 * i));
  }
  return world;
}

/// Two rooms of 4 x 4 m side by side with boxes in them and one door, or two, in the wall between.
inline ToyWorld two_rooms(std::uint64_t seed, bool second_door) {
  ToyWorld world(seed, 0.05);
  const auto paint = [&world] { return Texture(world.random(), 0.15); };
  world.add_wall({0, 0}, {8, 0}, paint());
  world.add_wall({8, 0}, {8, 4}, paint());
  world.add_wall({8, 4}, {0, 4}, paint());
  world.add_wall({0, 4}, {0, 0}, paint());
  world.add_wall({4, 0}, {4, second_door ? 0.6 : 2.4}, paint());
  if (second_door) world.add_wall({4, 1.4}, {4, 2.4}, paint());
  world.add_wall({4, 3.2}, {4, 4}, paint());
  world.add_box({1.6, 1.4}, {2.2, 2.0}, {paint(), paint(), paint(), paint()}, 1.2);
  world.add_box({5.8, 2.2}, {6.4, 2.8}, {paint(), paint(), paint(), paint()}, 0.5);
  return world;
}

struct RoomKind {
  double width_m = 5.0;
  double depth_m = 4.0;
  int boxes = 4;
  double contrast = 0.15;
};

/// A room with textured walls, floor, ceiling and boxes at random, and the places in it.
class Room : public ToyWorld {
 public:
  Room(std::uint64_t seed, const RoomKind& kind)
      : ToyWorld(seed, 0.3 * kind.contrast), size_{kind.width_m, kind.depth_m} {
    const std::array<Point2, 4> corners = {Point2{0, 0}, Point2{size_.x_m, 0}, size_,
                                           Point2{0, size_.y_m}};
    for (std::size_t i = 0; i < 4; ++i) {
      add_wall(corners[i], corners[(i + 1) % 4], Texture(random(), kind.contrast));
    }
    for (int i = 0; i < kind.boxes; ++i) {
      const double width_m = random().uniform(0.2, 0.8);
      const double depth_m = random().uniform(0.2, 0.8);
      const Point2 low{random().uniform(0.0, size_.x_m - width_m),
                       random().uniform(0.0, size_.y_m - depth_m)};
      const double top_m = random().uniform(0.4, 2.0);
      const Texture texture(random(), kind.contrast);
      add_box(low, {low.x_m + width_m, low.y_m + depth_m}, {texture, texture, texture, texture},
              top_m);
    }
  }

  [[nodiscard]] bool is_free(Point2 p) const { return ToyWorld::is_free(p, size_); }

  [[nodiscard]] std::vector<Point2> grid(double step_m) const {
    std::vector<Point2> points;
    for (double x = 0.3; x < size_.x_m; x += step_m) {
      for (double y = 0.3; y < size_.y_m; y += step_m) {
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
    Random noise(noise_seed);
    return panorama(pose, rows, columns, ElevationBand{radians(-30.0), radians(40.0)}, noise,
                    disturbance);
  }

 private:
  Point2 size_;
};

/// Returns random texture on a cylinder of radius 1 m; `height_rate`: largest change with height.
inline ToyWorld random_surroundings(std::uint64_t seed, double height_rate = 0.0) {
  Random random(seed);
  std::vector<CylinderWave> waves;
  for (int i = 2; i < 26; ++i) {  // two waves of each of 12 frequencies
    const double rate = random.uniform(-height_rate, height_rate);
    const double amplitude = 0.3 / (i / 2) * random.uniform(0.5, 1.0);
    waves.push_back({i / 2, rate, amplitude, random.uniform(-std::numbers::pi, std::numbers::pi)});
  }
  return waved_cylinder(1.0, std::move(waves));
}

}  // namespace panonav::testing
