#include "panonav/localisation/internal/particle_motion.hpp"

#include <algorithm>
#include <array>

#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/motion.hpp"

namespace panonav {

namespace {

constexpr std::size_t most = 128;  // at a time, so that all stays in the first-level cache
using Numbers = std::array<double, most>;

void move_block(std::span<Particle> particles, const StepSampler& sampler, Random& random) {
  const std::size_t count = particles.size();
  const kernels::Instructions instructions = kernels::chosen_instructions();
  std::array<std::uint64_t, most> bits, further_bits;
  for (std::size_t i = 0; i < count; ++i) {
    bits[i] = random.next();
    if (sampler.holonomic()) further_bits[i] = random.next();
  }
  std::array<float, most> first, second, third, unused;
  const auto draw = [&](const auto& from, auto& x, auto& y) {
    kernels::normal_pairs(std::span(from).first(count), std::span(x).first(count),
                          std::span(y).first(count), instructions);
  };
  draw(bits, first, second);
  if (sampler.holonomic()) draw(further_bits, third, unused);

  Numbers x_m, y_m, heading_rad, forward_m, left_m, turn_error_rad;
  for (std::size_t i = 0; i < count; ++i) {
    const Pose2 error =
        sampler.error_of(static_cast<double>(first[i]), static_cast<double>(second[i]),
                         sampler.holonomic() ? static_cast<double>(third[i]) : 0.0);
    forward_m[i] = sampler.step().x_m + error.x_m;
    left_m[i] = sampler.step().y_m + error.y_m;
    turn_error_rad[i] = error.heading_rad;
    x_m[i] = particles[i].pose.x_m;
    y_m[i] = particles[i].pose.y_m;
    heading_rad[i] = particles[i].pose.heading_rad;
  }
  const auto part = [count](Numbers& numbers) { return std::span(numbers).first(count); };
  kernels::move_poses({part(x_m), part(y_m), part(heading_rad)},
                      {part(forward_m), part(left_m), part(turn_error_rad),
                       sampler.step().heading_rad, sampler.share_before()},
                      instructions);
  for (std::size_t i = 0; i < count; ++i) {
    particles[i].pose = {x_m[i], y_m[i], wrap_angle(heading_rad[i])};
  }
}

}  // namespace

void move_particles(std::span<Particle> particles, const StepSampler& sampler, Random& random) {
  while (!particles.empty()) {
    const std::size_t count = std::min(most, particles.size());
    move_block(particles.first(count), sampler, random);
    particles = particles.subspan(count);
  }
}

}  // namespace panonav
