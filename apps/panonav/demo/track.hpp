#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.hpp"
#include "demo/recordings.hpp"
#include "panonav/storage/memory_file.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// Results of tracking a robot with unknown start in a corridor of similar places; it is kidnapped
/// halfway.
struct DemoTrack {
  std::size_t images = 0;
  std::size_t places_at_first = 0;  ///< number of possible places after the first image
  /// Number of images up to and including the first correct one: localised with an error of at most
  /// the views' spacing. nullopt if there is none before the robot is kidnapped.
  std::optional<std::size_t> until_localised;
  /// The same, counted from the first image after the robot was kidnapped.
  std::optional<std::size_t> until_found_again;
  std::size_t localised = 0;         ///< number of images reported as localised
  std::size_t wrong = 0;             ///< localised images with an error above the spacing
  std::vector<double> errors_m;      ///< position errors of all localised images
  viewer::MapAnimation convergence;  ///< animation of the particles, image by image
};

/// "9 images", or "never".
[[nodiscard]] std::string format_image_count(const std::optional<std::size_t>& images);

/// Tracks the robot with Monte-Carlo localisation and adds a part with a replay to the page. The
/// same seed gives the same run.
DemoTrack demonstrate_tracking(const DemoOptions& options, const DemoRecordings& recordings,
                               const MemoryFile& file, Session& session, viewer::ReportPage& page);

}  // namespace panonav::command
