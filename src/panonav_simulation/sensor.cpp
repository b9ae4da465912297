#include "panonav_simulation/sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::simulation {

namespace {

constexpr double full_turn_rad = 2.0 * std::numbers::pi;

// Random streams of the seed, separate so that occluders do not depend on the number of noise
// values drawn.
enum Stream : std::uint64_t { noise_stream = 31, occluder_stream = 32 };

// Occluders around the robot, each hiding a sector of azimuths over the full height of the view.
class Occluders {
 public:
  Occluders(const SensorOptions& options, std::uint64_t seed) {
    if (options.occluded_fraction <= 0.0) return;
    Random random(seed, occluder_stream);
    const double first = random.uniform(0.0, full_turn_rad);
    const double sector = full_turn_rad / options.occluders;
    width_rad_ = options.occluded_fraction * sector;
    for (int i = 0; i < options.occluders; ++i) {
      // One occluder per sector: they never overlap, so the hidden share is exact.
      Occluder occluder;
      occluder.start_rad =
          std::fmod(first + sector * i + random.uniform(0.0, sector - width_rad_), full_turn_rad);
      for (float& band : occluder.bands) band = static_cast<float>(random.uniform(0.03, 0.7));
      occluders_.push_back(occluder);
    }
  }

  // Returns the brightness of the occluder at this azimuth; nullopt if there is none. `height` runs
  // from 0 (bottom) to 1 (top of the view).
  [[nodiscard]] std::optional<float> at(double azimuth_rad, double height) const {
    for (const Occluder& occluder : occluders_) {
      const double within =
          std::fmod(azimuth_rad - occluder.start_rad + 2.0 * full_turn_rad, full_turn_rad);
      if (within < width_rad_) {
        const auto band = static_cast<std::size_t>(std::clamp(height * 3.0, 0.0, 2.0));
        return occluder.bands[band];
      }
    }
    return std::nullopt;
  }
  [[nodiscard]] bool empty() const noexcept { return occluders_.empty(); }

 private:
  struct Occluder {
    double start_rad = 0.0;
    std::array<float, 3> bands{};
  };
  double width_rad_ = 0.0;
  std::vector<Occluder> occluders_;
};

// Converts light to a noisy digital value in 0 .. 1.
class PixelSensor {
 public:
  PixelSensor(const SensorOptions& options, std::uint64_t seed)
      : options_(options), random_(seed, noise_stream) {}

  float value(double light) {
    const double signal = std::clamp(light * options_.exposure, 0.0, 1.0);
    const double deviation =
        std::sqrt(options_.read_noise * options_.read_noise + signal / options_.full_well);
    const double value = options_.gain * (signal + deviation * random_.normal());
    return static_cast<float>(std::clamp(value, 0.0, 1.0));
  }

 private:
  const SensorOptions& options_;
  Random random_;
};

double light_factor(const SensorOptions& options, double azimuth_rad) {
  return 1.0 + options.directional_light * std::cos(azimuth_rad - options.light_azimuth_rad);
}

}  // namespace

void visit_options(SensorOptions& options, OptionVisitor& visitor) {
  using T = SensorOptions;
  constexpr OptionTable table{
      option<&T::exposure>("exposure as a factor; 1 is full exposure", above(0), 1000),
      option<&T::gain>("electronic amplification of signal and noise", above(0), 1000),
      option<&T::read_noise>(
          "standard deviation of the noise of a dark pixel, as a share of full scale", 0, 1),
      option<&T::full_well>(
          "electrons in a fully exposed pixel; fewer electrons mean more shot noise", 1, 1e12),
      option<&T::vignetting>("share of light lost at the mirror's rim", 0, 1),
      option<&T::directional_light>(
          "share by which objects are brighter in the direction of the light", 0, 1),
      option<&T::light_azimuth_rad>(
          "direction of the light relative to the heading, counter-clockwise positive",
          -full_turn_rad, full_turn_rad),
      option<&T::occluded_fraction>(
          "share of all azimuths in which people or objects hide the scene", 0, 1),
      option<&T::occluders>(
          "number of people or objects that hide the scene; all have the same width", 1, 1000),
      option<&T::eight_bit>("round pixel values to multiples of 1/255"),
  };
  table.visit(options, visitor);
}

Panorama apply_sensor(Panorama view, const SensorOptions& options, std::uint64_t seed) {
  validate(options);
  const Occluders occluders(options, seed);
  PixelSensor pixel(options, seed);
  for (int y = 0; y < view.rows(); ++y) {
    const double height = 1.0 - (y + 0.5) / view.rows();
    for (int c = 0; c < view.columns(); ++c) {
      const double azimuth = view.azimuth_rad(c);
      const auto hidden = occluders.at(azimuth, height);
      const double light = hidden ? *hidden : view.at(y, c);
      const float value = pixel.value(light * light_factor(options, azimuth));
      view.at(y, c) = options.eight_bit ? std::round(255.0F * value) / 255.0F : value;
    }
  }
  return view;
}

Image apply_sensor(const Radiance& view, const Camera& camera, const SensorOptions& options,
                   std::uint64_t seed, std::span<const std::uint32_t> pixels) {
  validate(options);
  validate(camera);
  require(view.width == camera.image_size.width, "width of the view", view.width,
          "that of the camera's image");
  require(view.height == camera.image_size.height, "height of the view", view.height,
          "that of the camera's image");
  const std::size_t count = static_cast<std::size_t>(view.width) * view.height;
  require(pixels.empty() || *std::ranges::max_element(pixels) < count, "pixels",
          static_cast<double>(count), "offsets within the image");
  const Occluders occluders(options, seed);
  const ElevationBand band = visible_elevations(camera);
  const std::array<ImageCircle, 2> circles{image_circle(camera, 0),
                                           image_circle(camera, lens_count(camera) - 1)};
  // Compute the directions of pixels, which is slow, only if light or occluders depend on them.
  const bool needs_directions = options.directional_light > 0.0 || !occluders.empty();
  PixelSensor pixel(options, seed);
  Image image(view.width, view.height, view.channels);
  const auto channels = static_cast<std::size_t>(view.channels);
  const auto measure = [&](std::size_t offset) {
    const auto width = static_cast<std::size_t>(view.width);
    const PixelPoint point{static_cast<double>(offset % width) + 0.5,
                           static_cast<double>(offset / width) + 0.5};
    double factor = 1.0;
    std::optional<float> hidden;
    const auto direction = needs_directions ? unproject(camera, point) : std::nullopt;
    if (direction) {
      const double azimuth = direction->azimuth_rad();
      factor = light_factor(options, azimuth);
      hidden = occluders.at(azimuth, (direction->elevation_rad() - band.bottom_rad) /
                                         (band.top_rad - band.bottom_rad));
    }
    const ImageCircle& circle = circles[static_cast<std::size_t>(lens_at(camera, point))];
    if (options.vignetting > 0.0 && circle.rim_radius_px > 0.0) {
      const double radius =
          std::hypot(point.u_px - circle.centre.u_px, point.v_px - circle.centre.v_px) /
          circle.rim_radius_px;
      factor *= 1.0 - options.vignetting * std::min(1.0, radius * radius);
    }
    for (std::size_t i = channels * offset; i < channels * (offset + 1); ++i) {
      const double light = hidden ? *hidden : view.values[i];
      image.pixels()[i] =
          static_cast<std::uint8_t>(std::lround(255.0F * pixel.value(light * factor)));
    }
  };
  for (const std::uint32_t offset : pixels) measure(offset);
  for (std::size_t offset = 0; pixels.empty() && offset < count; ++offset) measure(offset);
  return image;
}

}  // namespace panonav::simulation
