#include <algorithm>

#include "cli/verbs.hpp"
#include "runs/reproduce_all.hpp"
#include "runs/reproduced_paper.hpp"

namespace panonav::command {

namespace {

// "-0.056 (..)  holds", a line each.
void print_rows(const lab::Reproduction& reproduction, Session& session) {
  for (const lab::ResultRow& row : reproduction.rows) {
    std::string line = "  " + row.what + ": " + session.strong(lab::shown_figure(row));
    if (row.target) {
      line +=
          "  " + (row.holds() ? session.good("holds")
                              : session.bad("DOES NOT HOLD") + ", missed " + lab::miss_text(row));
    }
    session.print(line);
  }
}

ExitCode reproduce(const ReproduceArguments& wanted, Session& session) {
  if (wanted.paper == "all") return reproduce_all(wanted, session);
  const auto papers = reproduced_papers();
  const auto paper = std::ranges::find(papers, wanted.paper, &ReproducedPaper::name);
  if (paper == papers.end()) {
    std::string allowed;
    for (const ReproducedPaper& one : papers) {
      allowed.append(one.name).append(" (").append(one.subject).append("), ");
    }
    throw OptionError("PAPER is '" + wanted.paper + "'; allowed: " + allowed + "all");
  }
  refuse_meaningless(*paper, wanted);
  const std::string out = wanted.out.value_or("reproduction/" + wanted.paper);
  const lab::Reproduction result = reproduce_paper(*paper, wanted, out, session);
  if (session.json()) {
    const std::string json = to_json(result.rows);
    session.print(json.substr(0, json.size() - 1));
    return ExitCode::done;
  }
  print_rows(result, session);
  const lab::TargetCount count = lab::count_targets(result.rows);
  session.print(std::to_string(result.rows.size()) + " rows, " +
                std::to_string(count.judged - count.held) +
                " of them miss their target; pictures and tables: " +
                (std::filesystem::path(out) / "index.html").string());
  return ExitCode::done;
}

Run declare_reproduce(Arguments& arguments) {
  auto wanted = std::make_shared<ReproduceArguments>();
  std::vector<std::string> papers;
  std::string names;
  for (const auto& paper : reproduced_papers()) {
    papers.emplace_back(paper.name);
    names.append(paper.name).append(", ");
  }
  papers.emplace_back("all");
  arguments.positional("PAPER", wanted->paper, names + "or all", std::move(papers));
  arguments.option("-o,--out FOLDER", wanted->out,
                   "Folder for the report (default: reproduction/PAPER; all: reproduction)");
  arguments.flag("--quick", wanted->quick, "A smoke run: few scenes, few questions or runs");
  arguments.flag("--continue", wanted->continues,
                 "all: continue a run of the same options that was stopped; papers that are "
                 "finished are not run again");
  const auto m04 = lab::default_options("m04");
  const auto m03 = lab::default_options("m03");
  const auto s06 = lab::default_options("s06");
  const auto f11 = lab::default_options("f11");
  const auto y03 = lab::default_options("y03");
  const auto navigation = lab::default_options("navigation");
  const auto elsewhere = lab::default_options("elsewhere");
  const auto defaults = [](auto elsewhere_value, auto f11_value, auto m03_value, auto m04_value,
                           auto navigation_value, auto s06_value, auto y03_value) {
    return " (default: " + std::to_string(elsewhere_value) + " for elsewhere, " +
           std::to_string(f11_value) + " for f11, " + std::to_string(m03_value) + " for m03, " +
           std::to_string(m04_value) + " for m04, " + std::to_string(navigation_value) +
           " for navigation, " + std::to_string(s06_value) + " for s06, " +
           std::to_string(y03_value) + " for y03";
  };
  const auto fallback = [](int value) { return " (default: " + std::to_string(value); };
  arguments.option("--seed", wanted->seed,
                   "First of the scene seeds" +
                       defaults(elsewhere.seed, f11.seed, m03.seed, m04.seed, navigation.seed,
                                s06.seed, y03.seed) +
                       ")");
  arguments.option("--scenes", wanted->scenes, 1,
                   "Variants of the scene" +
                       defaults(elsewhere.scenes, f11.scenes, m03.scenes, m04.scenes,
                                navigation.scenes, s06.scenes, y03.scenes) +
                       ")");
  arguments.option("--queries", wanted->queries, 1,
                   "m04: questions in each" + fallback(m04.queries) + "); elsewhere: the same" +
                       fallback(elsewhere.queries) + ")");
  arguments.option("--runs", wanted->runs, 2,
                   "elsewhere: homing runs and missions in each place" + fallback(elsewhere.runs) +
                       "); m04: missions of figure 18 in each kind of place" + fallback(m04.runs) +
                       "); m03: runs in each variant of an office" + fallback(m03.runs) +
                       "); f11: paths in each Gazebo world" + fallback(f11.runs) +
                       "); navigation: missions in each kind of place" + fallback(navigation.runs) +
                       "); y03: runs along routes of 60 m in each place" + fallback(y03.runs) +
                       ")");
  arguments.option("--rows", wanted->rows, 1,
                   "elsewhere, m03, m04: rows of the views" + fallback(m03.rows) + ")");
  arguments.option("--data FOLDER", wanted->data,
                   "elsewhere, f11, m03, navigation, s06, y03: folder with the recordings and "
                   "Gazebo worlds (default: the environment's PANONAV_DATA; without it they are "
                   "left out)");
  const auto parts = lab::tracking_reproduction_parts();
  arguments.choice("--only", wanted->only, {parts.begin(), parts.end()},
                   "m03: this part of the experiments (default: all)");
  arguments.uncommon({"--queries", "--rows", "--only"});
  return [wanted](Session& session) { return reproduce(*wanted, session); };
}

}  // namespace

Verb reproduce_verb() {
  return {"reproduce", "Run the experiments of a paper: published figures beside ours",
          "The verb writes pictures, results.json, results.md and index.html into the folder. The "
          "full run "
          "of a paper takes minutes. `all` runs every paper in a folder of its own and writes one "
          "table of all; targets that are missed are results and do not change the exit code.",
          "  panonav reproduce m03\n  panonav reproduce m04 --quick --json -o smoke\n"
          "  panonav reproduce y03 -o routes --data DATA\n"
          "  panonav reproduce all -o results --data DATA\n"
          "  panonav reproduce all -o results --data DATA --continue",
          declare_reproduce};
}

}  // namespace panonav::command
