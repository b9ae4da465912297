#include <algorithm>
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
#include "runs/memorising.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

constexpr const char* position_columns = "x_m,y_m,heading_deg";
constexpr const char* position_values = "1.5,0.25,90";

struct RecordArguments {
  std::string dataset;
  std::string memory;
  PictureArguments pictures;
  std::string name = "route";
  std::optional<double> every_m;
  std::optional<std::string> horizon_rows;
  bool odometry = false;
  std::optional<std::string> report;
  HorizonScanlineOptions line;
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

/// Returns the poses of the data set, or of its odometry, and sets `from_odometry`. Throws
/// FileError if there are none.
std::vector<Pose2> choose_poses(const RecordArguments& arguments, const Dataset& dataset,
                                bool& from_odometry, Session& session) {
  from_odometry = false;
  if (!arguments.odometry) {
    auto poses = dataset_poses(dataset);
    if (!poses.empty()) {
      if (!dataset.entries.front().pose->heading_rad) {
        session.note("panonav route record: " + arguments.dataset +
                     " contains no headings; the direction of travel is used");
      }
      return poses;
    }
  }
  auto poses = odometry_poses(dataset);
  if (poses.empty()) {
    throw FileError(
        arguments.dataset,
        arguments.odometry
            ? "has no odometry; allowed for --odometry: a table with the columns "
              "'odom_x_m', 'odom_y_m' and 'odom_heading_deg'"
            : "has neither positions nor odometry" +
                  (can_have_table(arguments.dataset)
                       ? explain_columns(arguments.dataset, position_columns, position_values) +
                             "; or odom_x_m,odom_y_m,odom_heading_deg instead"
                       : "; a recording of topics needs odometry (nav_msgs/Odometry or TF) or "
                         "poses (/ground_truth)"));
  }
  from_odometry = true;
  return poses;
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

ExitCode record(const Arguments& declared, const RecordArguments& arguments, Session& session) {
  if (arguments.every_m && !(*arguments.every_m >= 0.0)) {
    throw UsageError("--every-m is " + to_text(*arguments.every_m) + "; allowed: 0 or more");
  }
  RouteRecorderOptions options{.name = arguments.name, .every_m = arguments.every_m.value_or(0.1)};
  std::optional<MemoryFile> memory;
  if (memory_exists(arguments.memory))
    memory = MemoryFile::open(arguments.memory, Access::read_write);
  const Dataset dataset =
      read_dataset_with_columns(arguments.dataset, arguments.pictures,
                                memory ? std::optional(memory->header().source) : std::nullopt,
                                position_columns, position_values, session);
  set_line_options(declared, arguments, dataset.source, memory, options);
  const auto poses = choose_poses(arguments, dataset, options.odometry, session);
  if (arguments.report) prepare_report_folder(*arguments.report, "route record");
  // Sets the image layout of a new file now, so that views can be memorised into it later.
  RouteRecorder recorder(
      memory ? std::move(*memory)
             : MemoryFile::create(arguments.memory,
                                  make_header_from_recording(dataset, {}, {}, session.executor())),
      dataset.source, options);
  std::optional<Progress> bar;
  const auto recorded = recorder.record(dataset, poses, session.executor(), [&](std::size_t lines) {
    if (!bar) bar.emplace(session, "recording", lines);
    bar->advance();
  });
  bar.reset();
  const double length_m = recorded.route.length_m();
  const double bytes_per_km = recorded.bytes_per_km();
  if (arguments.report)
    write_record_report(*arguments.report, arguments.name, recorded.route, bytes_per_km);
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", arguments.memory},
                                         {"route", arguments.name},
                                         {"appended", recorded.appended},
                                         {"lines", recorded.route.size()},
                                         {"columns", recorded.route.columns()},
                                         {"length_m", length_m},
                                         {"bytes", recorded.bytes},
                                         {"bytes_per_km", bytes_per_km},
                                         {"file_bytes", recorder.memory().info().file_bytes}}));
    return ExitCode::done;
  }
  session.print(session.bold(std::to_string(recorded.appended)) + " lines recorded; route '" +
                arguments.name + "' in " + arguments.memory + " has " +
                std::to_string(recorded.route.size()) + " over " + format_fixed(length_m, 2) +
                " m, " + format_fixed(1e-6 * bytes_per_km, 2) + " MB per kilometre");
  if (dataset.source.kind == PictureKind::panorama && !dataset.source.layout.elevations &&
      !recorder.source().horizon_rows) {
    session.print(
        "The elevations of the images are not known; each line is the mean of all rows. Select the "
        "rows at the horizon with --horizon-rows.");
  }
  session.suggest({"panonav", "route", "follow", arguments.memory, "DATASET"});
  return ExitCode::done;
}

Run declare_route_record(Arguments& arguments) {
  auto values = std::make_shared<RecordArguments>();
  arguments.positional(
      "DATASET", values->dataset,
      "Data set or recording with positions or odometry, with images in the order of the drive");
  arguments.positional("MEMORY", values->memory, "Memory file (NAME.panonav), new or existing");
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
  return [values, &arguments](Session& session) { return record(arguments, *values, session); };
}

}  // namespace

Verb route_record_verb() {
  return {"route record", "Record a route as lines of pixels at equal distances",
          "A line of pixels shows the horizon all around the robot at one place of the route. A "
          "line has one byte per degree, and one kilometre of route needs a few megabytes. Lines "
          "are stored in batches. To continue after an interruption, run the same command again. A "
          "recording that starts at the end of the route extends the route.",
          "  panonav route record teach_run office.panonav\n"
          "  panonav route record teach_run office.panonav --name corridor --odometry --report "
          "corridor",
          declare_route_record};
}

}  // namespace panonav::command
