#include "demo/story.hpp"

#include <utility>

namespace panonav::command {

void add_story(DemoStory story, viewer::ReportPage& page) {
  page.add_story(
      {{.title = "Omnidirectional camera",
        .shown = std::move(story.mirror),
        .value = "2.4 kB",
        .meaning =
            "per stored view. With one stored view of a place, the robot recognises this place at "
            "any heading. The robot needs no laser scanner, no GPU and no training.",
        .part = 1},
       {.title = "Localisation",
        .shown = viewer::ReportPlot{std::move(story.areas), ""},
        .value = std::move(story.position_error),
        .meaning = "median error of the position computed from one image. Orange: possible "
                   "positions. They become fewer when the robot compares more Fourier components "
                   "of the image (explained in parts 1 and 3). Cross: true position.",
        .part = 2},
       {.title = "Kidnapped robot",
        .shown = viewer::ReportPlot{std::move(story.convergence), ""},
        .value = std::move(story.found_again),
        .meaning = "until the robot was localised again after it was moved by hand (kidnapped). "
                   "Dots: possible positions. Ring: true position.",
        .part = 4},
       {.title = "Navigation",
        .shown = viewer::ReportPlot{std::move(story.missions), ""},
        .value = std::move(story.arrived),
        .meaning = "robots reached their goals. Each goal is a stored view. Squares: starts. "
                   "Crosses: goals. Blue: driven paths.",
        .part = 8}},
      "Your own images",
      {"panonav memorise photos place.panonav --kind equirectangular --elevation-deg -30 40",
       "panonav localise place.panonav now.jpg"});
}

}  // namespace panonav::command
