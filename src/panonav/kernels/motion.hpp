#pragma once

#include <cstdint>
#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Draws two independent normal deviates of each number, of mean 0 and deviation 1, as
/// `Random::normal_pair` makes them of one number of the generator; the last bits differ. Spans of
/// one size; throws ContractError otherwise. All instruction sets give the same bits. Cost: 2 ns a
/// pair with AVX-512.
void normal_pairs(std::span<const std::uint64_t> bits, std::span<float> first,
                  std::span<float> second, Instructions instructions);

/// Poses in the plane, one array for each coordinate.
struct PoseColumns {
  /// Steps, one for each pose, in the frame of the robot before it.
  struct Steps {
    std::span<const double> forward_m,       ///< along the robot's heading
        left_m;                              ///< to the left of it
    std::span<const double> turn_error_rad;  ///< true turn less `turn_rad`
    double turn_rad;                  ///< what each heading turns by before its error is added
    double turn_share_before_travel;  ///< of the error of the turn, made before the travel
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
