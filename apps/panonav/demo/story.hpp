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
  viewer::ReportPicture mirror;    ///< what the camera sees, in colour
  viewer::UnfoldingMap areas;      ///< how the memory answers one question
  std::string position_error;      ///< "1.4 cm"
  std::string found_again;         ///< "4 images"
  viewer::UnfoldingMap gathering;  ///< particles of the robot that is tracked
  std::string arrived;             ///< "12 of 12"
  viewer::UnfoldingMap missions;
};

/// Four pictures that show what the program does, how well, and how to use it.
void add_story(DemoStory story, viewer::ReportPage& page);

}  // namespace panonav::command
