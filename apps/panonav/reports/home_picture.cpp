#include "reports/home_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "panonav/geometry/angles.hpp"
#include "reporting/plot.hpp"

namespace panonav::command {

namespace {

using Colour = std::array<std::uint8_t, 3>;
constexpr int width = 1024;
constexpr int band_px = 26;  // above, between and below the views, for the marks

Colour rgb(PlotColour colour) {
  const unsigned long value = std::stoul(std::string(hex(colour).substr(1)), nullptr, 16);
  return {static_cast<std::uint8_t>(value >> 16U), static_cast<std::uint8_t>(value >> 8U),
          static_cast<std::uint8_t>(value)};
}

int height_of(const Panorama& panorama) {
  // As wide as high in angle would be true to the eye, but a small view must be seen at all.
  const int wide = width * panorama.rows() / panorama.columns();
  return std::clamp(wide, 100, 400);
}

void set(Image& image, int u, int v, const Colour& colour) {
  if (v < 0 || v >= image.height()) return;
  const int wrapped = ((u % image.width()) + image.width()) % image.width();
  for (int c = 0; c < 3; ++c) image.at(wrapped, v, c) = colour[static_cast<std::size_t>(c)];
}

void paste(Image& image, const Panorama& panorama, int top) {
  const Image picture = to_picture(panorama);
  const int height = height_of(panorama);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const std::uint8_t value =
          picture.at(u * picture.width() / width, v * picture.height() / height);
      set(image, u, top + v, {value, value, value});
    }
  }
}

/// A triangle whose tip touches the view below it.
void mark(Image& image, double azimuth_rad, int top, const Colour& colour) {
  const double share = 0.5 - azimuth_rad / (2.0 * std::numbers::pi);
  const int u = static_cast<int>(std::floor(share * width));
  constexpr int tip = 20;
  for (int v = 0; v < tip; ++v) {
    for (int x = -v / 2; x <= v / 2; ++x) set(image, u + x, top + band_px - 3 - v, colour);
  }
}

void line(Image& image, double azimuth_rad, int top, int height, const Colour& colour) {
  const double share = 0.5 - azimuth_rad / (2.0 * std::numbers::pi);
  const int u = static_cast<int>(std::floor(share * width));
  for (int v = 0; v < height; ++v) {
    if ((v / 6) % 2 == 0) {
      set(image, u, top + v, colour);
      set(image, u + 1, top + v, colour);
    }
  }
}

}  // namespace

Image picture_of_homing(const std::optional<Panorama>& home, const Panorama& current,
                        const HomeVector& found, bool points) {
  const int home_height = home ? height_of(*home) + band_px : 0;
  Image image(width, band_px + home_height + height_of(current), 3);
  std::fill(image.pixels().begin(), image.pixels().end(), std::uint8_t{255});
  const auto show = [&](const Panorama& panorama, int top) {
    paste(image, panorama, top + band_px);
    mark(image, 0.0, top, rgb(PlotColour::grey));
    if (!points) return;
    for (const auto& [azimuth, colour] :
         {std::pair{found.direction_rad(), rgb(PlotColour::vermilion)},
          std::pair{wrap_angle(found.direction_rad() + std::numbers::pi), rgb(PlotColour::blue)}}) {
      mark(image, azimuth, top, colour);
      line(image, azimuth, top + band_px, height_of(panorama), colour);
    }
  };
  if (home) {
    // The robot at home turns to the current heading.
    const double columns = -found.heading_rad / (2.0 * std::numbers::pi) * home->columns();
    show(turn_columns(*home, static_cast<int>(std::lround(columns))), 0);
  }
  show(current, home_height);
  return image;
}

Image picture_of_views(const std::vector<Panorama>& views) {
  int height = 0;
  for (const Panorama& view : views) height += band_px + height_of(view);
  Image image(width, height, 3);
  std::fill(image.pixels().begin(), image.pixels().end(), std::uint8_t{255});
  int top = 0;
  for (const Panorama& view : views) {
    paste(image, view, top + band_px);
    mark(image, 0.0, top, rgb(PlotColour::grey));
    top += band_px + height_of(view);
  }
  return image;
}

}  // namespace panonav::command
