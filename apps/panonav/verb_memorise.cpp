#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <unordered_set>

#include "known_views.hpp"
#include "memory_pipeline.hpp"
#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/storage/memory_file.hpp"
#include "recording.hpp"
#include "session.hpp"
#include "verbs.hpp"

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
};

/// How many views the full scale is taken from.
constexpr std::size_t scale_views = 32;

double now_s() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

/// Views at the head of the recording decide the scale of the whole memory.
MemoryHeader header_from_first_views(const Dataset& recording, const MemoriseArguments& wanted,
                                     Executor& executor) {
  MemoryHeader header;
  header.source = recording.source;
  header.preprocessing = wanted.preprocessing;
  header.created_s = now_s();
  const PanoramaShape shape = wanted_shape(recording, wanted.signature);
  const PanoramaReader reader(recording.source, shape);
  const auto first = reader.read(recording.entries.front().path);
  header.shape = {first.rows(), wanted.signature.components};
  header.panorama_columns = first.columns();
  header.elevations = first.elevations();
  if (recording.source.kind == PictureKind::panorama) {
    const auto [width, height] = read_image_size(recording.entries.front().path);
    const PanoramaShape own{height, width};
    if (own != PanoramaShape{first.rows(), first.columns()}) header.picture_shape = own;
  }
  if (2 * header.shape.components > header.panorama_columns) {
    throw ContractError("components", header.shape.components,
                        "1 to " + std::to_string(header.panorama_columns / 2) +
                            ", half the columns of " + recording.entries.front().path.string());
  }

  const MemoryPipeline pipeline(header, recording.source);
  const std::size_t count = std::min(scale_views, recording.entries.size());
  std::vector<float> largest(count, 0.0F);
  for_each_entry(executor, count, [&](std::size_t i) {
    const auto signature = pipeline.signature(pipeline.read(recording.entries[i]));
    largest[i] = largest_structure(signature);
  });
  header.full_scale = *std::max_element(largest.begin(), largest.end());
  if (!(header.full_scale > 0.0F)) {
    throw FileError(recording.entries.front().path.string(),
                    "the first " + std::to_string(count) +
                        " views are of one colour; a memory needs views with structure");
  }
  return header;
}

/// A resumed memory keeps its own options; other ones that the user asks for are refused.
void check_same_options(const Arguments& arguments, const MemoriseArguments& wanted,
                        const MemoryFile& memory) {
  const auto& header = memory.header();
  const auto refuse = [&](const std::string& option, int value, int kept) {
    throw ContractError(option, value,
                        std::to_string(kept) + ", as " + memory.path().string() +
                            " was made with; leave the option out or start a new memory");
  };
  if (arguments.given("signature", "components") &&
      wanted.signature.components != header.shape.components) {
    refuse("components", wanted.signature.components, header.shape.components);
  }
  if (arguments.given("signature", "rows") && wanted.signature.rows != 0 &&
      wanted.signature.rows != header.shape.rows) {
    refuse("rows", wanted.signature.rows, header.shape.rows);
  }
  if (arguments.given("signature", "columns") && wanted.signature.columns != 0 &&
      wanted.signature.columns != header.panorama_columns) {
    refuse("columns", wanted.signature.columns, header.panorama_columns);
  }
  if (arguments.given("preprocessing") && wanted.preprocessing != header.preprocessing) {
    throw FileError(memory.path().string(),
                    "was made with other preprocessing; leave these options out or start a new "
                    "memory");
  }
}

struct Counts {
  std::size_t appended = 0;
  std::size_t known_before = 0;
};

/// Signatures are computed side by side, appended one by one in the order of the recording; what
/// was appended stays, whatever happens later.
Counts append_all(const Dataset& recording, const MemoryPipeline& pipeline, bool thumbnails,
                  MemoryFile& memory, Session& session) {
  Counts counts;
  std::vector<const DatasetEntry*> missing;
  {
    const auto names = memory.names();
    const std::unordered_set<std::string> known(names.begin(), names.end());
    for (const auto& entry : recording.entries) {
      if (!known.contains(entry.file)) missing.push_back(&entry);
    }
  }
  counts.known_before = recording.entries.size() - missing.size();
  Progress progress("memorising", missing.size());
  constexpr std::size_t batch = 16;
  for (std::size_t begin = 0; begin < missing.size(); begin += batch) {
    const std::size_t count = std::min(batch, missing.size() - begin);
    std::vector<std::optional<NewView>> views(count);
    std::vector<std::exception_ptr> failures(count);
    for_each_entry(session.executor(), count, [&](std::size_t i) {
      const auto& entry = *missing[begin + i];
      try {
        const auto panorama = pipeline.read(entry);
        views[i] = NewView{{entry.file, entry.pose, entry.stamp_s},
                           pipeline.packed(panorama),
                           thumbnails ? thumbnail_png(panorama) : std::vector<std::uint8_t>{}};
      } catch (const Error&) {
        failures[i] = std::current_exception();
      }
    });
    for (std::size_t i = 0; i < count; ++i) {
      if (failures[i]) std::rethrow_exception(failures[i]);
      (void)memory.append(*views[i]);
      ++counts.appended;
      progress.advance();
    }
  }
  return counts;
}

ExitCode memorise(const Arguments& arguments, const MemoriseArguments& wanted, Session& session) {
  const bool resumes = fs::exists(wanted.memory);
  std::optional<MemoryFile> memory;
  if (resumes) memory = MemoryFile::open(wanted.memory, Access::read_write);
  const auto recording =
      open_recording(wanted.input, wanted.pictures,
                     memory ? std::optional(memory->header().source) : std::nullopt);
  if (memory) {
    check_same_options(arguments, wanted, *memory);
  } else {
    memory = MemoryFile::create(wanted.memory,
                                header_from_first_views(recording, wanted, session.executor()));
  }
  const MemoryPipeline pipeline(memory->header(), recording.source);
  if (resumes) check_known_views(recording, *memory, pipeline, session);
  remember_recording(recording, *memory);
  const auto counts = append_all(recording, pipeline, !wanted.no_thumbnails, *memory, session);
  const auto info = memory->info();
  if (session.json()) {
    session.print(nlohmann::ordered_json{{"memory", wanted.memory},
                                         {"appended", counts.appended},
                                         {"known_before", counts.known_before},
                                         {"views", info.views},
                                         {"file_bytes", info.file_bytes}}
                      .dump());
    return ExitCode::done;
  }
  session.print(session.strong(std::to_string(counts.appended)) + " views memorised" +
                (counts.known_before > 0
                     ? ", " + std::to_string(counts.known_before) + " were known before"
                     : "") +
                "; " + wanted.memory + " holds " + std::to_string(info.views));
  if (!memory->header().elevations) {
    session.print(
        "The pictures' elevations are not known: every row is treated as on the horizon.");
  }
  session.print("Next: panonav localise " + wanted.memory + " INPUT");
  return ExitCode::done;
}

Run declare(Arguments& arguments) {
  auto wanted = std::make_shared<MemoriseArguments>();
  arguments.positional("INPUT", wanted->input, "Data set, folder of pictures, or one picture");
  arguments.positional("MEMORY", wanted->memory,
                       "Memory file (NAME.panonav); grows if it is there");
  declare_pictures(arguments, wanted->pictures);
  arguments.flag("--no-thumbnails", wanted->no_thumbnails,
                 "Do not keep small pictures of the views");
  arguments.options("signature", wanted->signature);
  arguments.options("preprocessing", wanted->preprocessing);
  return [wanted, &arguments](Session& session) { return memorise(arguments, *wanted, session); };
}

}  // namespace

Verb memorise_verb() {
  return {
      "memorise", "Remember what the places of a recording look like",
      "Every view is on the disk before the next one is taken up; after an interruption the same\n"
      "command goes on where it stopped. Views that the memory knows by name must be the same\n"
      "views: another pose, stamp or picture under a known name is refused.",
      "  panonav memorise office_run office.panonav\n"
      "  panonav memorise photos walk.panonav --kind equirectangular --elevation-deg -30 40",
      declare};
}

}  // namespace panonav::command
