#include "demo/track.hpp"

#include <filesystem>
#include <set>
#include <string>
#include <utility>

#include "panonav/core/statistics.hpp"
#include "reports/track_animation.hpp"
#include "reports/track_pictures.hpp"
#include "reports/track_report.hpp"
#include "verbs/tracked_run.hpp"

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

/// The first image, that at which it is localised, the last before it is kidnapped, the first
/// after it, that at which it is found again, and the last.
std::set<std::size_t> moments_of(const DemoTrack& track, std::size_t kidnapped_after) {
  std::set<std::size_t> moments{0, kidnapped_after, kidnapped_after + 1, track.images - 1};
  if (track.until_localised) moments.insert(*track.until_localised - 1);
  if (track.until_found_again) moments.insert(kidnapped_after + *track.until_found_again);
  return moments;
}

std::string images_text(const std::optional<std::size_t>& images) {
  return images ? std::to_string(*images) + (*images == 1 ? " image" : " images") : "never";
}

void add_part(const DemoTrack& track, double spacing_m, std::size_t kidnapped_after,
              ReportPage& page) {
  const std::string median_text =
      track.errors_m.empty() ? "none" : fixed(100.0 * median(track.errors_m), 1) + " cm";
  page.part("It tracks itself",
            {images_text(track.until_found_again), "until a robot that was kidnapped knew it"});
  page.text(
      "A robot that does not know where it is, nor which way it faces, drives through the office. "
      "Red dots are particles: places where it may be. Its odometry, which drifts, moves them, and "
      "each picture keeps those that explain it. After " +
      std::to_string(kidnapped_after + 1) +
      " pictures somebody carries the robot elsewhere and tells it nothing. It counts as localised "
      "when it says so and is right to " +
      fixed(100.0 * spacing_m, 0) + " cm, the spacing of the views.");
  page.figures({{images_text(track.until_localised), "until it was localised"},
                {images_text(track.until_found_again), "until it was found again, once kidnapped"},
                {median_text, "median error where it says that it is localised"},
                {std::to_string(track.wrong) + " of " + std::to_string(track.localised),
                 "of these answers farther off than the spacing"}});
  page.pictures(
      {{"particles.png",
        "Before the first image, when localised, before and after it was kidnapped, when found "
        "again, at the "
        "end. Blue cross: where it is; black square: where it says that it is, orange while it is "
        "not sure. Grey circles are remembered views, grey areas furniture."},
       {"tracked.png",
        "The whole run: true way in blue, which begins anew where the robot was put down, and the "
        "estimated one in black."}});
  page.link("track.html", "Play the run, image by image");
}

}  // namespace

DemoTrack show_track(const DemoOptions& options, const DemoRecordings& recordings,
                     const MemoryFile& file, const FloorPlan& plan, Session& session,
                     ReportPage& page) {
  const Dataset& run = recordings.walk_run;
  const OdometryNoise odometry = simulation_of(options, 0).odometry;
  Tracker tracker(file, {.filter = {.seed = static_cast<int>(options.seed % 1000000000)},
                         .odometry = odometry,
                         .source = run.source});
  const VisualMemory& memory = tracker.memory();
  const std::size_t particles_kept = particles_shown(run.entries.size());
  const std::vector<Point2> at_first = even_sample(tracker.localiser().particles(), particles_kept);
  std::vector<TrackedImage> images;
  track(tracker, run, {.particles_kept = particles_kept}, session.executor(),
        [&](TrackedImage&& image) { images.push_back(std::move(image)); });
  DemoTrack result = outcome_of(images, recordings.kidnapped_after, options.spacing_m());
  const TrackBackground background{
      {MapLayer{.label = "furniture", .colour = "#cccccc", .filled_polygons = plan.boxes}},
      recordings.kidnapped_after};
  draw_track_snapshots(memory, images, moments_of(result, recordings.kidnapped_after), background,
                       options.out / "particles.png", at_first);
  draw_track_map(memory, images, background, options.out / "tracked.png");
  write_track_animation(options.out / "track.html", memory, options.spacing_m(), images);
  add_part(result, options.spacing_m(), recordings.kidnapped_after, page);
  return result;
}

}  // namespace panonav::command
