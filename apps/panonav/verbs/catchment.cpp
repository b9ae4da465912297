#include <algorithm>
#include <cmath>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/catchment_survey.hpp"
#include "reports/catchment_report.hpp"
#include "reports/report_page.hpp"
#include "runs/homing_pictures.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

constexpr const char* pose_columns = "x_m,y_m,heading_deg";
constexpr const char* pose_values = "1.5,0.25,90";

struct CatchmentArguments {
  std::string dataset;
  std::optional<std::string> current;
  PictureArguments pictures;
  HomingArguments homing;
  CatchmentSettings settings;
  std::optional<std::string> stages;
  std::optional<std::uint64_t> turn_seed;
  std::optional<int> ahead;
  std::optional<std::string> goal;
  std::optional<std::string> report;
};

/// Returns a callback that shows a progress bar for each reported work.
WorkProgress make_progress_callback(Session& session) {
  return [&session, bar = std::shared_ptr<Progress>(), shown = std::string()](
             const std::string& work, std::size_t steps, std::size_t total) mutable {
    if (work != shown) {
      bar.reset();
      bar = std::make_shared<Progress>(session, shown = work, total);
    }
    bar->advance(steps);
  };
}

ordered_json to_json(const CatchmentArguments& arguments, const RecordedViews& goals,
                     const CatchmentResult& result) {
  ordered_json json{{"dataset", arguments.dataset},
                    {"current", to_json_or_null(arguments.current)},
                    {"goals", result.survey.goals.size()},
                    {"places", result.survey.places.size()},
                    {"spacing_m", result.spacing_m},
                    {"typical_distance_m", result.typical_distance_m},
                    {"up_to_m", to_json_or_null(arguments.settings.up_to_m)},
                    {"pairs", result.pairs},
                    {"stages", to_json_or_null(arguments.stages)},
                    {"homeward_component", to_json_or_null(result.component)},
                    {"orientation_error_rad", to_json_or_null(result.orientation_error_rad)}};
  auto bins = ordered_json::array();
  for (const CatchmentResult::Bin& bin : result.bins) {
    bins.push_back({{"distance_m", bin.homeward.distance_m},
                    {"pairs", bin.homeward.pairs},
                    {"homeward_component", to_json_or_null(bin.homeward.component)},
                    {"orientation_error_rad", to_json_or_null(bin.orientation_error_rad)}});
  }
  json["bins"] = std::move(bins);
  auto areas = ordered_json::array();
  const auto places = static_cast<double>(result.survey.places.size());
  for (std::size_t i = 0; i < result.areas.size(); ++i) {
    areas.push_back({{"accepted_m", result.accepted_m[i]},
                     {"places", result.areas[i]},
                     {"share", result.areas[i] / places}});
  }
  json["catchment_areas"] = std::move(areas);
  auto views = ordered_json::array();
  for (std::size_t g = 0; g < goals.files.size(); ++g) {
    views.push_back({{"file", goals.files[g]},
                     {"places", count_places_in_catchment(result, g, result.spacing_m)}});
  }
  json["views"] = std::move(views);
  return json;
}

void print_text(const CatchmentArguments& arguments, const CatchmentResult& result,
                Session& session) {
  const std::string range = arguments.settings.up_to_m
                                ? " up to " + format_number(*arguments.settings.up_to_m) + " m"
                                : "";
  session.print("Average homeward component over " + format_count(result.pairs, "pair") + range +
                ": " + session.bold(format_fixed(result.component, 3)) +
                " (1: straight home, 0: random direction)");
  session.print("  heading error " + format_fixed(degrees(result.orientation_error_rad), 1) +
                " degrees (circular standard deviation); a home vector of length 1 means " +
                format_fixed(result.typical_distance_m, 2) + " m");
  session.print("  distance [m]  pairs     homeward  heading error [degrees]");
  for (const CatchmentResult::Bin& bin : result.bins) {
    // Tolerates rounding of the distance, so that the last bin is printed.
    if (arguments.settings.up_to_m && bin.homeward.distance_m > 1.001 * *arguments.settings.up_to_m)
      break;
    const auto padded = [](std::string text, std::size_t width) {
      text.resize(std::max(width, text.size()), ' ');
      return text;
    };
    session.print("  " + padded(format_fixed(bin.homeward.distance_m, 3), 14) +
                  padded(std::to_string(bin.homeward.pairs), 10) +
                  padded(format_fixed(bin.homeward.component, 3), 10) +
                  format_fixed(degrees(bin.orientation_error_rad), 1));
  }
  session.print("Drives home between the " + format_count(result.survey.places.size(), "place") +
                ", " + format_fixed(result.spacing_m, 3) + " m apart; mean catchment area:");
  const auto places = static_cast<double>(result.survey.places.size());
  for (std::size_t i = 0; i < result.areas.size(); ++i) {
    session.print("  ending within " + format_fixed(result.accepted_m[i], 3) + " m: from " +
                  format_fixed(result.areas[i], 1) + " places (" +
                  format_fixed(100.0 * result.areas[i] / places, 0) + " %)");
  }
}

/// Homes from each view to the one `ahead` images later.
ExitCode measure_travel_direction(const CatchmentArguments& arguments, const RecordedViews& views,
                                  const FourierHomingOptions& options, Session& session) {
  const auto ahead = static_cast<std::size_t>(*arguments.ahead);
  if (views.files.size() <= ahead) {
    throw FileError(arguments.dataset, "has " + format_count(views.files.size(), "image") +
                                           "; --ahead allows 1 to " +
                                           std::to_string(views.files.size() - 1));
  }
  std::vector<double> directions;
  std::size_t backward = 0;
  for (std::size_t i = 0; i + ahead < views.files.size(); ++i) {
    const HomeVector found = home_vector(views.views[i + ahead], views.views[i], options);
    if (!(found.length() > 0.0)) continue;
    // Undoes the robot's random rotation.
    directions.push_back(wrap_angle(found.direction_rad() + views.rotation_rad[i]));
    backward += std::abs(directions.back()) > radians(90.0) ? 1 : 0;
  }
  const auto mean = circular_mean(directions);
  if (session.json()) {
    session.print(json_line(
        ordered_json{{"dataset", arguments.dataset},
                     {"ahead", ahead},
                     {"pairs", directions.size()},
                     {"direction_rad", mean ? ordered_json(mean->direction_rad) : ordered_json()},
                     {"resultant_length", mean ? mean->resultant_length : 0.0},
                     {"backward", backward}}));
  } else if (mean) {
    const double degrees_left = degrees(mean->direction_rad);
    session.print("From each of " + format_count(directions.size(), "view") + " to the one " +
                  std::to_string(ahead) + " later: on average " +
                  session.bold(format_fixed(std::abs(degrees_left), 1) + " degrees to the " +
                               (degrees_left > 0.0 ? "left" : "right")) +
                  " of the forward direction");
    session.print("  resultant length " + format_fixed(mean->resultant_length, 3) +
                  " (1: all directions equal), spread " +
                  format_fixed(degrees(circular_standard_deviation(*mean)), 1) + " degrees, " +
                  std::to_string(backward) + " point backwards");
  } else {
    session.print(session.red("no common direction"));
  }
  return mean ? ExitCode::done : ExitCode::no_answer;
}

void require_poses(const RecordedViews& views, const std::string& name) {
  for (std::size_t i = 0; i < views.files.size(); ++i) {
    if (views.poses[i] && views.poses[i]->heading_rad) continue;
    throw FileError(
        name, "image " + views.files[i] + " has no " + (views.poses[i] ? "heading" : "position") +
                  "; the positions and headings of all images are needed, except "
                  "with --ahead N" +
                  (can_have_table(name) ? explain_columns(name, pose_columns, pose_values)
                                        : "; a recording of topics needs poses (PoseStamped on "
                                          "/ground_truth)"));
  }
}

/// Returns the requested view, or the one nearest to the middle of all.
std::size_t choose_goal(const CatchmentArguments& arguments, const RecordedViews& goals) {
  if (arguments.goal) {
    const auto found = std::ranges::find(goals.files, *arguments.goal);
    if (found == goals.files.end()) {
      throw FileError(arguments.dataset,
                      "has no image '" + *arguments.goal + "', asked for by --goal");
    }
    return static_cast<std::size_t>(found - goals.files.begin());
  }
  Point2 middle;
  for (const auto& pose : goals.poses) {
    middle.x_m += pose->x_m / static_cast<double>(goals.poses.size());
    middle.y_m += pose->y_m / static_cast<double>(goals.poses.size());
  }
  std::size_t best = 0;
  for (std::size_t i = 0; i < goals.poses.size(); ++i) {
    if (distance(goals.poses[i]->position(), middle) <
        distance(goals.poses[best]->position(), middle)) {
      best = i;
    }
  }
  return best;
}

/// Parses numbers separated by commas. Throws UsageError.
std::vector<int> parse_stages(const std::string& text, int max_frequency) {
  std::vector<int> stages;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    int value = 0;
    const std::string_view number = std::string_view(text).substr(begin, end - begin);
    if (!read_number(number, value) || value < 1 || value > max_frequency) {
      throw UsageError("--stages is '" + text + "'; allowed: numbers from 1 to " +
                       std::to_string(max_frequency) +
                       ", components less two, with commas between them");
    }
    stages.push_back(value);
    begin = end + 1;
  }
  return stages;
}

CatchmentSettings check_settings(const Arguments& declared, const CatchmentArguments& arguments) {
  if (arguments.settings.up_to_m && !(*arguments.settings.up_to_m > 0.0)) {
    throw UsageError("--up-to-m is " + format_number(*arguments.settings.up_to_m) +
                     "; allowed: > 0");
  }
  if (arguments.settings.bin_m && !(*arguments.settings.bin_m > 0.0)) {
    throw UsageError("--bin-m is " + format_number(*arguments.settings.bin_m) + "; allowed: > 0");
  }
  const int components = arguments.homing.views.signature.components;
  CatchmentSettings settings = arguments.settings;
  settings.homing = make_homing_options(declared, arguments.homing, components);
  if (arguments.stages) {
    settings.stages = parse_stages(*arguments.stages, std::min(62, components - 2));
  }
  settings.has_typical_distance = declared.is_set("run", "typical_distance_m");
  settings.has_longest_step = declared.is_set("run", "max_step_m");
  settings.has_obstacle = declared.is_set("run", "obstacle_m");
  return settings;
}

/// Reads the views of a recording; images that cannot be read are skipped and named.
RecordedViews read_usable_views(const Dataset& recording, const CatchmentArguments& arguments,
                                const std::optional<std::uint64_t>& turn_seed, Session& session) {
  SkippedImages skipped(recording.entries.size(), session);
  return read_views(recording, arguments.homing.views, turn_seed, session.executor(),
                    make_progress_callback(session),
                    [&](const std::exception_ptr& failure) { skipped.add(failure); });
}

/// Keeps the images of which there are views.
void keep_viewed(Dataset& recording, const RecordedViews& views) {
  std::size_t next = 0;
  std::erase_if(recording.entries, [&](const DatasetEntry& entry) {
    const bool is_viewed = next < views.files.size() && views.files[next] == entry.file;
    next += is_viewed ? 1 : 0;
    return !is_viewed;
  });
}

ExitCode catchment(const Arguments& declared, const CatchmentArguments& arguments,
                   Session& session) {
  const CatchmentSettings settings = check_settings(declared, arguments);
  auto recording =
      arguments.ahead ? open_recording(arguments.dataset, arguments.pictures, std::nullopt, session)
                      : read_dataset_with_columns(arguments.dataset, arguments.pictures,
                                                  std::nullopt, pose_columns, pose_values, session);
  std::optional<Dataset> second;
  if (arguments.current)
    second = open_recording(*arguments.current, arguments.pictures, recording.source, session);
  if (arguments.report) prepare_report_folder(*arguments.report, "catchment");

  if (arguments.ahead) {
    const auto views = read_usable_views(recording, arguments, arguments.turn_seed, session);
    reject_unused_rise_flags(declared, views.views.front(), arguments.dataset);
    return measure_travel_direction(arguments, views, settings.homing, session);
  }
  const auto goals = read_usable_views(recording, arguments, std::nullopt, session);
  keep_viewed(recording, goals);
  require_poses(goals, arguments.dataset);
  reject_unused_rise_flags(declared, goals.views.front(), arguments.dataset);
  const std::size_t goal = choose_goal(arguments, goals);
  const auto places =
      second || arguments.turn_seed
          ? read_usable_views(second ? *second : recording, arguments, arguments.turn_seed, session)
          : goals;
  const std::string& places_name = arguments.current ? *arguments.current : arguments.dataset;
  require_poses(places, places_name);
  if (goals.views.front().rows() != places.views.front().rows()) {
    throw FileError(places_name, "rows is " + std::to_string(places.views.front().rows()) +
                                     "; allowed: " + std::to_string(goals.views.front().rows()) +
                                     ", as in " + arguments.dataset);
  }
  const auto result = survey_catchment(goals, places, settings, places_name, session.executor(),
                                       make_progress_callback(session));
  if (session.json()) {
    session.print(json_line(to_json(arguments, goals, result)));
  } else {
    print_text(arguments, result, session);
  }
  if (arguments.report) {
    write_catchment_report(*arguments.report, goals, places, result, settings.homing, goal);
    print_report_path(*arguments.report, session);
  }
  return std::isfinite(result.component) ? ExitCode::done : ExitCode::no_answer;
}

Run declare_catchment(Arguments& arguments) {
  auto values = std::make_shared<CatchmentArguments>();
  arguments.positional("DATASET", values->dataset,
                       "Data set, folder of images, video or recording; each view is used as a "
                       "home. Except with --ahead N, the positions and headings of all images are "
                       "needed (in a recording: poses on the topic /ground_truth)");
  arguments.option(
      "--current DATASET", values->current,
      "Data set of the current views, also with positions and headings; default: DATASET");
  declare_pictures(arguments, values->pictures);
  values->pictures.check = PictureArguments::Check::heads;
  arguments.option("--up-to-m", values->settings.up_to_m,
                   "Average the results of all pairs of views up to this distance");
  arguments.option(
      "--bin-m", values->settings.bin_m,
      "Step of the distance in the table of results; default: the spacing of the views");
  arguments.option(
      "--turn-randomly SEED", values->turn_seed,
      "Rotate each current view by a random number of columns; SEED is the random seed");
  arguments.option(
      "--stages K,K,...", values->stages,
      "Drive home in stages; each K is the highest frequency of a stage, for example 2,4,10");
  arguments.option(
      "--ahead N", values->ahead, 1,
      "Compare each view only with the view N images later; this measures the direction of travel "
      "relative to the camera, and needs no positions or headings");
  arguments.option(
      "--goal IMAGE", values->goal,
      "Image for which the report shows home vectors; default: the image in the middle");
  declare_report(arguments, values->report, "a page with curves and maps");
  declare_homing(arguments, values->homing);
  arguments.options("run", values->settings.run);
  arguments.hide_from_help({"--bin-m", "--goal"});
  arguments.reject_options_unless(
      {"--current", "--report", "--up-to-m", "--bin-m", "--stages", "[run]"},
      [values] { return !values->ahead; },
      "with --ahead, which compares the images of one recording in their order");
  arguments.reject_options_unless(
      {"--goal"}, [values] { return values->report.has_value(); }, "without --report");
  return [values, &arguments](Session& session) { return catchment(arguments, *values, session); };
}

}  // namespace

Verb catchment_verb() {
  return {"catchment",
          VerbGroup::experiments,
          "Measure from how far a robot finds the way home to views",
          "The verb computes the direction home for all pairs of views and simulates drives home "
          "from place to place [S06 section 4]. By default, a step is at most twice as long as the "
          "spacing of the places, and the distance from its end to the nearest place is at most "
          "0.8 times this spacing. The typical distance of objects is estimated from pairs of "
          "views that are close together.",
          "  panonav catchment grid_run --up-to-m 0.3 --turn-randomly 1 --report catchment\n"
          "  panonav catchment monday_run --current tuesday_run --published 5 --json\n"
          "  panonav catchment grid_run --published 10 --stages 2,4,10\n"
          "  panonav catchment walk_run --ahead 20",
          declare_catchment};
}

}  // namespace panonav::command
