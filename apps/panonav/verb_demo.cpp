#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "arguments.hpp"
#include "demo_homing.hpp"
#include "demo_maps.hpp"
#include "demo_pictures.hpp"
#include "demo_recordings.hpp"
#include "demo_route.hpp"
#include "memorising.hpp"
#include "panonav/core/error.hpp"
#include "panonav/evaluation/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "report_page.hpp"
#include "session.hpp"
#include "verbs.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

std::string percent(double share) {
  return fixed(100.0 * share, 0) + " %";
}

// Raw picture, what calibration found in it, and the cylinder made of it.
void show_camera(const DemoRecordings& recordings, const fs::path& out, Session& session,
                 ReportPage& page) {
  const Dataset& asked = recordings.query_run;
  const Image colour = recordings.colour_picture(asked.entries.front(), session.executor());
  write_png(out / "mirror.png", colour.view());
  const Image overlay = draw_mirror(colour.view(), recordings.mirror);
  write_png(out / "calibration.png", overlay.view());
  const PanoramaReader reader(asked.source, {});
  const Panorama cylinder = reader.read(asked.entries.front().path);
  const Image picture = to_picture(cylinder);
  write_png(out / "cylinder.png", picture.view());

  const Camera truth = recordings.true_camera;
  const MirrorCircle& found = recordings.mirror;
  page.section("1. What the robot sees");
  page.text(
      "A camera looks up into a curved mirror and sees all around at once. The dark disc in the "
      "middle is the camera "
      "itself. Before anything else, calibration finds the mirror in some of the raw pictures: "
      "centre, rim and inner radius. "
      "Everything below uses what it found, not the simulator's own numbers.");
  page.pictures(
      {{"mirror.png",
        "Raw picture of the mirror camera, 640 x 480 (in colour for you; the robot "
        "works on grey)"},
       {"calibration.png",
        "What calibration found in " + std::to_string(recordings.calibrated_on) +
            " raw pictures: rim green, inner radius orange, centre red. The centre is off by " +
            fixed(std::hypot(found.centre.u_px - truth.centre.u_px,
                             found.centre.v_px - truth.centre.v_px),
                  2) +
            " pixels, the rim by " + fixed(std::abs(found.rim_radius_px - truth.rim_radius_px), 2) +
            "."}});
  page.text(
      "The picture is then unwrapped to a panoramic cylinder. Of each of its 80 rows only the "
      "first "
      "15 Fourier components "
      "are kept, 2.4 kB a view. Their magnitudes do not change when the robot turns, so they tell "
      "the place whichever way "
      "it faces; their phases tell the heading.");
  page.pictures({{"cylinder.png",
                  "The same view as a cylinder of 512 x 80 pixels, forward in the middle, left on "
                  "the left"}});
}

std::vector<AskedView> ask(const Localiser& localiser, const MemoryPipeline& pipeline,
                           const Dataset& queries, Executor& executor) {
  std::vector<std::optional<AskedView>> asked(queries.entries.size());
  for_each_entry(executor, queries.entries.size(), [&](std::size_t i) {
    const auto& entry = queries.entries[i];
    PackedSignature signature = pipeline.packed(pipeline.read(entry));
    Localisation found = localiser.localise(signature);
    const ReferencePose& pose = *entry.pose;
    asked[i] =
        AskedView{{pose.x_m, pose.y_m, *pose.heading_rad}, std::move(signature), std::move(found)};
  });
  std::vector<AskedView> all;
  for (auto& view : asked) all.push_back(std::move(*view));
  return all;
}

/// What the answers are worth.
struct Outcome {
  std::vector<double> errors_m;
  std::vector<double> nearest_errors_m;
  std::vector<double> heading_errors_rad;
  double known = 0.0;        ///< share of all questions
  double bytes_share = 0.0;  ///< of a full scan
};

Outcome outcome_of(const std::vector<AskedView>& asked, const VisualMemory& memory) {
  Outcome outcome;
  std::uint64_t read = 0;
  std::uint64_t in_full = 0;
  std::size_t known = 0;
  for (const auto& [truth, signature, found] : asked) {
    known += found.known ? 1 : 0;
    read += found.bytes_read;
    in_full += found.bytes_in_full;
    if (!found.matches.empty()) {
      const Point2 nearest = memory.info(found.matches.front().view).pose->position();
      outcome.nearest_errors_m.push_back(distance(nearest, truth.position()));
    }
    if (found.position) {
      outcome.errors_m.push_back(distance(found.position->position, truth.position()));
    }
    if (found.heading_rad) {
      outcome.heading_errors_rad.push_back(
          std::abs(angle_difference(*found.heading_rad, truth.heading_rad)));
    }
  }
  outcome.known = static_cast<double>(known) / static_cast<double>(asked.size());
  outcome.bytes_share = static_cast<double>(read) / static_cast<double>(in_full);
  return outcome;
}

std::string median_text(const std::vector<double>& values, double unit, int digits,
                        std::string_view name) {
  if (values.empty()) return "none";
  return fixed(unit * median(values), digits) + " " + std::string(name);
}

void show_answers(const VisualMemory& memory, const FloorPlan& plan,
                  const std::vector<AskedView>& asked, const Outcome& own, const Outcome& foreign,
                  double spacing_m, const fs::path& out, ReportPage& page) {
  draw_answers(memory, plan, asked, out / "map.png");
  const std::string spacing = fixed(100.0 * spacing_m, 0) + " cm";
  page.section("2. Remember and localise");
  page.text("The robot took a view every " + spacing +
            " and remembered it. Then it was put down at " + std::to_string(asked.size()) +
            " random places between them, facing anywhere, and asked from one new picture each: "
            "where are you, and which way do "
            "you face? It was also put into another room, where the right answer is that it does "
            "not know the place.");
  page.figures({{std::to_string(memory.size()), "views remembered, " + spacing + " apart"},
                {median_text(own.errors_m, 100.0, 1, "cm"), "median error of the position"},
                {median_text(own.heading_errors_rad, degrees(1.0), 2, "degrees"),
                 "median error of the heading"},
                {percent(own.known), "of its own places recognised"},
                {percent(foreign.known), "of the views of another room taken for this one"}});
  page.text(
      "On the map, circles are the remembered views and green crosses the places where the robot "
      "was put down. From each a "
      "line runs to where its memory says it is; the shorter, the better. The nearest remembered "
      "view alone would be " +
      median_text(own.nearest_errors_m, 100.0, 1, "cm") +
      " off (median): the position is interpolated between views.");
  page.pictures({{"map.png", "True places, and the error of each answer"}});
}

/// The first place that was recognised stands for all.
const AskedView& shown_view(const std::vector<AskedView>& asked) {
  const auto known =
      std::find_if(asked.begin(), asked.end(), [](const auto& view) { return view.found.known; });
  return known == asked.end() ? asked.front() : *known;
}

void show_levels(const VisualMemory& memory, const FloorPlan& plan, const AskedView& view,
                 double spacing_m, const fs::path& out, ReportPage& page) {
  const auto areas_m2 = draw_areas(memory, plan, view, out / "areas.png");
  draw_similarity(memory, spacing_m, view, out / "similarity.png");
  page.section("3. As accurate as needed");
  page.text(
      "With one Fourier component compared, the robot may be anywhere in a large area (" +
      fixed(areas_m2.front(), 1) +
      " square metres here); with each further component the area shrinks, down to " +
      fixed(areas_m2.back(), 2) +
      ". In the open a coarse answer is enough and costs less; at a door a fine one is needed.");
  page.pictures({{"areas.png",
                  "Orange: where the robot may be, after 1, 3, 6 and 15 components. Red cross: "
                  "where it is."}});
  page.pictures({{"similarity.png",
                  "How similar each remembered view is to the one asked for. It falls with "
                  "distance on all sides."}});
}

void show_what_next(const DemoRecordings& recordings, const fs::path& out, ReportPage& page) {
  const auto in_out = [&](const char* name) { return (out / name).string(); };
  page.section("Try it yourself");
  page.text(
      "The recordings and the memory of this run lie beside this page. Each command shows more "
      "with --help.");
  const std::string memory = in_out("office.panonav");
  page.commands(
      {"alias panonav=build/release/bin/panonav", "panonav info " + memory,
       "panonav localise " + memory + " " + in_out("query_run"),
       "panonav localise " + memory + " " + in_out("elsewhere_run") + "    # another room: unknown",
       "panonav localise " + memory + " " + recordings.query_run.entries.front().path.string() +
           " --areas",
       "panonav home view_00000.png " + recordings.query_run.entries.front().path.string() +
           " --memory " + memory + " --report " + in_out("way_home"),
       "panonav unwrap " + recordings.query_run.entries.front().path.string() + " --camera " +
           (recordings.query_run.folder / "camera.toml").string() + " -o panorama.png"});
}

ExitCode demonstrate(const DemoOptions& wanted, Session& session) {
  const auto start = std::chrono::steady_clock::now();
  const fs::path& out = wanted.out;
  prepare_demo_folder(out);
  const auto recordings = record_demo(wanted, session);
  if (!recordings) {
    session.note("panonav demo: no mirror was found in the simulated pictures");
    return ExitCode::no_answer;
  }
  ReportPage page("panonav: a robot that remembers what places look like",
                  "A simulated robot with one mirror camera drives through an office and remembers "
                  "what it looks like. Put down "
                  "somewhere else, it says where it is and which way it faces, from one picture. "
                  "No laser, no GPU, no training.");
  show_camera(*recordings, out, session, page);

  const fs::path memory_path = out / "office.panonav";
  MemoryFile file = MemoryFile::create(
      memory_path, header_from_first_views(recordings->memory_run, SignatureOptions{},
                                           PreprocessingOptions{}, session.executor()));
  const MemoryPipeline pipeline(file.header(), recordings->memory_run.source);
  (void)append_views(recordings->memory_run, pipeline, true, file, session);
  const VisualMemory memory = file.load();
  const Localiser localiser(memory);
  const auto asked = ask(localiser, pipeline, recordings->query_run, session.executor());
  const auto elsewhere = ask(localiser, pipeline, recordings->elsewhere_run, session.executor());
  const Outcome own = outcome_of(asked, memory);
  const Outcome foreign = outcome_of(elsewhere, memory);
  constexpr double margin_m = 1.2;  // furniture stands around the free floor
  const FloorPlan plan = floor_plan(
      *recordings->office, {recordings->low.x_m - margin_m, recordings->low.y_m - margin_m},
      {recordings->high.x_m + margin_m, recordings->high.y_m + margin_m});
  show_answers(memory, plan, asked, own, foreign, wanted.spacing_m(), out, page);
  show_levels(memory, plan, shown_view(asked), wanted.spacing_m(), out, page);
  const DemoHoming homing = show_homing(recordings->office_scene, plan, wanted.runs_home(),
                                        wanted.seed, out, session, page);
  const DemoMaps maps = show_maps(memory, wanted.seed, wanted.quick, out, session, page);
  const DemoRoute route =
      show_route(recordings->office_scene, plan, wanted.route_m(), wanted.seed, out, session, page);
  show_what_next(*recordings, out, page);
  page.write(out);

  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto median_or_null = [](const std::vector<double>& values) {
    return values.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(median(values));
  };
  if (session.json()) {
    session.print(nlohmann::ordered_json{
        {"report", (out / "index.html").string()},
        {"views", memory.size()},
        {"questions", asked.size()},
        {"position_error_m", median_or_null(own.errors_m)},
        {"heading_error_rad", median_or_null(own.heading_errors_rad)},
        {"known", own.known},
        {"known_elsewhere", foreign.known},
        {"bytes_share", own.bytes_share},
        {"runs_home", homing.runs.size()},
        {"arrived_home", homing.arrived},
        {"home_error_m", median(homing.distances_m)},
        {"arranged_shape_difference", maps.lattice
                                          ? nlohmann::ordered_json(maps.lattice->shape_difference)
                                          : nlohmann::ordered_json()},
        {"drive_shape_difference", maps.map_error},
        {"wheels_shape_difference", maps.wheels_error},
        {"route_runs", route.runs.size()},
        {"route_completed", route.completed},
        {"route_distance_m", median_or_null(route.lateral_m)},
        {"seconds",
         seconds}}.dump());
    return ExitCode::done;
  }
  session.print("panonav demo: " + std::to_string(memory.size()) +
                " views of an office remembered, " + std::to_string(asked.size()) +
                " questions asked, " + fixed(seconds, 0) + " s");
  session.print("  position: median error " + median_text(own.errors_m, 100.0, 1, "cm") +
                "; heading: " + median_text(own.heading_errors_rad, degrees(1.0), 2, "degrees"));
  session.print("  own places recognised: " + percent(own.known) +
                "; views of another room taken for this one: " + percent(foreign.known));
  session.print("  home from one metre away: " + std::to_string(homing.arrived) + " of " +
                std::to_string(homing.runs.size()) + " runs ended within 10 cm; median " +
                fixed(100.0 * median(homing.distances_m), 1) + " cm");
  session.print("  arranged without positions: shape difference " +
                (maps.lattice ? fixed(maps.lattice->shape_difference, 3) : std::string("none")) +
                "; map from a drive: " + fixed(maps.map_error, 3) + ", its wheels alone " +
                fixed(maps.wheels_error, 3));
  session.print("  a route of " + fixed(route.length_m, 0) + " m repeated from 0.3 m off: " +
                std::to_string(route.completed) + " of " + std::to_string(route.runs.size()) +
                " runs reached its end; distance from it: median " +
                median_text(route.lateral_m, 100.0, 1, "cm"));
  tell_report(out, session);
  return ExitCode::done;
}

Run declare(Arguments& arguments) {
  auto wanted = std::make_shared<DemoOptions>();
  auto out = std::make_shared<std::string>("demo");
  auto seed = std::make_shared<std::optional<std::uint64_t>>();
  arguments.option("-o,--out", *out,
                   "Folder for the report: a new one, or that of an earlier demo (default: demo)");
  arguments.option("--seed", *seed, "Of the simulated office (default: 1)");
  arguments.flag("--quick", wanted->quick, "A smoke run: fewer views and questions");
  return [wanted, out, seed](Session& session) {
    wanted->out = *out;
    wanted->seed = seed->value_or(1);
    return demonstrate(*wanted, session);
  };
}

}  // namespace

Verb demo_verb() {
  return {"demo", "The whole story on a simulated office, with a report to look at",
          "Takes about a minute. Needs nothing but this program and gnuplot. What an earlier demo "
          "left in the folder\n"
          "is written anew; a folder that holds anything else is refused.",
          "  panonav demo\n  panonav demo --seed 5 -o other_office", declare};
}

}  // namespace panonav::command
