#include "demo/track.hpp"

#include <string>
#include <utility>

#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav_viewer/scene_drawing.hpp"
#include "reports/track_pictures.hpp"
#include "reports/track_report.hpp"
#include "runs/shown_references.hpp"
#include "runs/tracked_run.hpp"

namespace panonav::command {

namespace {

bool is_correct(const TrackedImage& image, double within_m) {
  const auto error_m = position_error_m(image);
  return is_localised(image) && error_m && *error_m <= within_m;
}

/// Returns the number of images in [begin, end) up to and including the first correct one; nullopt
/// if there is none.
std::optional<std::size_t> count_images_until_right(const std::vector<TrackedImage>& images,
                                                    std::size_t begin, std::size_t end,
                                                    double within_m) {
  for (std::size_t i = begin; i < end; ++i) {
    if (is_correct(images[i], within_m)) return i - begin + 1;
  }
  return std::nullopt;
}

DemoTrack summarise_outcome(const std::vector<TrackedImage>& images, std::size_t kidnapped_after,
                            double spacing_m) {
  DemoTrack track{.images = images.size()};
  track.until_localised = count_images_until_right(images, 0, kidnapped_after + 1, spacing_m);
  track.until_found_again =
      count_images_until_right(images, kidnapped_after + 1, images.size(), spacing_m);
  for (const TrackedImage& image : images) {
    if (!is_localised(image)) continue;
    ++track.localised;
    track.wrong += is_correct(image, spacing_m) ? 0 : 1;
    track.errors_m.push_back(*position_error_m(image));
  }
  return track;
}

/// Returns the title of an image's frame, which describes the state of the filter.
std::string frame_title(const TrackedImage& image, std::size_t kidnapped_after, double within_m) {
  const std::string number = "image " + std::to_string(image.index + 1) + ": ";
  if (image.index == kidnapped_after + 1) return number + "the robot was moved by hand";
  switch (image.estimate.state) {
    case LocalisationState::localised:
      return number +
             (is_correct(image, within_m) ? "localised" : "wrong position, not yet noticed");
    case LocalisationState::position_known:
      return number + "position known, heading not";
    case LocalisationState::ambiguous:
      return number + "several places are possible";
    case LocalisationState::lost:
      break;
  }
  return number + "lost";
}

/// Animates how the particles converge. Few particles are drawn, so that they fit into a small
/// picture.
viewer::MapAnimation draw_convergence(const std::vector<TrackedImage>& images,
                                      const std::vector<Point2>& initial_positions,
                                      std::vector<viewer::MapLayer> scene,
                                      std::size_t kidnapped_after, double within_m) {
  viewer::MapAnimation map{.title = "", .backdrop = std::move(scene)};
  const viewer::MapLayer initial_particles{.label = "possible positions",
                                           .colour = viewer::PlotColour::vermilion,
                                           .dots = initial_positions};
  map.frames.push_back({.title = "before the first image", .layers = {initial_particles}});
  for (const TrackedImage& image : images) {
    viewer::MapLayer particles = initial_particles;
    particles.dots = positions_of(image.particles);
    const viewer::MapLayer truth{.label = "true position",
                                 .colour = viewer::PlotColour::black,
                                 .circles = {image.truth->position()}};
    map.frames.push_back(
        {.title = frame_title(image, kidnapped_after, within_m), .layers = {particles, truth}});
  }
  return map;
}

void add_part(const DemoTrack& track, double spacing_m, std::size_t kidnapped_after,
              const viewer::RunPage& replay_page, const viewer::MapPlot& path_map,
              viewer::ReportPage& page) {
  const std::string median_text =
      track.errors_m.empty() ? "none" : format_fixed(100.0 * median(track.errors_m), 1) + " cm";
  page.begin_part("Tracking",
                  {format_image_count(track.until_localised),
                   "until the robot was localised; at first, " +
                       std::to_string(track.places_at_first) + " places were possible"});
  page.add_text(
      "The robot drives in a corridor with identical doors and eight identical junctions. At first "
      "it knows neither its position nor its heading. It starts in one of two narrow "
      "cross-corridors. The floor plan is symmetric, so the first image matches more than one "
      "place. Each dot is a particle: a possible pose (position and heading) of the robot. The "
      "particles move by the motion that the robot measures (odometry). This measurement contains "
      "errors. After each image, only the particles that match the image remain. They first "
      "concentrate in a few places, which look almost the same. After more images, the small "
      "differences between these places are sufficient, and the particles concentrate in one "
      "place.");
  page.add_text(
      "After " + std::to_string(kidnapped_after + 1) +
      " images the robot is kidnapped: it is moved by hand to the other cross-corridor. The robot "
      "counts as correctly localised if it reports a position with an error of at most " +
      format_fixed(100.0 * spacing_m, 0) + " cm.");
  page.add_figures(
      {{std::to_string(track.places_at_first), "possible places after the first image"},
       {format_image_count(track.until_localised), "until the robot was localised"},
       {format_image_count(track.until_found_again),
        "until the robot was localised again after it was kidnapped"},
       {median_text, "median error of the reported positions"},
       {std::to_string(track.wrong) + " of " + std::to_string(track.localised),
        "reported positions were wrong; the robot needs some images to notice that it was "
        "kidnapped"}});
  page.add_run(replay_page);
  page.add_plots({{path_map,
                   "The whole run. Black: the true path. It has two parts because the robot was "
                   "kidnapped. Blue: the estimated path. The two paths agree except just after the "
                   "robot was kidnapped."}});
}

}  // namespace

std::string format_image_count(const std::optional<std::size_t>& images) {
  return images ? format_count(*images, "image") : "never";
}

DemoTrack demonstrate_tracking(const DemoOptions& options, const DemoRecordings& recordings,
                               const MemoryFile& file, Session& session, viewer::ReportPage& page) {
  const Dataset& run = recordings.walk_run;
  const OdometryNoise odometry = demo_world_options(options, 0).odometry;
  Tracker tracker(file, {.filter = {.seed = static_cast<int>(options.seed % 1000000000)},
                         .odometry = odometry,
                         .source = run.source});
  const VisualMemory& memory = tracker.memory();
  const std::size_t particles_per_image = count_shown_particles(run.entries.size());
  const std::vector<Point2> initial_positions = positions_of(
      recordings::resample_systematically(tracker.localiser().particles(), particles_per_image));
  std::vector<TrackedImage> images;
  viewer::RunPage replay_page("A kidnapped robot", run.entries.size());
  const ShownReferences shown_references(memory);
  track(tracker, run,
        {.particles_per_image = particles_per_image,
         .thumbnail_file = &file,
         .shown_references = &shown_references},
        session, [&](TrackedImage&& image) {
          if (image.index == 0)
            image.moment->walls = viewer::scene_outlines(recordings.corridor_scene);
          add(replay_page, image);
          image.moment.reset();
          images.push_back(std::move(image));
        });
  DemoTrack result = summarise_outcome(images, recordings.kidnapped_after, options.spacing_m());
  result.places_at_first = images.front().estimate.modes.size();
  const std::vector<viewer::MapLayer> scene = viewer::scene_layers(recordings.corridor_scene);
  result.convergence = draw_convergence(images, initial_positions, scene,
                                        recordings.kidnapped_after, options.spacing_m());
  add_part(result, options.spacing_m(), recordings.kidnapped_after, replay_page,
           draw_track(memory, images, {scene, recordings.kidnapped_after}), page);
  return result;
}

}  // namespace panonav::command
