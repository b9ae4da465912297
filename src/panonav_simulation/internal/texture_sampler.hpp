#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// A material ready to be looked up fast: its colour and its texture with all smaller copies of it
/// (mip maps), in grey or in three channels.
class MaterialSampler {
 public:
  MaterialSampler(const Material& material, int channels);

  /// Writes `channels` values. `footprint` is the size of the pixel on the surface in texture
  /// coordinates: details smaller than it are averaged away.
  void sample(float u, float v, float footprint, float* values) const;
  [[nodiscard]] float emission() const noexcept { return emission_; }
  [[nodiscard]] bool textured() const noexcept { return !levels_.empty(); }

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> texels;
  };
  void bilinear(const Level& level, float u, float v, float weight, float* values) const;

  int channels_;
  float emission_;
  std::array<float, 3> scale_{};  // value = scale * texel, or the value itself without a texture
  float max_side_ = 1.0F;
  std::vector<Level> levels_;
};

}  // namespace panonav::simulation
