#include "panonav_server/place_json.hpp"

#include <cmath>
#include <optional>
#include <utility>

namespace panonav::server {

namespace {

using nlohmann::ordered_json;

ordered_json to_json_or_null(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

}  // namespace

ordered_json place_json(const Place& place) {
  auto matches = ordered_json::array();
  for (const PlaceMatch& match : place.matches) {
    matches.push_back({{"file", match.name},
                       {"dissimilarity", match.dissimilarity},
                       {"column_difference", match.column_difference},
                       {"heading_rad", to_json_or_null(match.heading_rad)}});
    if (match.verified_features) {
      matches.back()["verified_features"] = *match.verified_features;
    }
  }
  ordered_json json{{"known", place.known},
                    {"known_probability", place.known_probability},
                    {"matches", std::move(matches)},
                    {"position", nullptr},
                    {"heading_rad", to_json_or_null(place.heading_rad)},
                    {"components", place.components},
                    {"bytes_read", place.bytes_read}};
  if (place.position) {
    json["position"] = {{"x_m", place.position->x_m},
                        {"y_m", place.position->y_m},
                        {"radius_m", to_json_or_null(place.position->radius_m)}};
  }
  return json;
}

}  // namespace panonav::server
