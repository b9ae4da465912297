#include <cmath>
#include <memory>
#include <vector>

#include "arguments.hpp"
#include "panonav/core/error.hpp"
#include "panonav/evaluation/reproduction.hpp"
#include "panonav/io/atomic_file.hpp"
#include "report_page.hpp"
#include "session.hpp"
#include "verbs.hpp"

namespace panonav::command {

namespace {

struct ReproduceArguments {
  std::string paper;
  std::string out = "reproduction";
  bool quick = false;
  std::optional<std::uint64_t> seed;
  std::optional<int> scenes;
  std::optional<int> queries;
  std::optional<int> rows;
};

std::string shown(double value) {
  if (!std::isfinite(value)) return "none";  // nothing could be measured
  const double size = std::abs(value);
  return fixed(value, size >= 100.0 ? 0 : size >= 10.0 ? 1 : 3);
}

std::string shown(const ResultRow& row) {
  return shown(row.ours) + (row.unit.empty() ? "" : " " + row.unit);
}

/// "-" for none, one number where both ends are the same.
std::string shown(const std::optional<std::pair<double, double>>& interval) {
  if (!interval) return "-";
  const auto& [low, high] = *interval;
  return low == high ? shown(low) : shown(low) + " .. " + shown(high);
}

void write_page(const ReproductionOptions& options, const Reproduction& result) {
  std::size_t judged = 0;
  std::size_t held = 0;
  for (const auto& row : result.rows) {
    judged += row.target ? 1 : 0;
    held += row.target && row.holds() ? 1 : 0;
  }
  ReportPage page(
      "The localisation experiments of [M04]",
      "Menegatti, Maeda, Ishiguro 2004, run on " + std::to_string(options.scenes) +
          " simulated offices with a 25 cm grid of reference views, " +
          std::to_string(options.queries) +
          " questions in each. Published figures beside ours. Few offices and questions "
          "give wide intervals, and rows may then miss their target by chance.");
  page.figures({{std::to_string(held) + " of " + std::to_string(judged), "targets hold"},
                {std::to_string(result.rows.size() - judged), "more figures are reported"}});
  page.section("Published and measured");
  std::vector<std::vector<std::string>> rows;
  for (const auto& row : result.rows) {
    const std::string target =
        row.target ? std::string(row.target->comparison == Comparison::at_most ? "at most "
                                                                               : "at least ") +
                         shown(row.target->value)
                   : "reported";
    rows.push_back({row.what, shown(row.published), shown(row), shown(row.interval), target,
                    row.target ? (row.holds() ? "yes" : "NO") : "-"});
  }
  page.table({"what", "published", "ours", "95 % interval", "target", "holds"}, rows);
  page.section("Pictures");
  std::vector<ReportPicture> pictures;
  for (const auto& picture : result.pictures) {
    pictures.push_back({picture.file.string(), picture.caption});
  }
  page.pictures(pictures);
  page.write(options.out);
}

ExitCode reproduce(const ReproduceArguments& wanted, Session& session) {
  if (wanted.paper != "m04") {
    throw OptionError("PAPER is '" + wanted.paper +
                      "'; allowed: m04 (localisation; m03 f11 s06 y03 are to come)");
  }
  Progress progress("reproduce " + wanted.paper, 100);
  std::size_t shown_percent = 0;
  ReproductionOptions options{.out = wanted.out, .seed = wanted.seed.value_or(1)};
  if (wanted.quick) options = quick_run(options);
  if (wanted.scenes) options.scenes = *wanted.scenes;
  if (wanted.queries) options.queries = *wanted.queries;
  if (wanted.rows) options.rows = *wanted.rows;
  const Reproduction result =
      reproduce_m04(options, session.executor(), [&](std::string_view, double fraction) {
        const auto percent = static_cast<std::size_t>(100.0 * fraction);
        if (percent > shown_percent) progress.advance(percent - shown_percent);
        shown_percent = std::max(shown_percent, percent);
      });
  progress.clear();
  const std::string json = to_json(result.rows);
  const std::filesystem::path out(wanted.out);
  write_file(out / "results.json", json);
  write_file(out / "results.md", to_markdown(result.rows));
  write_page(options, result);
  if (session.json()) {
    session.print(json.substr(0, json.size() - 1));
    return ExitCode::done;
  }
  std::size_t failed = 0;
  for (const auto& row : result.rows) {
    std::string line = "  " + row.what + ": " + session.strong(shown(row));
    if (row.target) {
      line += row.holds() ? "  " + session.good("holds") : "  " + session.bad("DOES NOT HOLD");
      failed += row.holds() ? 0 : 1;
    }
    session.print(line);
  }
  session.print(
      std::to_string(result.rows.size()) + " rows, " + std::to_string(failed) +
      " of them miss their target; pictures and tables: " + (out / "index.html").string());
  return ExitCode::done;
}

Run declare(Arguments& arguments) {
  auto wanted = std::make_shared<ReproduceArguments>();
  arguments.positional("PAPER", wanted->paper, "m04");
  arguments.option("-o,--out", wanted->out, "Folder for the report (default: reproduction)");
  arguments.flag("--quick", wanted->quick, "A smoke run: two scenes, few queries");
  arguments.option("--seed", wanted->seed, "First of the scene seeds (default: 1)");
  const ReproductionOptions full;
  const auto in_full = [](int value) { return " (default: " + std::to_string(value); };
  arguments.option("--scenes", wanted->scenes, 2,
                   "Variants of the scene" + in_full(full.scenes) + "; from 2)");
  arguments.option("--queries", wanted->queries, 1,
                   "Questions in each" + in_full(full.queries) + "; from 1)");
  arguments.option("--rows", wanted->rows, 1,
                   "Rows of the views" + in_full(full.rows) + "; from 1)");
  return [wanted](Session& session) { return reproduce(*wanted, session); };
}

}  // namespace

Verb reproduce_verb() {
  return {"reproduce", "Run the experiments of a paper: published figures beside ours",
          "Writes pictures, results.json, results.md and index.html into the folder. The full run "
          "takes some minutes.",
          "  panonav reproduce m04\n  panonav reproduce m04 --quick --json -o smoke", declare};
}

}  // namespace panonav::command
