#include "panonav/localisation/internal/particle_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/motion.hpp"

namespace panonav {

namespace {

/// Number of particles moved together; their data fit into the first-level cache.
constexpr std::size_t block_size = 128;
using Numbers = std::array<double, block_size>;

void move_block(const kernels::PoseColumns& poses, const StepSampler& sampler, Random& random) {
  const std::size_t count = poses.x_m.size();
  const kernels::Instructions instructions = kernels::chosen_instructions();
  std::array<std::uint64_t, block_size> bits, further_bits;
  for (std::size_t i = 0; i < count; ++i) {
    bits[i] = random.next();
    if (sampler.is_holonomic()) further_bits[i] = random.next();
  }
  std::array<float, block_size> first, second, third, unused;
  const auto draw = [&](const auto& from, auto& x, auto& y) {
    kernels::normal_pairs(std::span(from).first(count), std::span(x).first(count),
                          std::span(y).first(count), instructions);
  };
  draw(bits, first, second);
  if (sampler.is_holonomic()) draw(further_bits, third, unused);

  Numbers forward_m, left_m, turn_error_rad;
  for (std::size_t i = 0; i < count; ++i) {
    const Pose2 error =
        sampler.error_from_deviates(static_cast<double>(first[i]), static_cast<double>(second[i]),
                                    sampler.is_holonomic() ? static_cast<double>(third[i]) : 0.0);
    forward_m[i] = sampler.step().x_m + error.x_m;
    left_m[i] = sampler.step().y_m + error.y_m;
    turn_error_rad[i] = error.heading_rad;
  }
  const auto part = [count](Numbers& numbers) { return std::span(numbers).first(count); };
  kernels::move_poses(poses,
                      {part(forward_m), part(left_m), part(turn_error_rad),
                       sampler.step().heading_rad, sampler.turn_share_before_travel()},
                      instructions);
  for (double& heading_rad : poses.heading_rad) heading_rad = wrap_angle(heading_rad);
}

}  // namespace

void move_particles(Particles& particles, const StepSampler& sampler, Random& random) {
  for (std::size_t begin = 0; begin < particles.size(); begin += block_size) {
    const auto part = [begin](std::vector<double>& column) {
      return std::span(column).subspan(begin, std::min(block_size, column.size() - begin));
    };
    move_block({part(particles.x_m), part(particles.y_m), part(particles.heading_rad)}, sampler,
               random);
  }
}

void spread_particles(Particles& particles, double deviation_m, double heading_deviation_rad,
                      Random& random) {
  require(std::isfinite(deviation_m) && deviation_m >= 0.0, "deviation_m", deviation_m, ">= 0");
  require(std::isfinite(heading_deviation_rad) && heading_deviation_rad >= 0.0,
          "heading_deviation_rad", heading_deviation_rad, ">= 0");
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const double x = random.normal(particles.x_m[i], deviation_m);
    const double y = random.normal(particles.y_m[i], deviation_m);
    const double heading = random.normal(particles.heading_rad[i], heading_deviation_rad);
    particles.set(i, {x, y, wrap_angle(heading)}, particles.weight[i]);
  }
}

}  // namespace panonav
