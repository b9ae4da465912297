#include <cmath>
#include <exception>
#include <filesystem>
#include <memory>
#include <numbers>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "reports/localise_report.hpp"
#include "verbs/localised_query.hpp"
#include "verbs/recording.hpp"
#ifdef PANONAV_COMMAND_SIMULATES
#include "reports/report_page.hpp"
#endif

namespace panonav::command {

namespace {

struct LocaliseArguments {
  std::string memory;
  std::vector<std::string> inputs;
  PictureArguments pictures;
  LocaliserOptions localiser;
  WantedAccuracy accuracy;
  std::optional<std::uint64_t> turn_seed;
  bool exclude_same_file = false;
  bool areas = false;
  std::optional<std::string> out;
  std::optional<std::string> report;
};

/// One line for each picture, with the header of docs/formats.md; unknown values are empty.
std::string as_csv(const std::vector<LocalisedQuery>& answers) {
  std::string table =
      "file,answer,known_probability,x_m,y_m,radius_m,heading_deg,best,dissimilarity,column_"
      "difference,"
      "turn_deg,next,"
      "next_dissimilarity,next_column_difference,error\n";
  const auto add = [&table](const std::string& field) {
    table += ',';
    table += field;
  };
  const auto add_degrees = [&](const std::optional<double>& angle_rad) {
    add(angle_rad ? to_text(written_degrees(*angle_rad)) : "");
  };
  for (const LocalisedQuery& answer : answers) {
    const auto& [probability, known, matches, position, heading_rad, components, read, areas] =
        answer.place;
    table += csv_field(answer.file);
    add(!answer.error.empty() ? "unreadable" : known ? "known" : "unknown");
    add(answer.error.empty() ? fixed(probability, 4) : "");
    add(position ? to_text(position->x_m) : "");
    add(position ? to_text(position->y_m) : "");
    add(position && position->radius_m ? to_text(*position->radius_m) : "");
    add_degrees(heading_rad);
    for (std::size_t i = 0; i < 2; ++i) {
      const PlaceMatch* const match = i < matches.size() ? &matches[i] : nullptr;
      add(match ? csv_field(match->name) : "");
      add(match ? std::to_string(match->dissimilarity) : "");
      add(match ? to_text(match->column_difference) : "");
      if (i == 0) add_degrees(match ? match->heading_rad : std::nullopt);
    }
    add(answer.error.empty() ? "" : csv_field(readable_line(answer.error)));
    table += '\n';
  }
  return table;
}

/// Turns the robot as it is asked for; gives by how much.
double turn(Observation& observation, const PlaceRecogniser& recogniser,
            const LocaliseArguments& wanted, std::size_t index) {
  if (!wanted.turn_seed) return 0.0;
  const Panorama panorama = recogniser.encoder().panorama(observation);
  Random random(*wanted.turn_seed, index);
  const auto columns = static_cast<std::uint64_t>(panorama.columns());
  const auto turned = static_cast<int>(random.index(columns));
  observation.picture = turn_columns(panorama, turned);
  return wrap_angle(2.0 * std::numbers::pi * turned / static_cast<double>(columns));
}

LocalisedQuery answer(const PlaceRecogniser& recogniser, const LocaliseArguments& wanted,
                      const DatasetEntry& entry, Observation observation, std::size_t index) {
  LocalisedQuery answer{
      entry.file, turn(observation, recogniser, wanted, index), {}, entry.pose, ""};
  // Several pictures are called as they were typed.
  const std::string name = wanted.inputs.size() > 1 ? entry.path.filename().string() : entry.file;
  answer.place =
      recogniser.localise(observation, std::span(&name, wanted.exclude_same_file ? 1 : 0));
  return answer;
}

/// A recording, or several pictures, of which some may be missing.
Dataset open_queries(const LocaliseArguments& wanted, const MemoryFile& file, Session& session) {
  const auto open = [&](const std::string& input) {
    return open_recording(input, wanted.pictures, file, session);
  };
  if (wanted.inputs.size() == 1) return open(wanted.inputs.front());
  const PartArguments& part = wanted.pictures.part;
  if (part.from_s || part.to_s || part.every) {
    throw UsageError("--from, --to and --every go with one recording, not with several pictures");
  }
  std::error_code ignored;
  std::optional<Dataset> queries;
  for (const std::string& input : wanted.inputs) {
    if (std::filesystem::is_directory(input, ignored) || is_recording(input)) {
      throw UsageError(input +
                       " is a folder or recording; allowed: one of these, or several pictures");
    }
    if (!queries && std::filesystem::exists(input, ignored)) queries = open(input);
  }
  if (!queries) queries = open(wanted.inputs.front());  // says that it is missing
  queries->entries.clear();
  for (const std::string& input : wanted.inputs) {
    DatasetEntry entry;
    entry.file = input;
    entry.path = input;
    queries->entries.push_back(std::move(entry));
  }
  return std::move(*queries);
}

void check(const Arguments& arguments, const LocaliseArguments& wanted,
           const MemoryHeader& header) {
  const int components = wanted.localiser.components;
  const bool zero = components == 0 && arguments.given("localiser", "components");
  if (zero || components > header.shape.components) {
    throw ContractError("components", components,
                        "1 to " + std::to_string(header.shape.components) + ", the memory's");
  }
}

/// All answers, told as they come. What cannot be read is named; throws where nothing can.
std::vector<LocalisedQuery> answer_all(const PlaceRecogniser& recogniser,
                                       const LocaliseArguments& wanted, const Dataset& recording,
                                       Session& session) {
  const std::size_t total = recording.entries.size();
  Progress progress(session, "localising", total);
  std::vector<LocalisedQuery> answers;
  std::size_t told = 0;
  std::exception_ptr failure;
  make_in_order(
      total, session.executor(),
      [&](std::size_t i) -> std::pair<LocalisedQuery, std::exception_ptr> {
        const DatasetEntry& entry = recording.entries[i];
        std::optional<Observation> seen;
        try {
          seen = read_observation(entry);
        } catch (const FileError& error) {
          return {{entry.file, 0.0, {}, entry.pose, error.what()}, std::current_exception()};
        }
        return {answer(recogniser, wanted, entry, std::move(*seen), i), nullptr};
      },
      [&](std::size_t, std::pair<LocalisedQuery, std::exception_ptr>&& made) {
        answers.push_back(std::move(made.first));
        if (made.second && !failure) failure = made.second;
        progress.advance();
        if (told == 0 && made.second) return;  // it may be all that there is to say
        progress.clear();
        for (; told < answers.size(); ++told) {
          const LocalisedQuery& given = answers[told];
          if (!given.error.empty()) session.note("skipped: " + readable_line(given.error));
          if (session.json()) {
            session.print(json_line(as_json(given, wanted.areas)));
          } else if (given.error.empty()) {
            session.print(as_text(given, session));
          }
        }
      });
  if (told == 0 && failure) std::rethrow_exception(failure);
  return answers;
}

ExitCode localise(const Arguments& arguments, const LocaliseArguments& wanted, Session& session) {
  const auto file = MemoryFile::open(wanted.memory, Access::read_only);
  check(arguments, wanted, file.header());
#ifdef PANONAV_COMMAND_SIMULATES
  if (wanted.report) prepare_localise_report(*wanted.report);
#endif
  const auto recording = open_queries(wanted, file, session);
  const PlaceRecogniser recogniser(
      file, {.localiser = wanted.localiser,
             .source = recording.source,
             .areas = wanted.areas ? std::optional(wanted.accuracy) : std::nullopt});
  const auto answers = answer_all(recogniser, wanted, recording, session);
  const auto count = [&](const auto& holds) {
    return static_cast<std::size_t>(std::ranges::count_if(answers, holds));
  };
  const std::size_t known = count([](const LocalisedQuery& query) { return query.place.known; });
  const std::size_t unread =
      count([](const LocalisedQuery& query) { return !query.error.empty(); });
  if (wanted.out) write_file(*wanted.out, std::string_view(as_csv(answers)));
  if (!session.json() && answers.size() > 1) {
    session.print(
        session.strong(std::to_string(known) + " of " + std::to_string(answers.size() - unread)) +
        " views show a place of " + wanted.memory +
        (unread > 0 ? "; " + std::to_string(unread) + " could not be read" : ""));
  }
#ifdef PANONAV_COMMAND_SIMULATES
  if (wanted.report) {
    write_localise_report(*wanted.report, file, recogniser, answers, [&](std::size_t i) {
      Observation seen = read_observation(recording.entries[i]);
      (void)turn(seen, recogniser, wanted, i);
      return recogniser.encoder().panorama(seen);
    });
    tell_report(*wanted.report, session);
  }
#endif
  return known > 0 ? ExitCode::done : ExitCode::no_answer;
}

Run declare_localise(Arguments& arguments) {
  auto wanted = std::make_shared<LocaliseArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file");
  arguments.positionals(
      "INPUT", wanted->inputs,
      "Data set, folder of pictures, video, recording of topics, - for JPEG pictures "
      "on standard input, or one or more pictures");
  declare_pictures(arguments, wanted->pictures);
  arguments.option("-o,--out FILE", wanted->out, "Write a CSV table, one line for each picture");
#ifdef PANONAV_COMMAND_SIMULATES
  arguments.option("--report FOLDER", wanted->report,
                   "Write a page with each picture above its best match, turned alike, into this "
                   "folder: a new one, or that of an earlier report");
#endif
  arguments.flag("--exclude-same-file", wanted->exclude_same_file,
                 "Leave out the reference view of the same file name (leave-one-out)");
  arguments.option("--turn-randomly SEED", wanted->turn_seed,
                   "Turn the robot before each query by a random number of whole columns; "
                   "turned_rad is the turn, counter-clockwise positive");
  arguments.flag("--areas", wanted->areas,
                 "Also show the area where the robot may be, component by component");
  arguments.options("localiser", wanted->localiser);
  arguments.options("accuracy", wanted->accuracy, "area");
  arguments.common({"--top"});
  arguments.used_only(
      {"[accuracy]"}, [wanted] { return wanted->areas; }, "without --areas");
  return [wanted, &arguments](Session& session) { return localise(arguments, *wanted, session); };
}

}  // namespace

Verb localise_verb() {
  return {
      "localise",
      "Tell where pictures were taken and which way the robot faced",
      "Pictures without a dataset.toml are read as those that the memory was made from. Pictures "
      "that cannot be read are named and skipped. The exit code is 1 when no picture shows a place "
      "of the memory.",
      "  panonav localise office.panonav query_run --report answers\n"
      "  panonav localise office.panonav one.png two.png -o answers.csv\n"
      "  panonav localise office.panonav view.png --json\n"
      "  panonav localise office.panonav office_run --exclude-same-file --turn-randomly 7 --json",
      declare_localise,
      "localize"};
}

}  // namespace panonav::command
