#include <exception>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/storage/memory_address.hpp"
#include "runs/live_run.hpp"
#include "runs/memorising.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct MemoriseArguments {
  std::string input;
  std::string memory;
  PictureArguments pictures;
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
  bool no_thumbnails = false;
  bool no_features = false;
  bool strict = false;
  LiveArguments live;
};

/// A picture that was not memorised.
struct Skipped {
  std::string file;
  std::string why;
};

void skip(const std::string& file, const Error& error, std::vector<Skipped>& skipped,
          Session& session) {
  session.note("skipped: " + to_readable_line(error.what()));
  skipped.push_back({file, error.what()});
}

/// Appends what is missing; notes which recording it is of as soon as there is a file. Adds the
/// pictures that cannot be read to `skipped`; with `strict` the first of them ends it.
void add_all(const Dataset& missing, const Dataset& recording, bool strict, Memoriser& memoriser,
             std::vector<Skipped>& skipped, Session& session) {
  bool noted = false;
  const auto note = [&] {
    if (!noted && memoriser.file() != nullptr) remember_recording(recording, *memoriser.file());
    noted = memoriser.file() != nullptr;
  };
  note();
  Progress progress(session, "memorising", missing.entries.size());
  DatasetObservations source(missing, session.executor());
  std::exception_ptr failure;
  std::size_t read = 0;
  while (!failure && read < missing.entries.size()) {
    std::vector<Observation> batch;
    while (!failure && batch.size() < DatasetObservations::decoded_ahead &&
           read < missing.entries.size()) {
      const DatasetEntry& entry = missing.entries[read++];
      try {
        batch.push_back(source.next().value());
      } catch (const FileError& error) {
        if (strict) {
          failure = std::current_exception();  // what comes before it is memorised
          break;
        }
        progress.clear();
        skip(entry.file, error, skipped, session);
      }
    }
    progress.advance(batch.size());
    if (!batch.empty()) memoriser.add(std::move(batch), session.executor());
    note();
  }
  if (failure) std::rethrow_exception(failure);
  if (memoriser.file() == nullptr && skipped.size() == missing.entries.size()) {
    throw FileError(recording.folder.string(), "holds no picture that can be read");
  }
}

MemoriserOptions options_of(const MemoriseArguments& wanted, const PictureSource& source,
                            std::vector<Skipped>& skipped, Session& session) {
  MemoriserOptions options{.source = source,
                           .signature = wanted.signature,
                           .preprocessing = wanted.preprocessing,
                           .thumbnails = !wanted.no_thumbnails,
                           .features = !wanted.no_features,
                           .left_out = {}};
  if (!wanted.strict) {
    options.left_out = [&](const Observation& seen, const Error& error) {
      skip(seen.name, error, skipped, session);
    };
  }
  return options;
}

void tell(const MemoriseArguments& wanted, const MemoryFile& memory, std::size_t appended,
          std::size_t known_before, const std::vector<Skipped>& skipped, Session& session) {
  const auto info = memory.info();
  if (session.json()) {
    auto skipped_json = ordered_json::array();
    for (const Skipped& one : skipped) {
      skipped_json.push_back({{"file", one.file}, {"why", one.why}});
    }
    session.print(json_line(ordered_json{{"memory", wanted.memory},
                                         {"appended", appended},
                                         {"known_before", known_before},
                                         {"skipped", std::move(skipped_json)},
                                         {"views", info.views},
                                         {"file_bytes", info.file_bytes}}));
    return;
  }
  session.print(
      session.strong(std::to_string(appended)) + " views memorised" +
      (known_before > 0 ? ", " + std::to_string(known_before) + " were known before" : "") +
      (skipped.empty() ? "" : ", " + std::to_string(skipped.size()) + " could not be read") + "; " +
      wanted.memory + " holds " + std::to_string(info.views));
  if (!memory.header().elevations) {
    session.print(
        "The pictures' elevations are not known: every row is treated as on the horizon.");
  }
  session.suggest({"panonav", "localise", wanted.memory, "INPUT"});
}

/// Memorises pictures as they come until the source ends or the user interrupts.
ExitCode memorise_live(const Arguments& arguments, const MemoriseArguments& wanted,
                       const std::optional<PictureSource>& remembered, Session& session) {
  const auto source = open_live(arguments, wanted.input, wanted.pictures, remembered, wanted.live);
  std::vector<Skipped> skipped;
  Memoriser memoriser(wanted.memory, options_of(wanted, source->pictures(), skipped, session));
  LiveRun taking(*source, wanted.pictures.part, wanted.live, session);
  taking.take([](const Observation&) { return ""; },
              [&](Observation&& seen) { memoriser.add(std::move(seen)); });
  const LiveCounts& counts = taking.finish();
  if (counts.pictures == 0) throw FileError(wanted.input, "gave no picture");
  const auto stored = memoriser.finish(session.executor());
  tell(wanted, *memoriser.file(), stored.appended, stored.known_before, skipped, session);
  if (const std::string events = events_text(counts, 0); !events.empty()) {
    session.note(std::to_string(counts.pictures) + " pictures" + events);
  }
  return ExitCode::done;
}

ExitCode memorise(const Arguments& arguments, const MemoriseArguments& wanted, Session& session) {
  const bool resumes = memory_exists(wanted.memory);
  const bool live = recordings::is_live(wanted.input);
  if (!live) refuse_live(arguments, wanted.input, true);
  std::optional<PictureSource> remembered;
  if (resumes) {
    const auto memory = MemoryFile::open(wanted.memory, Access::read_write);
    require_kept_options(arguments, wanted.signature, wanted.preprocessing, memory);
    require_kept_band(wanted.pictures, memory);
    remembered = memory.header().source;
  }
  if (live) return memorise_live(arguments, wanted, remembered, session);
  const Dataset recording = open_recording(wanted.input, wanted.pictures, remembered, session);
  std::vector<Skipped> skipped;
  Memoriser memoriser(wanted.memory, options_of(wanted, recording.source, skipped, session));
  Dataset missing = recording;
  if (resumes) {
    Progress comparing(session, "comparing", recording.entries.size());
    check_known_views(recording, *memoriser.file(), *memoriser.encoder(), session.executor(),
                      [&](std::size_t compared) { comparing.advance(compared); });
    std::erase_if(missing.entries, [&](const DatasetEntry& entry) {
      return memoriser.file()->find(entry.file).has_value();
    });
  }
  const std::size_t known_before = recording.entries.size() - missing.entries.size();
  add_all(missing, recording, wanted.strict, memoriser, skipped, session);
  const auto counts = memoriser.finish(session.executor());
  tell(wanted, *memoriser.file(), counts.appended, known_before, skipped, session);
  return ExitCode::done;
}

Run declare_memorise(Arguments& arguments) {
  auto wanted = std::make_shared<MemoriseArguments>();
  arguments.positional(
      "INPUT", wanted->input,
      "Data set, folder of pictures, one picture, video, recording of topics (MCAP, "
      "rosbag2, ROS 1 bag), or a live source: - for JPEG pictures on standard input, a camera "
      "(/dev/video0), an address (rtsp://, http://, tcp://)");
  arguments.positional("MEMORY", wanted->memory,
                       "Memory file (NAME.panonav); grows if it is there");
  declare_pictures(arguments, wanted->pictures);
  declare_live(arguments, wanted->live);
  arguments.flag("--no-thumbnails", wanted->no_thumbnails,
                 "Do not keep small pictures of the views");
  arguments.flag("--no-features", wanted->no_features,
                 "Do not keep local features, with which views 1 to 2 m apart are told apart: 4 kB "
                 "a view");
  arguments.flag(
      "--strict", wanted->strict,
      "End at the first picture that cannot be read or is of another size; otherwise it is "
      "named and skipped");
  arguments.flag("--recursive", wanted->pictures.recursive,
                 "A folder of pictures: take those of the folders within, too");
  arguments.options("signature", wanted->signature);
  arguments.options("preprocessing", wanted->preprocessing);
  arguments.common({"--components"});
  return [wanted, &arguments](Session& session) { return memorise(arguments, *wanted, session); };
}

}  // namespace

Verb memorise_verb() {
  return {
      "memorise",
      "Remember what the places of a recording look like",
      "Views reach the disk in batches of 16, a new memory's first 32 together, each batch whole "
      "or not at all; after an interruption the same command goes on where it stopped. Views that "
      "the memory knows by name must be the same views: another pose, stamp or picture under a "
      "known name is refused. A live source is memorised until Ctrl-C.",
      "  panonav memorise office_run office.panonav\n"
      "  panonav memorise photos walk.panonav --kind equirectangular --elevation-deg -30 40\n"
      "  panonav memorise /dev/video0 walk.panonav --kind equirectangular --every 0.5s",
      declare_memorise,
      "memorize"};
}

}  // namespace panonav::command
