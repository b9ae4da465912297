#pragma once

// Rooms of textured walls with doors, seen by casting one ray per pixel, and a robot in them that
// stops where something is in its way.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "localisation/ray_cast_room.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::test {

class WalledWorld {
 public:
  static constexpr double camera_height_m = 0.6;
  static constexpr double height_m = 2.6;
  static constexpr double robot_radius_m = 0.15;

  explicit WalledWorld(std::uint64_t seed)
      : random_(seed), floor_(random_, 0.05), ceiling_(random_, 0.05) {}

  /// Throughout the height, or up to `top_m`: things that one may look over.
  void add_wall(Point2 from, Point2 to, double top_m = height_m) {
    walls_.push_back({from, to, top_m, testing::Texture(random_, 0.15),
                      0.75 + 0.25 * std::cos(1.3 * static_cast<double>(walls_.size()))});
  }
  void add_box(Point2 low, Point2 high, double top_m) {
    add_wall(low, {high.x_m, low.y_m}, top_m);
    add_wall({high.x_m, low.y_m}, high, top_m);
    add_wall(high, {low.x_m, high.y_m}, top_m);
    add_wall({low.x_m, high.y_m}, low, top_m);
    boxes_.push_back({low, high});
  }

  /// To the nearest wall; 0 within a box.
  [[nodiscard]] double clearance_m(Point2 p) const {
    for (const auto& [low, high] : boxes_) {
      if (p.x_m > low.x_m && p.x_m < high.x_m && p.y_m > low.y_m && p.y_m < high.y_m) return 0.0;
    }
    double least = std::numeric_limits<double>::infinity();
    for (const Wall& wall : walls_) {
      const double ex = wall.to.x_m - wall.from.x_m;
      const double ey = wall.to.y_m - wall.from.y_m;
      const double share = std::clamp(
          ((p.x_m - wall.from.x_m) * ex + (p.y_m - wall.from.y_m) * ey) / (ex * ex + ey * ey), 0.0,
          1.0);
      least =
          std::min(least, distance(p, {wall.from.x_m + share * ex, wall.from.y_m + share * ey}));
    }
    return least;
  }
  [[nodiscard]] bool is_free(Point2 p) const { return clearance_m(p) > robot_radius_m; }
  [[nodiscard]] bool is_passable(Point2 a, Point2 b) const {
    const int steps = static_cast<int>(std::ceil(distance(a, b) / 0.02));
    for (int i = 0; i <= steps; ++i) {
      const double share = steps == 0 ? 0.0 : static_cast<double>(i) / steps;
      if (!is_free({a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m)}))
        return false;
    }
    return true;
  }

  [[nodiscard]] FourierSignature seen_from(const Pose2& pose, Random& noise,
                                           double light = 1.0) const {
    constexpr int rows = 12;
    constexpr int columns = 64;
    Panorama panorama(rows, columns, ElevationBand{radians(-25.0), radians(35.0)});
    for (int c = 0; c < columns; ++c) {
      const double azimuth = pose.heading_rad + 2.0 * std::numbers::pi * c / columns;
      for (int y = 0; y < rows; ++y) {
        const double value =
            light * colour(pose.position(), azimuth, std::tan(panorama.elevation_rad(y))) +
            0.01 * noise.normal();
        panorama.at(y, c) = static_cast<float>(std::clamp(value, 0.0, 1.0));
      }
    }
    return compute_signature(preprocess(std::move(panorama), {}));
  }

  /// The horizon line, each value the mean over its width and four degrees of height.
  [[nodiscard]] std::vector<float> line_from(const Pose2& pose) const {
    constexpr int columns = 360;
    constexpr int rays = 3;
    std::vector<float> values(columns);
    for (int c = 0; c < columns; ++c) {
      double sum = 0.0;
      for (int i = 0; i < rays; ++i) {
        const double at = c + (i + 0.5) / rays - 0.5;
        const double azimuth = pose.heading_rad + 2.0 * std::numbers::pi * at / columns;
        for (int j = 0; j < rays; ++j) {
          sum += colour(pose.position(), azimuth, std::tan(radians(1.5 * (j - 1))));
        }
      }
      values[static_cast<std::size_t>(c)] = static_cast<float>(sum / (rays * rays));
    }
    return values;
  }

 private:
  struct Wall {
    Point2 from, to;
    double top_m;
    testing::Texture texture;
    double shade;
  };

  [[nodiscard]] double colour(Point2 eye, double azimuth, double tangent) const {
    const double ux = std::cos(azimuth);
    const double uy = std::sin(azimuth);
    double nearest = std::numeric_limits<double>::infinity();
    double value = 0.0;
    for (const Wall& wall : walls_) {
      const double ex = wall.to.x_m - wall.from.x_m;
      const double ey = wall.to.y_m - wall.from.y_m;
      const double ox = wall.from.x_m - eye.x_m;
      const double oy = wall.from.y_m - eye.y_m;
      const double cross = ux * ey - uy * ex;
      if (std::abs(cross) < 1e-12) continue;
      const double range = (ox * ey - oy * ex) / cross;
      const double share = (ox * uy - oy * ux) / cross;
      const double z = camera_height_m + range * tangent;
      if (range <= 1e-6 || range >= nearest || share < 0.0 || share > 1.0 || z < 0.0 ||
          z > wall.top_m) {
        continue;
      }
      nearest = range;
      value = wall.shade * wall.texture.at(share * std::hypot(ex, ey), z);
    }
    if (std::isfinite(nearest)) return value;
    const double range = tangent < 0.0 ? -camera_height_m / tangent
                                       : (height_m - camera_height_m) / std::max(tangent, 1e-9);
    return (tangent < 0.0 ? floor_ : ceiling_).at(eye.x_m + range * ux, eye.y_m + range * uy);
  }

  Random random_;
  testing::Texture floor_, ceiling_;
  std::vector<Wall> walls_;
  std::vector<std::pair<Point2, Point2>> boxes_;
};

/// Two rooms of 4 x 4 m side by side with boxes in them and one door, or two, in the wall between.
inline WalledWorld two_rooms(std::uint64_t seed, bool second_door) {
  WalledWorld world(seed);
  world.add_wall({0, 0}, {8, 0});
  world.add_wall({8, 0}, {8, 4});
  world.add_wall({8, 4}, {0, 4});
  world.add_wall({0, 4}, {0, 0});
  world.add_wall({4, 0}, {4, second_door ? 0.6 : 2.4});
  if (second_door) world.add_wall({4, 1.4}, {4, 2.4});
  world.add_wall({4, 3.2}, {4, 4});
  world.add_box({1.6, 1.4}, {2.2, 2.0}, 1.2);
  world.add_box({5.8, 2.2}, {6.4, 2.8}, 0.5);
  return world;
}

/// A memory of a grid, every view in a heading at random, linked where a robot can drive straight.
struct RememberedWorld {
  double spacing_m;
  std::vector<Pose2> poses;
  VisualMemory memory;

  RememberedWorld(const WalledWorld& world, Point2 high, double spacing, std::uint64_t seed)
      : spacing_m(spacing), poses(), memory(remember(world, high, seed)) {}

  [[nodiscard]] const Pose2& pose_of(ViewId view) const { return poses.at(view.value); }

 private:
  [[nodiscard]] VisualMemory remember(const WalledWorld& world, Point2 high, std::uint64_t seed) {
    Random random(seed);
    std::vector<FourierSignature> signatures;
    for (double y = 0.4; y < high.y_m; y += spacing_m) {
      for (double x = 0.4; x < high.x_m; x += spacing_m) {
        if (world.clearance_m({x, y}) < WalledWorld::robot_radius_m + 0.05) continue;
        poses.push_back({x, y, random.uniform(-std::numbers::pi, std::numbers::pi)});
        signatures.push_back(world.seen_from(poses.back(), random));
      }
    }
    // No pose is told: navigation must do without.
    VisualMemory made = testing::make_memory(
        signatures, std::vector<std::optional<ReferencePose>>(signatures.size()));
    for (std::size_t a = 0; a < poses.size(); ++a) {
      for (std::size_t b = a + 1; b < poses.size(); ++b) {
        if (distance(poses[a].position(), poses[b].position()) < 1.5 * spacing_m &&
            world.is_passable(poses[a].position(), poses[b].position())) {
          made.link({made.views()[a], made.views()[b], LinkKind::neighbour});
        }
      }
    }
    return made;
  }
};

/// A robot with an inexact drive.
class SimulatedRobot final : public RobotBase {
 public:
  SimulatedRobot(const WalledWorld& world, const Pose2& pose, DriveKind drive, std::uint64_t seed)
      : world_(&world), pose_(pose), random_(seed) {
    base_.drive = drive;
    noise_.drive = drive;
  }

  void command(const Velocity& velocity) override {
    const Pose2 told = motion_after(velocity, base_.period_s);
    const Pose2 step = sample_step(told, noise_, random_);
    const Pose2 there = pose_ * step;
    if (!world_->is_free(there.position())) {
      // A round robot that turns on the spot hits nothing.
      obstacle_ |= velocity.forward_m_s != 0.0 || velocity.left_m_s != 0.0;
      pose_.heading_rad = there.heading_rad;
      told_ = told_ * Pose2{0.0, 0.0, told.heading_rad};
      return;
    }
    told_ = told_ * told;
    travelled_m_ += std::hypot(step.x_m, step.y_m);
    pose_ = there;
  }

  /// Makes a step as a robot does that knows its own speeds only. Returns whether it was stopped.
  bool go(double direction_rad, double advance_m) {
    obstacle_ = false;
    Point2 target{advance_m * std::cos(direction_rad), advance_m * std::sin(direction_rad)};
    for (int i = 0; i < 200 && !obstacle_ && std::hypot(target.x_m, target.y_m) > 0.005; ++i) {
      const Velocity v = command_towards(std::atan2(target.y_m, target.x_m),
                                         std::hypot(target.x_m, target.y_m), base_);
      command(v);
      target = remaining_way(target, motion_after(v, base_.period_s));
    }
    return obstacle_;
  }

  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  /// Its wheels do not tell.
  void carry_to(const Pose2& pose) { pose_ = pose; }
  /// The motion that its wheels tell since the last time.
  [[nodiscard]] Pose2 take_odometry() { return std::exchange(told_, Pose2{}); }
  [[nodiscard]] double travelled_m() const noexcept { return travelled_m_; }

 private:
  const WalledWorld* world_;
  Pose2 pose_;
  Pose2 told_;
  Random random_;
  BaseOptions base_;
  OdometryNoise noise_;
  bool obstacle_ = false;
  double travelled_m_ = 0.0;
};

}  // namespace panonav::test
