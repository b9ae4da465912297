#pragma once

#include <numbers>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::testing {

/// Magnitudes 0.1 .. 1 and phases all over the circle; k = 0 is real and positive, as for a view.
inline FourierSignature random_signature(Random& random, SignatureShape shape) {
  std::vector<float> magnitudes(shape.size());
  std::vector<float> phases(shape.size());
  for (std::size_t i = 0; i < shape.size(); ++i) {
    magnitudes[i] = static_cast<float>(random.uniform(0.1, 1.0));
    phases[i] = i < static_cast<std::size_t>(shape.rows)
                    ? 0.0F
                    : static_cast<float>(random.uniform(-3.14, 3.14));
  }
  return {shape, std::move(magnitudes), std::move(phases), std::nullopt};
}

/// Every value independent and uniform in [0, 1).
inline Panorama random_panorama(Random& random, int rows, int columns,
                                std::optional<ElevationBand> elevations = std::nullopt) {
  Panorama panorama(rows, columns, elevations);
  for (float& value : panorama.values()) value = static_cast<float>(random.uniform());
  return panorama;
}

}  // namespace panonav::testing
