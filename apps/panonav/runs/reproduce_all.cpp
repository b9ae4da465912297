#include "runs/reproduce_all.hpp"

#include <algorithm>
#include <cstddef>
#include <system_error>
#include <vector>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "lab/reporting/results_document.hpp"
#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "reports/results_page.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

constexpr const char* results_file_name = "results.json";
constexpr const char* run_file_name = "run.json";
// Larger than any file that a run writes.
constexpr std::size_t max_file_bytes = 64 << 20;

std::string read_text(const fs::path& path) {
  const auto bytes = read_file(path, max_file_bytes);
  return {bytes.begin(), bytes.end()};
}

// Returns version and options on which the results depend.
ordered_json make_run_record(const ReproduceArguments& arguments) {
  const fs::path data = find_data_folder(arguments);
  ordered_json record;
  record["version"] = PANONAV_VERSION;
  record["quick"] = arguments.quick;
  record["seed"] = to_json_or_null(arguments.seed);
  record["scenes"] = to_json_or_null(arguments.scenes);
  record["queries"] = to_json_or_null(arguments.queries);
  record["runs"] = to_json_or_null(arguments.runs);
  record["rows"] = to_json_or_null(arguments.rows);
  record["optics"] = to_json_or_null(arguments.optics);
  record["data"] =
      data.empty() ? ordered_json(nullptr) : ordered_json(fs::weakly_canonical(data).string());
  return record;
}

void require_same_run(const fs::path& out, const ordered_json& record) {
  const std::string file = (out / run_file_name).string();
  if (!fs::exists(out / run_file_name)) {
    throw FileError(file, "does not exist: there is no run to continue; leave out --continue");
  }
  const auto earlier = ordered_json::parse(read_text(out / run_file_name), nullptr, false);
  if (!earlier.is_object()) throw FileError(file, "is not a complete JSON object");
  for (const auto& [field, value] : record.items()) {
    if (!earlier.contains(field)) throw FileError(file, field + " is missing");
    const ordered_json& before = earlier[field];
    if (before.is_structured()) throw FileError(file, field + " is an " + before.type_name());
    if (before == value) continue;
    throw OptionError("--continue: the run in " + out.string() + " has " + field + " " +
                      before.dump() + ", this run " + value.dump() + "; allowed: the same");
  }
}

// Returns the command line without paths of this machine.
std::string format_command_line(const ReproduceArguments& arguments) {
  std::string line = "panonav reproduce all";
  if (arguments.quick) line += " --quick";
  const auto add = [&](const std::string& flag, const auto& value) {
    if (value) line += " " + flag + " " + std::to_string(*value);
  };
  add("--seed", arguments.seed);
  add("--scenes", arguments.scenes);
  add("--queries", arguments.queries);
  add("--runs", arguments.runs);
  add("--rows", arguments.rows);
  if (!find_data_folder(arguments).empty()) line += " --data DATA";
  return line;
}

// Removes the options that have no meaning for the paper.
ReproduceArguments make_paper_arguments(const ReproducedPaper& paper,
                                        ReproduceArguments arguments) {
  arguments.paper = paper.name;
  if (!paper.queries) arguments.queries = std::nullopt;
  if (!paper.runs) arguments.runs = std::nullopt;
  if (!paper.rows) arguments.rows = std::nullopt;
  return arguments;
}

void remove_file(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  if (error) throw FileError(path.string(), "cannot be removed: " + error.message());
}

}  // namespace

lab::Reproduction reproduce_paper(const ReproducedPaper& paper, const ReproduceArguments& arguments,
                                  const fs::path& out, Session& session) {
  Progress progress(session, "reproduce " + std::string(paper.name), 100);
  std::size_t shown_percent = 0;
  const lab::ReproductionProgress report = [&](double fraction) {
    const auto percent = static_cast<std::size_t>(100.0 * fraction);
    if (percent > shown_percent) progress.advance(percent - shown_percent);
    shown_percent = std::max(shown_percent, percent);
  };
  remove_file(out / results_file_name);
  const lab::ReproductionOptions options = make_reproduction_options(paper, arguments, out);
  lab::Reproduction result = lab::reproduce(paper.name, options, session.executor(), report);
  progress.clear();
  const std::string name(paper.name);
  write_file(out / "results.md",
             lab::to_markdown({.version = PANONAV_VERSION,
                               .command = "panonav reproduce " + name,
                               .papers = {{name, std::string(paper.title), result.rows}}}));
  write_paper_page(out, paper, describe_experiments(paper, options), result);
  write_file(out / results_file_name, to_json(result.rows));
  return result;
}

ExitCode reproduce_all(const ReproduceArguments& arguments, Session& session) {
  if (arguments.only) throw OptionError("--only cannot be used with all");
  require_enough_scenes(arguments);  // before files of an earlier run are removed
  const fs::path out(arguments.out.value_or("reproduction"));
  const ordered_json record = make_run_record(arguments);
  const auto papers = list_reproduced_papers();
  if (arguments.continues) {
    require_same_run(out, record);
  } else {
    std::error_code error;
    fs::create_directories(out, error);
    if (error) throw FileError(out.string(), "cannot be created: " + error.message());
    // Removes results of an earlier run, so that --continue does not take them for results of this
    // run.
    for (const ReproducedPaper& paper : papers) remove_file(out / paper.name / results_file_name);
    write_file(out / run_file_name, record.dump(1) + "\n");
  }
  remove_file(out / results_file_name);

  const auto report = [&](const ReproducedPaper& paper, const std::vector<lab::ResultRow>& rows,
                          std::string_view note) {
    if (session.json()) return;
    const lab::TargetCount count = lab::count_targets(rows);
    session.print("  " + session.bold(paper.name) + ": " + std::to_string(count.held) + " of " +
                  std::to_string(count.judged) + " targets met" + std::string(note));
  };
  lab::ResultsDocument document{
      .version = PANONAV_VERSION, .command = format_command_line(arguments), .papers = {}};
  for (const ReproducedPaper& paper : papers) {
    const fs::path file = out / paper.name / results_file_name;
    const bool is_done = fs::exists(file);
    if (!is_done) {
      static_cast<void>(reproduce_paper(paper, make_paper_arguments(paper, arguments),
                                        out / paper.name, session));
    }
    lab::PaperResults results{std::string(paper.name), std::string(paper.title),
                              lab::rows_from_json(read_text(file), file.string())};
    report(paper, results.rows, is_done ? " (finished by an earlier run)" : "");
    document.papers.push_back(std::move(results));
  }
  const std::string json = to_json(document);
  write_file(out / "results.md", lab::to_markdown(document));
  write_results_page(out, document);
  write_file(out / results_file_name, json);
  if (session.json()) {
    session.print(json.substr(0, json.size() - 1));
    return ExitCode::done;
  }
  for (const std::string& line : lab::list_misses(document)) {
    session.print(session.red("MISSED") + "  " + line);
  }
  const lab::TargetCount count = lab::count_targets(document);
  session.print(session.bold(std::to_string(count.held) + " of " + std::to_string(count.judged)) +
                " targets met; table of results: " + (out / "index.html").string());
  return ExitCode::done;
}

}  // namespace panonav::command
