#pragma once

#include <nlohmann/json.hpp>

#include "panonav/localisation/place.hpp"

namespace panonav::server {

/// Returns a place as JSON for the command and the server, as docs/formats.md describes it; unknown
/// values are null.
[[nodiscard]] nlohmann::ordered_json place_json(const Place& place);

}  // namespace panonav::server
