#pragma once

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
  std::string position_error;        ///< "1.4 cm"
  std::string found_again;           ///< "4 images"
  viewer::MapAnimation convergence;  ///< particles of the tracked robot
  std::string arrived;               ///< "12 of 12"
  viewer::MapAnimation missions;
};

/// Adds four pictures with results and the commands for the user's own images to the page.
void add_story(DemoStory story, viewer::ReportPage& page);

}  // namespace panonav::command
