#include "cli/option_values.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/pipeline/memory_export.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/route/firmware_header.hpp"
#include "panonav/route/sampler_pixels.hpp"
#include "runs/recording.hpp"
#include "runs/web_folder.hpp"

namespace panonav::command {

namespace {

struct ExportArguments {
  std::string memory;
  std::optional<std::string> out;
  std::optional<std::string> web;
  std::optional<std::string> pictures;  ///< recording of which the page shows pictures
  std::optional<std::string> firmware;
  std::optional<std::string> name;    ///< route of the firmware
  std::optional<std::string> camera;  ///< camera file of the firmware
};

/// Lists the values that the data set does not have, each with the reason.
std::string list_missing_values(const MemoryExport& done, const MemoryFile& memory) {
  std::vector<std::string> missing;
  if (!done.positions && memory.info().views_with_position > 0 &&
      read_length_unit(memory) == LengthUnit::view_steps) {
    missing.emplace_back(
        "positions and headings (they are in view steps, and a data set has metres: panonav "
        "scale)");
  } else if (!done.positions) {
    missing.emplace_back("positions and headings (no view has a position)");
  } else if (!done.headings) {
    missing.emplace_back("headings (no view has one)");
  }
  if (!done.stamps) missing.emplace_back("stamps (not all views have one)");
  return join_texts(missing);
}

void print_export(const MemoryExport& done, const MemoryFile& memory, const std::string& out,
                  Session& session) {
  const auto info = memory.info();
  session.print(session.bold(format_count(done.views, "view")) + " of " + memory.path().string() +
                " in " + out +
                ": names, poses and stamps in views.csv, signatures in signatures.npy");
  if (done.pictures == 0) {
    session.print(
        info.thumbnails == 0
            ? "No images were written, because the memory has no thumbnails. memorise cannot read "
              "this folder."
            : "No images were written, because the thumbnails are too small for the memory's " +
                  std::to_string(memory.header().shape.components) +
                  " components or were not made by panonav. memorise cannot read this folder.");
    return;
  }
  session.print("Data set with " + format_count(done.pictures, "image") +
                " made from the thumbnails" +
                (done.enlarged ? ", enlarged to the size of the memory's panoramas; fine detail is "
                                 "lost, and signatures differ slightly from the memory's"
                               : "") +
                ".");
  if (done.pictures < done.views) {
    session.print(format_count(done.views - done.pictures, "view") +
                  " without a thumbnail left out of the data set.");
  }
  if (done.renamed > 0) {
    session.print(format_count(done.renamed, "image") +
                  " with other names than their views, because file names cannot contain "
                  "the names of these views; views.csv lists both names.");
  }
  const std::string missing = list_missing_values(done, memory);
  if (!missing.empty()) {
    session.print("The data set does not contain " + missing +
                  "; views.csv lists all known values.");
  }
  const bool more = info.links + info.maps + info.routes > 0;
  if (more) session.print("Links, maps and routes are not exported.");
  session.suggest({"panonav", "memorise", "NEW.panonav", out, "--config", out + "/memorise.toml"},
                  "To make a memory of this folder:");
}

/// Writes the page that localises pictures in a browser.
ExitCode export_web(const ExportArguments& arguments, Session& session) {
  const auto memory = MemoryFile::open(arguments.memory, Access::read_only);
  const auto page = find_web_page();
  std::optional<Dataset> recording;
  if (arguments.pictures) {
    recording = open_recording(*arguments.pictures, PictureArguments{}, memory, session);
  }
  Progress progress(session, "drawing", recording ? recording->entries.size() : 0);
  const WebFolder done =
      write_web_folder(memory, page, recording ? &*recording : nullptr, *arguments.web,
                       session.executor(), [&] { progress.advance(); });
  progress.clear();
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", arguments.memory},
                                         {"folder", *arguments.web},
                                         {"views", done.views},
                                         {"pictures", done.pictures},
                                         {"thumbnails", done.thumbnails},
                                         {"bytes", done.bytes}}));
    return ExitCode::done;
  }
  session.print(session.bold(*arguments.web) + " is a page for " +
                format_count(done.views, "view") + " of " + arguments.memory + ", " +
                format_fixed(static_cast<double>(done.bytes) / 1e6, 1) + " MB");
  if (done.pictures + done.thumbnails == 0) {
    session.print(
        "It shows no pictures, because the memory has no thumbnails. To show those of a "
        "recording, use --pictures RECORDING.");
  }
  if (!has_narrow_features(memory)) {
    session.print(
        "It takes 360 degree images alone. For photos of phones, memorise the recording with "
        "--narrow.");
  }
  session.print(
      "Put the folder on a web server (https), or try it here: python3 -m http.server -d " +
      quote_for_shell(*arguments.web) + ", then open http://localhost:8000");
  return ExitCode::done;
}

/// Returns the pixels at which pictures of the camera are sampled for snapshots of this chain.
std::vector<std::uint16_t> read_sampler_pixels(const std::string& camera,
                                               const SnapshotChain& chain) {
  if (!chain.elevations()) {
    throw ContractError("elevations of the chain", "unknown",
                        "known, to sample pictures of a camera; record the route with "
                        "--elevation-deg or a mirror camera");
  }
  try {
    return make_sampler_pixels(
        read_camera(camera).camera, *chain.elevations(),
        {.rows = chain.shape().rows, .components = chain.shape().components});
  } catch (const ContractError& error) {
    throw FileError(camera, error.what());
  }
}

/// Writes a route as constant arrays for the firmware of a small robot.
ExitCode export_firmware(const ExportArguments& arguments, Session& session) {
  const auto memory = MemoryFile::open(arguments.memory, Access::read_only);
  const std::string name = find_route_name(memory, arguments.name);
  const SnapshotChain chain = memory.chain(name).value();
  std::vector<std::uint16_t> pixels;
  if (arguments.camera) pixels = read_sampler_pixels(*arguments.camera, chain);
  write_file(*arguments.firmware, format_firmware_header(chain, pixels));
  const std::uint64_t chain_bytes = memory.route_bytes(name);
  const std::size_t sampler_bytes = pixels.size() * sizeof(std::uint16_t);
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", arguments.memory},
                                         {"file", *arguments.firmware},
                                         {"route", name},
                                         {"snapshots", chain.snapshots()},
                                         {"chain_bytes", chain_bytes},
                                         {"sampler_bytes", sampler_bytes}}));
    return ExitCode::done;
  }
  session.print(session.bold(*arguments.firmware) + " holds the route " + name + ": " +
                format_count(chain.snapshots(), "snapshot") + ", " +
                format_count(chain_bytes, "byte") + " as panonav_chain" +
                (pixels.empty() ? ""
                                : ", and " + format_count(sampler_bytes, "byte") +
                                      " of pixels as panonav_sampler"));
  if (pixels.empty()) {
    session.print("To add the pixels at which pictures are sampled, use --camera FILE.");
  }
  return ExitCode::done;
}

ExitCode export_all(const ExportArguments& arguments, Session& session) {
  if (arguments.firmware) return export_firmware(arguments, session);
  if (arguments.web) return export_web(arguments, session);
  const std::string& out = *arguments.out;
  const auto memory = MemoryFile::open(arguments.memory, Access::read_only);
  Progress progress(session, "exporting", static_cast<std::size_t>(memory.info().views));
  const MemoryExport done =
      export_memory(memory, out, session.executor(), [&] { progress.advance(); });
  progress.clear();
  if (!session.json()) {
    print_export(done, memory, out, session);
    return ExitCode::done;
  }
  session.print(json_line(ordered_json{{"memory", arguments.memory},
                                       {"folder", out},
                                       {"views", done.views},
                                       {"images", done.pictures},
                                       {"renamed", done.renamed},
                                       {"enlarged", done.enlarged},
                                       {"positions", done.positions},
                                       {"headings", done.headings},
                                       {"stamps", done.stamps}}));
  return ExitCode::done;
}

Run declare_export(Arguments& arguments) {
  auto values = std::make_shared<ExportArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.option("-o,--out FOLDER", values->out,
                   "Write a data set into this folder, which must be new or empty");
  arguments.option("--web FOLDER", values->web,
                   "Instead, write a page that localises pictures in a browser into this folder, "
                   "which must be new or empty");
  arguments.option("--pictures RECORDING", values->pictures,
                   "With --web: show the places by the images of the recording from which the "
                   "memory was made; default: by the thumbnails of the memory");
  arguments.option("--firmware FILE", values->firmware,
                   "Instead, write a chain of snapshots (route record --method chain, home learn) "
                   "as constant arrays into this C header, for the firmware of a small robot");
  arguments.option("--name NAME", values->name,
                   "With --firmware: name of the route; needed if the memory contains several");
  arguments.option("--camera FILE", values->camera,
                   "With --firmware: camera of the small robot, whose pictures have at most 65,536 "
                   "pixels; adds the pixels at which its pictures are sampled");
  arguments.declare_outputs({"--out", "--web", "--firmware"});
  arguments.reject_options_unless(
      {"--pictures"}, [values] { return values->web.has_value(); }, "without --web");
  arguments.reject_options_unless(
      {"--name", "--camera"}, [values] { return values->firmware.has_value(); },
      "without --firmware");
  return [values](Session& session) {
    if (int{values->out.has_value()} + int{values->web.has_value()} +
            int{values->firmware.has_value()} !=
        1) {
      throw UsageError("export needs one of --out FOLDER, --web FOLDER and --firmware FILE");
    }
    return export_all(*values, session);
  };
}

}  // namespace

Verb export_verb() {
  return {
      "export",
      VerbGroup::memory,
      "Export a memory as a data set, a page or firmware arrays",
      "A memory stores its images only as thumbnails. The verb enlarges these thumbnails to "
      "panoramas that panonav memorise can read. The files views.csv and signatures.npy "
      "contain the poses and signatures of all views without loss. Links, maps and routes are "
      "not exported. With --web, the folder is a page instead: a browser localises pictures in "
      "it by itself and sends them nowhere; put it on any web server. If the export is "
      "interrupted, no folder is written. With --firmware, the result is the route that a small "
      "robot follows by ChainPilot, without a file system.",
      "  panonav export office.panonav -o office_views\n"
      "  panonav memorise again.panonav office_views --config office_views/memorise.toml\n"
      "  panonav export office.panonav --web office_page\n"
      "  panonav export walk.panonav --firmware walk.h --name home",
      declare_export};
}

}  // namespace panonav::command
