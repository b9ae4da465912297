#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "panonav/route/route_panorama.hpp"
#include "panonav_viewer/page.hpp"
#include "runs/followed_run.hpp"

namespace panonav::command {

/// The route panorama [Y03 figures 3b and 5] and the path. Throws FileError.
void write_record_report(const std::filesystem::path& folder, const std::string& name,
                         const RoutePanorama& route, double bytes_per_km);

/// A route as the page of a run along it shows it.
struct FollowedRoute {
  std::string name;
  const RoutePanorama& panorama;
  const RouteLines& lines;
};

/// The run, played beside the route panorama; path, fixes and truth; what was seen beside what the
/// route shows from there; correlations and errors along the run. `played` holds a moment for each
/// image. Throws FileError.
void write_follow_report(const std::filesystem::path& folder, const FollowedRoute& route,
                         const std::vector<FollowedImage>& images, const FollowSummary& summary,
                         viewer::RunPage played);

}  // namespace panonav::command
