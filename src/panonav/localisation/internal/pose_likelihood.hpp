#pragma once

#include <span>

#include "panonav/localisation/particles.hpp"

namespace panonav {

/// Likelihood of one image at any pose, by which particles are weighted.
class PoseLikelihood {
 public:
  virtual ~PoseLikelihood() = default;
  /// Computes the log-likelihood of the image at each pose relative to an image that says nothing.
  virtual void compute_log_ratios(const Particles& particles, std::span<double> ratios) = 0;
  /// Brings the particles into the order in which they are weighted fastest.
  virtual void reorder(Particles& /*particles*/) {}
};

}  // namespace panonav
