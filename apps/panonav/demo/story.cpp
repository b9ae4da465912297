#include "demo/story.hpp"

#include <utility>

namespace panonav::command {

void tell_story(DemoStory story, viewer::ReportPage& page) {
  page.add_story(
      {{.title = "One camera, all around",
        .shown = std::move(story.mirror),
        .value = "2.4 kB",
        .meaning = "is all that it keeps of such a view, to know the place again whichever way it "
                   "faces. No laser, no GPU, no training.",
        .part = 1},
       {.title = "It knows where it is",
        .shown = viewer::ReportPlot{std::move(story.areas), ""},
        .value = std::move(story.position_error),
        .meaning = "is the median error, by one picture. Orange: where it may be, by ever more of "
                   "what it sees; cross: where it is.",
        .part = 2},
       {.title = "Lost, and found again",
        .shown = viewer::ReportPlot{std::move(story.gathering), ""},
        .value = std::move(story.found_again),
        .meaning =
            "until it knew again where it is, when somebody had carried it away. Dots: where "
            "it may be; ring: where it is.",
        .part = 4},
       {.title = "It goes where it is told",
        .shown = viewer::ReportPlot{std::move(story.missions), ""},
        .value = std::move(story.arrived),
        .meaning = "robots reached a remembered view. Squares: starts; crosses: goals; blue: ways "
                   "driven.",
        .part = 8}},
      "With pictures of your own",
      {"panonav memorise photos place.panonav --kind equirectangular --elevation-deg -30 40",
       "panonav localise place.panonav now.jpg"});
}

}  // namespace panonav::command
