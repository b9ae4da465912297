#include "panonav/kernels/polar.hpp"

#include <string>

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

void to_polar(std::span<const float> real, std::span<const float> imaginary,
              std::span<float> magnitudes, std::span<float> phases_rad, Instructions instructions) {
  for (const std::size_t size : {imaginary.size(), magnitudes.size(), phases_rad.size()}) {
    require(size == real.size(), "number of values", static_cast<double>(size),
            std::to_string(real.size()) + " (as of real parts)");
  }
  with_body<PolarBody>(instructions, [&](auto body) {
    body.to_polar(real.data(), imaginary.data(), magnitudes.data(), phases_rad.data(),
                  static_cast<int>(real.size()));
  });
}

}  // namespace panonav::kernels
