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

void record_skipped(const std::string& file, const Error& error, std::vector<Skipped>& skipped,
                    Session& session) {
  session.note("skipped: " + to_readable_line(error.what()));
  skipped.push_back({file, error.what()});
}

/// Memorises the missing images and stores the name of the recording as soon as the memory file
/// exists. Images that cannot be read are added to `skipped`; with `strict` the first one throws.
void memorise_missing(const Dataset& missing, const Dataset& recording, bool strict,
                      Memoriser& memoriser, std::vector<Skipped>& skipped, Session& session) {
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
          failure = std::current_exception();  // images before it are memorised first
          break;
        }
        progress.clear();
        record_skipped(entry.file, error, skipped, session);
      }
    }
    progress.advance(batch.size());
    if (!batch.empty()) memoriser.add(std::move(batch), session.executor());
    note();
  }
  if (failure) std::rethrow_exception(failure);
  if (memoriser.file() == nullptr && skipped.size() == missing.entries.size()) {
    throw FileError(recording.folder.string(), "contains no image that can be read");
  }
}

MemoriserOptions make_options(const MemoriseArguments& arguments, const PictureSource& source,
                              std::vector<Skipped>& skipped, Session& session) {
  MemoriserOptions options{.source = source,
                           .signature = arguments.signature,
                           .preprocessing = arguments.preprocessing,
                           .thumbnails = !arguments.no_thumbnails,
                           .features = !arguments.no_features,
                           .left_out = {}};
  if (!arguments.strict) {
    options.left_out = [&](const Observation& observation, const Error& error) {
      record_skipped(observation.name, error, skipped, session);
    };
  }
  return options;
}

void print_result(const MemoriseArguments& arguments, const MemoryFile& memory,
                  std::size_t appended, std::size_t known_before,
                  const std::vector<Skipped>& skipped, Session& session) {
  const auto info = memory.info();
  if (session.json()) {
    auto skipped_json = ordered_json::array();
    for (const Skipped& one : skipped) {
      skipped_json.push_back({{"file", one.file}, {"why", one.why}});
    }
    session.print(json_line(ordered_json{{"memory", arguments.memory},
                                         {"appended", appended},
                                         {"known_before", known_before},
                                         {"skipped", std::move(skipped_json)},
                                         {"views", info.views},
                                         {"file_bytes", info.file_bytes}}));
    return;
  }
  session.print(
      session.bold(std::to_string(appended)) + " views stored" +
      (known_before > 0 ? ", " + std::to_string(known_before) + " were already in the memory"
                        : "") +
      (skipped.empty() ? "" : ", " + std::to_string(skipped.size()) + " could not be read") + "; " +
      arguments.memory + " holds " + std::to_string(info.views));
  if (!memory.header().elevations) {
    session.print(
        "The elevations of the images are not known; every row is treated as a row at the "
        "horizon.");
  }
  session.suggest({"panonav", "localise", arguments.memory, "INPUT"});
}

/// Memorises images of a live source until it ends or the user interrupts.
ExitCode memorise_live(const Arguments& declared, const MemoriseArguments& arguments,
                       const std::optional<PictureSource>& remembered, Session& session) {
  const auto source =
      open_live(declared, arguments.input, arguments.pictures, remembered, arguments.live, session);
  std::vector<Skipped> skipped;
  Memoriser memoriser(arguments.memory,
                      make_options(arguments, source->pictures(), skipped, session));
  LiveRun loop(*source, arguments.pictures.part, arguments.live, session);
  loop.run([](const Observation&) { return ""; },
           [&](Observation&& observation) { memoriser.add(std::move(observation)); });
  const LiveCounts& counts = loop.finish();
  if (counts.pictures == 0) throw FileError(arguments.input, "provided no image");
  const auto stored = memoriser.finish(session.executor());
  print_result(arguments, *memoriser.file(), stored.appended, stored.known_before, skipped,
               session);
  if (const std::string events = describe_events(counts, 0); !events.empty()) {
    session.note(std::to_string(counts.pictures) + " images" + events);
  }
  return ExitCode::done;
}

ExitCode memorise(const Arguments& declared, const MemoriseArguments& arguments, Session& session) {
  const bool memory_existed = memory_exists(arguments.memory);
  const bool live = recordings::is_live(arguments.input);
  if (!live) reject_live_options(declared, arguments.input, true);
  std::optional<PictureSource> remembered;
  if (memory_existed) {
    const auto memory = MemoryFile::open(arguments.memory, Access::read_write);
    require_stored_options(declared, arguments.signature, arguments.preprocessing, memory);
    require_stored_band(arguments.pictures, memory);
    remembered = memory.header().source;
  }
  if (live) return memorise_live(declared, arguments, remembered, session);
  const Dataset recording =
      open_recording(arguments.input, arguments.pictures, remembered, session);
  std::vector<Skipped> skipped;
  Memoriser memoriser(arguments.memory,
                      make_options(arguments, recording.source, skipped, session));
  Dataset missing = recording;
  if (memory_existed) {
    Progress comparing(session, "comparing", recording.entries.size());
    check_known_views(recording, *memoriser.file(), *memoriser.encoder(), session.executor(),
                      [&](std::size_t compared) { comparing.advance(compared); });
    std::erase_if(missing.entries, [&](const DatasetEntry& entry) {
      return memoriser.file()->find(entry.file).has_value();
    });
  }
  const std::size_t known_before = recording.entries.size() - missing.entries.size();
  memorise_missing(missing, recording, arguments.strict, memoriser, skipped, session);
  const auto counts = memoriser.finish(session.executor());
  print_result(arguments, *memoriser.file(), counts.appended, known_before, skipped, session);
  return ExitCode::done;
}

Run declare_memorise(Arguments& arguments) {
  auto values = std::make_shared<MemoriseArguments>();
  arguments.positional("INPUT", values->input,
                       "Data set, folder of images, one image, video, recording (MCAP, rosbag2, "
                       "ROS 1 bag), or a live source: - (JPEG images on standard input), a camera "
                       "(/dev/video0), or an address (rtsp://, http://, tcp://)");
  arguments.positional("MEMORY", values->memory, "Memory file (NAME.panonav), new or existing");
  declare_pictures(arguments, values->pictures);
  declare_live(arguments, values->live);
  arguments.flag("--no-thumbnails", values->no_thumbnails, "Do not store thumbnails of the views");
  arguments.flag("--no-features", values->no_features,
                 "Do not store local features (4 kB per view); local features help to distinguish "
                 "places that are 1 to 2 m apart");
  arguments.flag("--strict", values->strict,
                 "Stop at the first image that cannot be read, or whose size differs from that of "
                 "the other images; by default, such images are reported and skipped");
  arguments.flag("--recursive", values->pictures.recursive, "Also read the images in subfolders");
  arguments.options("signature", values->signature);
  arguments.options("preprocessing", values->preprocessing);
  arguments.show_in_help({"--components"});
  return [values, &arguments](Session& session) { return memorise(arguments, *values, session); };
}

}  // namespace

Verb memorise_verb() {
  return {
      "memorise",
      "Store the images of a recording as views in a memory",
      "Views are stored in batches of 16; the first batch of a new memory has 32 views. An "
      "interruption never leaves an incomplete batch. To continue, run the same command again. An "
      "image with the same name as a stored view is refused if its pose, time stamp or content "
      "differs from that view. From a live source, views are stored until you press Ctrl-C.",
      "  panonav memorise office_run office.panonav\n"
      "  panonav memorise photos walk.panonav --kind equirectangular --elevation-deg -30 40\n"
      "  panonav memorise /dev/video0 walk.panonav --kind equirectangular --every 0.5s",
      declare_memorise,
      "memorize"};
}

}  // namespace panonav::command
