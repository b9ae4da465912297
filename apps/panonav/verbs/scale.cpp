#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav::command {

namespace {

struct ScaleArguments {
  std::string memory;
  std::optional<std::vector<std::string>> distance;
  std::optional<double> camera_height_m;
};

/// Parses a length such as "3.2m" or "320cm", in metres. Throws UsageError.
double parse_length_m(const std::string& text) {
  const double metres_per_unit = text.ends_with("cm") ? 0.01 : 1.0;
  const std::string number = text.substr(0, text.find_last_not_of("cm") + 1);
  double value = 0.0;
  if (!text.ends_with('m') || !read_number(number, value) || !(value > 0.0) || value > 1e6) {
    throw UsageError("--distance is '" + text +
                     "'; allowed: a length above 0, such as 3.2m or 320cm");
  }
  return metres_per_unit * value;
}

ExitCode scale(const ScaleArguments& arguments, Session& session) {
  if (arguments.distance.has_value() == arguments.camera_height_m.has_value()) {
    throw UsageError("set either --distance or --camera-height-m");
  }
  auto memory = MemoryFile::open(arguments.memory, Access::read_write);
  if (!has_positions_from_map(memory)) {
    throw FileError(arguments.memory, memory.info().views_with_position > 0
                                          ? "has positions from a data set, which are in metres"
                                          : "has no map; panonav memorise makes one of images "
                                            "taken every 20 to 50 cm");
  }
  const double former_unit_m = read_assumed_unit_m(memory);
  std::optional<double> factor;
  if (arguments.distance) {
    const auto& words = *arguments.distance;
    factor = scale_to_metres(memory, find_view_by_name_or_id(memory, words[0]),
                             find_view_by_name_or_id(memory, words[1]), parse_length_m(words[2]),
                             "scale by the distance of " + words[0] + " and " + words[1]);
  } else {
    if (!(*arguments.camera_height_m > 0.0) || *arguments.camera_height_m > 100.0) {
      throw UsageError("--camera-height-m is " + to_text(*arguments.camera_height_m) +
                       "; allowed: above 0 and at most 100");
    }
    const MemoryMap map = describe_map(memory).value();
    if (2 * map.part_sizes.front() < map.views) {
      return session.no_answer(
          "panonav scale: the map of " + arguments.memory + " has " +
          format_count(map.part_sizes.size(), "part") + ", the largest with " +
          std::to_string(map.part_sizes.front()) + " of " + format_count(map.views, "view") +
          ", so lengths cannot be computed from one image to the next; use --distance");
    }
    Progress progress(session, "mapping", memory.info().views);
    static_cast<void>(map_views(memory, {}, session.executor(), *arguments.camera_height_m,
                                [&] { progress.advance(); }));
    if (read_length_unit(memory) != LengthUnit::metres) {
      return session.no_answer("panonav scale: the ground in the images of " + arguments.memory +
                               " does not show the lengths of steps; use --distance");
    }
  }
  const auto step_m = median_step_length(memory.map(map_name).value());
  if (session.json()) {
    session.print(command::json_line(ordered_json{{"memory", arguments.memory},
                                                  {"factor", to_json_or_null(factor)},
                                                  {"view_step_m", to_json_or_null(step_m)}}));
    return ExitCode::done;
  }
  session.print(
      "positions in " + arguments.memory + " are now in " + session.bold("metres") +
      (step_m ? "; consecutive views are " + format_number(*step_m, {}, 2) + " m apart (median)"
              : ""));
  session.suggest({"panonav", "localise", arguments.memory, "INPUT"});
  session.detail("one unit was assumed to be " + format_number(former_unit_m) + " m");
  return ExitCode::done;
}

Run declare_scale(Arguments& arguments) {
  auto values = std::make_shared<ScaleArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file with a map of its images");
  arguments.option("--distance", "VIEW VIEW LENGTH", values->distance,
                   "Names or ids of two views of one part of the map, and their distance, such as "
                   "3.2m");
  arguments.option("--camera-height-m", values->camera_height_m,
                   "Height of the camera above level ground; the map is made again, and lengths "
                   "are computed from the images of the ground");
  arguments.explain_interruption(
      "The memory is as before. To start over, run the same command again.");
  return [values](Session& session) { return scale(*values, session); };
}

}  // namespace

Verb scale_verb() {
  return {
      "scale",
      VerbGroup::maps_and_routes,
      "Scale a map of images to metres",
      "A map that was computed from images alone has no scale: its positions are in view steps, "
      "the median distance between consecutive views. The known distance between two views, or "
      "the height of the camera above the ground, makes them metres. Positions from a data set "
      "or from odometry are in metres already. Routes in view steps are scaled, too. panonav "
      "undo reverts a scaling by --distance.",
      "  panonav scale walk.panonav --distance view_00003.png view_00027.png 3.2m\n"
      "  panonav scale walk.panonav --camera-height-m 1.6",
      declare_scale};
}

}  // namespace panonav::command
