#include "panonav/kernels/remap.hpp"

#include <string>

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

void halve(ImageView image, std::uint8_t* halved, Instructions instructions) {
  with_body<RemapBody>(instructions, [&](auto body) {
    body.halve(image.data, image.stride, image.width / 2, image.height / 2, halved);
  });
}

void pair_rows(ImageView image, std::uint16_t* pairs, Instructions instructions) {
  with_body<RemapBody>(instructions, [&](auto body) {
    body.pair_rows(image.data, image.stride, image.width, image.height - 1, pairs);
  });
}

void remap(std::span<const std::uint16_t> pairs, std::span<const std::uint32_t> positions,
           std::span<const std::uint32_t> weights, int taps, float scale, std::span<float> values,
           Instructions instructions) {
  require(taps >= 1, "taps", taps, ">= 1");
  const std::size_t entries = static_cast<std::size_t>(taps) * values.size();
  require(positions.size() == entries, "number of positions", static_cast<double>(positions.size()),
          std::to_string(entries));
  require(weights.size() == entries, "number of weights", static_cast<double>(weights.size()),
          std::to_string(entries));
  const RemapJob job{
      pairs.data(), positions.data(), weights.data(), taps, static_cast<int>(values.size()),
      scale,        values.data()};
  with_body<RemapBody>(instructions, [&](auto body) { body.remap(job); });
}

}  // namespace panonav::kernels
