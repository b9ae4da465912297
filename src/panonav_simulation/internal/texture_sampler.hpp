#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// A material prepared for fast sampling: its colour, and its texture with mip maps, in grey or in
/// three channels.
class MaterialSampler {
 public:
  MaterialSampler(const Material& material, int channels);

  /// Writes `channels` values of the material at texture coordinates (u, v). `footprint` is the
  /// size of the pixel on the surface in texture coordinates; smaller details are averaged.
  void sample(float u, float v, float footprint, float* values) const;
  [[nodiscard]] float emission() const noexcept { return emission_; }
  [[nodiscard]] bool textured() const noexcept { return !levels_.empty(); }

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> texels;
  };
  void add_bilinear_sample(const Level& level, float u, float v, float weight, float* values) const;

  int channels_;
  float emission_;
  std::array<float, 3> scale_{};  // factor of texels; the value itself without texture
  float max_side_ = 1.0F;
  std::vector<Level> levels_;
};

}  // namespace panonav::simulation
