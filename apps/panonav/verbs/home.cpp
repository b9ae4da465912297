#include <cmath>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/chain_route.hpp"
#include "panonav/pipeline/homing_guide.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "panonav/pipeline/view_list.hpp"
#include "panonav/storage/memory_file.hpp"
#include "reports/home_answer.hpp"
#include "reports/home_report.hpp"
#include "reports/report_page.hpp"
#include "runs/homing_pictures.hpp"
#include "runs/memorising.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct HomeArguments {
  std::string goal;
  std::string current;
  std::optional<std::string> memory;
  PictureArguments pictures;
  HomingArguments homing;
  std::optional<std::string> report;
  bool area = false;
  std::optional<int> back_from;
};

ordered_json to_json(const HomeAnswer& answer, const std::string& goal) {
  const auto& evidence = answer.result.evidence;
  ordered_json json = {{"goal", goal},
                       {"current", answer.file},
                       {"known", evidence.has_value()},
                       {"direction_rad", to_json_or_null(answer.result.direction_rad)}};
  const auto add = [&](const char* key, const auto& value_of) {
    json[key] = evidence ? ordered_json(value_of(*evidence)) : ordered_json();
  };
  using Evidence = PairEvidence;
  add("probability", [](const Evidence& e) { return e.probability; });
  add("length", [](const Evidence& e) { return e.vector.length(); });
  add("xi", [](const Evidence& e) { return e.vector.xi; });
  add("eta", [](const Evidence& e) { return e.vector.eta; });
  add("heading_rad", [](const Evidence& e) { return e.vector.heading_rad; });
  add("direction_deviation_rad", [](const Evidence& e) { return e.direction_deviation_rad; });
  add("heading_deviation_rad", [](const Evidence& e) { return e.turn_deviation_rad; });
  add("correlation", [](const Evidence& e) { return e.vector.correlation; });
  add("residual", [](const Evidence& e) { return e.vector.residual; });
  add("frequencies", [](const Evidence& e) { return e.vector.frequencies; });
  add("covariance", [](const Evidence& e) { return e.vector.covariance; });
  const bool has_second = evidence && evidence->second;
  json["second"] = has_second ? ordered_json{{"heading_rad", evidence->second->heading_rad},
                                             {"residual", evidence->second->residual}}
                              : ordered_json();
  return json;
}

std::string format_line(const HomeAnswer& answer, Session& session) {
  const HomingResult& result = answer.result;
  if (!result.known())
    return answer.file + "  " + session.red("no answer") + ": " + explain_no_direction(result);
  if (result.direction_rad) {
    return answer.file + "  home is " + session.green(describe_direction(*result.direction_rad)) +
           ", about " + format_fixed(result.distance_r(), 2) +
           " times as far as the objects around; " + describe_rotation(-result.turn_rad()) +
           "; probability " + format_fixed(result.probability(), 2);
  }
  return answer.file + "  " + session.red("no direction home") + ": " +
         explain_no_direction(result);
}

/// Returns the layout in the dataset.toml next to the image; nullopt if there is no such file.
std::optional<PictureSource> find_folder_source(const std::string& picture) {
  const fs::path folder = fs::path(picture).parent_path();
  std::error_code ignored;
  if (!fs::is_regular_file(picture, ignored) || !has_dataset_file(folder)) {
    return std::nullopt;
  }
  return read_dataset(folder.empty() ? fs::path(".") : folder).source;
}

ExitCode answer_all(const HomeArguments& arguments, const HomingGuide& guide, const Goal& goal,
                    const Dataset& recording, Session& session) {
  const std::size_t total = recording.entries.size();
  std::vector<HomeAnswer> answers;
  std::vector<std::size_t> answered;  // indices of their images
  std::size_t answers_with_direction = 0;
  SkippedImages skipped(total, session);
  Progress progress(session, "homing", total);
  process_in_order(
      total, session.executor(),
      [&](std::size_t i) {
        const DatasetEntry& entry = recording.entries[i];
        return HomeAnswer{entry.file, entry.pose, guide.home(read_observation(entry))};
      },
      [&](std::size_t i, HomeAnswer&& answer) {
        progress.clear();
        answered.push_back(i);
        answers_with_direction += answer.result.direction_rad ? 1 : 0;
        session.print(session.json() ? json_line(to_json(answer, goal.name))
                                     : format_line(answer, session));
        answers.push_back(std::move(answer));
        progress.advance();
      },
      [&](std::size_t, const std::exception_ptr& failure) {
        progress.clear();
        skipped.add(failure);
        progress.advance();
      });
  progress.clear();
  if (!session.json() && total > 1) {
    session.print(session.bold(std::to_string(answers_with_direction) + " of " +
                               std::to_string(answers.size())) +
                  " views give the direction to " + goal.name);
  }
  if (arguments.report) {
    write_home_report(*arguments.report, goal, answers, [&](std::size_t i) {
      return guide.encoder().panorama(read_observation(recording.entries[answered[i]]));
    });
    print_report_path(*arguments.report, session);
  }
  return answers_with_direction > 0 ? ExitCode::done : ExitCode::no_answer;
}

ExitCode home_from_memory(const Arguments& declared, const HomeArguments& arguments,
                          Session& session) {
  const auto file = MemoryFile::open(*arguments.memory, Access::read_only);
  const auto& header = file.header();
  SignatureOptions stored = arguments.homing.views.signature;
  stored.components = header.shape.components;  // the user may compare fewer components
  require_stored_options(declared, stored, arguments.homing.views.preprocessing, file);
  int components = header.shape.components;
  if (declared.is_set("signature", "components")) {
    components = arguments.homing.views.signature.components;
  }
  const ViewId view = find_view_by_name_or_id(file, arguments.goal);
  const auto recording = open_recording(arguments.current, arguments.pictures, file, session);
  const HomingGuide guide(file, arguments.goal, recording.source,
                          make_homing_options(declared, arguments.homing, components), components,
                          arguments.homing.views.horizon);
  reject_unused_rise_flags(declared, guide.goal(), *arguments.memory);
  // A position by a map is in another frame than the positions of the recording.
  const auto pose =
      has_positions_from_map(file) ? std::nullopt : file.load({&view, 1}).info(view).pose;
  const Goal goal{guide.goal_name(), pose, guide.goal(),
                  arguments.report ? panorama_from_thumbnail(file, view) : std::nullopt};
  return answer_all(arguments, guide, goal, recording, session);
}

ordered_json to_json(const HomeStep& step, const DatasetEntry& entry) {
  ordered_json json{{"file", entry.file},
                    {"stamp_s", to_json_or_null(entry.stamp_s)},
                    {"state", step.decision ? to_string(step.decision->state) : "away"},
                    {"turn_rad", nullptr},
                    {"advance_m", nullptr},
                    {"pose", pose_json(step.pose)},
                    {"distance_m", step.distance_m},
                    {"direction_rad", step.direction_rad},
                    {"deviation_m", step.deviation_m},
                    {"drift_m_per_m", {step.drift_m_per_m.x_m, step.drift_m_per_m.y_m}}};
  if (step.decision) {
    json["turn_rad"] = step.decision->turn_rad;
    json["advance_m"] = step.decision->advance_m;
  }
  return json;
}

std::string format_step(const HomeStep& step, const DatasetEntry& entry, Session& session) {
  const bool is_lost = step.decision && step.decision->state == ChainState::lost;
  const std::string state = step.decision ? to_string(step.decision->state) : "away";
  std::string text = entry.file + "  " + (is_lost ? session.red(state) : session.green(state)) +
                     "  home is " + describe_direction(step.direction_rad) + ", " +
                     session.format_length(step.distance_m, 2) + " away, within " +
                     session.format_length(2.0 * step.deviation_m, 2);
  if (step.decision) {
    text += "  turn " + format_fixed(degrees(step.decision->turn_rad), 1) + " degrees  advance " +
            session.format_length(step.decision->advance_m, 2);
  }
  return text;
}

/// Leads a robot home that left the home area GOAL; prints a line for each image with odometry.
ExitCode home_to_area(const HomeArguments& arguments, Session& session) {
  const auto file = MemoryFile::open(*arguments.memory, Access::read_only);
  const auto run = open_recording(arguments.current, arguments.pictures, file, session);
  HomeAreaGuide guide(file, run.source, arguments.goal);
  const auto count = static_cast<int>(run.entries.size());
  if (arguments.back_from && *arguments.back_from > count) {
    throw UsageError("--back-from is " + std::to_string(*arguments.back_from) + "; allowed: 1 to " +
                     std::to_string(count) + ", the number of images");
  }
  std::optional<ChainState> state;
  std::size_t answered = 0;
  for (int i = 0; i < count; ++i) {
    const DatasetEntry& entry = run.entries[static_cast<std::size_t>(i)];
    if (!entry.odometry) continue;
    const HomeStep step =
        guide.step(read_observation(entry), i + 1 >= arguments.back_from.value_or(count));
    ++answered;
    session.print(session.json() ? session.json_line(to_json(step, entry))
                                 : format_step(step, entry, session));
    if (step.decision) state = step.decision->state;
    if (state == ChainState::arrived || state == ChainState::lost) break;
  }
  if (answered == 0) {
    throw FileError(arguments.current, "has no odometry; needed to find home by its area (--area)");
  }
  return state == ChainState::lost ? ExitCode::no_answer : ExitCode::done;
}

ExitCode home(const Arguments& declared, const HomeArguments& arguments, Session& session) {
  if (arguments.area) {
    if (!arguments.memory) throw UsageError("--area needs --memory FILE, which has the home GOAL");
    return home_to_area(arguments, session);
  }
  if (arguments.report) prepare_report_folder(*arguments.report, "home");
  if (arguments.memory) return home_from_memory(declared, arguments, session);
  const auto& views = arguments.homing.views;
  const auto options = make_homing_options(declared, arguments.homing, views.signature.components);
  std::error_code ignored;
  if (fs::is_directory(arguments.goal, ignored)) {
    throw FileError(arguments.goal, "is a folder; allowed: one image, or a view of --memory");
  }
  // A dataset.toml in the folder of one image is used for both images.
  std::optional<PictureSource> known = find_folder_source(arguments.current);
  if (!known) known = find_folder_source(arguments.goal);
  const auto recording = open_recording(arguments.current, arguments.pictures, known, session);
  std::optional<PictureSource> goal_source = find_folder_source(arguments.goal);
  if (!goal_source) goal_source = recording.source;
  PictureArguments goal_pictures = arguments.pictures;
  goal_pictures.part = {};
  const auto goals = open_recording(arguments.goal, goal_pictures, goal_source, session);
  const HomingEncoder encoder(goals.source, views);
  const Panorama picture = encoder.panorama(read_observation(goals.entries.front()));
  const Goal goal{arguments.goal, std::nullopt, encoder.view(picture), picture};
  reject_unused_rise_flags(declared, goal.view, goal.name);
  const HomingGuide guide(HomingEncoder(recording.source, views), goal.name, goal.view, options);
  return answer_all(arguments, guide, goal, recording, session);
}

Run declare_home(Arguments& arguments) {
  auto values = std::make_shared<HomeArguments>();
  arguments.positional("GOAL", values->goal,
                       "Image of the place to return to; with --memory: name or id of a view; with "
                       "--area: name of a home that panonav home learn has stored");
  arguments.positional("CURRENT", values->current,
                       "Current image, or a data set with several current images; with --area: a "
                       "recording with odometry that begins at home");
  arguments.option("--memory FILE", values->memory, "Memory file that contains the view GOAL");
  arguments.flag("--area", values->area,
                 "Lead the robot to the home GOAL of --memory by odometry and by the surroundings "
                 "that it learnt");
  arguments.option("--back-from N", values->back_from, 1,
                   "Number of the image from which on the robot is on its way back; default: the "
                   "last one");
  declare_pictures(arguments, values->pictures);
  values->pictures.check = PictureArguments::Check::heads;
  declare_report(arguments, values->report, "a page with both views and the direction home");
  declare_homing(arguments, values->homing);
  arguments.reject_options_unless(
      {"--back-from"}, [values] { return values->area; }, "without --area");
  arguments.reject_options_unless(
      {"--report", "--horizon", "--published", "[signature]", "[preprocessing]", "[homing]"},
      [values] { return !values->area; }, "with --area, which uses the options of the memory");
  return [values, &arguments](Session& session) { return home(arguments, *values, session); };
}

}  // namespace

Verb home_verb() {
  return {"home",
          VerbGroup::localisation,
          "Compute the direction back to a place from its image",
          "Directions are relative to the robot's current heading, which may be unknown. The "
          "distance is given relative to that of the objects around the robot. "
          "If an image is in the folder of a data set, the type of the image is read "
          "from dataset.toml. The exit code is 1 if no direction is found, because the robot is "
          "already at home or because the images are not more similar than random images.",
          "  panonav home door.png now.png --kind panorama --elevation-deg -30 40\n"
          "  panonav home view_00012.png now.png --memory office.panonav --report way_home\n"
          "  panonav home office_run/view_00012.png office_run --json\n"
          "  panonav home dock flight_run --memory office.panonav --area --back-from 40",
          declare_home};
}

}  // namespace panonav::command
