#include <cmath>

#include "panonav/kernels/polar_targets.hpp"

namespace panonav::kernels::scalar {

void to_polar(const PolarJob& job) {
  constexpr float pi = 3.14159265358979323846F;
  for (int i = 0; i < job.count; ++i) {
    const float magnitude =
        std::sqrt(job.real[i] * job.real[i] + job.imaginary[i] * job.imaginary[i]);
    const float phase = std::atan2(job.imaginary[i], job.real[i]);
    job.magnitudes[i] = magnitude;
    job.phases_rad[i] = magnitude > 0.0F ? (phase >= pi ? -pi : phase) : 0.0F;
  }
}

}  // namespace panonav::kernels::scalar
