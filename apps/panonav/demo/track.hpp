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

/// A robot that does not know where it is drives through a corridor of places that look alike and
/// is kidnapped half way.
struct DemoTrack {
  std::size_t images = 0;
  std::size_t places_at_first = 0;  ///< where it may be after the first image
  /// Images until it says that it is localised and is within the views' spacing of the truth, that
  /// one included; empty: never before it was kidnapped.
  std::optional<std::size_t> until_localised;
  /// The same from the first image after it was kidnapped on.
  std::optional<std::size_t> until_found_again;
  std::size_t localised = 0;       ///< images at which it says so
  std::size_t wrong = 0;           ///< of these, farther off than the spacing
  std::vector<double> errors_m;    ///< of these, right or wrong
  viewer::UnfoldingMap gathering;  ///< the particles, picture by picture
};

/// "9 images", or "never".
[[nodiscard]] std::string format_image_count(const std::optional<std::size_t>& images);

/// Tracks it by Monte-Carlo localisation and adds a part that plays the run to the page. The same
/// seed gives the same run.
DemoTrack demonstrate_tracking(const DemoOptions& options, const DemoRecordings& recordings,
                               const MemoryFile& file, Session& session, viewer::ReportPage& page);

}  // namespace panonav::command
