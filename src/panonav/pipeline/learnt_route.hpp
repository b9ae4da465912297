#pragma once

#include <string>

#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/route/route_tracker.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Learns the limits by which a robot on the route is recognised (`RouteTracker`, with default
/// options). Stores them in the file with a fingerprint of the route. Does nothing if the stored
/// limits are current or the route has fewer than two lines. Call it after changing lines or poses.
/// Throws FileError. Cost: loading the route, and up to half a second of learning.
void learn_and_store_route(MemoryFile& file, const std::string& name);

/// Reads the stored limits; nullopt if there are none, if the route has changed since, or if
/// trackers with these options learn others.
[[nodiscard]] std::optional<RouteLimits> load_route_limits(const MemoryFile& file,
                                                           const std::string& name,
                                                           const RoutePanorama& route,
                                                           const RouteTrackerOptions& options,
                                                           const RouteFitOptions& fit);

/// Returns the options with the unit of the route's poses.
[[nodiscard]] RouteFitOptions scale_fit(RouteFitOptions fit, const RouteSource& source);

}  // namespace panonav
