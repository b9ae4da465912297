#include <cmath>
#include <exception>
#include <limits>
#include <numbers>

#include "cli/verbs.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/orientation_check.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_recordings/recording.hpp"
#include "reports/localise_report.hpp"
#include "reports/report_page.hpp"
#include "runs/localised_query.hpp"
#include "runs/localised_run.hpp"
#include "runs/orientation_note.hpp"

namespace panonav::command {

namespace {

/// Rotates the image by a random number of columns, with --turn-randomly, and returns the rotation
/// in radians, counter-clockwise positive; otherwise 0.
double rotate_randomly(Observation& observation, const PlaceRecogniser& recogniser,
                       const LocaliseArguments& arguments, std::size_t index) {
  if (!arguments.turn_seed) return 0.0;
  const Panorama panorama = recogniser.encoder().panorama(observation);
  Random random(*arguments.turn_seed, index);
  const auto columns = static_cast<std::uint64_t>(panorama.columns());
  const auto turned = static_cast<int>(random.index(columns));
  observation.picture = rotate_columns(panorama, turned);
  return wrap_angle(2.0 * std::numbers::pi * turned / static_cast<double>(columns));
}

void print_answer(const LocalisedQuery& query, const LocaliseArguments& arguments,
                  Session& session) {
  if (!query.error.empty()) session.note("skipped: " + to_readable_line(query.error));
  if (session.json()) {
    session.print(session.json_line(to_json(query, arguments.areas)));
  } else if (query.error.empty()) {
    session.print(format_line(query, session));
  }
}

/// Localises all images on all threads and prints the answers in order. Reports images that cannot
/// be used; throws FileError if none can be used.
std::vector<LocalisedQuery> answer_all(const PlaceRecogniser& recogniser,
                                       const LocaliseArguments& arguments, const Dataset& recording,
                                       Session& session) {
  struct Answer {
    LocalisedQuery query;
    std::exception_ptr failure = {};  ///< why the image could not be used
  };
  Progress progress(session, "localising", recording.entries.size());
  std::vector<LocalisedQuery> answers;
  std::size_t printed = 0;
  std::exception_ptr failure;
  process_in_order(
      recording.entries.size(), session.executor(),
      [&](std::size_t i) -> Answer {
        const DatasetEntry& entry = recording.entries[i];
        // The entries of several typed images contain paths; the memory has file names.
        const std::string name =
            arguments.inputs.size() > 1 ? escape_name(entry.path.filename().string()) : entry.file;
        try {
          Observation observation = read_observation(entry);
          const double turned_rad = rotate_randomly(observation, recogniser, arguments, i);
          Place place = recogniser.localise(observation,
                                            std::span(&name, arguments.exclude_same_file ? 1 : 0));
          return {{observation.name, turned_rad, std::move(place), observation.pose, ""}};
        } catch (const FileError& error) {
          return {{entry.file, 0.0, {}, entry.pose, error.what()}, std::current_exception()};
        }
      },
      [&](std::size_t, Answer&& made) {
        answers.push_back(std::move(made.query));
        if (made.failure && !failure) failure = made.failure;
        progress.advance();
        if (printed == 0 && made.failure) return;  // throws later if no image can be read
        progress.clear();
        for (; printed < answers.size(); ++printed) {
          print_answer(answers[printed], arguments, session);
        }
      });
  if (printed == 0 && failure) std::rethrow_exception(failure);
  return answers;
}

/// Writes the CSV table and prints how many images show known places; returns this number.
std::size_t write_table_and_count(const LocaliseArguments& arguments,
                                  const std::vector<LocalisedQuery>& answers, Session& session) {
  std::string table = make_csv_header(session.length_unit());
  std::size_t known = 0;
  std::size_t unread = 0;
  for (const LocalisedQuery& answer : answers) {
    table += csv_row(answer);
    known += answer.place.known ? 1 : 0;
    unread += answer.error.empty() ? 0 : 1;
  }
  if (arguments.out) write_file(*arguments.out, std::string_view(table));
  if (!session.json() && answers.size() > 1) {
    session.print(
        session.bold(std::to_string(known) + " of " + std::to_string(answers.size() - unread)) +
        " images show a place of " + arguments.memory +
        (unread > 0 ? "; " + std::to_string(unread) + " could not be read" : ""));
  }
  return known;
}

ExitCode localise(const Arguments& declared, const LocaliseArguments& arguments, Session& session) {
  const bool live = arguments.inputs.size() == 1 && recordings::is_live(arguments.inputs.front());
  if (live || arguments.add || arguments.update || arguments.route || arguments.record.file ||
      arguments.record.view) {
    if (arguments.pictures.kind == "pinhole") {
      throw UsageError(
          "--kind pinhole cannot be used with live images, --add, --update, --route, --record or "
          "--view; allowed: image files");
    }
    return localise_in_order(declared, arguments, session);
  }
  const auto file = MemoryFile::open(arguments.memory, Access::read_only);
  session.set_length_unit(read_length_unit(file));
  require_components(declared, arguments, file.header());
  reject_live_options(declared, arguments.inputs.front(), true);
  if (arguments.report) prepare_report_folder(*arguments.report, "localise");
  require_stored_band(arguments.pictures, file);
  Dataset recording = open_queries(arguments, file.header().source, session);
  const bool is_narrow = recording.source.kind == PictureKind::pinhole;
  if (is_narrow) {
    declared.reject_options({"--turn-randomly", "--areas", "--report"},
                            "with narrow images (pinhole)");
  }
  if (!is_narrow && arguments.inputs.size() == 1 && recording.entries.size() > 1) {
    const OrientationCheck orientation = check_orientation(recording, session.executor());
    if (orientation.fault) {
      session.note("the stated orientation of the images is wrong: " +
                   describe_fault(orientation, recording.source, arguments.inputs.front()));
    }
  }
  if (has_incomparable_truth(recording, arguments.inputs.front(), file, session)) {
    for (DatasetEntry& entry : recording.entries) entry.pose.reset();
  }
  PlaceRecogniserOptions options{.localiser = arguments.localiser, .source = recording.source};
  if (arguments.areas) options.areas = arguments.accuracy;
  // Loads the whole memory for a report, which shows all its views.
  if (arguments.report) options.max_held_views = std::numeric_limits<std::size_t>::max();
  const PlaceRecogniser recogniser(arguments.memory, options);
  const auto answers = answer_all(recogniser, arguments, recording, session);
  const std::size_t known = write_table_and_count(arguments, answers, session);
  if (known > 0 && has_positions_from_map(file)) {
    session.note(
        "positions are those in the map of the images; 'within' does not contain its errors");
  }
  if (arguments.report) {
    write_localise_report(*arguments.report, file, recogniser, answers, [&](std::size_t i) {
      Observation observation = read_observation(recording.entries[i]);
      (void)rotate_randomly(observation, recogniser, arguments, i);
      return recogniser.encoder().panorama(observation);
    });
    print_report_path(*arguments.report, session);
  }
  return known > 0 ? ExitCode::done : ExitCode::no_answer;
}

void declare_changes(Arguments& arguments, const std::shared_ptr<LocaliseArguments>& values) {
  arguments.flag(
      "--add", values->add,
      "Add images of unknown places to the memory; a new memory first collects 32 images");
  arguments.option("--add-interval-s", values->add_interval_s,
                   "Shortest time between two added views; default 0.5");
  arguments.hide_from_help({"--add-interval-s"});
  arguments.flag("--update", values->update,
                 "Update views of known places: add changed views, up to --appearances per place, "
                 "and replace views that repeatedly do not match");
  arguments.option("--route NAME", values->route,
                   "Locate the robot relative to this route; with --add: record the route as one "
                   "line of pixels every 0.1 m");
  arguments.options("update", values->update_options);
  arguments.options("signature", values->signature, "new");
  arguments.options("preprocessing", values->preprocessing);
  arguments.reject_options_unless(
      {"--add-interval-s", "[signature]", "[preprocessing]"}, [values] { return values->add; },
      "without --add");
  arguments.reject_options_unless(
      {"[update]"}, [values] { return values->update; }, "without --update");
}

Run declare_localise(Arguments& arguments) {
  auto values = std::make_shared<LocaliseArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.positionals(
      "INPUT", values->inputs,
      "Data set, folder of images, video (several are joined), recording, one or "
      "more images, or a live source: - (JPEG images on standard input), a camera (/dev/video0), "
      "or an address (rtsp://, http://, tcp://)");
  values->pictures.takes_narrow = true;
  declare_pictures(arguments, values->pictures);
  declare_live(arguments, values->live);
  declare_record(arguments, values->record);
  declare_view(arguments, values->record);
  arguments.hide_from_help({"--record"});
  arguments.option("-o,--out FILE", values->out,
                   "Write the answers as CSV, one line for each image");
  declare_report(arguments, values->report, "a page that shows each image above its best match");
  arguments.flag(
      "--exclude-same-file", values->exclude_same_file,
      "Do not compare an image with the view that has the same file name (leave-one-out test)");
  arguments.option("--turn-randomly SEED", values->turn_seed,
                   "Rotate each image by a random number of columns; SEED is the random seed. "
                   "'turned_rad' in the answers is the rotation, counter-clockwise positive");
  arguments.hide_from_help({"--exclude-same-file", "--turn-randomly"});
  arguments.flag("--areas", values->areas,
                 "Also print the areas in which the robot may be; each area is computed from more "
                 "Fourier components than the area before");
  arguments.hide_from_help({"--areas"});
  arguments.options("localiser", values->localiser);
  arguments.options("accuracy", values->accuracy, "area");
  declare_changes(arguments, values);
  arguments.reject_options_unless(
      {"[accuracy]"}, [values] { return values->areas; }, "without --areas");
  arguments.declare_outputs({"--out"});
  arguments.explain_interruption(
      "Views added so far are kept; --update changes nothing before the end. To continue, run the "
      "same command again.",
      [values] { return values->add || values->update; });
  return [values, &arguments](Session& session) { return localise(arguments, *values, session); };
}

}  // namespace

Verb localise_verb() {
  return {
      "localise",
      VerbGroup::localisation,
      "Find the position and heading of a robot from images",
      "An image without a dataset.toml is read with the image type of the memory. Images that "
      "cannot be read are reported and skipped. From a live source, the verb always reads the "
      "newest image; press Ctrl-C to stop. --update uses the odometry; if there is none, motion is "
      "computed from the images. panonav undo reverts an update. With --add, --route takes the "
      "positions of the route from the recording's poses; if there are none, from its odometry; "
      "otherwise from the images. The exit code is 1 if no image shows a place of the memory.",
      "  panonav localise office.panonav query_run --report answers\n"
      "  panonav localise office.panonav /dev/video0\n"
      "  panonav localise office.panonav one.png two.png -o answers.csv\n"
      "  panonav localise office.panonav view.png --json\n"
      "  panonav localise walk.panonav /dev/video0 --add --kind equirectangular\n"
      "  panonav localise office.panonav monday_run --update\n"
      "  panonav localise office.panonav office_run --exclude-same-file --turn-randomly 7 --json",
      declare_localise,
      "localize"};
}

}  // namespace panonav::command
