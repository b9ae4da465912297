#pragma once

#include "panonav/motion/velocity.hpp"

namespace panonav {

/// Computes the command of `compute_command_towards` without its checks, without exceptions and
/// with the same bits on a microcontroller. The caller guarantees valid options, a finite direction
/// and a finite distance of at least 0.
[[nodiscard]] Velocity command_towards(double direction_rad, double distance_m,
                                       const BaseOptions& options) noexcept;

}  // namespace panonav
