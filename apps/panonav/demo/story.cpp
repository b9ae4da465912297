#include "demo/story.hpp"

#include <utility>

namespace panonav::command {

void add_story(DemoStory story, viewer::ReportPage& page) {
  page.add_story(
      {{.title = "One omnidirectional camera",
        .shown = std::move(story.mirror),
        .value = "2.4 kB",
        .meaning = "are stored for such a view. The robot recognises the place from it at "
                   "any heading, without laser, GPU or training.",
        .part = 1},
       {.title = "Localisation",
        .shown = viewer::ReportPlot{std::move(story.areas), ""},
        .value = std::move(story.position_error),
        .meaning = "is the median error from one image. Orange: possible positions, as more "
                   "Fourier components are compared; cross: true position.",
        .part = 2},
       {.title = "Kidnapped and found again",
        .shown = viewer::ReportPlot{std::move(story.gathering), ""},
        .value = std::move(story.found_again),
        .meaning = "until the robot was localised again after it had been carried away. "
                   "Dots: possible positions; ring: true position.",
        .part = 4},
       {.title = "Navigation",
        .shown = viewer::ReportPlot{std::move(story.missions), ""},
        .value = std::move(story.arrived),
        .meaning = "robots reached their goal, a remembered view. Squares: starts; crosses: "
                   "goals; blue: driven paths.",
        .part = 8}},
      "With your own images",
      {"panonav memorise photos place.panonav --kind equirectangular --elevation-deg -30 40",
       "panonav localise place.panonav now.jpg"});
}

}  // namespace panonav::command
