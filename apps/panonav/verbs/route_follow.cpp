#include <array>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_viewer/page.hpp"
#include "reports/report_page.hpp"
#include "reports/route_report.hpp"
#include "runs/chain_run.hpp"
#include "runs/followed_run.hpp"
#include "runs/picture_layout.hpp"
#include "runs/recording.hpp"
#include "runs/run_record.hpp"

namespace panonav::command {

namespace {

struct FollowArguments {
  std::string memory;
  std::string dataset;
  RunArguments run;
  std::optional<std::string> name;
  int every = 1;
  bool no_odometry = false;
  bool back = false;
  std::optional<std::string> tum;
  std::optional<std::string> report;
  RunRecordArguments record;
  RouteTrackerOptions tracker;
  RouteFitOptions fit;
};

ordered_json to_json(const FollowedImage& image, bool headings_known) {
  ordered_json json{{"file", image.file},
                    {"stamp_s", to_json_or_null(image.stamp_s)},
                    {"on_route", image.fix.has_value()},
                    {"pose", nullptr},
                    {"origin", nullptr},
                    {"along_m", nullptr},
                    {"lateral_m", nullptr},
                    {"correlation", nullptr},
                    {"residual", nullptr},
                    {"covariance", nullptr},
                    {"columns", 0},
                    {"changed", ordered_json::array()},
                    {"ground_truth", nullptr}};
  if (image.fix) {
    const RouteFix& fix = *image.fix;
    json["pose"] = pose_json(fix.pose);
    json["origin"] = to_string(image.fix->origin);
    json["along_m"] = image.fix->along_m;
    json["lateral_m"] = image.fix->lateral_m;
    json["correlation"] = fix.correlation;
    json["residual"] = fix.residual;
    json["covariance"] = fix.covariance;
    json["columns"] = fix.columns;
  }
  for (const RouteChanges::AzimuthRange& range : image.changed) {
    json["changed"].push_back({{"from_rad", range.from_rad}, {"to_rad", range.to_rad}});
  }
  if (image.truth) {
    json["ground_truth"] = {{"x_m", image.truth->x_m},
                            {"y_m", image.truth->y_m},
                            {"heading_rad", nullptr},
                            {"along_m", image.true_place->along_m},
                            {"lateral_m", image.true_place->lateral_m}};
    if (headings_known) json["ground_truth"]["heading_rad"] = image.truth->heading_rad;
  }
  return json;
}

std::string format_line(const FollowedImage& image, Session& session) {
  if (!image.fix) return image.file + "  " + session.red("not on this route");
  const RouteFix& fix = *image.fix;
  std::string line = image.file + "  " + session.green(format_origin(image.fix->origin)) + "  x " +
                     session.format_length(fix.pose.x_m, 3) + "  y " +
                     session.format_length(fix.pose.y_m, 3) + "  heading " +
                     format_fixed(degrees(fix.pose.heading_rad), 1) + " degrees  along " +
                     session.format_length(image.fix->along_m, 3) + "  lateral " +
                     session.format_length(image.fix->lateral_m, 3) + "  correlation " +
                     format_fixed(fix.correlation, 3);
  for (const RouteChanges::AzimuthRange& range : image.changed) {
    line += "  changed at " + format_fixed(degrees(range.from_rad), 0) + " to " +
            format_fixed(degrees(range.to_rad), 0) + " degrees";
  }
  return line;
}

void print_error(const std::string& what, const std::vector<double>& errors, double scale,
                 int digits, const std::string& unit, Session& session) {
  if (errors.empty()) return;
  session.print(what + "  median " + format_fixed(scale * quantile(errors, 0.5), digits) + unit +
                "  95 % within " + format_fixed(scale * quantile(errors, 0.95), digits) + unit);
}

void print_summary(const FollowSummary& summary, const std::vector<FollowedImage>& images,
                   Session& session) {
  session.print(
      "on the route at " +
      session.bold(std::to_string(summary.on_route) + " of " + std::to_string(summary.images)) +
      " images: " + std::to_string(summary.predicted) + " predicted, " +
      std::to_string(summary.recovered) + " recovered, " + std::to_string(summary.searched) +
      " found");
  if (summary.on_route > 0) session.print(std::string("(") + std::string(origin_explanation) + ")");
  const std::string unit = std::string(" ") + to_string(session.length_unit());
  print_error("error of position      ", summary.position_m, 1.0, 4, unit, session);
  print_error("error along the route  ", summary.along_m, 1.0, 4, unit, session);
  print_error("lateral error          ", summary.lateral_m, 1.0, 4, unit, session);
  print_error("error of heading       ", summary.heading_rad, degrees(1.0), 2, " degrees", session);
  for (const auto& [from_m, to_m] : find_changed_sections(images)) {
    session.print("changed scene from " + format_fixed(from_m, 2) + " to " +
                  session.format_length(to_m, 2) + " along the route");
  }
}

/// True if the poses of the route are in the frame of the data set from which it was recorded.
bool is_in_data_set_frame(const RouteSource& route) {
  return !route.from_odometry && !route.assumed_unit_m && !route.is_in_map_unit;
}

/// Prints the frame of the poses if the views or the data set have positions in another one.
void print_frame(const RouteSource& route, const MemoryFile& memory, bool has_uncompared_truth,
                 Session& session) {
  const bool is_data_set = is_in_data_set_frame(route);
  const std::string frame = is_data_set           ? "the frame of the recorded data set"
                            : route.from_odometry ? "the route's own frame"
                                                  : "the frame of the map";
  const bool is_view_frame = !route.from_odometry && is_data_set != has_positions_from_map(memory);
  if (memory.info().views_with_position > 0 && !is_view_frame) {
    session.print("x, y and heading are in " + frame + ", not in that of the views (localise).");
  }
  if (has_uncompared_truth) {
    session.print("The true positions are not compared, as x, y and heading are in " + frame + ".");
  }
}

void write_fixes(const std::string& path, const std::vector<FollowedImage>& images,
                 const std::vector<double>& seconds, const TrajectoryUnits& units) {
  std::vector<StampedPose> trajectory;
  for (const FollowedImage& image : images) {
    if (image.fix)
      append_pose(trajectory, {seconds[image.index], image.fix->pose}, path, image.file);
  }
  write_trajectory(path, trajectory, units);
}

/// Follows the chain of that name. Throws UsageError on options for route panoramas.
ExitCode follow_chain(const Arguments& declared, const FollowArguments& arguments,
                      const MemoryFile& memory, const std::string& name, const Dataset& run,
                      Session& session) {
  declared.reject_options({"--no-odometry", "[route_tracker]", "[route_fit]"},
                          "as the route '" + name + "' is a chain of snapshots");
  ChainGuide guide(memory, run.source, name,
                   arguments.back ? ChainDirection::back : ChainDirection::forward);
  std::vector<double> seconds;
  if (arguments.tum)
    seconds = trajectory_stamps(run, "route follow", arguments.dataset, *arguments.tum, session);
  if (arguments.report) prepare_report_folder(*arguments.report, "route follow");
  RunRecord record(arguments.record, std::array{arguments.dataset, arguments.memory}, false,
                   session, {});
  viewer::RunPage replay_page("", run.entries.size() / static_cast<std::size_t>(arguments.every));
  if (arguments.report) record.copy_to(replay_page);
  const std::vector<ChainStep> steps =
      follow_chain_run(guide, run, arguments.every, record, session);
  if (arguments.tum) {
    std::vector<StampedPose> trajectory;
    for (const ChainStep& step : steps) {
      append_pose(trajectory, {seconds[step.index], step.pose}, *arguments.tum, step.file);
    }
    write_trajectory(*arguments.tum, trajectory, find_trajectory_units(run, LengthUnit::metres));
  }
  if (arguments.report) {
    write_chain_report(*arguments.report, name, guide.chain(), steps, replay_page);
    print_report_path(*arguments.report, session);
  }
  return steps.back().decision.state == ChainState::lost ? ExitCode::no_answer : ExitCode::done;
}

ExitCode follow_run(const Arguments& declared, const FollowArguments& arguments, Session& session) {
  const auto memory = MemoryFile::open(arguments.memory, Access::read_only);
  const Dataset run = open_run(arguments.dataset, arguments.run, memory, session);
  const std::string name = find_route_name(memory, arguments.name);
  if (memory.route_method(name) == RouteMethod::chain) {
    return follow_chain(declared, arguments, memory, name, run, session);
  }
  declared.reject_options({"--back"}, "as the route '" + name + "' is no chain of snapshots");
  if (!has_odometry(run)) {
    declared.reject_options({"--recovery-m", "--surprise-m"},
                            "as " + arguments.dataset + " has no odometry");
  }
  RouteFollower follower(memory, run.source,
                         {.name = arguments.name,
                          .tracker = arguments.tracker,
                          .fit = arguments.fit,
                          .use_odometry = !arguments.no_odometry && has_odometry(run)});
  if (follower.source().assumed_unit_m) session.set_length_unit(LengthUnit::view_steps);
  // The poses of a data set are no ground truth for a route in another frame: of odometry or a map.
  const auto poses = dataset_poses(run);
  const bool is_compared = is_in_data_set_frame(follower.source());
  const auto truth = is_compared ? poses : std::vector<Pose2>{};
  const bool headings_known = !truth.empty() && run.entries.front().pose->heading_rad.has_value();
  std::vector<double> seconds;
  if (arguments.tum)
    seconds = trajectory_stamps(run, "route follow", arguments.dataset, *arguments.tum, session);
  if (arguments.report) prepare_report_folder(*arguments.report, "route follow");
  std::vector<FollowedImage> images;
  Progress progress(session, "following", (run.entries.size() - 1) / arguments.every + 1);
  RunRecord record(arguments.record, std::array{arguments.dataset, arguments.memory}, false,
                   session, {});
  std::optional<PanoramaReader> panorama_reader;
  if (record.is_active() || arguments.report) panorama_reader.emplace(run.source, PanoramaShape{});
  viewer::RunPage replay_page(
      "", (run.entries.size() - 1) / static_cast<std::size_t>(arguments.every) + 1);
  follow(follower, run, truth, arguments.every, panorama_reader ? &*panorama_reader : nullptr,
         session, [&](FollowedImage&& image) {
           progress.clear();
           session.print(session.json() ? session.json_line(to_json(image, headings_known))
                                        : format_line(image, session));
           if (arguments.report) {
             recordings::RunMoment moment = *image.moment;
             moment.values.insert(moment.values.begin(), {"image", image.file});
             replay_page.add(moment);
           }
           if (image.moment) record.add(std::move(*image.moment));
           image.moment.reset();
           images.push_back(std::move(image));
           progress.advance();
         });
  progress.clear();
  record.close();

  if (arguments.tum) {
    write_fixes(*arguments.tum, images, seconds, find_trajectory_units(run, session.length_unit()));
  }
  const FollowSummary summary = summarise_follow(images, headings_known);
  if (!session.json()) {
    print_summary(summary, images, session);
    print_frame(follower.source(), memory, !is_compared && !poses.empty(), session);
  }
  if (arguments.report) {
    const auto panorama = memory.route(follower.name());
    write_follow_report(
        *arguments.report,
        {follower.name(), *panorama, follower.tracker().lines(), session.length_unit()}, images,
        summary, std::move(replay_page));
    print_report_path(*arguments.report, session);
  }
  return summary.on_route > 0 ? ExitCode::done : ExitCode::no_answer;
}

Run declare_route_follow(Arguments& arguments) {
  auto values = std::make_shared<FollowArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file with a route");
  arguments.positional("INPUT", values->dataset,
                       "Data set, folder of images, video or recording of a later drive, with "
                       "images in the order of the drive");
  declare_topics(arguments, values->run.topics);
  declare_part(arguments, values->run.part, false);
  declare_gpano(arguments, values->run.ignore_gpano);
  arguments.option("--name NAME", values->name,
                   "Name of the route; needed if the memory contains several routes");
  arguments.option("--every N", values->every, 1,
                   "Use only every N-th image; the odometry of skipped images is added up");
  arguments.flag("--no-odometry", values->no_odometry,
                 "Do not use odometry, but search the whole route for each image");
  arguments.flag("--back", values->back,
                 "Follow a chain of snapshots from its end to its beginning");
  arguments.option("--tum FILE", values->tum,
                   "Write the estimated poses to this file: as CSV if the name ends in .csv, "
                   "otherwise as TUM text");
  declare_record(arguments, values->record);
  declare_view(arguments, values->record);
  declare_report(arguments, values->report,
                 "a page with the route, the computed positions and the predicted images");
  arguments.options("route_tracker", values->tracker);
  arguments.options("route_fit", values->fit);
  arguments.reject_options_unless(
      {"--recovery-m", "--surprise-m"}, [values] { return !values->no_odometry; },
      "with --no-odometry");
  arguments.reject_options_unless(
      {"--coarse-deg"}, [values] { return values->fit.levels > 1; }, "with --levels 1");
  arguments.declare_outputs({"--tum"});
  return [values, &arguments](Session& session) { return follow_run(arguments, *values, session); };
}

}  // namespace

Verb route_follow_verb() {
  return {"route follow",
          VerbGroup::maps_and_routes,
          "Find the position of a robot relative to a recorded route",
          "From the recorded lines of the route, the verb predicts the images at other poses, and "
          "searches for the pose whose predicted image agrees best with the image of the robot. "
          "The robot may also be between the lines or beside the route. If the data set has "
          "odometry, the search starts at the pose that the odometry predicts (in the output: "
          "predicted). If this search fails, the verb searches near this pose (recovered), and "
          "then along the whole route (found). Parts of the scene that have changed are ignored "
          "and reported. Along a chain of snapshots, the verb gives the next motion of the robot "
          "for each image instead. The exit code is 1 if no image can be "
          "located on the route, or if the robot is lost along a chain.",
          "  panonav route follow office.panonav repeat_run\n"
          "  panonav route follow office.panonav repeat_run --report followed\n"
          "  panonav route follow office.panonav repeat_run --no-odometry --json\n"
          "  panonav route follow office.panonav return_run --name home --back",
          declare_route_follow};
}

}  // namespace panonav::command
