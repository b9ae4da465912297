#include "panonav/motion/command.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/portable_math.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

Velocity command_towards(double direction_rad, double distance_m,
                         const BaseOptions& options) noexcept {
  if (distance_m == 0.0) return {};
  const double speed = std::min(options.speed_m_s, distance_m / options.period_s);
  if (options.drive == DriveKind::holonomic) {
    const auto [cosine, sine] = portable::cosine_sine(direction_rad);
    return {speed * cosine, speed * sine, 0.0};
  }
  const double angle = wrap_angle(direction_rad);
  const double turn = std::clamp(angle / options.period_s, -options.turn_rad_s, options.turn_rad_s);
  if (std::abs(angle) > options.on_spot_rad) return {0.0, 0.0, turn};
  const auto [cosine, sine] = portable::cosine_sine(angle);
  // Limits the speed so that the largest rotation speed suffices for the arc to the point, whose
  // curvature is 2 sin(angle) / distance.
  const double arc = 0.5 * options.turn_rad_s * distance_m / std::max(std::abs(sine), 1e-9);
  const double forward = std::min(speed * cosine, arc);
  return {forward, 0.0, turn};
}

}  // namespace panonav
