#include "panonav/signature/fourier_signature.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/polar.hpp"

namespace panonav {

namespace {

/// Wraps a phase to [-pi, pi). The float nearest to an angle just below pi is pi itself, which the
/// invariant excludes and which becomes -pi.
float wrap_phase(double phase_rad) {
  const float phase = static_cast<float>(wrap_angle(phase_rad));
  return phase >= std::numbers::pi_v<float> ? -std::numbers::pi_v<float> : phase;
}

void check_full_scale(float full_scale) {
  require(std::isfinite(full_scale) && full_scale > 0.0F, "full_scale", full_scale, "finite, > 0");
}

}  // namespace

FourierSignature::FourierSignature(SignatureShape shape, std::vector<float> magnitudes,
                                   std::vector<float> phases_rad,
                                   std::optional<ElevationBand> elevations)
    : shape_(shape),
      magnitudes_(std::move(magnitudes)),
      phases_rad_(std::move(phases_rad)),
      elevations_(elevations) {
  require(shape.rows >= 1, "signature rows", shape.rows, ">= 1");
  require(shape.components >= 1, "signature components", shape.components, ">= 1");
  const std::string expected = to_text(static_cast<double>(shape.size()));
  require(magnitudes_.size() == shape.size(), "number of magnitudes",
          static_cast<double>(magnitudes_.size()), expected);
  require(phases_rad_.size() == shape.size(), "number of phases",
          static_cast<double>(phases_rad_.size()), expected);
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const float magnitude = magnitudes_[i];
    const float phase = phases_rad_[i];
    require(magnitude >= 0.0F && std::isfinite(magnitude), "magnitude", magnitude, "finite, >= 0");
    require(phase >= -std::numbers::pi_v<float> && phase < std::numbers::pi_v<float>, "phase",
            phase, "[-pi, pi)");
    require(magnitude != 0.0F || phase == 0.0F, "phase of magnitude 0", phase, "0");
  }
}

FourierSignature compute_signature(const Panorama& panorama, int components) {
  return compute_signature(panorama, kernels::RowTransform(panorama.columns(), components));
}

FourierSignature compute_signature(const Panorama& panorama,
                                   const kernels::RowTransform& transform) {
  require(panorama.columns() == transform.columns(), "panorama columns", panorama.columns(),
          std::to_string(transform.columns()) + " (as the transform)");
  const SignatureShape shape{panorama.rows(), transform.components()};
  std::vector<float> real(shape.size());
  std::vector<float> imaginary(shape.size());
  transform(panorama.values(), real, imaginary, static_cast<std::size_t>(shape.rows),
            kernels::chosen_instructions());
  std::vector<float> magnitudes(shape.size());
  std::vector<float> phases(shape.size());
  kernels::to_polar(real, imaginary, magnitudes, phases, kernels::chosen_instructions());
  return {shape, std::move(magnitudes), std::move(phases), panorama.elevations()};
}

FourierSignature turn(const FourierSignature& signature, double turn_rad) {
  require(std::isfinite(turn_rad), "turn_rad", turn_rad, "finite");
  std::vector<float> magnitudes(signature.magnitudes().begin(), signature.magnitudes().end());
  std::vector<float> phases(signature.phases_rad().begin(), signature.phases_rad().end());
  for (int k = 1; k < signature.components(); ++k) {
    const double change = wrap_angle(k * turn_rad);
    for (int y = 0; y < signature.rows(); ++y) {
      const auto i = static_cast<std::size_t>(k) * signature.rows() + y;
      if (magnitudes[i] != 0.0F) phases[i] = wrap_phase(phases[i] + change);
    }
  }
  return {signature.shape(), std::move(magnitudes), std::move(phases), signature.elevations()};
}

PackedSignature pack(const FourierSignature& signature, float full_scale) {
  check_full_scale(full_scale);
  const std::size_t size = signature.shape().size();
  PackedSignature packed{signature.shape(), std::vector<std::uint8_t>(size),
                         std::vector<std::uint8_t>(size)};
  const float scale = 255.0F / full_scale;
  constexpr float steps = 128.0F / std::numbers::pi_v<float>;
  for (std::size_t i = 0; i < size; ++i) {
    const float magnitude = std::min(signature.magnitudes()[i] * scale, 255.0F);
    packed.magnitudes[i] = static_cast<std::uint8_t>(magnitude + 0.5F);
    // Adds 256.5 instead of 0.5 to keep the number positive, so that truncation rounds it; the 256
    // vanish in the cast to a byte.
    const int step = static_cast<int>(signature.phases_rad()[i] * steps + 256.5F);
    packed.phases[i] =
        packed.magnitudes[i] == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(step);
  }
  return packed;
}

FourierSignature unpack(const PackedSignature& packed, float full_scale,
                        std::optional<ElevationBand> elevations) {
  check_full_scale(full_scale);
  const std::size_t size = packed.shape.size();
  require(packed.magnitudes.size() == size && packed.phases.size() == size,
          "bytes of a packed signature",
          static_cast<double>(std::min(packed.magnitudes.size(), packed.phases.size())),
          to_text(static_cast<double>(size)));
  std::vector<float> magnitudes(size);
  std::vector<float> phases(size);
  for (std::size_t i = 0; i < size; ++i) {
    magnitudes[i] = static_cast<float>(packed.magnitudes[i]) * (full_scale / 255.0F);
    phases[i] = packed.magnitudes[i] == 0
                    ? 0.0F
                    : static_cast<float>(static_cast<std::int8_t>(packed.phases[i])) *
                          (std::numbers::pi_v<float> / 128.0F);
  }
  return {packed.shape, std::move(magnitudes), std::move(phases), elevations};
}

}  // namespace panonav
