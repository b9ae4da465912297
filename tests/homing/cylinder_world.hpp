#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav::test {

/// A round room with a pattern on its wall, seen as one row by ray casting.
class CylinderWorld {
 public:
  CylinderWorld(double radius_m, std::uint64_t seed) : radius_m_(radius_m) {
    Random random(seed);
    for (int k = 1; k <= 12; ++k) {
      waves_.push_back({k, 0.3 / k * random.uniform(0.5, 1.0),
                        random.uniform(-std::numbers::pi, std::numbers::pi)});
    }
  }

  [[nodiscard]] HomingView seen_from(const Pose2& pose, int components = 14) const {
    return homing_view(signature_from(pose, components));
  }

  [[nodiscard]] FourierSignature signature_from(const Pose2& pose, int components = 14) const {
    constexpr int columns = 256;
    Panorama view(1, columns, std::nullopt);
    for (int c = 0; c < columns; ++c) {
      const double direction = pose.heading_rad + 2.0 * std::numbers::pi * c / columns;
      const double ux = std::cos(direction);
      const double uy = std::sin(direction);
      const double along = pose.x_m * ux + pose.y_m * uy;
      const double square = pose.x_m * pose.x_m + pose.y_m * pose.y_m;
      const double range = -along + std::sqrt(along * along + radius_m_ * radius_m_ - square);
      const double azimuth = std::atan2(pose.y_m + range * uy, pose.x_m + range * ux);
      double value = 0.5;
      for (const Wave& wave : waves_) {
        value += wave.amplitude * std::cos(wave.frequency * azimuth + wave.phase);
      }
      view.at(0, c) = static_cast<float>(value);
    }
    return compute_signature(view, components);
  }

 private:
  struct Wave {
    int frequency;
    double amplitude, phase;
  };
  double radius_m_;
  std::vector<Wave> waves_;
};

}  // namespace panonav::test
