#include "panonav_simulation/texture.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace panonav::simulation {

namespace {

// Periodic value noise: random values on a lattice of `cells` x `cells`, smoothly interpolated.
class LatticeNoise {
 public:
  LatticeNoise(Random& random, int cells_u, int cells_v)
      : cells_u_(cells_u), cells_v_(cells_v), values_(static_cast<std::size_t>(cells_u) * cells_v) {
    for (auto& value : values_) value = static_cast<float>(random.normal());
  }
  // s, t in [0, 1).
  [[nodiscard]] float at(double s, double t) const {
    const double u = s * cells_u_;
    const double v = t * cells_v_;
    const int u0 = static_cast<int>(u) % cells_u_;
    const int v0 = static_cast<int>(v) % cells_v_;
    const int u1 = (u0 + 1) % cells_u_;
    const int v1 = (v0 + 1) % cells_v_;
    const auto fu = static_cast<float>(smooth(u - std::floor(u)));
    const auto fv = static_cast<float>(smooth(v - std::floor(v)));
    return (1.0F - fv) * ((1.0F - fu) * get(u0, v0) + fu * get(u1, v0)) +
           fv * ((1.0F - fu) * get(u0, v1) + fu * get(u1, v1));
  }

 private:
  static double smooth(double x) { return x * x * (3.0 - 2.0 * x); }
  [[nodiscard]] float get(int u, int v) const {
    return values_[static_cast<std::size_t>(v) * cells_u_ + u];
  }
  int cells_u_, cells_v_;
  std::vector<float> values_;
};

// Makes a periodic field of standard deviation about 1 whose power falls as 1 / f^exponent.
std::vector<float> noise_field(Random& random, int width, int height, double exponent) {
  std::vector<float> field(static_cast<std::size_t>(width) * height);
  double energy = 0.0;
  for (int cells = 2; cells <= std::max(width, height) / 2; cells *= 2) {
    const double amplitude = std::pow(static_cast<double>(cells), 0.5 * (2.0 - exponent) - 0.5);
    energy += amplitude * amplitude * 0.4;  // interpolation reduces the variance of a lattice
    const LatticeNoise octave(random, std::min(cells, width), std::min(cells, height));
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        field[static_cast<std::size_t>(v) * width + u] +=
            static_cast<float>(amplitude) *
            octave.at(static_cast<double>(u) / width, static_cast<double>(v) / height);
      }
    }
  }
  const auto scale = static_cast<float>(1.0 / std::sqrt(std::max(energy, 1e-12)));
  for (auto& value : field) value *= scale;
  return field;
}

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(value, 0.0F, 1.0F)));
}

void set_pixel(Image& image, int u, int v, Colour colour, float factor = 1.0F) {
  for (int c = 0; c < 3; ++c) {
    image.at(u, v, c) = to_byte(colour[static_cast<std::size_t>(c)] * factor);
  }
}

void fill_rectangle(Image& image, int u0, int v0, int u1, int v1, Colour colour) {
  for (int v = std::max(0, v0); v < std::min(image.height(), v1); ++v) {
    for (int u = std::max(0, u0); u < std::min(image.width(), u1); ++u)
      set_pixel(image, u, v, colour);
  }
}

// Varies the brightness of a finished picture as light and dirt do, so that no surface has a
// uniform colour.
void add_weathering(Random& random, Image& image, double contrast) {
  const auto field = noise_field(random, image.width(), image.height(), 2.0);
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      const float factor = 1.0F + static_cast<float>(contrast) *
                                      field[static_cast<std::size_t>(v) * image.width() + u];
      for (int c = 0; c < 3; ++c) {
        image.at(u, v, c) = to_byte(static_cast<float>(image.at(u, v, c)) / 255.0F * factor);
      }
    }
  }
}

}  // namespace

Colour sample_colour(Random& random, double low, double high, double spread) {
  const double level = random.uniform(low, high);
  Colour colour{};
  for (float& channel : colour) {
    channel = static_cast<float>(level * random.uniform(1.0 - spread, 1.0 + spread));
  }
  return colour;
}

Colour vary_colour(Random& random, Colour colour, double spread) {
  const auto factor = static_cast<float>(random.uniform(1.0 - spread, 1.0 + spread));
  for (float& channel : colour) channel *= factor;
  return colour;
}

Image noise_texture(Random& random, int size, Colour base, double contrast, double exponent) {
  Image image(size, size, 3);
  const auto field = noise_field(random, size, size, exponent);
  for (int v = 0; v < size; ++v) {
    for (int u = 0; u < size; ++u) {
      set_pixel(
          image, u, v, base,
          1.0F + static_cast<float>(contrast) * field[static_cast<std::size_t>(v) * size + u]);
    }
  }
  return image;
}

Image wood_texture(Random& random, int size, Colour base) {
  Image image(size, size, 3);
  const LatticeNoise grain(random, std::min(size, 64), 4);
  const LatticeNoise fine(random, std::min(size, 256), 8);
  constexpr int board_count = 4;
  std::vector<float> tone(board_count);
  for (auto& t : tone) t = static_cast<float>(random.uniform(0.8, 1.2));
  for (int v = 0; v < size; ++v) {
    for (int u = 0; u < size; ++u) {
      const double s = static_cast<double>(u) / size;
      const double t = static_cast<double>(v) / size;
      const int board = static_cast<int>(s * board_count);
      const double within = s * board_count - board;
      float factor = tone[static_cast<std::size_t>(board)] *
                     (1.0F + 0.10F * grain.at(s, t) + 0.06F * fine.at(s, t));
      if (within < 0.02) factor *= 0.5F;
      set_pixel(image, u, v, base, factor);
    }
  }
  return image;
}

Image brick_texture(Random& random, int size, int columns, int rows, Colour brick, Colour joint) {
  Image image(size, size, 3);
  std::vector<float> tone(static_cast<std::size_t>(columns) * rows);
  for (auto& t : tone) t = static_cast<float>(random.uniform(0.7, 1.25));
  for (int v = 0; v < size; ++v) {
    const double y = static_cast<double>(v) / size * rows;
    const int row = static_cast<int>(y);
    for (int u = 0; u < size; ++u) {
      const double x =
          static_cast<double>(u) / size * columns + (row % 2 == 1 && columns > 1 ? 0.5 : 0.0);
      const int column = static_cast<int>(x) % columns;
      const double fx = x - std::floor(x);
      const double fy = y - row;
      const bool is_joint = fx < 0.05 || fy < 0.08;
      if (is_joint) {
        set_pixel(image, u, v, joint);
      } else {
        set_pixel(image, u, v, brick, tone[static_cast<std::size_t>(row) * columns + column]);
      }
    }
  }
  add_weathering(random, image, 0.08);
  return image;
}

Image bookshelf_texture(Random& random, int size, int boards) {
  Image image(size, size, 3);
  // The books of a shelf have similar brightness, as if from one series.
  const double level = random.uniform(0.15, 0.65);
  const Colour board{0.45F, 0.35F, 0.25F};
  fill_rectangle(image, 0, 0, size, size, {0.12F, 0.10F, 0.09F});
  const int height = size / boards;
  for (int b = 0; b < boards; ++b) {
    const int bottom = (b + 1) * height;
    int u = 0;
    while (u < size) {
      const int width = std::max(2, static_cast<int>(random.uniform(0.012, 0.07) * size));
      if (random.uniform() > 0.15) {
        const int top = bottom - static_cast<int>(height * random.uniform(0.55, 0.88));
        fill_rectangle(image, u, top, u + width - 1, bottom,
                       sample_colour(random, 0.6 * level, 1.4 * level, 0.3));
        if (random.uniform() < 0.4) {
          const int label = top + height / 6;
          fill_rectangle(image, u + width / 4, label, u + 3 * width / 4, label + height / 8,
                         {0.9F, 0.9F, 0.85F});
        }
      }
      u += width;
    }
    fill_rectangle(image, 0, bottom - std::max(2, height / 16), size, bottom, board);
  }
  add_weathering(random, image, 0.05);
  return image;
}

Image poster_texture(Random& random, int size) {
  Image image(size, size, 3);
  const double level = random.uniform(0.2, 0.75);
  fill_rectangle(image, 0, 0, size, size, sample_colour(random, level, level, 0.3));
  const int shapes = 3 + static_cast<int>(random.index(5));
  for (int i = 0; i < shapes; ++i) {
    const Colour colour = sample_colour(random, 0.4 * level, 1.6 * level, 0.5);
    const double cu = random.uniform(0.0, 1.0) * size;
    const double cv = random.uniform(0.0, 1.0) * size;
    const double ru = random.uniform(0.08, 0.35) * size;
    const double rv = random.uniform(0.08, 0.35) * size;
    const bool ellipse = random.uniform() < 0.5;
    for (int v = std::max(0, static_cast<int>(cv - rv)); v < std::min<double>(size, cv + rv); ++v) {
      for (int u = std::max(0, static_cast<int>(cu - ru)); u < std::min<double>(size, cu + ru);
           ++u) {
        const double x = (u - cu) / ru;
        const double y = (v - cv) / rv;
        if (!ellipse || x * x + y * y <= 1.0) set_pixel(image, u, v, colour);
      }
    }
  }
  add_weathering(random, image, 0.06);
  const int frame = size / 24;
  const Colour edge = sample_colour(random, 0.05, 0.3, 0.2);
  fill_rectangle(image, 0, 0, size, frame, edge);
  fill_rectangle(image, 0, size - frame, size, size, edge);
  fill_rectangle(image, 0, 0, frame, size, edge);
  fill_rectangle(image, size - frame, 0, size, size, edge);
  return image;
}

Image window_texture(Random& random, int size) {
  Image image(size, size, 3);
  const auto skyline = noise_field(random, size, 1, 2.0);
  for (int u = 0; u < size; ++u) {
    const int horizon = static_cast<int>(
        size * std::clamp(0.7 + 0.08 * skyline[static_cast<std::size_t>(u)], 0.4, 0.95));
    for (int v = 0; v < size; ++v) {
      const float glow = 0.80F + 0.18F * static_cast<float>(v) / static_cast<float>(size);
      set_pixel(image, u, v, v < horizon ? Colour{glow, glow, 1.0F} : Colour{0.25F, 0.32F, 0.22F});
    }
  }
  const int bar = std::max(2, size / 20);
  const Colour frame{0.85F, 0.85F, 0.82F};
  for (const int at : {0, size / 2 - bar / 2, size - bar}) {
    fill_rectangle(image, at, 0, at + bar, size, frame);
    fill_rectangle(image, 0, at, size, at + bar, frame);
  }
  return image;
}

Image door_texture(Random& random, int size, Colour base) {
  Image image(size, size, 3);
  fill_rectangle(image, 0, 0, size, size, base);
  const Colour dark{base[0] * 0.6F, base[1] * 0.6F, base[2] * 0.6F};
  for (const double top : {0.08, 0.55}) {
    const int v0 = static_cast<int>(top * size);
    const int v1 = static_cast<int>((top + 0.38) * size);
    fill_rectangle(image, size / 6, v0, size - size / 6, v1, dark);
    const int inset = size / 24;
    fill_rectangle(image, size / 6 + inset, v0 + inset, size - size / 6 - inset, v1 - inset, base);
  }
  fill_rectangle(image, size - size / 8, size / 2 - size / 50, size - size / 24,
                 size / 2 + size / 50, {0.85F, 0.82F, 0.7F});
  const Colour gap{0.08F, 0.08F, 0.08F};
  fill_rectangle(image, 0, 0, size / 40, size, gap);
  fill_rectangle(image, size - size / 40, 0, size, size, gap);
  fill_rectangle(image, 0, 0, size, size / 80, gap);
  add_weathering(random, image, 0.04);
  return image;
}

Image foliage_texture(Random& random, int size, Colour base) {
  return noise_texture(random, size, base, 0.45, 1.2);
}

Image sky_texture(Random& random, int width, int height) {
  Image image(width, height, 3);
  const auto field = noise_field(random, width, height, 2.4);
  for (int v = 0; v < height; ++v) {
    // v counts down from the zenith to the horizon, which is brightest.
    const float down = static_cast<float>(v) / static_cast<float>(height);
    const Colour blue{0.40F + 0.35F * down, 0.55F + 0.27F * down, 0.85F + 0.08F * down};
    for (int u = 0; u < width; ++u) {
      const float cloud =
          std::clamp(0.5F * field[static_cast<std::size_t>(v) * width + u] - 0.1F, 0.0F, 0.8F);
      Colour mixed{};
      for (std::size_t c = 0; c < 3; ++c) mixed[c] = (1.0F - cloud) * blue[c] + cloud * 0.97F;
      set_pixel(image, u, v, mixed);
    }
  }
  return image;
}

}  // namespace panonav::simulation
