#pragma once

#include <nlohmann/json.hpp>

#include "panonav/localisation/place.hpp"

namespace panonav::server {

/// What the command and the server tell of a place, as docs/formats.md describes it; null for what
/// is not known.
[[nodiscard]] nlohmann::ordered_json place_json(const Place& place);

}  // namespace panonav::server
