#include <algorithm>
#include <array>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/route_recorder.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_file.hpp"
#include "reports/report_page.hpp"
#include "reports/route_report.hpp"
#include "runs/chain_run.hpp"
#include "runs/memorising.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct RecordArguments {
  std::string memory;
  std::string dataset;
  PictureArguments pictures;
  std::string name = "route";
  std::optional<double> every_m;
  std::optional<std::string> horizon_rows;
  bool odometry = false;
  std::optional<std::string> report;
  HorizonScanlineOptions line;
  std::optional<std::string> method;
  ChainSpacing chain;
  ChainOdometry chain_odometry;

  [[nodiscard]] bool is_chain() const { return method == "chain"; }
};

/// Parses rows such as "17-20". Throws UsageError.
std::pair<int, int> parse_rows(const std::string& text) {
  const auto dash = text.find('-');
  const auto number = [&](const std::string& part) {
    int value = -1;
    return read_number(part, value) ? value : -1;
  };
  if (dash != std::string::npos) {
    const int first = number(text.substr(0, dash));
    const int last = number(text.substr(dash + 1));
    if (first >= 0 && last >= first) return {first, last};
  }
  throw UsageError("--horizon-rows is '" + text +
                   "'; allowed: FIRST-LAST, rows from 0 at the top, such as 17-20");
}

/// Finds the poses of the drive and prints a note about poses that were computed. Throws FileError
/// if there are none.
DrivePoses find_poses(const Arguments& declared, const RecordArguments& arguments,
                      const Dataset& dataset, const MemoryFile& memory, Session& session) {
  DrivePoses found =
      find_drive_poses(dataset, memory, arguments.name, arguments.odometry, session.executor());
  if (found.assumed_unit_m) {
    session.set_length_unit(LengthUnit::view_steps);
    declared.reject_options({"--every-m"},
                            "because the positions are in view steps, not metres "
                            "(panonav scale)");
  }
  const std::string lead = "panonav route record: " + arguments.dataset;
  switch (found.origin) {
    case RoutePoseOrigin::data_set:
      if (!found.drive.entries.front().pose->heading_rad) {
        session.note(lead + " contains no headings; the direction of travel is used");
      }
      break;
    case RoutePoseOrigin::odometry:
      break;
    case RoutePoseOrigin::map:
      session.note(lead +
                   " has neither positions nor odometry; the poses are those of the map of " +
                   arguments.memory);
      if (!found.is_in_order) {
        session.note(lead +
                     " shows no drive: consecutive images are not more similar than others, so the "
                     "route jumps between places; record a drive as a video, or name its images in "
                     "their order, and choose another --name");
      }
      break;
    case RoutePoseOrigin::images:
      session.note(lead +
                   " has neither positions nor odometry; the motion is computed from the images");
      break;
  }
  return found;
}

std::string format_rows(const std::optional<std::pair<int, int>>& rows) {
  return rows ? std::to_string(rows->first) + "-" + std::to_string(rows->second) : "none";
}

/// Sets the options of the route's lines. Throws ContractError if they differ from those of an
/// existing route.
void set_line_options(const Arguments& declared, const RecordArguments& arguments,
                      const PictureSource& pictures, const std::optional<MemoryFile>& memory,
                      RouteRecorderOptions& options) {
  if (arguments.horizon_rows) options.horizon_rows = parse_rows(*arguments.horizon_rows);
  if (pictures.kind == PictureKind::panorama && !pictures.layout.elevations) {
    declared.reject_options({"--half-band-rad"},
                            "because the elevations of the images are not known (--horizon-rows)");
  }
  const auto route = memory ? memory->route(arguments.name) : std::nullopt;
  if (!route) {
    options.line = arguments.line;
    return;
  }
  const RouteSource stored = read_route_source(*memory, arguments.name, route->columns());
  const std::string message_end = ", as the route '" + arguments.name + "' in " + arguments.memory +
                                  " was recorded; leave it out or choose another --name";
  declared.require_same("line", arguments.line, stored.line, message_end);
  if (options.horizon_rows && options.horizon_rows != stored.horizon_rows) {
    throw ContractError("--horizon-rows", *arguments.horizon_rows,
                        format_rows(stored.horizon_rows) + message_end);
  }
}

/// Frame of the poses of a route.
enum class RouteFrame { own, map, data_set };

const char* to_string(RouteFrame frame) {
  switch (frame) {
    case RouteFrame::own:
      return "own";
    case RouteFrame::map:
      return "map";
    case RouteFrame::data_set:
      return "data_set";
  }
  return "own";
}

RouteFrame find_frame(RoutePoseOrigin origin) {
  if (origin == RoutePoseOrigin::data_set) return RouteFrame::data_set;
  return origin == RoutePoseOrigin::map ? RouteFrame::map : RouteFrame::own;
}

/// Prints the frame of the route's poses if it is not that of the views.
void print_frame(RouteFrame frame, const MemoryFile& memory, Session& session) {
  if (memory.info().views_with_position == 0) return;
  if (frame == RouteFrame::own) {
    session.print(
        "The poses of the route are in a frame of its own, which is not that of the views: route "
        "follow and localise give different x, y and heading.");
  } else if (frame == RouteFrame::data_set && has_positions_from_map(memory)) {
    session.print(
        "The poses of the route are in the frame of the data set, those of the views in that of "
        "their map: route follow and localise give different x, y and heading.");
  }
}

/// Images of a drive that became no line of the route, by reason.
struct LeftOutImages {
  std::size_t unusable = 0;
  std::size_t without_pose = 0;
  std::string missing_pose;  ///< why an image has no pose, for people
  std::size_t too_near = 0;
  std::size_t known_before = 0;

  [[nodiscard]] std::size_t total() const {
    return unusable + without_pose + too_near + known_before;
  }
};

LeftOutImages count_left_out(const Dataset& dataset, const DrivePoses& drive,
                             const RouteRecorder::Recorded& recorded) {
  constexpr std::array reasons{"have no position", "have no odometry",
                               "are not in the largest part of the map",
                               "do not show the motion from the others"};
  return {.unusable = dataset.unusable.size(),
          .without_pose = dataset.entries.size() - drive.drive.entries.size(),
          .missing_pose = reasons.at(static_cast<std::size_t>(drive.origin)),
          .too_near = recorded.too_near,
          .known_before = recorded.known_before};
}

/// Prints how many images became no line, and why; nothing if there are none.
void print_left_out(const LeftOutImages& left_out, std::size_t lines, Session& session) {
  if (left_out.total() == 0) return;
  std::string text = "of " + format_count(lines + left_out.total(), "image") + ", " +
                     std::to_string(lines) + " became lines";
  const auto add = [&](std::size_t count, const std::string& reason) {
    if (count > 0) text += "; " + std::to_string(count) + " " + reason;
  };
  add(left_out.too_near, "are nearer to the line before than the distance between lines");
  add(left_out.known_before, "were recorded before");
  add(left_out.without_pose, left_out.missing_pose);
  add(left_out.unusable, "cannot be used");
  session.print(text);
}

void print_recorded(const RecordArguments& arguments, const RouteRecorder::Recorded& recorded,
                    const DrivePoses& drive, const LeftOutImages& left_out,
                    std::uint64_t file_bytes, Session& session) {
  const double length_m = recorded.route.length_m();
  const double bytes_per_km = recorded.bytes_per_km();
  const bool is_metric = session.length_unit() == LengthUnit::metres;
  if (session.json()) {
    session.print(session.json_line(
        ordered_json{{"memory", arguments.memory},
                     {"route", arguments.name},
                     {"frame", to_string(find_frame(drive.origin))},
                     {"appended", recorded.appended},
                     {"lines", recorded.route.size()},
                     {"columns", recorded.route.columns()},
                     {"length_m", length_m},
                     {"length_estimated", drive.is_scale_estimated},
                     {"bytes", recorded.bytes},
                     {"bytes_per_km", is_metric ? ordered_json(bytes_per_km) : ordered_json()},
                     {"file_bytes", file_bytes},
                     {"left_out",
                      {{"too_near", left_out.too_near},
                       {"known_before", left_out.known_before},
                       {"without_pose", left_out.without_pose},
                       {"unusable", left_out.unusable}}}}));
    return;
  }
  session.print(session.bold(format_count(recorded.appended, "line")) + " recorded; route '" +
                arguments.name + "' in " + arguments.memory + " has " +
                std::to_string(recorded.route.size()) + " over " +
                session.format_length(length_m, 2) +
                (is_metric ? ", " + format_fixed(1e-6 * bytes_per_km, 2) + " MB per kilometre"
                           : ", " + std::to_string(recorded.bytes) + " bytes"));
  print_left_out(left_out, recorded.appended, session);
  if (drive.is_scale_estimated) {
    session.print(
        "Lengths are estimated from the views of the memory and may be wrong by a factor; odometry "
        "or positions in the data set would measure them.");
  }
}

/// Prints how to improve and to use the recorded route.
void print_hints(const RecordArguments& arguments, const PictureSource& pictures,
                 const RouteRecorder& recorder, Session& session) {
  if (pictures.kind == PictureKind::panorama && !pictures.layout.elevations &&
      !recorder.source().horizon_rows) {
    session.print(
        "The elevations of the images are not known; each line is the mean of all rows. Select the "
        "rows at the horizon with --horizon-rows.");
  }
  if (recorder.memory().route_names().size() > 1) {
    session.suggest({"panonav", "route", "follow", arguments.memory, arguments.dataset, "--name",
                     arguments.name});
  } else {
    session.suggest({"panonav", "route", "follow", arguments.memory, arguments.dataset});
  }
}

ExitCode record(const Arguments& declared, const RecordArguments& arguments, Session& session) {
  if (arguments.every_m && !(*arguments.every_m >= 0.0)) {
    throw UsageError("--every-m is " + to_text(*arguments.every_m) + "; allowed: 0 or more");
  }
  RouteRecorderOptions options{.name = arguments.name, .every_m = arguments.every_m.value_or(0.1)};
  std::optional<MemoryFile> memory;
  if (memory_exists(arguments.memory))
    memory = MemoryFile::open(arguments.memory, Access::read_write);
  const Dataset dataset =
      open_recording(arguments.dataset, arguments.pictures,
                     memory ? std::optional(memory->header().source) : std::nullopt, session);
  if (!arguments.is_chain()) {
    set_line_options(declared, arguments, dataset.source, memory, options);
  }
  if (arguments.report) prepare_report_folder(*arguments.report, "route record");
  const bool is_new = !memory;
  // Sets the image layout of a new file now, so that views can be memorised into it later.
  if (is_new) {
    memory = MemoryFile::create(arguments.memory,
                                make_header_from_recording(dataset, {}, {}, session.executor()));
  }
  const auto remove_if_failing = [&](const auto& work) {
    try {
      return work();
    } catch (...) {
      memory.reset();
      std::error_code ignored;
      if (is_new) fs::remove(arguments.memory, ignored);
      throw;
    }
  };
  const DrivePoses drive =
      remove_if_failing([&] { return find_poses(declared, arguments, dataset, *memory, session); });
  if (arguments.is_chain()) {
    remove_if_failing([&] {
      record_chain_run({arguments.memory, arguments.name}, *memory, drive, dataset.entries.size(),
                       arguments.chain, arguments.chain_odometry, session);
    });
    return ExitCode::done;
  }
  options.odometry =
      drive.origin == RoutePoseOrigin::odometry || drive.origin == RoutePoseOrigin::images;
  options.assumed_unit_m = drive.assumed_unit_m;
  options.is_in_map_unit = drive.is_in_map_unit;
  RouteRecorder recorder(std::move(*memory), dataset.source, options);
  std::optional<Progress> bar;
  const auto recorded =
      recorder.record(drive.drive, drive.poses, session.executor(), [&](std::size_t lines) {
        if (!bar) bar.emplace(session, "recording", lines);
        bar->advance();
      });
  bar.reset();
  if (arguments.report)
    write_record_report(*arguments.report, arguments.name, recorded, session.length_unit());
  const RouteFrame frame = find_frame(drive.origin);
  print_recorded(arguments, recorded, drive, count_left_out(dataset, drive, recorded),
                 recorder.memory().info().file_bytes, session);
  if (session.json()) return ExitCode::done;
  print_frame(frame, recorder.memory(), session);
  print_hints(arguments, dataset.source, recorder, session);
  return ExitCode::done;
}

Run declare_route_record(Arguments& arguments) {
  auto values = std::make_shared<RecordArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file (NAME.panonav), new or existing");
  arguments.positional(
      "INPUT", values->dataset,
      "Data set, folder of images, video or recording with images in the order of the drive. If it "
      "has neither positions nor odometry, the motion is computed from the images");
  arguments.option("--name NAME", values->name,
                   "Name of the route; an existing route is continued");
  arguments.option("--every-m METRES", values->every_m,
                   "Distance between lines, in metres (default 0.1)");
  arguments.option("--horizon-rows FIRST-LAST", values->horizon_rows,
                   "First and last row at the horizon, counted from 0 at the top; only for "
                   "panoramas with unknown elevations (default: all rows)");
  arguments.flag("--odometry", values->odometry,
                 "Use the poses of the odometry, even if the data set has positions");
  declare_report(arguments, values->report, "a page with all lines of the route as one image");
  declare_pictures(arguments, values->pictures);
  arguments.options("line", values->line);
  arguments.choice("--method", values->method, {"panorama", "chain"},
                   "What is stored: lines of pixels (panorama, default), or a chain of small "
                   "snapshots with odometry between them, of some bytes a metre");
  arguments.options("chain", values->chain);
  arguments.options("chain_odometry", values->chain_odometry);
  arguments.reject_options_unless(
      {"[chain]", "[chain_odometry]"}, [values] { return values->is_chain(); },
      "without --method chain");
  arguments.reject_options_unless(
      {"--every-m", "--horizon-rows", "--report", "[line]"},
      [values] { return !values->is_chain(); }, "with --method chain");
  arguments.explain_interruption(
      "Lines stored so far are kept. To continue, run the same command again.");
  return [values, &arguments](Session& session) { return record(arguments, *values, session); };
}

}  // namespace

Verb route_record_verb() {
  return {
      "route record",
      VerbGroup::maps_and_routes,
      "Record a route as lines of pixels at equal distances",
      "A line of pixels shows the horizon all around the robot at one place of the route. A "
      "line has one byte per degree, and one kilometre of route needs a few megabytes. Lines "
      "are stored in batches. To continue after an interruption, run the same command again. A "
      "recording that starts at the end of the route extends the route. Its poses are those of "
      "the data set or of the memory's map; those of odometry or images alone are in a frame of "
      "the route's own, which is not that of the views. With --method chain, the verb stores a "
      "few small snapshots instead, along which a robot with odometry drives there and back. The "
      "smaller the stated errors of its odometry, the fewer snapshots it needs.",
      "  panonav route record office.panonav teach_run\n"
      "  panonav route record office.panonav teach_run --name home --method chain "
      "--heading-error-rad-per-m 0.01 --drift 0\n"
      "  panonav route record office.panonav teach_run --name corridor --odometry --report "
      "corridor",
      declare_route_record};
}

}  // namespace panonav::command
