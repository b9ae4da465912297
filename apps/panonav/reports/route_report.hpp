#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/route_recorder.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav_viewer/page.hpp"
#include "runs/chain_run.hpp"
#include "runs/followed_run.hpp"

namespace panonav::command {

/// Writes a page with the route panorama [Y03 figures 3b and 5] and the path. Throws FileError.
void write_record_report(const std::filesystem::path& folder, const std::string& name,
                         const RouteRecorder::Recorded& recorded, LengthUnit unit);

/// A route that a run followed, for the page of the run.
struct FollowedRoute {
  std::string name;
  const RoutePanorama& panorama;
  const RouteLines& lines;
  LengthUnit unit = LengthUnit::metres;  ///< of the poses
};

/// Writes a page with a replay of the run above the route panorama, a map with fixes and true path,
/// observed and predicted lines, correlations and errors. `replay_page` has a moment for each
/// image. Throws FileError.
void write_follow_report(const std::filesystem::path& folder, const FollowedRoute& route,
                         const std::vector<FollowedImage>& images, const FollowSummary& summary,
                         viewer::RunPage replay_page);

/// Writes a page with a replay of a run along a chain of snapshots, a map with the chain and the
/// estimated path, and the snapshot of each image. `replay_page` has a moment for each step. Throws
/// FileError.
void write_chain_report(const std::filesystem::path& folder, const std::string& name,
                        const SnapshotChain& chain, const std::vector<ChainStep>& steps,
                        const viewer::RunPage& replay_page);

}  // namespace panonav::command
