#include "panonav_simulation/internal/texture_sampler.hpp"

#include <algorithm>
#include <cmath>

namespace panonav::simulation {

namespace {

constexpr std::array<float, 3> grey_weights{0.299F, 0.587F, 0.114F};  // ITU-R BT.601

float compute_grey(const std::array<float, 3>& colour) {
  return grey_weights[0] * colour[0] + grey_weights[1] * colour[1] + grey_weights[2] * colour[2];
}

}  // namespace

MaterialSampler::MaterialSampler(const Material& material, int channels)
    : channels_(channels), emission_(material.emission) {
  const float grey_scale = compute_grey(material.colour);
  scale_ =
      channels == 1 ? std::array<float, 3>{grey_scale, grey_scale, grey_scale} : material.colour;
  if (!material.texture) return;
  const Image& image = *material.texture;
  for (float& scale : scale_) scale /= 255.0F;
  Level base{image.width(), image.height(), {}};
  const auto pixels = static_cast<std::size_t>(image.width()) * image.height();
  base.texels.resize(pixels * channels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::uint8_t* texel = image.pixels().data() + i * image.channels();
    std::array<float, 3> colour{};
    for (int c = 0; c < 3; ++c) colour[c] = texel[image.channels() == 3 ? c : 0];
    if (channels == 3) {
      for (int c = 0; c < 3; ++c) base.texels[3 * i + c] = texel[image.channels() == 3 ? c : 0];
    } else if (grey_scale > 0.0F) {
      // Multiply by the material's colour before converting to grey, as a grey camera would measure
      // it.
      for (int c = 0; c < 3; ++c) colour[c] *= material.colour[c];
      base.texels[i] = static_cast<std::uint8_t>(
          std::clamp(compute_grey(colour) / grey_scale + 0.5F, 0.0F, 255.0F));
    }
  }
  max_side_ = static_cast<float>(std::max(base.width, base.height));
  levels_.push_back(std::move(base));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& finer = levels_.back();
    Level coarser{std::max(1, finer.width / 2), std::max(1, finer.height / 2), {}};
    coarser.texels.resize(static_cast<std::size_t>(coarser.width) * coarser.height * channels);
    for (int y = 0; y < coarser.height; ++y) {
      // With an odd size the last texel is averaged with its neighbour.
      const int y0 = y * finer.height / coarser.height;
      const int y1 = (y + 1) * finer.height / coarser.height;
      for (int x = 0; x < coarser.width; ++x) {
        const int x0 = x * finer.width / coarser.width;
        const int x1 = (x + 1) * finer.width / coarser.width;
        const unsigned count = static_cast<unsigned>((y1 - y0) * (x1 - x0));
        for (int c = 0; c < channels; ++c) {
          unsigned sum = 0;
          for (int v = y0; v < y1; ++v) {
            for (int u = x0; u < x1; ++u) {
              sum += finer.texels[(static_cast<std::size_t>(v) * finer.width + u) * channels + c];
            }
          }
          coarser.texels[(static_cast<std::size_t>(y) * coarser.width + x) * channels + c] =
              static_cast<std::uint8_t>((sum + count / 2) / count);
        }
      }
    }
    levels_.push_back(std::move(coarser));
  }
}

void MaterialSampler::add_bilinear_sample(const Level& level, float u, float v, float weight,
                                          float* values) const {
  const float x = u * static_cast<float>(level.width) - 0.5F;
  const float y = v * static_cast<float>(level.height) - 0.5F;
  const float x_floor = std::floor(x);
  const float y_floor = std::floor(y);
  const float fx = x - x_floor;
  const float fy = y - y_floor;
  // u and v are in [0, 1], so the neighbours are at most one texel outside the texture.
  const auto wrap = [](int i, int n) { return i < 0 ? i + n : (i >= n ? i - n : i); };
  const int x0 = wrap(static_cast<int>(x_floor), level.width);
  const int y0 = wrap(static_cast<int>(y_floor), level.height);
  const int x1 = wrap(x0 + 1, level.width);
  const int y1 = wrap(y0 + 1, level.height);
  const std::uint8_t* upper =
      level.texels.data() + static_cast<std::size_t>(y0) * level.width * channels_;
  const std::uint8_t* lower =
      level.texels.data() + static_cast<std::size_t>(y1) * level.width * channels_;
  for (int c = 0; c < channels_; ++c) {
    const float a = upper[x0 * channels_ + c];
    const float b = upper[x1 * channels_ + c];
    const float d = lower[x0 * channels_ + c];
    const float e = lower[x1 * channels_ + c];
    const float top = a + fx * (b - a);
    const float bottom = d + fx * (e - d);
    values[c] += weight * scale_[c] * (top + fy * (bottom - top));
  }
}

void MaterialSampler::sample(float u, float v, float footprint, float* values) const {
  if (levels_.empty()) {
    std::copy_n(scale_.data(), channels_, values);
    return;
  }
  std::fill_n(values, channels_, 0.0F);
  u -= std::floor(u);
  v = std::ceil(v) - v;  // v runs upwards, rows run downwards
  const float level = std::log2(std::max(1.0F, footprint * max_side_));
  const auto last = static_cast<float>(levels_.size() - 1);
  if (level <= 0.0F) {
    add_bilinear_sample(levels_.front(), u, v, 1.0F, values);
  } else if (level >= last) {
    add_bilinear_sample(levels_.back(), u, v, 1.0F, values);
  } else {
    const auto finer_level = static_cast<std::size_t>(level);
    const float fraction = level - static_cast<float>(finer_level);
    add_bilinear_sample(levels_[finer_level], u, v, 1.0F - fraction, values);
    add_bilinear_sample(levels_[finer_level + 1], u, v, fraction, values);
  }
}

}  // namespace panonav::simulation
