#pragma once

#include <nlohmann/json.hpp>

#include "panonav/localisation/place.hpp"

namespace panonav::server {

/// Converts a place to JSON for the command and the server (docs/formats.md); unknown values are
/// null.
[[nodiscard]] nlohmann::ordered_json place_json(const Place& place);

}  // namespace panonav::server
