#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::test {

/// A round room around (0, 0) whose wall carries another pattern in each row, all frequencies
/// alike, so that places are told apart as in a furnished room. Rows are as on the horizon.
class RoundRoom {
 public:
  static constexpr int rows = 12;
  static constexpr int components = 15;

  RoundRoom(double radius_m, std::uint64_t seed) : radius_m_(radius_m) {
    Random random(seed);
    for (double& phase : phases_) phase = random.uniform(-std::numbers::pi, std::numbers::pi);
  }

  [[nodiscard]] FourierSignature seen_from(const Pose2& pose) const {
    constexpr int columns = 96;
    Panorama view(rows, columns, std::nullopt);
    for (int c = 0; c < columns; ++c) {
      const double direction = pose.heading_rad + 2.0 * std::numbers::pi * c / columns;
      const double along = pose.x_m * std::cos(direction) + pose.y_m * std::sin(direction);
      const double square = pose.x_m * pose.x_m + pose.y_m * pose.y_m;
      const double range = -along + std::sqrt(along * along + radius_m_ * radius_m_ - square);
      const double azimuth = std::atan2(pose.y_m + range * std::sin(direction),
                                        pose.x_m + range * std::cos(direction));
      for (int r = 0; r < rows; ++r) {
        double value = 0.5;
        for (int k = 1; k <= waves; ++k) {
          value +=
              0.04 * std::cos(k * azimuth + phases_[static_cast<std::size_t>(r * waves + k - 1)]);
        }
        view.at(r, c) = static_cast<float>(value);
      }
    }
    return compute_signature(view, components);
  }

 private:
  static constexpr int waves = 12;
  double radius_m_;
  std::vector<double> phases_ = std::vector<double>(rows * waves);
};

}  // namespace panonav::test
