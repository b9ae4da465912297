#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/route/route_panorama.hpp"
#include "verbs/followed_run.hpp"

namespace panonav::command {

/// Makes the folder of a report of `verb`; throws FileError as `prepare_report_folder`.
void prepare_route_report(const std::filesystem::path& folder, std::string_view verb);

/// The route panorama [Y03 figures 3b and 5] and the path. Throws FileError, and Error without
/// gnuplot.
void write_record_report(const std::filesystem::path& folder, const std::string& name,
                         const RoutePanorama& route, double bytes_per_km);

/// Path, fixes and truth; what was seen beside what the route shows from there; correlations and
/// errors along the run. Throws as above.
void write_follow_report(const std::filesystem::path& folder, const std::string& name,
                         const RouteLines& route, const std::vector<FollowedImage>& images,
                         const FollowSummary& summary);

}  // namespace panonav::command
