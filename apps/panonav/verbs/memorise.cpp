#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"
#include "verbs/known_views.hpp"
#include "verbs/memorising.hpp"
#include "verbs/recording.hpp"

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
    memory = MemoryFile::create(
        wanted.memory, header_from_first_views(recording, wanted.signature, wanted.preprocessing,
                                               session.executor()));
  }
  const ViewEncoder pipeline(memory->header(), recording.source);
  if (resumes) check_known_views(recording, *memory, pipeline, session);
  remember_recording(recording, *memory);
  const auto counts = append_views(recording, pipeline, !wanted.no_thumbnails, *memory, session);
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
