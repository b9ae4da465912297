#pragma once

#include <nlohmann/json.hpp>

#include "panonav/localisation/place.hpp"
#include "panonav/pipeline/memory_map.hpp"

namespace panonav::server {

/// Converts a place to JSON for the command and the server (docs/formats.md); unknown values are
/// null.
[[nodiscard]] nlohmann::ordered_json place_json(const Place& place);

/// Renames keys of lengths that are in view steps: "x_m" becomes "x_steps", "area_m2" becomes
/// "area_steps2". Does nothing if lengths are in metres.
void rename_lengths(nlohmann::ordered_json& document, LengthUnit unit);

}  // namespace panonav::server
