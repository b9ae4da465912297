#pragma once

#include <cstddef>
#include <string>

#include "demo/homing.hpp"
#include "demo/maps.hpp"
#include "demo/navigation.hpp"
#include "demo/route.hpp"
#include "demo/track.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// The content of the first screen of the page.
struct DemoStory {
  viewer::ReportPicture mirror;      ///< image of the camera, in colour
  viewer::MapAnimation areas;        ///< possible positions for one query
  std::string view_size;             ///< bytes of the memory file per view: "19 kB"
  std::string position_error;        ///< "1.4 cm"
  std::string found_again;           ///< "4 images"
  viewer::MapAnimation convergence;  ///< particles of the tracked robot
  std::string arrived;               ///< "12 of 12"
  viewer::MapAnimation missions;
};

/// Formats a count such as "12 of 12".
[[nodiscard]] std::string format_part_of(std::size_t part, std::size_t all);

/// Makes the page of the demonstration, with title and introduction but without parts.
[[nodiscard]] viewer::ReportPage make_demo_page();

/// Moves the animations of tracking and navigation into the story, with their results.
void add_results(DemoStory& story, DemoTrack& track, DemoNavigation& navigation);

/// Adds four pictures with results and the commands for the user's own images to the page.
void add_story(DemoStory story, viewer::ReportPage& page);

}  // namespace panonav::command
