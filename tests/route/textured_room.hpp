#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav::testing {

/// A rectangular room with pillars, all with smooth random textures, seen in the plane.
class TexturedRoom {
 public:
  /// `finest`: the highest frequency of the textures, radians a metre.
  explicit TexturedRoom(std::uint64_t seed, double finest = 9.0) {
    Random random(seed);
    for (int wave = 0; wave < 24; ++wave) {
      waves_.push_back(
          {random.uniform(0.5, finest), random.uniform(0.0, 6.28), random.uniform(-1.0, 1.0)});
    }
    for (int i = 0; i < 4; ++i) {
      pillars_.push_back(
          {{random.uniform(-3.0, 3.0), random.uniform(1.5, 2.3) * (i % 2 == 0 ? 1 : -1)},
           random.uniform(0.15, 0.35)});
    }
  }

  /// What a robot at `pose` sees, `columns` values, each the mean over its width.
  [[nodiscard]] std::vector<float> line(const Pose2& pose, int columns = 360) const {
    std::vector<float> values(static_cast<std::size_t>(columns));
    constexpr int rays = 8;
    for (int c = 0; c < columns; ++c) {
      double sum = 0.0;
      for (int ray = 0; ray < rays; ++ray) {
        const double at = c + (ray + 0.5) / rays - 0.5;
        sum += along(pose.position(), pose.heading_rad + 2.0 * std::numbers::pi * at / columns);
      }
      values[static_cast<std::size_t>(c)] = static_cast<float>(sum / rays);
    }
    return values;
  }

  [[nodiscard]] Point2 pillar(std::size_t i) const { return pillars_[i].middle; }
  /// Moves the first pillar.
  void move_pillar(Point2 by) {
    pillars_[0].middle.x_m += by.x_m;
    pillars_[0].middle.y_m += by.y_m;
  }

 private:
  struct Wave {
    double frequency, phase, height;
  };
  struct Pillar {
    Point2 middle;
    double radius_m;
  };

  [[nodiscard]] double texture(double at_m, double offset) const {
    double value = 0.0;
    for (const Wave& wave : waves_) {
      value += wave.height * std::sin(wave.frequency * at_m + wave.phase + offset * wave.frequency);
    }
    return 0.5 + 0.08 * value;
  }

  [[nodiscard]] double along(Point2 from, double direction_rad) const {
    const double ux = std::cos(direction_rad);
    const double uy = std::sin(direction_rad);
    double nearest = std::numeric_limits<double>::infinity();
    double value = 0.0;
    const auto hit = [&](double far, double at_m, double offset) {
      if (far > 1e-9 && far < nearest) {
        nearest = far;
        value = texture(at_m, offset);
      }
    };
    for (const int side : {-1, 1}) {
      const double to_x = (side * width_m_ / 2.0 - from.x_m) / ux;
      hit(to_x, from.y_m + to_x * uy, 10.0 * side);
      const double to_y = (side * depth_m_ / 2.0 - from.y_m) / uy;
      hit(to_y, from.x_m + to_y * ux, 20.0 * side);
    }
    for (std::size_t i = 0; i < pillars_.size(); ++i) {
      const double cx = pillars_[i].middle.x_m - from.x_m;
      const double cy = pillars_[i].middle.y_m - from.y_m;
      const double foot = cx * ux + cy * uy;
      const double off = cx * uy - cy * ux;
      const double r = pillars_[i].radius_m;
      if (std::abs(off) >= r) continue;
      const double far = foot - std::sqrt(r * r - off * off);
      hit(far, r * std::atan2(far * uy - cy, far * ux - cx), 40.0 + 10.0 * static_cast<double>(i));
    }
    return value;
  }

  double width_m_ = 8.0;
  double depth_m_ = 6.0;
  std::vector<Wave> waves_;
  std::vector<Pillar> pillars_;
};

}  // namespace panonav::testing
