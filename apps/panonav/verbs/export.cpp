#include "cli/option_values.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/memory_export.hpp"

namespace panonav::command {

namespace {

struct ExportArguments {
  std::string memory;
  std::string out;
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

ExitCode export_all(const ExportArguments& arguments, Session& session) {
  const auto memory = MemoryFile::open(arguments.memory, Access::read_only);
  Progress progress(session, "exporting", static_cast<std::size_t>(memory.info().views));
  const MemoryExport done =
      export_memory(memory, arguments.out, session.executor(), [&] { progress.advance(); });
  progress.clear();
  if (!session.json()) {
    print_export(done, memory, arguments.out, session);
    return ExitCode::done;
  }
  session.print(json_line(ordered_json{{"memory", arguments.memory},
                                       {"folder", arguments.out},
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
  arguments.required_option("-o,--out FOLDER", values->out,
                            "New or empty folder; another one is refused");
  arguments.declare_outputs({"--out"});
  return [values](Session& session) { return export_all(*values, session); };
}

}  // namespace

Verb export_verb() {
  return {"export",
          VerbGroup::memory,
          "Export the views of a memory as a data set",
          "A memory stores its images only as thumbnails. The verb enlarges these thumbnails to "
          "panoramas that panonav memorise can read. The files views.csv and signatures.npy "
          "contain the poses and signatures of all views without loss. Links, maps and routes are "
          "not exported. If the export is interrupted, no folder is written.",
          "  panonav export office.panonav -o office_views\n"
          "  panonav memorise again.panonav office_views --config office_views/memorise.toml",
          declare_export};
}

}  // namespace panonav::command
