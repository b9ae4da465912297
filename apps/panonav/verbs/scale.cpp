#include <array>
#include <string_view>
#include <utility>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/pipeline/map_scale.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav::command {

namespace {

struct ScaleArguments {
  std::string memory;
  std::optional<std::vector<std::string>> distance;
  std::optional<double> camera_height_m;
};

/// Parses a length with one of the units m, cm and mm, in metres. Throws UsageError.
double parse_length_m(const std::string& text) {
  constexpr double max_length_m = 1e6;
  constexpr std::array<std::pair<std::string_view, double>, 3> metres_per_unit{
      {{"m", 1.0}, {"cm", 0.01}, {"mm", 0.001}}};
  const std::size_t unit_at = text.find_last_of("0123456789.") + 1;  // 0 without a number
  for (const auto& [unit, unit_m] : metres_per_unit) {
    double value = 0.0;
    if (std::string_view(text).substr(unit_at) != unit) continue;
    if (!read_number(text.substr(0, unit_at), value)) continue;
    if (value > 0.0 && unit_m * value <= max_length_m) return unit_m * value;
  }
  throw UsageError("--distance is '" + text +
                   "'; allowed: a number above 0 with the unit m, cm or mm, such as 3.2m, 320cm or "
                   "3200mm; at most 1000000m");
}

/// Measures the metres per unit of the map from the ground. Throws UsageError, FileError if the
/// images cannot show the ground.
GroundScale measure_scale(const ScaleArguments& arguments, const MemoryFile& memory,
                          Session& session) {
  const double height_m = *arguments.camera_height_m;
  if (!(height_m > 0.0) || height_m > 100.0) {
    throw UsageError("--camera-height-m is " + to_text(height_m) +
                     "; allowed: above 0 and at most 100");
  }
  if (!memory.header().elevations) {
    throw FileError(arguments.memory,
                    "has images whose rows have unknown elevations, so the ground cannot be found; "
                    "use --distance VIEW VIEW LENGTH");
  }
  std::optional<Progress> bar;
  return measure_ground_scale(memory, height_m, [&](std::size_t pairs) {
    if (!bar) bar.emplace(session, "measuring", pairs);
    bar->advance();
  });
}

/// Returns the names of the routes that were scaled with the map.
std::vector<std::string> find_scaled_routes(const MemoryFile& memory) {
  const auto map_scale = read_map_scale(memory);
  std::vector<std::string> names = memory.route_names();
  std::erase_if(names, [&](const std::string& name) {
    if (memory.route_method(name) == RouteMethod::chain) return true;
    const int columns = memory.route(name).value().columns();
    const RouteSource source = read_route_source(memory, name, columns);
    return !source.is_in_map_unit || source.assumed_unit_m || source.map_scale != map_scale;
  });
  return names;
}

void print_result(const ScaleArguments& arguments, const MemoryFile& memory, double factor,
                  const std::optional<GroundScale>& ground, Session& session) {
  const TopologicalMap map = memory.map(map_name).value();
  const auto step_m = compute_view_step(map);
  const auto routes = find_scaled_routes(memory);
  const std::vector<std::size_t> parts = describe_map(memory).value().part_sizes;
  if (session.json()) {
    ordered_json json{{"memory", arguments.memory},
                      {"factor", factor},
                      {"view_step_m", to_json_or_null(step_m)},
                      {"routes", routes},
                      {"part_sizes", parts},
                      {"ground", nullptr}};
    if (ground) {
      json["ground"] = {{"measured", ground->measured},
                        {"tried", ground->tried},
                        {"deviation", ground->deviation}};
    }
    session.print(json_line(json));
    return;
  }
  session.print("positions in " + arguments.memory + " are now in " + session.bold("metres") +
                (step_m ? std::string("; the ") + describe_view_step(map) + " is " +
                              format_number(*step_m, {}, 2) + " m"
                        : "; one former unit is " + format_number(factor, {}, 2) + " m"));
  if (ground) {
    session.print("The ground shows the distance of " + std::to_string(ground->measured) + " of " +
                  format_count(ground->tried, "pair") +
                  " of neighbouring views; standard deviation of the scale: " +
                  format_number(100.0 * ground->deviation, {}, 2) + " %.");
  }
  if (parts.size() > 1) {
    session.print("The map has " +
                  session.red(std::to_string(parts.size()) + " parts that are not connected") +
                  ". All are scaled by " +
                  (ground ? "the median over all parts; lengths in a single part"
                          : "the distance in one part; lengths in the others") +
                  " may be wrong by a factor, and distances between parts have no meaning.");
  }
  if (!routes.empty()) {
    std::string names;
    for (const std::string& name : routes) names += (names.empty() ? "" : ", ") + name;
    session.print("Routes scaled with the map: " + names + ".");
  }
  session.print("To revert the scaling: panonav undo " + arguments.memory);
  session.suggest({"panonav", "localise", arguments.memory, "INPUT"});
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
  if (arguments.distance) {
    const auto& words = *arguments.distance;
    const double factor =
        scale_to_metres(memory, find_view_by_name_or_id(memory, words[0]),
                        find_view_by_name_or_id(memory, words[1]), parse_length_m(words[2]),
                        "scale by the distance of " + words[0] + " and " + words[1]);
    print_result(arguments, memory, factor, std::nullopt, session);
    return ExitCode::done;
  }
  const GroundScale ground = measure_scale(arguments, memory, session);
  if (!ground.unit_m) {
    return session.no_answer(
        "panonav scale: the ground in the images of " + arguments.memory +
        " does not show the scale: it shows the distance of " + std::to_string(ground.measured) +
        " of " + format_count(ground.tried, "pair") + " of neighbouring views" +
        (ground.measured > 0 ? ", and the standard deviation of the scale is " +
                                   format_number(100.0 * ground.deviation, {}, 2) + " %"
                             : "") +
        "; use --distance VIEW VIEW LENGTH");
  }
  scale_to_metres(
      memory, *ground.unit_m,
      "scale by a camera height of " + format_number(*arguments.camera_height_m) + " m");
  print_result(arguments, memory, *ground.unit_m, ground, session);
  return ExitCode::done;
}

Run declare_scale(Arguments& arguments) {
  auto values = std::make_shared<ScaleArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file with a map of its images");
  arguments.option("--distance", "VIEW VIEW LENGTH", values->distance,
                   "Names or ids of two views of one part of the map, and their distance in m, cm "
                   "or mm, such as 3.2m");
  arguments.option(
      "--camera-height-m", values->camera_height_m,
      "Height of the camera above level ground; lengths are computed from the images of "
      "the ground in neighbouring views, and the map keeps its shape");
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
      "the median distance between consecutive views or, if the images are in no order, between a "
      "view and the nearest one. The known distance between two views, or "
      "the height of the camera above the ground, makes them metres. All parts of a map are scaled "
      "by one factor, which may be wrong for parts that are not connected. Run the verb again to "
      "correct "
      "the scale. Routes in the unit of the map are scaled, too; those recorded with odometry or "
      "positions are not. panonav undo reverts a scaling.",
      "  panonav scale walk.panonav --distance view_00003.png view_00027.png 3.2m\n"
      "  panonav scale walk.panonav --camera-height-m 1.6",
      declare_scale};
}

}  // namespace panonav::command
