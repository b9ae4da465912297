#include "demo/track.hpp"

#include <string>
#include <utility>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav_viewer/scene_drawing.hpp"
#include "reports/track_pictures.hpp"
#include "reports/track_report.hpp"
#include "runs/shown_references.hpp"
#include "runs/tracked_run.hpp"

namespace panonav::command {

namespace {

bool is_right(const TrackedImage& image, double within_m) {
  const auto error_m = position_error_m(image);
  return is_localised(image) && error_m && *error_m <= within_m;
}

/// Images of [begin, end) until the first that is right, that one included.
std::optional<std::size_t> images_until_right(const std::vector<TrackedImage>& images,
                                              std::size_t begin, std::size_t end, double within_m) {
  for (std::size_t i = begin; i < end; ++i) {
    if (is_right(images[i], within_m)) return i - begin + 1;
  }
  return std::nullopt;
}

DemoTrack outcome_of(const std::vector<TrackedImage>& images, std::size_t kidnapped_after,
                     double spacing_m) {
  DemoTrack track{.images = images.size()};
  track.until_localised = images_until_right(images, 0, kidnapped_after + 1, spacing_m);
  track.until_found_again =
      images_until_right(images, kidnapped_after + 1, images.size(), spacing_m);
  for (const TrackedImage& image : images) {
    if (!is_localised(image)) continue;
    ++track.localised;
    track.wrong += is_right(image, spacing_m) ? 0 : 1;
    track.errors_m.push_back(*position_error_m(image));
  }
  return track;
}

/// What happened at an image, for people.
std::string frame_title(const TrackedImage& image, std::size_t kidnapped_after, double within_m) {
  const std::string number = "picture " + std::to_string(image.index + 1) + ": ";
  if (image.index == kidnapped_after + 1) return number + "carried away";
  switch (image.estimate.state) {
    case LocalisationState::localised:
      return number + (is_right(image, within_m) ? "it knows where it is" : "it has not noticed");
    case LocalisationState::ambiguous:
      return number + "it may be in several places";
    case LocalisationState::lost:
      break;
  }
  return number + "it does not know where it is";
}

/// The particles gather: few of them, so that they fit into a small picture.
viewer::UnfoldingMap gathering_of(const std::vector<TrackedImage>& images,
                                  const std::vector<Point2>& at_first,
                                  std::vector<viewer::MapLayer> scene, std::size_t kidnapped_after,
                                  double within_m) {
  viewer::UnfoldingMap map{.title = "", .backdrop = std::move(scene)};
  const viewer::MapLayer everywhere{
      .label = "where it may be", .colour = viewer::PlotColour::vermilion, .dots = at_first};
  map.frames.push_back({.title = "before the first picture", .layers = {everywhere}});
  for (const TrackedImage& image : images) {
    viewer::MapLayer particles = everywhere;
    particles.dots = positions_of(image.particles);
    const viewer::MapLayer truth{.label = "where it is",
                                 .colour = viewer::PlotColour::black,
                                 .circles = {image.truth->position()}};
    map.frames.push_back(
        {.title = frame_title(image, kidnapped_after, within_m), .layers = {particles, truth}});
  }
  return map;
}

void add_part(const DemoTrack& track, double spacing_m, std::size_t kidnapped_after,
              const viewer::RunPage& played, const viewer::MapPlot& whole,
              viewer::ReportPage& page) {
  const std::string median_text =
      track.errors_m.empty() ? "none" : format_fixed(100.0 * median(track.errors_m), 1) + " cm";
  page.begin_part("It tracks itself",
                  {pictures_text(track.until_localised),
                   "until a robot knew which of " + std::to_string(track.places_at_first) +
                       " places it was at, several of them alike"});
  page.add_text(
      "A corridor with identical doors and eight identical junctions. The robot does not know "
      "where it is, nor which way it faces, and it starts in one of two narrow crossings: its plan "
      "is the same when turned by half, so that at first several places explain what it sees. "
      "Each dot is a particle, a place where the robot may be. Its odometry, which drifts, moves "
      "them, and each picture keeps those that explain it: they gather in a few places, and in one "
      "once small differences have added up.");
  page.add_text(
      "After " + std::to_string(kidnapped_after + 1) +
      " pictures somebody carries the robot to the other crossing and tells it nothing. It "
      "counts as localised when it says so and is right to " +
      format_fixed(100.0 * spacing_m, 0) + " cm.");
  page.add_figures(
      {{std::to_string(track.places_at_first), "places possible after the first picture"},
       {pictures_text(track.until_localised), "until it was localised"},
       {pictures_text(track.until_found_again), "until it was found again, once kidnapped"},
       {median_text, "median error where it says that it is localised"},
       {std::to_string(track.wrong) + " of " + std::to_string(track.localised),
        "of these answers wrong; a kidnapped robot needs some pictures to notice"}});
  page.add_run(played);
  page.add_plots(
      {{whole,
        "The whole run. The true way in black begins anew where the robot was put down; the "
        "estimated one in blue lies on it, but for the pictures after it was kidnapped."}});
}

}  // namespace

std::string pictures_text(const std::optional<std::size_t>& pictures) {
  return pictures ? std::to_string(*pictures) + (*pictures == 1 ? " picture" : " pictures")
                  : "never";
}

DemoTrack show_track(const DemoOptions& options, const DemoRecordings& recordings,
                     const MemoryFile& file, Session& session, viewer::ReportPage& page) {
  const Dataset& run = recordings.walk_run;
  const OdometryNoise odometry = simulation_of(options, 0).odometry;
  Tracker tracker(file, {.filter = {.seed = static_cast<int>(options.seed % 1000000000)},
                         .odometry = odometry,
                         .source = run.source});
  const VisualMemory& memory = tracker.memory();
  const std::size_t particles_kept = particles_shown(run.entries.size());
  const std::vector<Point2> at_first = positions_of(
      recordings::resample_systematically(tracker.localiser().particles(), particles_kept));
  std::vector<TrackedImage> images;
  viewer::RunPage played("A robot that is kidnapped", run.entries.size());
  const ShownReferences shown(memory);
  track(tracker, run, {.particles_kept = particles_kept, .recorded = &file, .shown = &shown},
        session.executor(), [&](TrackedImage&& image) {
          if (image.index == 0)
            image.moment->walls = viewer::scene_outlines(recordings.corridor_scene);
          add(played, image);
          image.moment.reset();
          images.push_back(std::move(image));
        });
  DemoTrack result = outcome_of(images, recordings.kidnapped_after, options.spacing_m());
  result.places_at_first = images.front().estimate.modes.size();
  const std::vector<viewer::MapLayer> scene = viewer::scene_layers(recordings.corridor_scene);
  result.gathering =
      gathering_of(images, at_first, scene, recordings.kidnapped_after, options.spacing_m());
  add_part(result, options.spacing_m(), recordings.kidnapped_after, played,
           track_map(memory, images, {scene, recordings.kidnapped_after}), page);
  return result;
}

}  // namespace panonav::command
