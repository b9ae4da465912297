#include <algorithm>

#include "cli/option_values.hpp"
#include "cli/verbs.hpp"
#include "runs/reproduce_all.hpp"
#include "runs/reproduced_paper.hpp"

namespace panonav::command {

namespace {

/// Prints a line for each row: "  WHAT: FIGURE", and after it, if there is a target, "  holds" or
/// "  MISSED: by DIFFERENCE, REASON".
void print_rows(const lab::Reproduction& reproduction, Session& session) {
  for (const lab::ResultRow& row : reproduction.rows) {
    std::string line = "  " + row.what + ": " + session.bold(lab::format_figure(row));
    if (row.target) {
      line += "  " + (row.holds() ? session.green("holds")
                                  : session.red("MISSED") + ": " + lab::explain_miss(row));
    }
    session.print(line);
  }
}

ExitCode reproduce(const ReproduceArguments& arguments, Session& session) {
  if (arguments.paper == "all") return reproduce_all(arguments, session);
  const auto papers = list_reproduced_papers();
  const auto paper = std::ranges::find(papers, arguments.paper, &ReproducedPaper::name);
  if (paper == papers.end()) {
    std::string allowed;
    for (const ReproducedPaper& one : papers) {
      allowed.append(one.name).append(" (").append(one.subject).append("), ");
    }
    throw OptionError("PAPER is '" + arguments.paper + "'; allowed: " + allowed + "all");
  }
  reject_meaningless_options(*paper, arguments);
  const std::string out = arguments.out.value_or("reproduction/" + arguments.paper);
  const lab::Reproduction result = reproduce_paper(*paper, arguments, out, session);
  if (session.json()) {
    const std::string json = to_json(result.rows);
    session.print(json.substr(0, json.size() - 1));
    return ExitCode::done;
  }
  print_rows(result, session);
  const lab::TargetCount count = lab::count_targets(result.rows);
  session.print(
      session.bold(std::to_string(count.held) + " of " + std::to_string(count.judged)) +
      " targets met, " + std::to_string(result.rows.size()) +
      " rows; images and tables: " + (std::filesystem::path(out) / "index.html").string());
  return ExitCode::done;
}

/// Returns " (default: 3 for elsewhere, 2 for f11, ...)".
std::string format_defaults(const auto& option) {
  std::vector<std::string> values;
  for (const char* paper :
       {"elsewhere", "f11", "m03", "m04", "navigation", "routes", "s06", "y03"}) {
    values.push_back(std::to_string(lab::default_options(paper).*option) + " for " + paper);
  }
  return " (default: " + join_texts(values) + ")";
}

/// Formats the meaning of an option for each paper that has it, with its default.
std::string format_meanings(int lab::ReproductionOptions::*option,
                            std::initializer_list<std::pair<std::string, std::string>> meanings) {
  std::string text;
  for (const auto& [papers, meaning] : meanings) {
    const std::string last = papers.substr(papers.find_last_of(' ') + 1);
    text += (text.empty() ? "For " : "; for ") + papers + ": " + meaning +
            " (default: " + std::to_string(lab::default_options(last).*option) + ")";
  }
  return text;
}

Run declare_reproduce(Arguments& arguments) {
  auto values = std::make_shared<ReproduceArguments>();
  std::vector<std::string> papers;
  std::string names;
  for (const auto& paper : list_reproduced_papers()) {
    papers.emplace_back(paper.name);
    names.append(paper.name).append(", ");
  }
  papers.emplace_back("all");
  arguments.positional("PAPER", values->paper,
                       "Key of a paper in README.md or of other experiments: " + names + "or all",
                       std::move(papers));
  arguments.option("-o,--out FOLDER", values->out,
                   "Folder for the report (default: reproduction/PAPER; for all: reproduction)");
  arguments.flag("--quick", values->quick, "Run a short test with few scenes and few runs");
  arguments.flag("--continue", values->continues,
                 "For all: continue an interrupted run that had the same options; finished "
                 "papers are not run again");
  using Options = lab::ReproductionOptions;
  arguments.option("--seed", values->seed,
                   "First random seed of the scenes" + format_defaults(&Options::seed));
  arguments.option("--scenes", values->scenes, 1,
                   "Variants of the scene" + format_defaults(&Options::scenes));
  arguments.option(
      "--queries", values->queries, 1,
      format_meanings(&Options::queries, {{"m04", "queries in each variant of the scene"},
                                          {"elsewhere", "queries in each place"}}));
  arguments.option(
      "--runs", values->runs, 2,
      format_meanings(&Options::runs, {{"elsewhere", "drives home and missions in each place"},
                                       {"m04", "missions of figure 18 in each kind of place"},
                                       {"m03", "runs in each variant of an office"},
                                       {"f11", "paths in each Gazebo world"},
                                       {"navigation", "missions in each kind of place"},
                                       {"routes", "routes of each length in each place"},
                                       {"y03", "drives along routes of 60 m in each place"}}));
  arguments.option("--rows", values->rows, 1,
                   format_meanings(&Options::rows, {{"elsewhere, m03, m04", "rows of the views"}}));
  arguments.option(
      "--data FOLDER", values->data,
      "For elsewhere, f11, m03, navigation, routes, s06, y03: folder with the recordings and "
      "Gazebo worlds (default: the environment variable PANONAV_DATA; if it is not "
      "set, these experiments are skipped)");
  const auto parts = lab::tracking_reproduction_parts();
  arguments.choice("--only", values->only, {parts.begin(), parts.end()},
                   "For m03: run only this part of the experiments (default: all parts)");
  arguments.choice("--optics", values->optics, {"mirror", "panorama"},
                   "For m03, m04, navigation, s06: unwarp the views from images of a mirror "
                   "camera, or render them directly, which takes a third to a sixth of the time "
                   "(default: panorama)");
  arguments.hide_from_help({"--queries", "--rows", "--only", "--optics"});
  arguments.declare_outputs({"--out"});
  arguments.explain_interruption(
      "Reports of finished papers are kept. Run the same command again; with all, add --continue.");
  return [values](Session& session) { return reproduce(*values, session); };
}

}  // namespace

Verb reproduce_verb() {
  return {"reproduce",
          VerbGroup::experiments,
          "Run the experiments of a paper and compare the results",
          "The verb writes images, results.json, results.md and index.html into the folder. The "
          "full run of a paper takes minutes. 'all' runs every paper in a separate folder and "
          "writes a table with all results. The exit code is 0 even if a result misses its target.",
          "  panonav reproduce m03\n  panonav reproduce m04 --quick --json -o smoke\n"
          "  panonav reproduce y03 -o routes --data DATA\n"
          "  panonav reproduce all -o results --data DATA\n"
          "  panonav reproduce all -o results --data DATA --continue",
          declare_reproduce};
}

}  // namespace panonav::command
