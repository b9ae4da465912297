#include "cli/verbs.hpp"
#include "panonav/pipeline/memory_export.hpp"

namespace panonav::command {

namespace {

struct ExportArguments {
  std::string memory;
  std::string out;
};

std::string lost_columns(const MemoryExport& done) {
  std::string lost;
  for (const auto& [is_there, what] : {std::pair{done.positions, "positions"},
                                       {done.headings, "headings"},
                                       {done.stamps, "stamps"}}) {
    if (!is_there) lost += (lost.empty() ? "" : ", ") + std::string(what);
  }
  return lost;
}

void print_export(const MemoryExport& done, const MemoryFile& memory, const std::string& out,
                  Session& session) {
  const auto info = memory.info();
  session.print(session.bold(std::to_string(done.views)) + " views of " + memory.path().string() +
                " in " + out +
                ": names, poses and stamps in views.csv, signatures in signatures.npy");
  if (done.pictures == 0) {
    session.print(
        info.thumbnails == 0
            ? "No images: the memory holds no thumbnails. memorise cannot read this folder."
            : "No images: the thumbnails are too small for the memory's " +
                  std::to_string(memory.header().shape.components) +
                  " components, or are not panonav's. memorise cannot read this folder.");
    return;
  }
  session.print("A data set of " + std::to_string(done.pictures) + " images, the thumbnails" +
                (done.enlarged ? ", enlarged to the size of the memory's panoramas: fine detail is "
                                 "lost, and signatures differ a little from the memory's"
                               : "") +
                ".");
  if (done.pictures < done.views) {
    session.print(std::to_string(done.views - done.pictures) +
                  " views without a thumbnail are not in it.");
  }
  if (done.renamed > 0) {
    session.print(std::to_string(done.renamed) +
                  " images are not named as their views, whose names cannot be those of files; "
                  "views.csv has both.");
  }
  const std::string lost = lost_columns(done);
  if (!lost.empty()) {
    session.print("Not in the data set, as not every view has them: " + lost +
                  "; those that are known are in views.csv.");
  }
  const bool more = info.links + info.maps + info.routes > 0;
  if (more) session.print("Links, maps and routes are not exported.");
  session.suggest({"panonav", "memorise", out, "NEW.panonav", "--config", out + "/memorise.toml"},
                  "Back again:");
}

ExitCode export_all(const ExportArguments& arguments, Session& session) {
  const auto memory = MemoryFile::open(arguments.memory, Access::read_only);
  Progress progress(session, "exporting", static_cast<std::size_t>(memory.info().views));
  const MemoryExport done = export_memory(memory, arguments.out, [&] { progress.advance(); });
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
                            "Folder to write: a new or an empty one");
  arguments.writes({"--out"});
  return [values](Session& session) { return export_all(*values, session); };
}

}  // namespace

Verb export_verb() {
  return {
      "export", "Write views, poses, thumbnails and signatures of a memory as a data set",
      "Thumbnails are all that a memory keeps of its images; they become panoramas of the "
      "memory's size, which memorise takes back. views.csv and signatures.npy hold all views as "
      "they are. Links, maps and routes are not exported. The folder appears whole or not at all.",
      "  panonav export office.panonav -o office_views\n"
      "  panonav memorise office_views again.panonav --config office_views/memorise.toml",
      declare_export};
}

}  // namespace panonav::command
