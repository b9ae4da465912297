#include <algorithm>
#include <exception>
#include <filesystem>
#include <functional>
#include <set>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/storage/memory_address.hpp"
#include "runs/live_run.hpp"
#include "runs/memorising.hpp"
#include "runs/orientation_note.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct MemoriseArguments {
  std::string memory;
  std::vector<std::string> inputs;
  PictureArguments pictures;
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
  bool no_thumbnails = false;
  bool no_features = false;
  bool narrow = false;
  bool strict = false;
  std::string floor;
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

/// Memorises the missing images of a recording, in its order, and stores the name of the recording
/// as soon as the memory file exists. Images that cannot be read are added to `skipped`; with
/// `strict` the first one throws.
void memorise_missing(const Dataset& missing, const Dataset& recording,
                      const std::set<std::string>& known, bool strict, Memoriser& memoriser,
                      std::vector<Skipped>& skipped, Session& session) {
  bool noted = false;
  const auto note = [&] {
    if (!noted && memoriser.file() != nullptr) remember_recording(recording, *memoriser.file());
    noted = memoriser.file() != nullptr;
  };
  note();
  Progress progress(session, "memorising", missing.entries.size());
  DatasetObservations source(missing, session.executor(), PictureColours::grey);
  std::exception_ptr failure;
  std::size_t read = 0;  // entries of the recording
  while (!failure && read < recording.entries.size()) {
    std::vector<Observation> batch;
    while (!failure && (batch.empty() || source.has_decoded()) && read < recording.entries.size()) {
      const DatasetEntry& entry = recording.entries[read];
      if (known.contains(entry.file)) {
        if (!batch.empty()) break;  // earlier images first
        memoriser.recall(entry.file, entry.odometry);
        ++read;
        continue;
      }
      ++read;
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
  if (memoriser.file() == nullptr && skipped.size() >= missing.entries.size()) {
    throw FileError(recording.folder.string(), "contains no image that can be read");
  }
}

/// Throws FileError if no image of the recording fits the memory, for example as all have another
/// size. Reads images up to the first that fits.
void require_fitting_image(const Dataset& recording, const ViewEncoder& encoder) {
  std::optional<std::string> misfit;
  for (const DatasetEntry& entry : recording.entries) {
    std::optional<Observation> observation;
    try {
      observation = read_observation(entry);
    } catch (const Error&) {
      continue;  // is named and skipped when it is memorised
    }
    try {
      return encoder.require_fit(*observation);
    } catch (const Error& error) {
      if (!misfit) misfit = error.what();
    }
  }
  if (!misfit) return;
  throw FileError(recording.folder.string(), "no image fits the memory; the first one: " + *misfit);
}

MemoriserOptions make_options(const MemoriseArguments& arguments, const PictureSource& source,
                              std::vector<Skipped>& skipped, Session& session) {
  MemoriserOptions options{.source = source,
                           .signature = arguments.signature,
                           .preprocessing = arguments.preprocessing,
                           .thumbnails = !arguments.no_thumbnails,
                           .features = !arguments.no_features,
                           .narrow = arguments.narrow,
                           .left_out = {}};
  if (!arguments.strict) {
    options.left_out = [&](const Observation& observation, const Error& error) {
      record_skipped(observation.name, error, skipped, session);
    };
  }
  return options;
}

ordered_json to_json(const std::optional<MemoryMap>& map) {
  if (!map) return nullptr;
  return {{"unit", map->unit == LengthUnit::metres ? "m" : "view_steps"},
          {"views", map->views},
          {"part_sizes", map->part_sizes}};
}

/// Prints whether the parts of the map are connected, and its unit.
void print_map(const MemoriseArguments& arguments, const MemoryMap& map, bool is_stored,
               Session& session) {
  const std::size_t parts = map.part_sizes.size();
  if (!is_stored) {
    session.print(session.red("There is no map") + ": it needs " +
                  std::to_string(ObservationModel::min_views) +
                  " connected views, and the largest part has " +
                  std::to_string(map.part_sizes.front()) +
                  ". Take an image every 20 to 50 cm, and memorise their folder, or each after the "
                  "one before it.");
    return;
  }
  if (parts > 1) {
    std::size_t unplaced = 0;
    for (const std::size_t size : map.part_sizes) {
      if (size < static_cast<std::size_t>(ObservationModel::min_views)) unplaced += size;
    }
    session.print("The map has " +
                  session.red(std::to_string(parts) + " parts that are not connected") +
                  "; the largest has " + format_count(map.part_sizes.front(), "view") + ". " +
                  (unplaced > 0 ? "Without a position: " + format_count(unplaced, "view") +
                                      " in parts of fewer than " +
                                      std::to_string(ObservationModel::min_views) + ". "
                                : "") +
                  "Parts are placed beside each other; distances between them have no meaning. To "
                  "connect " +
                  (arguments.floor.empty() ? "them" : "parts of one floor") +
                  ", memorise a walk that leads through them, with an image every 20 to 50 cm.");
  }
  if (map.unit == LengthUnit::view_steps) {
    session.print("Positions are in view steps (" + std::string(map.view_step) +
                  "). For metres: panonav scale " + arguments.memory +
                  " --distance VIEW VIEW LENGTH");
  }
}

/// `recording`: its poses show the orientation of the images; null for a live source.
void print_result(const MemoriseArguments& arguments, const MemoryFile& memory,
                  const Memoriser::Counts& counts, std::size_t known_before,
                  const std::vector<Skipped>& skipped, const Dataset* recording, Session& session) {
  const OrientationCheck orientation =
      recording ? check_orientation(*recording, memory) : OrientationCheck{};
  const std::size_t appended = counts.appended;
  const auto info = memory.counts();
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
                                         {"views_with_position", info.views_with_position},
                                         {"map", to_json(counts.map)},
                                         {"orientation_fault", orientation_json(orientation)},
                                         {"file_bytes", info.file_bytes}}));
    return;
  }
  session.print(
      session.bold(format_count(appended, "view")) + " stored" +
      (known_before > 0 ? ", " + std::to_string(known_before) + " already in the memory" : "") +
      (skipped.empty() ? "" : ", " + std::to_string(skipped.size()) + " skipped") + "; " +
      arguments.memory + " holds " + std::to_string(info.views));
  if (orientation.fault) {
    session.print(session.red("The stated orientation of the images is wrong") + ": " +
                  describe_fault(orientation, recording->source, arguments.inputs.front()) +
                  ", and memorise them into a new memory");
  }
  if (!memory.header().elevations) {
    session.print(
        "The elevations of the images are not known; every row is treated as a row at the "
        "horizon.");
  }
  if (counts.map) {
    print_map(arguments, *counts.map, has_positions_from_map(memory), session);
  }
  print_views_without_position(memory, session);
  session.suggest({"panonav", "localise", arguments.memory, "INPUT"});
}

/// Memorises images of a live source until it ends or the user interrupts.
ExitCode memorise_live(const Arguments& declared, const MemoriseArguments& arguments,
                       const std::optional<PictureSource>& remembered, Session& session) {
  const auto source = open_live(declared, arguments.inputs.front(), arguments.pictures, remembered,
                                arguments.live, session);
  std::vector<Skipped> skipped;
  Memoriser memoriser(arguments.memory,
                      make_options(arguments, source->pictures(), skipped, session));
  LiveRun loop(*source, arguments.pictures.part, arguments.live, session);
  loop.run([](const Observation&) { return ""; },
           [&](Observation&& observation) {
             observation.name = make_name_on_floor(arguments.floor, observation.name);
             memoriser.add(std::move(observation));
           });
  const LiveCounts& counts = loop.finish();
  if (counts.pictures == 0) throw FileError(arguments.inputs.front(), "provided no image");
  const auto stored = memoriser.finish(session.executor());
  print_result(arguments, *memoriser.file(), stored, stored.known_before, skipped, nullptr,
               session);
  if (const std::string events = describe_events(counts, 0); !events.empty()) {
    session.note(format_count(counts.pictures, "image") + events);
  }
  return ExitCode::done;
}

ExitCode memorise(const Arguments& declared, const MemoriseArguments& arguments, Session& session) {
  require_floor(arguments.floor);
  const bool memory_existed = memory_exists(arguments.memory);
  if (arguments.narrow && arguments.no_features) {
    throw UsageError("--narrow cannot be used with --no-features");
  }
  const bool live = recordings::is_live(arguments.inputs.front());
  if (!live) reject_live_options(declared, arguments.inputs.front(), true);
  std::optional<PictureSource> remembered;
  if (memory_existed) {
    const auto memory = MemoryFile::open(arguments.memory, Access::read_write);
    require_stored_options(declared, arguments.signature, arguments.preprocessing, memory);
    require_stored_band(arguments.pictures, memory);
    if (arguments.narrow) require_narrow_features(memory);
    remembered = memory.header().source;
  }
  if (live) return memorise_live(declared, arguments, remembered, session);
  PictureArguments pictures = arguments.pictures;
  pictures.check = PictureArguments::Check::none;
  pictures.further_videos.assign(arguments.inputs.begin() + 1, arguments.inputs.end());
  Dataset recording = open_recording(arguments.inputs.front(), pictures, remembered, session);
  for (DatasetEntry& entry : recording.entries) {
    entry.file = make_name_on_floor(arguments.floor, entry.file);
  }
  std::vector<Skipped> skipped;
  for (const Dataset::Unusable& one : recording.unusable) {
    if (arguments.strict) throw FileError(one.path.string(), one.fault);
    skipped.push_back({one.file, one.describe()});
  }
  Memoriser memoriser(arguments.memory,
                      make_options(arguments, recording.source, skipped, session));
  Dataset missing = recording;
  std::set<std::string> known;
  if (memory_existed) {
    require_fitting_image(recording, *memoriser.encoder());
    Progress comparing(session, "comparing", recording.entries.size());
    std::function<void(const DatasetEntry&, const Error&)> unread;
    if (!arguments.strict) {
      unread = [&](const DatasetEntry& entry, const Error& error) {
        record_skipped(entry.file, error, skipped, session);
      };
    }
    check_known_views(
        recording, *memoriser.file(), *memoriser.encoder(), session.executor(),
        [&](std::size_t compared) { comparing.advance(compared); }, unread);
    memoriser.recognise_renamed(recording);
    std::erase_if(missing.entries, [&](const DatasetEntry& entry) {
      const bool is_known = memoriser.find(entry.file).has_value();
      if (is_known) known.insert(entry.file);
      return is_known;
    });
  }
  const std::size_t known_before = recording.entries.size() - missing.entries.size();
  const bool is_strict = arguments.strict || recording.entries.size() == 1;
  memorise_missing(missing, recording, known, is_strict, memoriser, skipped, session);
  Progress mapping(session, "mapping", known_before + missing.entries.size());
  return_freed_memory();
  const auto counts = memoriser.finish(session.executor(), [&] { mapping.advance(); });
  mapping.clear();
  print_result(arguments, *memoriser.file(), counts, known_before, skipped, &recording, session);
  return ExitCode::done;
}

Run declare_memorise(Arguments& arguments) {
  auto values = std::make_shared<MemoriseArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file (NAME.panonav), new or existing");
  arguments.positionals("INPUT", values->inputs,
                        "Data set, folder of images, one image, video (several are joined), "
                        "recording (MCAP, rosbag2, ROS 1 bag), or a live source: - (JPEG images on "
                        "standard input), a camera (/dev/video0), or an address (rtsp://, http://, "
                        "tcp://)");
  declare_pictures(arguments, values->pictures);
  declare_live(arguments, values->live);
  arguments.flag("--no-thumbnails", values->no_thumbnails, "Do not store thumbnails of the views");
  arguments.flag("--no-features", values->no_features,
                 "Do not store local features (4 kB per view); local features help to distinguish "
                 "places that are 1 to 2 m apart");
  arguments.flag("--narrow", values->narrow,
                 "In a new memory, also store features by which narrow images, such as those of a "
                 "phone, are localised (17 kB per view)");
  arguments.flag("--strict", values->strict,
                 "Stop at the first image that cannot be read, or whose size differs from that of "
                 "the other images; by default, such images are reported and skipped");
  arguments.option("--floor NAME", values->floor,
                   "Floor on which the images were taken; each floor has its own frame of "
                   "positions. Names of its views begin with floor=NAME/");
  arguments.flag("--recursive", values->pictures.recursive, "Also read the images in subfolders");
  arguments.options("signature", values->signature);
  arguments.options("preprocessing", values->preprocessing);
  arguments.show_in_help({"--components"});
  arguments.explain_interruption(
      "Views stored so far are kept. To continue, run the same command again.");
  return [values, &arguments](Session& session) { return memorise(arguments, *values, session); };
}

}  // namespace

Verb memorise_verb() {
  return {
      "memorise",
      VerbGroup::memory,
      "Store the images of a recording as views in a memory",
      "Views are stored in batches of 16; the first batch of a new memory has 32 views. An "
      "interruption never leaves an incomplete batch. To continue, run the same command again. An "
      "image with the same name as a stored view is refused if its pose, time stamp or content "
      "differs from that view. From a live source, views are stored until you press Ctrl-C.",
      "  panonav memorise office.panonav office_run\n"
      "  panonav memorise walk.panonav photos --kind equirectangular --elevation-deg -30 40\n"
      "  panonav memorise walk.panonav /dev/video0 --kind equirectangular --every 0.5s",
      declare_memorise,
      "memorize"};
}

}  // namespace panonav::command
