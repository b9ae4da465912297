#include "demo/story.hpp"

#include <utility>

namespace panonav::command {

std::string format_part_of(std::size_t part, std::size_t all) {
  return std::to_string(part) + " of " + std::to_string(all);
}

viewer::ReportPage make_demo_page() {
  return {"panonav: image-based memory for robot navigation",
          "A robot with one camera stores images of places as views. It compares new images with "
          "these views. In this way it finds its position, makes maps, drives back to a place, "
          "repeats routes and drives to goals. All data on this page were simulated on this "
          "computer, so the true positions are known. Click an animation to pause it."};
}

void add_results(DemoStory& story, DemoTrack& track, DemoNavigation& navigation) {
  story.found_again = format_image_count(track.until_found_again);
  story.convergence = std::move(track.convergence);
  story.arrived = format_part_of(navigation.arrived, navigation.runs.size());
  story.missions = std::move(navigation.all);
}

void add_story(DemoStory story, viewer::ReportPage& page) {
  page.add_story(
      {{.title = "Omnidirectional camera",
        .shown = std::move(story.mirror),
        .value = std::move(story.view_size),
        .meaning = "per stored view in the memory file; its signature takes 2.4 kB. With one "
                   "stored view of a place, the robot recognises this place at any heading. It "
                   "needs no laser scanner, no GPU and no training.",
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
      {"panonav memorise place.panonav photos --kind equirectangular --elevation-deg -30 40",
       "panonav localise place.panonav now.jpg"});
}

}  // namespace panonav::command
