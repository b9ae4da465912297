#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav_fleet/memory_synchronisation.hpp"

namespace panonav::command {

namespace {

struct SynchroniseArguments {
  std::string memory;
  std::string server;
  std::optional<std::pair<double, double>> around;
  std::optional<double> within_m;
};

fleet::SynchronisationOptions make_options(const SynchroniseArguments& arguments) {
  fleet::SynchronisationOptions options;
  if (arguments.around.has_value() != arguments.within_m.has_value()) {
    throw UsageError(arguments.around ? "--around needs --within-m" : "--within-m needs --around");
  }
  if (arguments.around) {
    options.areas =
        fleet::areas_around(arguments.around->first, arguments.around->second, *arguments.within_m);
  }
  return options;
}

std::string describe_report(const fleet::SynchronisationReport& report) {
  const std::array<std::pair<std::size_t, const char*>, 12> counts{{
      {report.uploaded, "uploaded"},
      {report.downloaded, "downloaded"},
      {report.adopted, "already in both"},
      {report.updated_on_server, "changed on the server"},
      {report.updated_in_file, "changed in the file"},
      {report.removed_on_server, "removed on the server"},
      {report.removed_in_file, "removed from the file"},
      {report.left, "kept only on the server, because they lie outside the areas of the file"},
      {report.renamed, "renamed, because other views had the same names"},
      {report.links_uploaded, "links changed on the server"},
      {report.links_downloaded, "links changed in the file"},
      {report.withheld, "changes not uploaded, because this login has no permission"},
  }};
  std::string text;
  for (const auto& [count, what] : counts) {
    if (count == 0) continue;
    text += (text.empty() ? "" : "; ") + std::to_string(count) + " " + what;
  }
  return text.empty() ? "no changes" : text;
}

ExitCode synchronise(const SynchroniseArguments& arguments, Session& session) {
  const fleet::SynchronisationReport report = [&] {
    std::optional<Progress> progress;
    std::size_t expected = 0;
    return fleet::synchronise_memory(arguments.memory, arguments.server, make_options(arguments),
                                     [&](std::size_t total) {
                                       if (!progress || std::exchange(expected, total) != total) {
                                         progress.emplace(session, "synchronising", total);
                                       }
                                       progress->advance();
                                     });
  }();
  {
    MemoryFile file = MemoryFile::open(arguments.memory, Access::read_write);
    learn_and_store_models(file);
  }
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", arguments.memory},
                                         {"server", arguments.server},
                                         {"views", report.views},
                                         {"uploaded", report.uploaded},
                                         {"downloaded", report.downloaded},
                                         {"adopted", report.adopted},
                                         {"updated_on_server", report.updated_on_server},
                                         {"updated_in_file", report.updated_in_file},
                                         {"removed_on_server", report.removed_on_server},
                                         {"removed_in_file", report.removed_in_file},
                                         {"renamed", report.renamed},
                                         {"conflicts", report.conflicts},
                                         {"withheld", report.withheld},
                                         {"left", report.left},
                                         {"links_uploaded", report.links_uploaded},
                                         {"links_downloaded", report.links_downloaded},
                                         {"restored", report.restored},
                                         {"seconds", report.seconds}}));
    return ExitCode::done;
  }
  session.print(arguments.memory + " and " + arguments.server + ": " + describe_report(report) +
                ". " + arguments.memory + " holds " + format_count(report.views, "view") + ".");
  if (report.conflicts > 0) {
    session.note((report.conflicts == 1
                      ? "1 change of this file was"
                      : format_count(report.conflicts, "change") + " of this file were") +
                 " discarded, because others had changed or removed the same views first");
  }
  if (report.restored) {
    session.note(
        "the server had lost acknowledged views; the views of this file were uploaded again");
  }
  return ExitCode::done;
}

Run declare_synchronise(Arguments& arguments) {
  auto values = std::make_shared<SynchroniseArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file of the robot, new or existing");
  arguments.positional("ADDRESS", values->server,
                       "Address of a memory on a server, new or existing");
  arguments.option("--around", "X_M Y_M", values->around,
                   "Keep in the file only views that have no position or are in areas (squares of "
                   "10 m) near this position");
  arguments.option(
      "--within-m", values->within_m,
      "Largest distance in metres from the position of --around to an area that is kept");
  arguments.explain_interruption(
      "Changes exchanged so far are kept. To continue, run the same command again.");
  return [values](Session& session) { return synchronise(*values, session); };
}

}  // namespace

Verb synchronise_verb() {
  return {
      "synchronise",
      VerbGroup::several_robots,
      "Synchronise a memory file with a memory on a server",
      "The verb uploads new views and changes from the file, and downloads the changes that other "
      "robots uploaded. Changes concern views with their images and features, poses, names, "
      "deletions and links. If two robots change the same view, the change that the server "
      "received first is used, but a deletion is always used. If two robots replace the same view, "
      "both new views are stored. If two different views have the same name, one of them is "
      "renamed ROBOT/NAME. Maps, routes and models are not synchronised. If the connection breaks, "
      "run the same command again to continue (docs/scale.md).",
      "  panonav synchronise robot.panonav 'postgresql://robots.example/panonav?memory=office'\n"
      "  panonav synchronise robot.panonav ADDRESS --around 12.5 40 --within-m 60 --json",
      declare_synchronise};
}

}  // namespace panonav::command
