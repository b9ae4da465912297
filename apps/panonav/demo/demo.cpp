#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "demo/homing.hpp"
#include "demo/maps.hpp"
#include "demo/navigation.hpp"
#include "demo/pictures.hpp"
#include "demo/recordings.hpp"
#include "demo/route.hpp"
#include "demo/story.hpp"
#include "demo/track.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/arrangement.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav_viewer/scene_drawing.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

std::string format_percent(double share) {
  return format_fixed(100.0 * share, 0) + " %";
}

// Adds the camera's image, the calibrated mirror in it and the panorama made of it to the page.
// Returns the first image for the beginning of the page.
viewer::ReportPicture add_camera_part(const DemoRecordings& recordings, Session& session,
                                      viewer::ReportPage& page) {
  const Dataset& queries = recordings.query_run;
  const Image colour = recordings.colour_picture(queries.entries.front(), session.executor());
  const Image overlay = draw_mirror(colour.view(), recordings.mirror);
  const PanoramaReader reader(queries.source, {});
  Panorama cylinder = reader.read(queries.entries.front().path);

  const Camera truth = recordings.true_camera;
  const MirrorCircle& found = recordings.mirror;
  const std::string centre_px = format_fixed(
      std::hypot(found.centre.u_px - truth.centre.u_px, found.centre.v_px - truth.centre.v_px), 2);
  page.begin_part("Camera",
                  {centre_px + " pixels",
                   "error of the mirror's centre after calibration with the robot's own images"});
  page.add_text(
      "The camera points up at a curved mirror and takes images of the whole surroundings. The "
      "dark disc in the middle of an image is the reflection of the camera itself. First, the "
      "robot calibrates its camera: in some unprocessed (raw) images, it finds the centre of the "
      "mirror, its rim, and the inner radius, inside which nothing but the camera is visible. All "
      "parts of this page use the calibrated values, not the true values of the simulation.");
  viewer::ReportPicture mirror = embed_image(
      colour.view(), "Raw image of the mirror camera, " + std::to_string(truth.image_size.width) +
                         " x " + std::to_string(truth.image_size.height) +
                         " pixels. The robot itself uses greyscale images.");
  page.add_pictures(
      {mirror,
       embed_image(
           overlay.view(),
           "Result of the calibration from " + std::to_string(recordings.calibration_image_count) +
               " raw images. Green: rim; orange: inner radius; red: centre. The error of "
               "the centre is " +
               centre_px + " pixels. The error of the rim's radius is " +
               format_fixed(std::abs(found.rim_radius_px - truth.rim_radius_px), 2) + " pixels.")});
  page.add_text(
      "The robot then unwraps each image into a panorama of 80 rows. For each row it stores only "
      "the first 15 components of the Fourier transform. This signature takes 2.4 kB. With "
      "local features and a thumbnail, the view takes about 10 kB in the memory file. The "
      "magnitudes of the components do not change when the robot rotates, so they identify the "
      "place at any heading. The phases give the heading.");
  page.add_views({{std::move(cylinder),
                   {},
                   "The same image as a panorama of 512 x 80 pixels. The robot's forward direction "
                   "is in the middle."}});
  return mirror;
}

std::vector<LocalisedView> localise_all(const Localiser& localiser, const ViewEncoder& encoder,
                                        const Dataset& queries, Executor& executor) {
  std::vector<std::optional<LocalisedView>> answers(queries.entries.size());
  parallel_for(executor, queries.entries.size(), [&](std::size_t i) {
    const auto& entry = queries.entries[i];
    PackedSignature signature = encoder.packed(encoder.read(entry));
    Place found = localiser.localise(signature);
    const ReferencePose& pose = *entry.pose;
    answers[i] = LocalisedView{
        {pose.x_m, pose.y_m, *pose.heading_rad}, std::move(signature), std::move(found)};
  });
  std::vector<LocalisedView> all;
  for (auto& view : answers) all.push_back(std::move(*view));
  return all;
}

/// Statistics of the answers.
struct Outcome {
  std::vector<double> errors_m;
  std::vector<double> nearest_errors_m;
  std::vector<double> heading_errors_rad;
  double known = 0.0;        ///< share of the images that were recognised
  double bytes_share = 0.0;  ///< bytes read, as a share of those of a full scan
};

Outcome summarise_outcome(const std::vector<LocalisedView>& queries, const VisualMemory& memory) {
  Outcome outcome;
  std::uint64_t read = 0;
  std::uint64_t in_full = 0;
  std::size_t known = 0;
  for (const auto& [truth, signature, found] : queries) {
    known += found.known ? 1 : 0;
    read += found.bytes_read;
    in_full += found.bytes_in_full;
    if (!found.matches.empty()) {
      const Point2 nearest = memory.info(found.matches.front().view).pose->position();
      outcome.nearest_errors_m.push_back(distance(nearest, truth.position()));
    }
    if (found.position) {
      outcome.errors_m.push_back(distance(found.position->position(), truth.position()));
    }
    if (found.heading_rad) {
      outcome.heading_errors_rad.push_back(
          std::abs(angle_difference(*found.heading_rad, truth.heading_rad)));
    }
  }
  outcome.known = static_cast<double>(known) / static_cast<double>(queries.size());
  outcome.bytes_share = static_cast<double>(read) / static_cast<double>(in_full);
  return outcome;
}

std::string format_median(const std::vector<double>& values, double unit, int digits,
                          std::string_view name) {
  if (values.empty()) return "none";
  return format_fixed(unit * median(values), digits) + " " + std::string(name);
}

void add_answers_part(const VisualMemory& memory, const std::vector<viewer::MapLayer>& scene,
                      const std::vector<LocalisedView>& queries, const Outcome& in_office,
                      const Outcome& in_other_room, double spacing_m, viewer::ReportPage& page) {
  const std::string spacing = format_fixed(100.0 * spacing_m, 0) + " cm";
  page.begin_part("Localisation", {format_median(in_office.errors_m, 100.0, 1, "cm"),
                                   "median error of the position computed from one image"});
  page.add_text(
      "The robot stored views of an office on a grid with a spacing of " + spacing +
      ". Then it was placed at " + std::to_string(queries.size()) +
      " random positions between these views, with random headings. At each of these positions, it "
      "took one new image and computed its position and heading from this image. The robot was "
      "also placed in another room. The correct answer in that room is that the place is unknown.");
  page.add_figures(
      {{std::to_string(memory.size()), "stored views with a spacing of " + spacing},
       {format_median(in_office.errors_m, 100.0, 1, "cm"), "median error of the position"},
       {format_median(in_office.heading_errors_rad, degrees(1.0), 2, "degrees"),
        "median error of the heading"},
       {format_percent(in_office.known), "of the places in the office were recognised"},
       {format_percent(in_other_room.known),
        "of the images from the other room were wrongly recognised"}});
  page.add_text(
      "The circles on the map are the stored views. The green crosses are the true positions of "
      "the robot. A line leads from each cross to the position that the robot computed; a short "
      "line means a small error. If the robot used the position of the most similar view as its "
      "answer, the median error would be " +
      format_median(in_office.nearest_errors_m, 100.0, 1, "cm") +
      ". The robot is more accurate because it interpolates between views.");
  page.add_plots({{draw_answers(memory, scene, queries),
                   "True positions of the robot, and the error of each computed position"}});
}

/// Returns the first image whose place was recognised, or the first image.
const LocalisedView& choose_view(const std::vector<LocalisedView>& queries) {
  const auto known = std::find_if(queries.begin(), queries.end(),
                                  [](const auto& view) { return view.found.known; });
  return known == queries.end() ? queries.front() : *known;
}

viewer::MapAnimation add_levels_part(const VisualMemory& memory,
                                     const std::vector<viewer::MapLayer>& scene,
                                     const LocalisedView& view, double spacing_m,
                                     viewer::ReportPage& page) {
  AreaAnimation areas = draw_areas(memory, scene, view);
  const std::string first = format_fixed(areas.areas_m2.front(), 1);
  const std::string last = format_fixed(areas.areas_m2.back(), 2);
  page.begin_part("Adjustable accuracy", {first + " to " + last + " m²",
                                          "size of the area in which the robot may be: large for a "
                                          "fast, rough answer, small for an accurate answer"});
  page.add_text(
      "If the robot compares only one Fourier component, it may be anywhere in an area of " +
      first + " square metres. More components reduce this area, down to " + last +
      " square metres. In open space a rough answer is sufficient and takes less "
      "computation. At a door the robot needs an accurate answer.");
  page.add_plots(
      {{areas.map,
        "Orange: the area in which the robot may be. The number of components increases from step "
        "to step. Cross: the true position."},
       {draw_similarity(memory, spacing_m, view),
        "Similarity of each stored view to the image that the robot took at the cross. The view "
        "nearest to the cross is the most similar one. Similarity decreases with distance in all "
        "directions. The areas in the other plot are computed from these similarities."}});
  return std::move(areas.map);
}

void add_commands(const DemoOptions& options, const DemoRecordings& recordings,
                  const DemoNavigation& navigation, viewer::ReportPage& page) {
  const auto path_in_out = [&](const char* name) { return (options.out / name).string(); };
  page.begin_section("Commands for these data");
  page.add_text(
      "The recordings and the memories of this demonstration are in the folder of this page. Every "
      "command has the option --help.");
  const std::string memory = path_in_out("office.panonav");
  const simulation::SimulatedWorldOptions world_options = demo_world_options(options, 0);
  std::string mission;
  for (const std::string& word : navigation.first_mission) mission += " " + word;
  page.add_commands(
      {"alias panonav=build/release/bin/panonav", "panonav info " + memory,
       "panonav localise " + memory + " " + path_in_out("query_run"),
       "panonav localise " + memory + " " + path_in_out("elsewhere_run") +
           "    # another room: unknown place",
       "panonav localise " + memory + " " + recordings.query_run.entries.front().path.string() +
           " --areas",
       "panonav track " + path_in_out("corridor.panonav") + " " + path_in_out("walk_run") +
           " --report " + path_in_out("track_report"),
       "panonav home view_00000.png " + recordings.query_run.entries.front().path.string() +
           " --memory " + memory + " --report " + path_in_out("way_home"),
       "panonav navigate " + memory + " --scene office --scene-seed " +
           std::to_string(world_options.simulation.scene.scene_seed) + " --exposure " +
           format_number(world_options.sensor.exposure) + mission + " --picture " +
           path_in_out("path.svg"),
       "panonav unwrap " + recordings.query_run.entries.front().path.string() + " --camera " +
           (recordings.query_run.folder / "camera.toml").string() + " -o panorama.png"});
}

/// The results of all parts.
struct DemoResults {
  std::size_t views = 0;
  std::size_t query_count = 0;
  Outcome in_office;
  Outcome in_other_room;
  DemoTrack track;
  DemoMaps maps;
  DemoHoming homing;
  DemoRoute route;
  DemoNavigation navigation;
  double seconds = 0.0;
};

ordered_json median_or_null(const std::vector<double>& values) {
  return values.empty() ? ordered_json() : ordered_json(median(values));
}

ordered_json to_json(const simulation::MissionRun& run) {
  return {{"end", to_string(run.end)},
          {"goal_distance_m", run.end_distance_m},
          {"steps", run.decisions.size()},
          {"travelled_m", run.travelled_m},
          {"shortest_m", run.shortest_m}};
}

ordered_json to_json(const DemoResults& done, const fs::path& out) {
  const DemoNavigation& navigation = done.navigation;
  return {{"report", (out / "index.html").string()},
          {"views", done.views},
          {"questions", done.query_count},
          {"position_error_m", median_or_null(done.in_office.errors_m)},
          {"heading_error_rad", median_or_null(done.in_office.heading_errors_rad)},
          {"known", done.in_office.known},
          {"known_elsewhere", done.in_other_room.known},
          {"bytes_share", done.in_office.bytes_share},
          {"track_images", done.track.images},
          {"track_places_at_first", done.track.places_at_first},
          {"track_until_localised", to_json_or_null(done.track.until_localised)},
          {"track_until_found_again", to_json_or_null(done.track.until_found_again)},
          {"track_localised", done.track.localised},
          {"track_wrong", done.track.wrong},
          {"track_error_m", median_or_null(done.track.errors_m)},
          {"arranged_procrustes_disparity",
           done.maps.lattice ? ordered_json(done.maps.lattice->shape.value) : ordered_json()},
          {"drive_procrustes_disparity", done.maps.map_error},
          {"wheels_procrustes_disparity", done.maps.wheels_error},
          {"runs_home", done.homing.runs.size()},
          {"arrived_home", done.homing.arrived},
          {"home_error_m", median(done.homing.distances_m)},
          {"route_runs", done.route.runs.size()},
          {"route_completed", done.route.completed},
          {"route_distance_m", median_or_null(done.route.lateral_m)},
          {"missions", navigation.runs.size()},
          {"missions_arrived", navigation.arrived},
          {"mission_detour", median_or_null(navigation.detours)},
          {"mission_steps", median_or_null(navigation.steps)},
          {"mission_kidnapped", to_json(navigation.kidnapped)},
          {"mission_screen", navigation.screened ? to_json(*navigation.screened) : ordered_json()},
          {"seconds", done.seconds}};
}

std::string format_delay(const std::optional<std::size_t>& images) {
  return (images ? "after " : "") + format_image_count(images);
}

void print(const DemoResults& done, const fs::path& out, Session& session) {
  if (session.json()) return session.print(json_line(to_json(done, out)));
  session.print("panonav demo: " + std::to_string(done.views) + " views of an office stored, " +
                std::to_string(done.query_count) + " images localised, " +
                format_fixed(done.seconds, 0) + " s");
  session.print(
      "  position: median error " + format_median(done.in_office.errors_m, 100.0, 1, "cm") +
      "; heading: " + format_median(done.in_office.heading_errors_rad, degrees(1.0), 2, "degrees"));
  session.print(
      "  places in the office recognised: " + format_percent(done.in_office.known) +
      "; images of another room wrongly recognised: " + format_percent(done.in_other_room.known));
  session.print("  tracking: localised " + format_delay(done.track.until_localised) +
                "; after the robot was kidnapped, localised again " +
                format_delay(done.track.until_found_again) + "; median error " +
                format_median(done.track.errors_m, 100.0, 1, "cm") + "; " +
                format_part_of(done.track.wrong, done.track.localised) + " answers wrong");
  const auto centimetres = [](double metres) { return format_fixed(100.0 * metres, 0) + " cm"; };
  session.print(
      "  arrangement from images alone: error " +
      (done.maps.lattice ? centimetres(done.maps.lattice->truth_from_map.rms_m) : "none") +
      "; map of a drive: error " + centimetres(done.maps.map_rms_m) + "; odometry alone: error " +
      centimetres(done.maps.wheels_rms_m));
  session.print("  homing from a distance of one metre: " +
                format_part_of(done.homing.arrived, done.homing.runs.size()) +
                " runs ended within 10 cm; median " +
                format_fixed(100.0 * median(done.homing.distances_m), 1) + " cm");
  session.print("  route of " + format_fixed(done.route.length_m, 0) +
                " m, repeated from a start 0.3 m beside it: " +
                format_part_of(done.route.completed, done.route.runs.size()) +
                " runs reached the end; median distance from the route " +
                format_median(done.route.lateral_m, 100.0, 1, "cm"));
  const DemoNavigation& navigation = done.navigation;
  session.print(
      "  navigation: " + format_part_of(navigation.arrived, navigation.runs.size()) +
      " missions arrived; median ratio of driven path to shortest path " +
      (navigation.detours.empty() ? "none" : format_fixed(median(navigation.detours), 2)) +
      "; mission with a kidnapped robot: " + std::string(to_string(navigation.kidnapped.end)) +
      "; mission with a new obstacle on the path: " +
      (navigation.screened ? std::string(to_string(navigation.screened->end)) : "none"));
  print_report_path(out, session);
}

MemoryFile memorise_run(const Dataset& run, const fs::path& path, Executor& executor) {
  {
    Memoriser memoriser(path, {.source = run.source});
    DatasetObservations source(run, executor);
    std::vector<Observation> observations;
    while (auto observation = source.next()) observations.push_back(std::move(*observation));
    memoriser.add(std::move(observations), executor);
    memoriser.finish(executor);
  }
  return MemoryFile::open(path, Access::read_write);
}

/// Returns the size of the memory file per view, such as "10 kB".
std::string format_bytes_per_view(const MemoryFile& file) {
  const auto info = file.info();
  return format_fixed(1e-3 * static_cast<double>(info.file_bytes) / static_cast<double>(info.views),
                      0) +
         " kB";
}

/// Localises images of the office and of another room, and adds the answers to the page.
std::vector<LocalisedView> demonstrate_localisation(const DemoOptions& options,
                                                    const DemoRecordings& recordings,
                                                    const VisualMemory& memory,
                                                    const ViewEncoder& encoder, DemoResults& done,
                                                    Session& session, viewer::ReportPage& page) {
  const Localiser localiser(memory);
  auto queries = localise_all(localiser, encoder, recordings.query_run, session.executor());
  const auto elsewhere =
      localise_all(localiser, encoder, recordings.elsewhere_run, session.executor());
  done.query_count = queries.size();
  done.in_office = summarise_outcome(queries, memory);
  done.in_other_room = summarise_outcome(elsewhere, memory);
  add_answers_part(memory, viewer::scene_layers(recordings.office_scene), queries, done.in_office,
                   done.in_other_room, options.spacing_m(), page);
  return queries;
}

ExitCode demonstrate(const DemoOptions& options, Session& session) {
  const auto start = std::chrono::steady_clock::now();
  const fs::path& out = options.out;
  prepare_demo_folder(out);
  constexpr int parts = 8;
  int part = 0;
  Progress progress(session, "demo", parts);
  const auto next_part = [&](const std::string& what) {
    if (part > 0) progress.advance();
    progress.relabel("part " + std::to_string(++part) + " of " + std::to_string(parts) + ": " +
                     what);
  };
  next_part("simulate images");
  const auto recordings = record_demo(options, session);
  if (!recordings) {
    return session.no_answer("panonav demo: no mirror was found in the simulated images");
  }
  viewer::ReportPage page = make_demo_page();
  DemoStory story{.mirror = add_camera_part(*recordings, session, page)};

  next_part("store views and localise");
  MemoryFile file =
      memorise_run(recordings->memory_run, out / "office.panonav", session.executor());
  const auto encoder =
      std::make_shared<const ViewEncoder>(file.header(), recordings->memory_run.source);
  const VisualMemory memory = file.load();
  DemoResults done{.views = memory.size()};
  const auto queries =
      demonstrate_localisation(options, *recordings, memory, *encoder, done, session, page);
  story.view_size = format_bytes_per_view(file);
  story.position_error = format_median(done.in_office.errors_m, 100.0, 1, "cm");
  next_part("adjustable accuracy");
  story.areas = add_levels_part(memory, viewer::scene_layers(recordings->office_scene),
                                choose_view(queries), options.spacing_m(), page);
  next_part("track the robot");
  const MemoryFile corridor =
      memorise_run(recordings->corridor_run, out / "corridor.panonav", session.executor());
  done.track = demonstrate_tracking(options, *recordings, corridor, session, page);
  next_part("make maps");
  done.maps = demonstrate_maps(memory, options.seed, options.quick, session, page);
  store_lattice(done.maps.arranged, memory, file);
  next_part("drive home");
  done.homing = demonstrate_homing(recordings->office_scene, options.homing_run_count(),
                                   options.seed, session, page);
  next_part("repeat a route");
  done.route =
      demonstrate_route(recordings->office_scene, options.route_m(), options.seed, session, page);
  next_part("drive to goals");
  done.navigation = demonstrate_navigation(options, *recordings, file, memory, done.maps.arranged,
                                           encoder, session, page);
  add_commands(options, *recordings, done.navigation, page);
  add_results(story, done.track, done.navigation);
  add_story(std::move(story), page);
  page.write(out, "index.html", "panonav demo");
  progress.clear();

  done.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  print(done, out, session);
  return ExitCode::done;
}

Run declare_demo(Arguments& arguments) {
  auto values = std::make_shared<DemoOptions>();
  auto out = std::make_shared<std::string>("demo");
  auto seed = std::make_shared<std::optional<std::uint64_t>>();
  arguments.option("-o,--out FOLDER", *out,
                   "Folder for the page: a new folder, or the folder of an earlier demo");
  arguments.declare_outputs({"--out"});
  arguments.option("--seed", *seed, "Seed of the simulated office (default: 1)");
  arguments.flag(
      "--quick", values->quick,
      "Run a short demonstration with fewer and smaller images and fewer drives to goals");
  arguments.explain_interruption(
      "The page was not written. To start over, run the same command again.");
  return [values, out, seed](Session& session) {
    values->out = *out;
    values->seed = seed->value_or(1);
    return demonstrate(*values, session);
  };
}

}  // namespace

Verb demo_verb() {
  return {"demo",
          VerbGroup::first_steps,
          "Run all functions in a simulated office and write a page",
          "A simulated robot stores views, finds its position, makes maps, drives home, repeats a "
          "route and drives to goals. This takes about a minute on two cores. Files of an earlier "
          "demo in the folder are replaced. A folder that contains other files is refused.",
          "  panonav demo\n  panonav demo --seed 5 -o other_office",
          declare_demo};
}

}  // namespace panonav::command
