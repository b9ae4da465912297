#pragma once

#include <cstdint>
#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Converts each random 64-bit number to two independent standard normal deviates, as
/// `Random::normal_pair` does (up to the last bits). Spans of one size; throws ContractError
/// otherwise. All instruction sets give the same bits. Cost: 2 ns a pair with AVX-512.
void normal_pairs(std::span<const std::uint64_t> bits, std::span<float> first,
                  std::span<float> second, Instructions instructions);

/// Poses in the plane as a structure of arrays.
struct PoseColumns {
  /// Steps, one for each pose, in the frame of the robot before it.
  struct Steps {
    std::span<const double> forward_m,       ///< along the robot's heading
        left_m;                              ///< to the left of it
    std::span<const double> turn_error_rad;  ///< rotation minus `turn_rad`
    double turn_rad;                         ///< rotation common to all poses
    double turn_share_before_travel;  ///< share of `turn_error_rad` that acts before the travel
  };

  std::span<double> x_m,  ///< along the frame's x axis
      y_m,                ///< along its y axis
      heading_rad;        ///< counter-clockwise, not wrapped
};

/// Moves each pose by its step; headings are not wrapped. Spans of one size; throws ContractError
/// otherwise. Headings up to a million turns. All instruction sets give the same bits. Cost: 3 ns a
/// pose with AVX-512.
void move_poses(const PoseColumns& poses, const PoseColumns::Steps& steps,
                Instructions instructions);

}  // namespace panonav::kernels
