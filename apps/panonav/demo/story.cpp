#include "demo/story.hpp"

#include <utility>

namespace panonav::command {

void add_story(DemoStory story, viewer::ReportPage& page) {
  page.add_story(
      {{.title = "Omnidirectional camera",
        .shown = std::move(story.mirror),
        .value = "2.4 kB",
        .meaning = "per stored view. From one view the robot recognises the place at any heading. "
                   "It needs no laser scanner, no GPU and no training.",
        .part = 1},
       {.title = "Localisation",
        .shown = viewer::ReportPlot{std::move(story.areas), ""},
        .value = std::move(story.position_error),
        .meaning = "median error from one image. Orange: possible positions, for an increasing "
                   "number of Fourier components. Cross: true position.",
        .part = 2},
       {.title = "Kidnapped robot",
        .shown = viewer::ReportPlot{std::move(story.convergence), ""},
        .value = std::move(story.found_again),
        .meaning = "until the robot was localised again after it was moved by hand. Dots: possible "
                   "positions. Ring: true position.",
        .part = 4},
       {.title = "Navigation",
        .shown = viewer::ReportPlot{std::move(story.missions), ""},
        .value = std::move(story.arrived),
        .meaning = "robots reached their goal, a stored view. Squares: starts. Crosses: goals. "
                   "Blue: driven paths.",
        .part = 8}},
      "Your own images",
      {"panonav memorise photos place.panonav --kind equirectangular --elevation-deg -30 40",
       "panonav localise place.panonav now.jpg"});
}

}  // namespace panonav::command
