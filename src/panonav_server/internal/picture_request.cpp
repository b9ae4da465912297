#include "panonav_server/internal/picture_request.hpp"

#include <cstdint>
#include <span>
#include <utility>

#include "panonav/camera/pinhole_model.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::server {

std::optional<PictureSource> read_narrow_source(const HttpArguments& arguments) {
  if (arguments.empty()) return std::nullopt;
  constexpr std::string_view name = "field_of_view_deg";
  const auto& [argument, value] = *arguments.begin();
  if (arguments.size() > 1 || argument != name) {
    throw ContractError("argument", to_readable_line(argument), "field_of_view_deg");
  }
  PictureSource source{.kind = PictureKind::pinhole};
  if (value == "exif") return source;
  double width_deg = 0.0;
  if (!read_number(value, width_deg) || !is_field_of_view(radians(width_deg))) {
    throw ContractError(name, to_readable_line(value), "10 .. 150 or exif");
  }
  source.field_of_view_rad = radians(width_deg);
  return source;
}

Observation decode_observation(std::string_view picture,
                               std::optional<PictureSource> narrow_source) {
  const auto* const first = reinterpret_cast<const std::uint8_t*>(picture.data());
  const std::span bytes(first, picture.size());
  Observation observation(decode_image(bytes, "the image", picture_limits));
  const bool needs_exif = narrow_source && !narrow_source->field_of_view_rad;
  if (needs_exif) observation.encoded.assign(bytes.begin(), bytes.end());
  observation.narrow_source = std::move(narrow_source);
  return observation;
}

}  // namespace panonav::server
