#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/core/random.hpp"

namespace panonav::testing {

enum class Surroundings { dark, plain, lamps, textured };

/// A picture of a mirror, painted without any camera model: a scene of straight-sided patches in
/// polar coordinates inside the rim, a disc in the middle, optional ring, arm and vignetting, blur
/// and noise.
struct MirrorPicture {
  ImageSize size{640, 480};
  PixelPoint centre{322.3, 238.6};
  double rim_px = 210.0;
  double disc_px = 45.0;  ///< 0: none
  double ring_px = 0.0;   ///< width of the holder's ring; 0: none
  double ring_grey = 20.0;
  double arm_width_rad = 0.0;  ///< holder arm across mirror and surroundings
  double arm_angle_rad = 1.0;
  Surroundings surroundings = Surroundings::dark;
  double contrast = 1.0;
  double noise = 2.0;  ///< standard deviation in grey levels
  double blur_px = 0.8;
  bool colour = false;
  std::uint64_t seed = 1;  ///< of scene and noise
  std::uint64_t surroundings_seed = 1;
};

/// Random rectangles in any two coordinates of period (0 .. 1) x (0 .. 1), as a fine raster.
class Patches {
 public:
  explicit Patches(std::uint64_t seed, int count = 160) {
    Random random(seed, 7);
    std::array<double, 3> base{};
    for (double& grey : base) grey = random.uniform(60, 180);
    raster_.assign(static_cast<std::size_t>(across) * down, base);
    for (int i = 0; i < count; ++i) {
      const auto left = static_cast<int>(random.index(across));
      const auto top = static_cast<int>(random.index(down));
      const int width = static_cast<int>(random.uniform(0.01, 0.12) * across);
      const int height = static_cast<int>(random.uniform(0.02, 0.25) * down);
      std::array<double, 3> colour{};
      for (double& grey : colour) grey = random.uniform(15, 240);
      for (int y = top; y < std::min(down, top + height); ++y) {
        for (int x = left; x < left + width; ++x) raster_[cell(x % across, y)] = colour;
      }
    }
  }
  [[nodiscard]] double at(double x, double y, int channel) const {
    const int column = static_cast<int>((x - std::floor(x)) * across) % across;
    const int row = std::clamp(static_cast<int>(y * down), 0, down - 1);
    return raster_[cell(column, row)][static_cast<std::size_t>(channel)];
  }

 private:
  static constexpr int across = 2048;
  static constexpr int down = 512;
  static std::size_t cell(int x, int y) {
    return static_cast<std::size_t>(y) * across + static_cast<std::size_t>(x);
  }
  std::vector<std::array<double, 3>> raster_;
};

inline double surroundings_grey(const MirrorPicture& p, const Patches& patches, double u, double v,
                                int channel) {
  switch (p.surroundings) {
    case Surroundings::dark:
      return 8;
    case Surroundings::plain:
      return 150 + 30 * (u / p.size.width);
    case Surroundings::lamps: {
      double grey = 60 + 40 * (v / p.size.height);
      for (int i = 0; i < 4; ++i) {
        const double du = u - p.size.width * (0.1 + 0.27 * i);
        const double dv = v - p.size.height * (0.15 + 0.7 * (i % 2));
        grey += 180 * std::exp(-(du * du + dv * dv) / (2 * 30 * 30));
      }
      return std::min(255.0, grey);
    }
    case Surroundings::textured:
      return patches.at(u / p.size.width, v / p.size.height, channel);
  }
  return 0;
}

inline Image paint(const MirrorPicture& p) {
  constexpr double pi = std::numbers::pi;
  const int channels = p.colour ? 3 : 1;
  const Patches scene(p.seed);
  const Patches outside(p.surroundings_seed + 1000);
  Random random(p.seed, 11);
  const auto ideal = [&](double u, double v, int channel) {
    const double x = u - p.centre.u_px;
    const double y = v - p.centre.v_px;
    const double r = std::hypot(x, y);
    const double angle = std::atan2(y, x);
    double grey = 0;
    if (r < p.disc_px) {
      grey = 12;
    } else if (r < p.rim_px) {
      grey = scene.at(angle / (2 * pi) + 0.5, (r - p.disc_px) / (p.rim_px - p.disc_px), channel);
    } else if (r < p.rim_px + p.ring_px) {
      grey = p.ring_grey;
    } else {
      grey = surroundings_grey(p, outside, u, v, channel);
    }
    double off = angle - p.arm_angle_rad;
    off -= 2 * pi * std::round(off / (2 * pi));
    if (r > p.disc_px && std::abs(off) < 0.5 * p.arm_width_rad) grey = 35;
    return 128 + p.contrast * (grey - 128);
  };
  // Pixel value: mean over a disc of samples as wide as the blur.
  std::vector<std::array<double, 2>> offsets;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      offsets.push_back({0.5 + (i - 1) * p.blur_px * 0.8, 0.5 + (j - 1) * p.blur_px * 0.8});
    }
  }
  Image image(p.size.width, p.size.height, channels);
  for (int v = 0; v < p.size.height; ++v) {
    for (int u = 0; u < p.size.width; ++u) {
      for (int c = 0; c < channels; ++c) {
        double sum = 0;
        for (const auto& offset : offsets) sum += ideal(u + offset[0], v + offset[1], c);
        const double value = sum / static_cast<double>(offsets.size()) + random.normal(0, p.noise);
        image.at(u, v, c) = static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
      }
    }
  }
  return image;
}

/// Pictures without a mirror.
enum class Plain { black, noise, gradient, patches, checkerboard, stripes, discs };

inline Image paint_without_mirror(Plain kind, ImageSize size, std::uint64_t seed) {
  Random random(seed, 3);
  const Patches patches(seed, 200);
  struct Disc {
    double u, v, radius, grey;
  };
  std::vector<Disc> discs;
  for (int i = 0; i < 60; ++i) {
    discs.push_back({random.uniform(0, size.width), random.uniform(0, size.height),
                     random.uniform(0.02, 0.12) * size.height, random.uniform(20, 235)});
  }
  const double angle = random.uniform(0, 3);
  const double period = random.uniform(11, 47);
  Image image(size.width, size.height, 1);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const double x = (u * std::cos(angle) + v * std::sin(angle)) / period;
      const double y = (v * std::cos(angle) - u * std::sin(angle)) / period;
      double grey = 0;
      switch (kind) {
        case Plain::black:
          break;
        case Plain::noise:
          grey = random.uniform(0, 255);
          break;
        case Plain::gradient:
          grey = 40 + 150.0 * u / size.width + random.normal(0, 2);
          break;
        case Plain::patches:
          grey = patches.at(static_cast<double>(u) / size.width,
                            static_cast<double>(v) / size.height, 0) +
                 random.normal(0, 2);
          break;
        case Plain::checkerboard:
          grey = (static_cast<long>(std::floor(x)) + static_cast<long>(std::floor(y))) % 2 == 0
                     ? 220
                     : 30;
          break;
        case Plain::stripes:
          grey = 128 + 100 * std::sin(2 * std::numbers::pi * x) + random.normal(0, 3);
          break;
        case Plain::discs:
          grey = 90;
          for (const Disc& disc : discs) {
            if (std::hypot(u - disc.u, v - disc.v) < disc.radius) grey = disc.grey;
          }
          break;
      }
      image.at(u, v) = static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L));
    }
  }
  return image;
}

}  // namespace panonav::testing
