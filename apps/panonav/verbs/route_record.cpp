#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"
#include "verbs/memorising.hpp"
#include "verbs/recording.hpp"
#include "verbs/route_reading.hpp"
#ifdef PANONAV_COMMAND_SIMULATES
#include "reports/route_report.hpp"
#endif

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct RecordArguments {
  std::string dataset;
  std::string memory;
  std::string name = "route";
  std::optional<double> every_m;
  int every = 1;
  std::optional<std::string> horizon_rows;
  bool odometry = false;
  std::optional<std::string> report;
  HorizonLineOptions line;
};

/// "17-20".
std::pair<int, int> rows_from_text(const std::string& text) {
  const auto dash = text.find('-');
  const auto number = [&](const std::string& part) {
    int value = -1;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    return error == std::errc() && end == part.data() + part.size() ? value : -1;
  };
  if (dash != std::string::npos) {
    const int first = number(text.substr(0, dash));
    const int last = number(text.substr(dash + 1));
    if (first >= 0 && last >= first) return {first, last};
  }
  throw UsageError("--horizon-rows is '" + text +
                   "'; allowed: FIRST-LAST, rows from 0 at the top, such as 17-20");
}

/// The entries that become lines: every N-th, and of these the ones far enough from the last.
std::vector<std::size_t> chosen_entries(const std::vector<Pose2>& poses, int every,
                                        double every_m) {
  std::vector<std::size_t> chosen;
  // A robot that goes every_m from picture to picture takes them a little nearer or farther.
  const double least_m = 0.999 * every_m;
  for (std::size_t i = 0; i < poses.size(); i += static_cast<std::size_t>(every)) {
    if (chosen.empty() ||
        distance(poses[chosen.back()].position(), poses[i].position()) >= least_m) {
      chosen.push_back(i);
    }
  }
  return chosen;
}

/// The poses to remember and the frame that they are in.
std::vector<Pose2> recorded_poses(const RecordArguments& wanted, const Dataset& dataset,
                                  RouteSource& source, Session& session) {
  if (!wanted.odometry) {
    auto poses = dataset_poses(dataset);
    if (!poses.empty()) {
      if (!dataset.entries.front().pose->heading_rad) {
        session.note("panonav route record: " + wanted.dataset +
                     " has no headings; they are taken along the way");
      }
      return poses;
    }
  }
  auto poses = odometry_poses(dataset);
  if (poses.empty()) {
    throw FileError(wanted.dataset,
                    wanted.odometry
                        ? "has no odometry; allowed for --odometry: a table with the columns "
                          "'odom_x_m', 'odom_y_m' and 'odom_heading_deg'"
                        : "has neither positions nor odometry; allowed: a table with the columns "
                          "'x_m' and 'y_m', or 'odom_x_m', 'odom_y_m' and 'odom_heading_deg'");
  }
  source.from_odometry = true;
  return poses;
}

/// Lines can only go on where the route ends, with the same camera and in the same frame.
void check_goes_on(const RecordArguments& wanted, const Arguments& arguments,
                   const MemoryFile& memory, const RoutePanorama& known, const Pose2& start,
                   RouteSource& source) {
  const RouteSource before = route_source(memory, wanted.name, known.columns());
  const std::string route = "the route '" + wanted.name + "' in " + wanted.memory;
  if (!arguments.given("line")) source.line = before.line;
  if (!wanted.horizon_rows) source.horizon_rows = before.horizon_rows;
  if (source.line != before.line || source.horizon_rows != before.horizon_rows) {
    throw UsageError(route +
                     " was recorded with other --columns, --half-band-rad or "
                     "--horizon-rows; leave them out or take another --name");
  }
  if (source.from_odometry != before.from_odometry) {
    throw UsageError(route + " is in the frame of " +
                     (before.from_odometry ? "its odometry" : "its data set") +
                     ", these poses are not; take another --name");
  }
  constexpr double farthest_m = 1.0;
  const double gap_m = distance(known.poses().back().position(), start.position());
  if (gap_m > farthest_m) {
    throw FileError(wanted.dataset, "begins " + short_number(gap_m) + " m from the end of " +
                                        route + "; allowed: at most " + short_number(farthest_m) +
                                        " m, or another --name");
  }
}

struct Recorded {
  std::size_t appended = 0;
  RoutePanorama route{};
};

Recorded record_lines(const RecordArguments& wanted, const Dataset& dataset,
                      const std::vector<Pose2>& poses, const RouteSource& source,
                      MemoryFile& memory, Session& session) {
  const LineReader reader(dataset.source, source);
  const auto chosen = chosen_entries(poses, wanted.every, wanted.every_m.value_or(0.1));
  Recorded recorded;
  Progress progress("recording", chosen.size());
  constexpr std::size_t batch = 64;
  for (std::size_t begin = 0; begin < chosen.size(); begin += batch) {
    const std::size_t count = std::min(batch, chosen.size() - begin);
    std::vector<std::vector<float>> lines(count);
    for_each_entry(session.executor(), count, [&](std::size_t i) {
      lines[i] = reader.read(dataset.entries[chosen[begin + i]].path);
    });
    RoutePanorama more(source.line.columns);
    for (std::size_t i = 0; i < count; ++i) {
      static_cast<void>(more.append(poses[chosen[begin + i]], std::span<const float>(lines[i])));
    }
    recorded.appended += memory.append_route(wanted.name, more);
    progress.advance(count);
  }
  recorded.route = memory.route(wanted.name).value();
  return recorded;
}

ExitCode record(const Arguments& arguments, const RecordArguments& wanted, Session& session) {
  if (wanted.every_m && !(*wanted.every_m >= 0.0)) {
    throw UsageError("--every-m is " + to_text(*wanted.every_m) + "; allowed: 0 or more");
  }
  const Dataset dataset = read_dataset(wanted.dataset);
  RouteSource source{.line = wanted.line};
  if (wanted.horizon_rows) source.horizon_rows = rows_from_text(*wanted.horizon_rows);
  const auto poses = recorded_poses(wanted, dataset, source, session);
#ifdef PANONAV_COMMAND_SIMULATES
  if (wanted.report) prepare_route_report(*wanted.report, "route record");
#endif
  std::optional<MemoryFile> memory;
  if (fs::exists(wanted.memory)) memory = MemoryFile::open(wanted.memory, Access::read_write);
  if (memory) {
    const auto known = memory->route(wanted.name);
    if (known) check_goes_on(wanted, arguments, *memory, *known, poses.front(), source);
  } else {
    // Views can be memorised into the same file later; what they need of the pictures is known now.
    memory = MemoryFile::create(wanted.memory,
                                header_from_first_views(dataset, {}, {}, session.executor()));
  }
  remember_route_source(*memory, wanted.name, source);
  const auto recorded = record_lines(wanted, dataset, poses, source, *memory, session);
  const double length_m = recorded.route.length_m();
  const auto bytes = memory->route_bytes(wanted.name);
  const double bytes_per_km = length_m > 0.0 ? 1000.0 * static_cast<double>(bytes) / length_m : 0.0;
#ifdef PANONAV_COMMAND_SIMULATES
  if (wanted.report) write_record_report(*wanted.report, wanted.name, recorded.route, bytes_per_km);
#endif
  if (session.json()) {
    session.print(ordered_json{{"memory", wanted.memory},
                               {"route", wanted.name},
                               {"appended", recorded.appended},
                               {"lines", recorded.route.size()},
                               {"columns", recorded.route.columns()},
                               {"length_m", length_m},
                               {"bytes", bytes},
                               {"bytes_per_km", bytes_per_km},
                               {"file_bytes", memory->info().file_bytes}}
                      .dump());
    return ExitCode::done;
  }
  session.print(session.strong(std::to_string(recorded.appended)) + " lines recorded; route '" +
                wanted.name + "' in " + wanted.memory + " has " +
                std::to_string(recorded.route.size()) + " over " + fixed(length_m, 2) + " m, " +
                fixed(1e-6 * bytes_per_km, 2) + " MB a kilometre");
  if (dataset.source.kind == PictureKind::panorama && !dataset.source.layout.elevations &&
      !source.horizon_rows) {
    session.print(
        "The pictures' elevations are not known: all rows are averaged into a line. Say which show "
        "the horizon with --horizon-rows.");
  }
  session.print("Next: panonav route follow " + wanted.memory + " DATASET");
  return ExitCode::done;
}

Run declare(Arguments& arguments) {
  auto wanted = std::make_shared<RecordArguments>();
  arguments.positional("DATASET", wanted->dataset,
                       "Data set with positions or odometry, in the order of the drive");
  arguments.positional("MEMORY", wanted->memory,
                       "Memory file (NAME.panonav); made where there is none");
  arguments.option("--name", wanted->name,
                   "Name of the route; grows if it is there (default route)");
  arguments.option("--every-m", wanted->every_m, "Way between lines, in metres (default 0.1)");
  arguments.option("--every", wanted->every, 1, "Take every N-th picture only (default 1)");
  arguments.option("--horizon-rows", wanted->horizon_rows,
                   "FIRST-LAST: rows that show the horizon, from 0 at the top, of panoramas whose "
                   "elevations are not known; all without it");
  arguments.flag("--odometry", wanted->odometry,
                 "Remember the odometry's poses, even where the data set knows positions");
#ifdef PANONAV_COMMAND_SIMULATES
  arguments.option("--report", wanted->report,
                   "Write a picture of the route panorama into this folder: a new one, or that of "
                   "an earlier report");
#endif
  arguments.options("line", wanted->line);
  return [wanted, &arguments](Session& session) { return record(arguments, *wanted, session); };
}

}  // namespace

Verb route_record_verb() {
  return {"route record", "Remember a route as one line of pixels a step",
          "What the camera sees at its own height, a byte a degree, from every place of the way: a "
          "few\n"
          "megabytes a kilometre. Lines are on the disk batch by batch; a drive that goes on where "
          "the\n"
          "route ends makes it longer.",
          "  panonav route record teach_run office.panonav\n"
          "  panonav route record teach_run office.panonav --name corridor --odometry --report "
          "corridor",
          declare};
}

}  // namespace panonav::command
