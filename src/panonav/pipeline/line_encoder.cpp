#include "panonav/pipeline/line_encoder.hpp"

#include <algorithm>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/route_panorama.hpp"

namespace panonav {

namespace {

std::string make_parameter_name(const std::string& name) {
  return "route." + name;
}

/// Chooses a cylinder with only the rows needed for the line, and with four columns for each
/// column of the line, at most 4096.
PanoramaShape choose_line_panorama_shape(const PictureSource& pictures, const RouteSource& route) {
  if (pictures.kind == PictureKind::panorama) return {};
  constexpr int rows = 5;
  return {rows, std::min(4 * route.line.columns, 4096)};
}

PictureSource crop_to_horizon(PictureSource pictures, const RouteSource& route) {
  if (pictures.kind == PictureKind::panorama) return pictures;
  const double half_rad = std::max(route.line.half_band_rad, radians(0.1));
  pictures.layout.kept_elevations = ElevationBand{-half_rad, half_rad};
  return pictures;
}

}  // namespace

RouteSource read_route_source(const MemoryFile& memory, const std::string& name, int columns) {
  RouteSource source;
  source.line.columns = columns;
  const auto text = memory.parameter(make_parameter_name(name));
  if (!text) return source;
  const std::vector<std::string> words = split_words(*text);
  const auto read_next = [&words](std::size_t& at, auto& value) {
    return ++at < words.size() && read_number(words[at], value);
  };
  bool good = true;
  for (std::size_t i = 0; good && i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "half_band_rad") {
      good = read_next(i, source.line.half_band_rad);
    } else if (word == "horizon_rows") {
      auto& [first, second] = source.horizon_rows.emplace();
      good = read_next(i, first) && read_next(i, second);
    } else if (word == "odometry") {
      source.from_odometry = true;
    } else if (word == "map_unit") {
      source.is_in_map_unit = true;
    } else if (word == "map_scale") {
      good = read_next(i, source.map_scale.emplace()) && *source.map_scale > 0.0;
    } else if (word == "assumed_unit_m") {
      good = read_next(i, source.assumed_unit_m.emplace()) && *source.assumed_unit_m > 0.0;
    } else {
      good = false;
    }
  }
  if (!good) {
    throw FileError(memory.path().string(), "parameter " + make_parameter_name(name) + " is '" +
                                                *text + "'; allowed: what a RouteRecorder writes");
  }
  return source;
}

void store_route_source(MemoryFile& memory, const std::string& name, const RouteSource& source) {
  std::string text = "half_band_rad " + to_text(source.line.half_band_rad);
  if (source.horizon_rows) {
    text += " horizon_rows " + std::to_string(source.horizon_rows->first) + " " +
            std::to_string(source.horizon_rows->second);
  }
  if (source.from_odometry) text += " odometry";
  if (source.is_in_map_unit) text += " map_unit";
  if (source.assumed_unit_m) text += " assumed_unit_m " + to_text(*source.assumed_unit_m);
  if (source.map_scale) text += " map_scale " + to_text(*source.map_scale);
  memory.set_parameter(make_parameter_name(name), text);
}

LineEncoder::LineEncoder(const PictureSource& pictures, const RouteSource& route)
    : route_(route),
      reader_(crop_to_horizon(pictures, route), choose_line_panorama_shape(pictures, route)) {
  if (route.horizon_rows &&
      (pictures.kind != PictureKind::panorama || pictures.layout.elevations)) {
    throw ContractError(
        "the option horizon_rows can only be used with panoramas of unknown elevations; these "
        "images have known elevations");
  }
}

std::vector<float> LineEncoder::line(const Observation& observation) const {
  return rethrow_with_file_name(observation, [&] {
    const Tilt tilt = observation.tilt.value_or(Tilt{});
    if (const auto* ready = std::get_if<Panorama>(&observation.picture))
      return make_line(level_panorama(*ready, tilt));
    return make_line(reader_.convert(std::get<Image>(observation.picture).view(), tilt));
  });
}

std::vector<float> LineEncoder::make_line(const Panorama& panorama) const {
  if (!route_.horizon_rows) return horizon_scanline(panorama, route_.line);
  const auto [first, last] = *route_.horizon_rows;
  if (last >= panorama.rows()) {
    throw ContractError("last of the option horizon_rows", last,
                        "0 to " + std::to_string(panorama.rows() - 1));
  }
  const auto columns = static_cast<std::size_t>(panorama.columns());
  const auto values =
      panorama.values().subspan(static_cast<std::size_t>(first) * columns,
                                static_cast<std::size_t>(last - first + 1) * columns);
  return horizon_scanline({last - first + 1, panorama.columns(), std::nullopt,
                           std::vector<float>(values.begin(), values.end())},
                          route_.line);
}

std::string find_route_name(const MemoryFile& memory, const std::optional<std::string>& name) {
  const auto names = memory.route_names();
  std::string all;
  for (const auto& known : names) all += (all.empty() ? "" : ", ") + known;
  if (names.empty()) {
    throw FileError(memory.path().string(), "contains no route; allowed: one that was recorded");
  }
  if (!name) {
    if (names.size() == 1) return names.front();
    throw FileError(memory.path().string(),
                    "contains several routes; choose one with the option name: " + all);
  }
  if (std::ranges::find(names, *name) == names.end()) {
    throw FileError(memory.path().string(),
                    "contains no route '" + *name + "'; allowed for the option name: " + all);
  }
  return *name;
}

RoutePanorama load_route_to_follow(const MemoryFile& memory, const std::string& name) {
  RoutePanorama route = memory.route(name).value();
  if (route.size() < 2) {
    throw FileError(memory.path().string(), "route '" + name + "' has 1 line; allowed: 2 or more");
  }
  return route;
}

}  // namespace panonav
