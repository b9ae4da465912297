#pragma once

// Signatures and memories of the toy world, and a robot in it that stops at obstacles.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/memory/floors.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/signature/fourier_signature.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {

/// A view in `striped_round_room`: one row.
inline FourierSignature striped_signature(const ToyWorld& world, const Pose2& pose,
                                          int components = 14) {
  return compute_signature(world.panorama(pose, 1, 256), components);
}

inline constexpr double round_room_radius_m = 4.0;
/// A view in `round_room`.
inline constexpr SignatureShape round_room_shape{12, 15};
inline FourierSignature round_room_signature(const ToyWorld& world, const Pose2& pose) {
  return compute_signature(world.panorama(pose, round_room_shape.rows, 96),
                           round_room_shape.components);
}

/// A view in `two_rooms`, a little noisy, and its horizon scanline over four degrees of height.
inline FourierSignature two_rooms_signature(const ToyWorld& world, const Pose2& pose, Random& noise,
                                            double light = 1.0) {
  const ElevationBand band{radians(-25.0), radians(35.0)};
  return compute_signature(
      preprocess(world.panorama(pose, 12, 64, band, noise, {light, 0.01}), {}));
}
inline std::vector<float> two_rooms_line(const ToyWorld& world, const Pose2& pose) {
  return world.line(pose, 360, 3, {radians(-1.5), 0.0, radians(1.5)});
}

inline VisualMemory empty_round_room_memory() {
  return {round_room_shape, 0.1F, std::nullopt};
}

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
/// The same of views without poses.
inline VisualMemory make_memory(const std::vector<FourierSignature>& signatures) {
  return make_memory(signatures, std::vector<std::optional<ReferencePose>>(signatures.size()));
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

/// A memory of the views of both rooms on the floors "a" and "b", in the same coordinates.
inline VisualMemory remember_floors(const RememberedRoom& a, const RememberedRoom& b) {
  VisualMemory memory(a.memory.shape(), a.memory.full_scale(), a.memory.elevations());
  for (const auto& [floor, room] : {std::pair("a", &a), std::pair("b", &b)}) {
    for (const ViewId view : room->memory.views()) {
      ReferenceInfo info = room->memory.info(view);
      info.name = make_name_on_floor(floor, info.name);
      memory.append(room->memory.signature(view), info);
    }
  }
  return memory;
}

/// Radius of the robot of these tests.
inline constexpr double robot_radius_m = 0.15;
inline bool robot_fits(const ToyWorld& world, Point2 p) {
  return world.clearance_m(p) > robot_radius_m;
}
inline bool is_passable(const ToyWorld& world, Point2 a, Point2 b) {
  const int steps = static_cast<int>(std::ceil(distance(a, b) / 0.02));
  for (int i = 0; i <= steps; ++i) {
    const double share = steps == 0 ? 0.0 : static_cast<double>(i) / steps;
    const Point2 p{a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m)};
    if (!robot_fits(world, p)) return false;
  }
  return true;
}

/// A memory of a grid, every view in a heading at random, linked where a robot can drive straight.
struct RememberedWorld {
  double spacing_m;
  std::vector<Pose2> poses;
  VisualMemory memory;

  RememberedWorld(const ToyWorld& world, Point2 high, double spacing, std::uint64_t seed)
      : spacing_m(spacing), poses(), memory(remember(world, high, seed)) {}

  [[nodiscard]] const Pose2& pose_of(ViewId view) const { return poses.at(view.value); }

 private:
  [[nodiscard]] VisualMemory remember(const ToyWorld& world, Point2 high, std::uint64_t seed) {
    Random random(seed);
    std::vector<FourierSignature> signatures;
    for (double y = 0.4; y < high.y_m; y += spacing_m) {
      for (double x = 0.4; x < high.x_m; x += spacing_m) {
        if (world.clearance_m({x, y}) < robot_radius_m + 0.05) continue;
        poses.push_back({x, y, random.uniform(-std::numbers::pi, std::numbers::pi)});
        signatures.push_back(two_rooms_signature(world, poses.back(), random));
      }
    }
    VisualMemory made = make_memory(signatures);  // no pose is told: navigation must do without
    for (std::size_t a = 0; a < poses.size(); ++a) {
      for (std::size_t b = a + 1; b < poses.size(); ++b) {
        if (distance(poses[a].position(), poses[b].position()) < 1.5 * spacing_m &&
            is_passable(world, poses[a].position(), poses[b].position())) {
          made.link({made.views()[a], made.views()[b], Link::Kind::neighbour});
        }
      }
    }
    return made;
  }
};

/// A robot with an inexact drive.
class SimulatedRobot final : public RobotBase {
 public:
  SimulatedRobot(const ToyWorld& world, const Pose2& pose, DriveKind drive, std::uint64_t seed)
      : world_(&world), pose_(pose), random_(seed) {
    base_.drive = drive;
    noise_.drive = drive;
  }

  void command(const Velocity& velocity) override {
    const Pose2 commanded = integrate_velocity(velocity, base_.period_s);
    const Pose2 step = sample_step(commanded, noise_, random_);
    const Pose2 there = pose_ * step;
    if (!robot_fits(*world_, there.position())) {
      // A round robot that turns on the spot hits nothing.
      obstacle_ |= velocity.forward_m_s != 0.0 || velocity.left_m_s != 0.0;
      pose_.heading_rad = there.heading_rad;
      odometry_ = odometry_ * Pose2{0.0, 0.0, commanded.heading_rad};
      return;
    }
    odometry_ = odometry_ * commanded;
    travelled_m_ += std::hypot(step.x_m, step.y_m);
    pose_ = there;
  }

  /// Makes a step as a robot does that knows its own speeds only. Returns whether it was stopped.
  bool go(double direction_rad, double advance_m) {
    obstacle_ = false;
    Point2 target{advance_m * std::cos(direction_rad), advance_m * std::sin(direction_rad)};
    for (int i = 0; i < 200 && !obstacle_ && std::hypot(target.x_m, target.y_m) > 0.005; ++i) {
      const Velocity v = compute_command_towards(std::atan2(target.y_m, target.x_m),
                                                 std::hypot(target.x_m, target.y_m), base_);
      command(v);
      target = inverse(integrate_velocity(v, base_.period_s)) * target;
    }
    return obstacle_;
  }

  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  /// Its wheels do not tell.
  void teleport_to(const Pose2& pose) { pose_ = pose; }
  /// The motion that its wheels tell since the last time.
  [[nodiscard]] Pose2 take_odometry() { return std::exchange(odometry_, Pose2{}); }
  [[nodiscard]] double travelled_m() const noexcept { return travelled_m_; }

 private:
  const ToyWorld* world_;
  Pose2 pose_;
  Pose2 odometry_;
  Random random_;
  BaseOptions base_;
  OdometryNoise noise_;
  bool obstacle_ = false;
  double travelled_m_ = 0.0;
};

}  // namespace panonav::testing
