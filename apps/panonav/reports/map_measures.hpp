#pragma once

#include <optional>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "panonav/mapping/map_measures.hpp"

namespace panonav::command {

/// Returns "trustworthiness" and "continuity" as JSON; both are null if there are too few
/// positions.
[[nodiscard]] ordered_json neighbours_json(const MapComparison& comparison);
/// Prints trustworthiness and continuity; nothing if there are too few positions.
void print_neighbours(const MapComparison& comparison, Session& session);

/// Returns "right_closures" and "wrong_closures" as JSON; both are null without `closures`.
[[nodiscard]] ordered_json closures_json(const std::optional<MapComparison::Closures>& closures);
/// Prints the same.
void print_closures(const MapComparison::Closures& closures, Session& session);

}  // namespace panonav::command
