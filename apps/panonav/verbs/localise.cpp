#include <cmath>
#include <exception>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/pipeline/memory_learner.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/pipeline/visual_motion.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_recordings/recording.hpp"
#include "reports/localise_report.hpp"
#include "reports/report_page.hpp"
#include "verbs/live_run.hpp"
#include "verbs/localised_query.hpp"
#include "verbs/recording.hpp"
#include "verbs/run_record.hpp"
#include "verbs/shown_references.hpp"

namespace panonav::command {

namespace {

struct LocaliseArguments {
  std::string memory;
  std::vector<std::string> inputs;
  PictureArguments pictures;
  LocaliserOptions localiser;
  LocalisationAccuracy accuracy;
  std::optional<std::uint64_t> turn_seed;
  bool exclude_same_file = false;
  bool learn = false;
  MemoryUpdateOptions update;
  bool areas = false;
  std::optional<std::string> out;
  std::optional<std::string> report;
  RunRecordArguments record;
  LiveArguments live;
};

/// Of the CSV table (docs/formats.md).
constexpr std::string_view csv_header =
    "file,answer,known_probability,x_m,y_m,radius_m,heading_deg,best,dissimilarity,column_"
    "difference,turn_deg,next,next_dissimilarity,next_column_difference,error\n";

/// Unknown values are empty.
std::string csv_row(const LocalisedQuery& answer) {
  const Place& place = answer.place;
  const auto& position = place.position;
  std::string row = to_csv_field(answer.file);
  const auto add = [&row](const std::string& field) {
    row += ',';
    row += field;
  };
  const auto add_degrees = [&](const std::optional<double>& angle_rad) {
    add(angle_rad ? to_text(round_trip_degrees(*angle_rad)) : "");
  };
  add(!answer.error.empty() ? "unreadable" : place.known ? "known" : "unknown");
  add(answer.error.empty() ? format_fixed(place.known_probability, 4) : "");
  add(position ? to_text(position->x_m) : "");
  add(position ? to_text(position->y_m) : "");
  add(position && position->radius_m ? to_text(*position->radius_m) : "");
  add_degrees(place.heading_rad);
  for (std::size_t i = 0; i < 2; ++i) {
    const PlaceMatch* const match = i < place.matches.size() ? &place.matches[i] : nullptr;
    add(match ? to_csv_field(match->name) : "");
    add(match ? std::to_string(match->dissimilarity) : "");
    add(match ? to_text(match->column_difference) : "");
    if (i == 0) add_degrees(match ? match->heading_rad : std::nullopt);
  }
  add(answer.error.empty() ? "" : to_csv_field(to_readable_line(answer.error)));
  return row + '\n';
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

/// An answer and what is recorded of it.
struct Answer {
  LocalisedQuery query;
  std::exception_ptr failure;  ///< why there is none
  std::optional<recordings::RunMoment> moment;
  std::optional<Observation> seen;  ///< with its panorama, where the memory learns from it
};

/// `name`: what is called the same file. `shown`: null where nothing is recorded.
Answer answer(const PlaceRecogniser& recogniser, const LocaliseArguments& wanted,
              const RunRecord& record, const ShownReferences* shown, const std::string& name,
              Observation observation, std::size_t index) {
  const double turned_rad = turn(observation, recogniser, wanted, index);
  Answer answer;
  StageClock clock;
  if (shown != nullptr) answer.moment = record.moment_of(observation, index);
  clock.restart();
  if (shown != nullptr && record.wants_pictures()) {
    answer.moment->panorama = recogniser.encoder().panorama(observation);
    observation.picture = *answer.moment->panorama;  // it is that of a level robot
    observation.tilt.reset();
    clock.stage("unwarping");
  }
  answer.query = {
      observation.name, turned_rad,
      recogniser.localise(observation, std::span(&name, wanted.exclude_same_file ? 1 : 0)),
      observation.pose, ""};
  if (wanted.learn) {
    answer.seen.emplace(recogniser.encoder().panorama(observation));
    answer.seen->name = observation.name;
    answer.seen->stamp_s = observation.stamp_s;
    answer.seen->odometry = observation.odometry;
  }
  if (!answer.moment) return answer;
  recordings::RunMoment& moment = *answer.moment;
  clock.stage(moment.panorama ? "signature, search, ranking" : "unwarping to ranking");
  if (moment.panorama) {
    shown->compare(moment, recogniser.memory(), recogniser.encoder().packed(*moment.panorama));
    clock.stage("for viewers");
  }
  clock.put(moment);
  describe(moment, answer.query.place);
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
    if (std::filesystem::is_directory(input, ignored) || recordings::is_recording(input)) {
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
void print_answer(const LocalisedQuery& query, const LocaliseArguments& wanted, Session& session) {
  if (!query.error.empty()) session.note("skipped: " + to_readable_line(query.error));
  if (session.json()) {
    session.print(json_line(as_json(query, wanted.areas)));
  } else if (query.error.empty()) {
    session.print(as_text(query, session));
  }
}

std::vector<LocalisedQuery> answer_all(const PlaceRecogniser& recogniser,
                                       const LocaliseArguments& wanted, const Dataset& recording,
                                       const MemoryFile& file, MemoryLearner* learner,
                                       Session& session) {
  std::vector<std::string> read = wanted.inputs;
  read.push_back(wanted.memory);
  RunRecord record(wanted.record, read, false, session, {.memory = wanted.memory});
  std::optional<ShownReferences> shown;
  if (record.wanted()) shown.emplace(recogniser.memory());
  bool first = true;
  const std::size_t total = recording.entries.size();
  Progress progress(session, "localising", total);
  std::vector<LocalisedQuery> answers;
  std::size_t told = 0;
  std::exception_ptr failure;
  make_in_order(
      total, session.executor(),
      [&](std::size_t i) -> Answer {
        const DatasetEntry& entry = recording.entries[i];
        StageClock clock;
        std::optional<Observation> seen;
        try {
          seen = read_observation(entry);
        } catch (const FileError& error) {
          return {
              {entry.file, 0.0, {}, entry.pose, error.what()}, std::current_exception(), {}, {}};
        }
        clock.stage("reading");
        // Several pictures are called as they were typed.
        Answer given =
            answer(recogniser, wanted, record, shown ? &*shown : nullptr,
                   wanted.inputs.size() > 1 ? entry.path.filename().string() : entry.file,
                   std::move(*seen), i);
        if (given.moment) clock.put(*given.moment);
        return given;
      },
      [&](std::size_t, Answer&& made) {
        if (learner != nullptr && made.seen) {
          learner->see(*made.seen, std::get<Panorama>(made.seen->picture), made.query.place);
        }
        if (made.moment) {
          made.moment->best_match = best_match_of(made.query.place, file);
          if (std::exchange(first, false)) shown->put(*made.moment);
          record.add(std::move(*made.moment));
        }
        answers.push_back(std::move(made.query));
        if (made.failure && !failure) failure = made.failure;
        progress.advance();
        if (told == 0 && made.failure) return;  // it may be all that there is to say
        progress.clear();
        for (; told < answers.size(); ++told) print_answer(answers[told], wanted, session);
      });
  if (told == 0 && failure) std::rethrow_exception(failure);
  record.close();
  return answers;
}

PlaceRecogniserOptions recogniser_options(const LocaliseArguments& wanted,
                                          const PictureSource& source) {
  PlaceRecogniserOptions options{.localiser = wanted.localiser, .source = source};
  if (wanted.areas) options.areas = wanted.accuracy;
  // These take all views of the memory, so that it is held whatever its size.
  if (wanted.learn || wanted.report || wanted.record.file || wanted.record.view) {
    options.max_held_views = std::numeric_limits<std::size_t>::max();
  }
  return options;
}

/// Answers pictures as they come until the source ends or the user interrupts.
ExitCode localise_live(const Arguments& arguments, const LocaliseArguments& wanted,
                       const MemoryFile& file, Session& session) {
  const std::string& input = wanted.inputs.front();
  arguments.refuse_unused({"--report", "--exclude-same-file", "--learn"},
                          "where " + input + " is a live source");
  const auto source = open_live(arguments, input, checked_beside(wanted.pictures, file),
                                file.header().source, wanted.live);
  const PlaceRecogniser recogniser(wanted.memory, recogniser_options(wanted, source->pictures()));
  RunRecord record(wanted.record, std::span(&wanted.memory, 1), true, session,
                   {.memory = wanted.memory});
  std::optional<ShownReferences> shown;
  if (record.wanted()) shown.emplace(recogniser.memory());
  std::string table(csv_header);
  std::size_t number = 0;
  std::size_t known = 0;
  Answer given;
  LiveRun taking(*source, wanted.pictures.part, wanted.live, session);
  taking.take(
      [&](const Observation& seen) {
        given =
            answer(recogniser, wanted, record, shown ? &*shown : nullptr, seen.name, seen, number);
        if (const auto ms = taking.decoding_ms(); given.moment && ms) {
          given.moment->stages_ms.emplace_back("reading", *ms);
        }
        if (given.moment && number == 0) shown->put(*given.moment);
        ++number;
        if (given.query.place.known) ++known;
        if (!session.json()) return as_text(given.query, session);
        auto json = as_json(given.query, wanted.areas);
        json["stamp_s"] = or_null(seen.stamp_s);
        return json_line(json);
      },
      [&](Observation&&) {
        if (wanted.out) table += csv_row(given.query);
        if (!given.moment) return;
        if (given.moment->panorama) {
          given.moment->best_match = best_match_of(given.query.place, file);
        }
        record.add(std::move(*given.moment));
      });
  if (wanted.out) write_file(*wanted.out, std::string_view(table));
  record.close();
  const LiveCounts& counts = taking.finish();
  session.note(std::to_string(known) + " of " + std::to_string(number) + " views show a place of " +
               wanted.memory + events_text(counts, record.left_out()));
  return known > 0 ? ExitCode::done : ExitCode::no_answer;
}

/// Writes the table that was asked for and prints how many places are known; returns that number.
std::size_t conclude(const LocaliseArguments& wanted, const std::vector<LocalisedQuery>& answers,
                     Session& session) {
  const auto count = [&](const auto& holds) {
    return static_cast<std::size_t>(std::ranges::count_if(answers, holds));
  };
  const std::size_t known = count([](const LocalisedQuery& query) { return query.place.known; });
  const std::size_t unread =
      count([](const LocalisedQuery& query) { return !query.error.empty(); });
  if (wanted.out) {
    std::string table(csv_header);
    for (const LocalisedQuery& one : answers) table += csv_row(one);
    write_file(*wanted.out, std::string_view(table));
  }
  if (!session.json() && answers.size() > 1) {
    session.print(
        session.strong(std::to_string(known) + " of " + std::to_string(answers.size() - unread)) +
        " views show a place of " + wanted.memory +
        (unread > 0 ? "; " + std::to_string(unread) + " could not be read" : ""));
  }
  return known;
}

ExitCode localise(const Arguments& arguments, const LocaliseArguments& wanted, Session& session) {
  const auto file = MemoryFile::open(wanted.memory, Access::read_only);
  check(arguments, wanted, file.header());
  if (wanted.inputs.size() == 1 && recordings::is_live(wanted.inputs.front())) {
    return localise_live(arguments, wanted, file, session);
  }
  refuse_live(arguments, wanted.inputs.front(), true);
  if (wanted.learn) {
    arguments.refuse_unused({"--turn-randomly", "--exclude-same-file"}, "with --learn");
  }
  if (wanted.report) prepare_report_folder(*wanted.report, "localise");
  if (wanted.learn && wanted.inputs.size() > 1) {
    throw UsageError("--learn goes with one recording, whose pictures are in order");
  }
  std::optional<MemoryLearner> learner;  // refuses before anything is answered
  if (wanted.learn) learner.emplace(wanted.memory, wanted.update);
  auto recording = open_queries(wanted, file, session);
  const PlaceRecogniser recogniser(wanted.memory, recogniser_options(wanted, recording.source));
  const bool moves = std::ranges::all_of(
      recording.entries, [](const DatasetEntry& entry) { return entry.odometry.has_value(); });
  if (learner && !moves) {
    session.note("motion is read from the pictures, as some have no odometry: " +
                 add_visual_odometry(recording, recogniser.memory(), recogniser.encoder(),
                                     session.executor()));
  }
  const auto answers =
      answer_all(recogniser, wanted, recording, file, learner ? &*learner : nullptr, session);
  const std::size_t known = conclude(wanted, answers, session);
  if (wanted.report) {
    write_localise_report(*wanted.report, file, recogniser, answers, [&](std::size_t i) {
      Observation seen = read_observation(recording.entries[i]);
      (void)turn(seen, recogniser, wanted, i);
      return recogniser.encoder().panorama(seen);
    });
    tell_report(*wanted.report, session);
  }
  if (learner) {
    const auto changes = learner->finish("learn from " + wanted.inputs.front());
    session.note(as_text(changes) + "; " + std::to_string(changes.certain) + " of " +
                 std::to_string(changes.seen) + " places certain");
    if (changes.certain > 0)
      session.suggest({"panonav", "undo", wanted.memory}, "To take it back:");
  }
  return known > 0 ? ExitCode::done : ExitCode::no_answer;
}

Run declare_localise(Arguments& arguments) {
  auto wanted = std::make_shared<LocaliseArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file");
  arguments.positionals(
      "INPUT", wanted->inputs,
      "Data set, folder of pictures, video, recording of topics, one or more pictures, or a live "
      "source: - for JPEG pictures on standard input, a camera (/dev/video0), an address "
      "(rtsp://, http://, tcp://)");
  declare_pictures(arguments, wanted->pictures);
  declare_live(arguments, wanted->live);
  declare_record(arguments, wanted->record);
  declare_view(arguments, wanted->record);
  arguments.uncommon({"--record"});
  arguments.option("-o,--out FILE", wanted->out, "Write a CSV table, one line for each picture");
  arguments.option("--report FOLDER", wanted->report,
                   "Write a page with each picture above its best match, turned alike, into this "
                   "folder: a new one, or that of an earlier report");
  arguments.flag("--exclude-same-file", wanted->exclude_same_file,
                 "Leave out the reference view of the same file name (leave-one-out)");
  arguments.flag("--learn", wanted->learn,
                 "Keep the memory true by a recording in order, whose odometry counts or motion is "
                 "read from the pictures: other appearances of known places are added, up to "
                 "--appearances, and what keeps failing is replaced");
  arguments.option("--turn-randomly SEED", wanted->turn_seed,
                   "Turn the robot before each query by a random number of whole columns; "
                   "turned_rad is the turn, counter-clockwise positive");
  arguments.uncommon({"--turn-randomly"});
  arguments.flag("--areas", wanted->areas,
                 "Also show the area where the robot may be, component by component");
  arguments.options("localiser", wanted->localiser);
  arguments.options("accuracy", wanted->accuracy, "area");
  arguments.options("learning", wanted->update);
  arguments.common({"--top"});
  arguments.used_only(
      {"[learning]"}, [wanted] { return wanted->learn; }, "without --learn");
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
      "that cannot be read are named and skipped. Of a live source the newest picture is answered "
      "as "
      "it comes, until Ctrl-C. The exit code is 1 when no picture shows a place of the memory.",
      "  panonav localise office.panonav query_run --report answers\n"
      "  panonav localise office.panonav one.png two.png -o answers.csv\n"
      "  panonav localise office.panonav view.png --json\n"
      "  panonav localise office.panonav /dev/video0\n"
      "  panonav localise office.panonav monday_run --learn\n"
      "  panonav localise office.panonav office_run --exclude-same-file --turn-randomly 7 --json",
      declare_localise,
      "localize"};
}

}  // namespace panonav::command
