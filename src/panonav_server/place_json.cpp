#include "panonav_server/place_json.hpp"

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace panonav::server {

namespace {

using nlohmann::ordered_json;

ordered_json to_json_or_null(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json floor_json(std::string_view floor) {
  return floor.empty() ? ordered_json() : ordered_json(floor);
}

ordered_json match_json(const PlaceMatch& match) {
  // Narrow images are compared by local features alone; a number that is not finite becomes null.
  const bool has_rows = !std::isnan(match.column_difference);
  ordered_json json{
      {"file", match.name},
      {"dissimilarity", has_rows ? ordered_json(match.dissimilarity) : ordered_json()},
      {"column_difference", match.column_difference},
      {"heading_rad", to_json_or_null(match.heading_rad)}};
  if (match.verified_features) json["verified_features"] = *match.verified_features;
  return json;
}

ordered_json position_json(const std::optional<PositionEstimate>& position) {
  if (!position) return nullptr;
  ordered_json json{{"x_m", position->x_m},
                    {"y_m", position->y_m},
                    {"radius_m", to_json_or_null(position->radius_m)},
                    {"along_route", nullptr}};
  if (const auto& along = position->along_route) {
    json["along_route"] = {{"direction_rad", along->direction_rad}, {"within_m", along->within_m}};
  }
  return json;
}

}  // namespace

ordered_json place_json(const Place& place) {
  auto matches = ordered_json::array();
  for (const PlaceMatch& match : place.matches) matches.push_back(match_json(match));
  auto alternatives = ordered_json::array();
  for (const AlternativePlace& other : place.alternatives) {
    alternatives.push_back({{"match", match_json(other.match)},
                            {"probability", other.probability},
                            {"floor", floor_json(other.floor())},
                            {"position", position_json(other.position)},
                            {"heading_rad", to_json_or_null(other.heading_rad)}});
  }
  return {{"known", place.known},
          {"known_probability", place.known_probability},
          {"probability", place.probability},
          {"matches", std::move(matches)},
          {"floor", floor_json(place.floor())},
          {"position", position_json(place.position)},
          {"heading_rad", to_json_or_null(place.heading_rad)},
          {"alternatives", std::move(alternatives)},
          {"components", place.components},
          {"bytes_read", place.bytes_read}};
}

void rename_lengths(ordered_json& document, LengthUnit unit) {
  if (unit == LengthUnit::metres) return;
  if (document.is_array()) {
    for (auto& element : document) rename_lengths(element, unit);
  }
  if (!document.is_object()) return;
  auto renamed = ordered_json::object();
  for (auto& [key, value] : document.items()) {
    rename_lengths(value, unit);
    std::string new_key = key;
    for (const std::string_view ending : {"_m", "_m2"}) {
      if (!key.ends_with(ending)) continue;
      new_key = key.substr(0, key.size() - ending.size()) + "_steps" +
                std::string(ending.substr(std::string_view("_m").size()));
    }
    renamed[new_key] = std::move(value);
  }
  document = std::move(renamed);
}

}  // namespace panonav::server
