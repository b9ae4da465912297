#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string_view>
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
  std::optional<int> runs;
  std::optional<int> rows;
  std::optional<std::string> data;
  std::optional<std::string> only;
};

/// What the report says of a paper.
struct PaperText {
  std::string title;
  std::string lead;
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

void write_page(const std::filesystem::path& out, const PaperText& text,
                const Reproduction& result) {
  std::size_t judged = 0;
  std::size_t held = 0;
  for (const auto& row : result.rows) {
    judged += row.target ? 1 : 0;
    held += row.target && row.holds() ? 1 : 0;
  }
  ReportPage page(text.title, text.lead);
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
  page.write(out);
}

/// The folder with recordings and worlds: as asked for, else where the environment says.
std::filesystem::path data_folder(const ReproduceArguments& wanted) {
  if (wanted.data) {
    if (!std::filesystem::is_directory(*wanted.data)) {
      throw FileError(*wanted.data, "there is no such folder");
    }
    return *wanted.data;
  }
  const char* const folder = std::getenv("PANONAV_DATA");
  return folder == nullptr ? "" : folder;
}

void refuse(bool given, const std::string& flag, const ReproduceArguments& wanted) {
  if (given) throw OptionError(flag + " has no meaning for " + wanted.paper);
}

/// Where they are to begin and how many variants, as wanted; intervals need two of them.
template <typename Options>
void set_scenes(const ReproduceArguments& wanted, Options& options) {
  if (wanted.quick) options = quick_run(options);
  if (wanted.seed) options.seed = *wanted.seed;
  if (!wanted.scenes) return;
  options.scenes = *wanted.scenes;
  if (options.scenes < 2) {
    throw OptionError("--scenes is '" + std::to_string(options.scenes) + "'; allowed for " +
                      wanted.paper + ": from 2");
  }
}

std::pair<PaperText, Reproduction> run_m04(const ReproduceArguments& wanted, Session& session,
                                           const ReproductionProgress& progress) {
  refuse(wanted.runs.has_value(), "--runs", wanted);
  refuse(wanted.data.has_value(), "--data", wanted);
  refuse(wanted.only.has_value(), "--only", wanted);
  ReproductionOptions options{.out = wanted.out};
  set_scenes(wanted, options);
  if (wanted.queries) options.queries = *wanted.queries;
  if (wanted.rows) options.rows = *wanted.rows;
  const PaperText text{
      "The localisation experiments of [M04]",
      "Menegatti, Maeda, Ishiguro 2004, run on " + std::to_string(options.scenes) +
          " simulated offices with a 25 cm grid of reference views, " +
          std::to_string(options.queries) +
          " questions in each. Published figures beside ours. Few offices and questions "
          "give wide intervals, and rows may then miss their target by chance."};
  return {text, reproduce_m04(options, session.executor(), progress)};
}

std::pair<PaperText, Reproduction> run_m03(const ReproduceArguments& wanted, Session& session,
                                           const ReproductionProgress& progress) {
  refuse(wanted.queries.has_value(), "--queries", wanted);
  TrackingReproductionOptions options{.out = wanted.out, .data = data_folder(wanted)};
  if (wanted.quick) options = quick_run(options);
  if (wanted.seed) options.seed = *wanted.seed;
  if (wanted.scenes) options.scenes = *wanted.scenes;
  if (wanted.runs) options.runs = *wanted.runs;
  if (wanted.only) options.only = *wanted.only;
  if (wanted.rows) options.rows = *wanted.rows;
  const PaperText text{
      "Monte-Carlo localisation: the experiments of [M03]",
      "Menegatti, Zoccarato, Pagello, Ishiguro 2003, run in " + std::to_string(options.scenes) +
          " simulated offices with a 25 cm grid of reference views, " +
          std::to_string(options.variants * options.runs) +
          " runs in each, and what its authors announced: a corridor of identical doors and "
          "the open air; Gazebo worlds and recordings where they are at hand. Published figures "
          "beside ours. Few runs give wide intervals, and rows may then miss their target by "
          "chance."};
  return {text, reproduce_m03(options, session.executor(), progress)};
}

std::pair<PaperText, Reproduction> run_s06(const ReproduceArguments& wanted, Session& session,
                                           const ReproductionProgress& progress) {
  refuse(wanted.runs.has_value(), "--runs", wanted);
  refuse(wanted.queries.has_value(), "--queries", wanted);
  refuse(wanted.rows.has_value(), "--rows", wanted);
  refuse(wanted.only.has_value(), "--only", wanted);
  HomingReproductionOptions options{.out = wanted.out, .data = data_folder(wanted)};
  set_scenes(wanted, options);
  const PaperText text{
      "Visual homing: the experiments of [S06]",
      "Stürzl, Mallot 2006, run in " + std::to_string(options.scenes) +
          " simulated toy house arenas, each recorded twice with different noise and slightly "
          "different light, headings at random; pictures are of the first arena. Runs home and "
          "chains of "
          "snapshots in rooms and Gazebo worlds. Published figures beside ours."};
  return {text, reproduce_s06(options, session.executor(), progress)};
}

std::pair<PaperText, Reproduction> run_f11(const ReproduceArguments& wanted, Session& session,
                                           const ReproductionProgress& progress) {
  refuse(wanted.queries.has_value(), "--queries", wanted);
  refuse(wanted.rows.has_value(), "--rows", wanted);
  refuse(wanted.only.has_value(), "--only", wanted);
  MappingReproductionOptions options{.out = wanted.out, .data = data_folder(wanted)};
  set_scenes(wanted, options);
  if (wanted.runs) options.runs = *wanted.runs;
  const PaperText text{
      "Visual odometry and topological maps: the experiments of [F11]",
      "Fernandez, Paya, Reinoso, Amoros 2011, run in " + std::to_string(options.scenes) +
          " variants of two simulated places; loops closed, which its authors left to later work; "
          "a corridor of identical doors, Gazebo worlds and recordings where they are at hand, "
          "maps of up to " +
          std::to_string(options.most_views) + " views. Published figures beside ours."};
  return {text, reproduce_f11(options, session.executor(), progress)};
}

std::pair<PaperText, Reproduction> run_y03(const ReproduceArguments& wanted, Session& session,
                                           const ReproductionProgress& progress) {
  refuse(wanted.queries.has_value(), "--queries", wanted);
  refuse(wanted.rows.has_value(), "--rows", wanted);
  refuse(wanted.only.has_value(), "--only", wanted);
  RouteReproductionOptions options{.out = wanted.out, .data = data_folder(wanted)};
  set_scenes(wanted, options);
  if (wanted.runs) options.runs = *wanted.runs;
  options.swept = std::min(options.swept, options.scenes);
  const PaperText text{
      "Route panoramas: the experiments of [Y03]",
      "Yagi, Imai, Yachida 2003, run in " + std::to_string(options.scenes) +
          " variants of a simulated lab seen through a mirror camera with its noise; pictures are "
          "of the first. Then routes of 60 m, each recorded once and repeated in closed loop, " +
          std::to_string(options.runs) +
          " runs in each place, and a real route; Gazebo worlds and the recording where they are "
          "at hand. Published figures beside ours."};
  return {text, reproduce_y03(options, session.executor(), progress)};
}

std::pair<PaperText, Reproduction> run_navigation(const ReproduceArguments& wanted,
                                                  Session& session,
                                                  const ReproductionProgress& progress) {
  refuse(wanted.queries.has_value(), "--queries", wanted);
  refuse(wanted.rows.has_value(), "--rows", wanted);
  refuse(wanted.only.has_value(), "--only", wanted);
  NavigationReproductionOptions options{.out = wanted.out, .data = data_folder(wanted)};
  set_scenes(wanted, options);
  if (wanted.runs) options.runs = *wanted.runs;
  if (options.runs < options.scenes) {
    throw OptionError("--runs is '" + std::to_string(options.runs) +
                      "'; allowed for navigation: from --scenes (" +
                      std::to_string(options.scenes) + ")");
  }
  const PaperText text{
      "Going somewhere over the visual memory",
      "Menegatti, Maeda, Ishiguro 2004, section 3.5 and figure 18, and what its authors left to "
      "later work: " +
          std::to_string(options.runs) +
          " missions from random starts to random goals in each kind of place, " +
          std::to_string(options.scenes) +
          " variants of each. The robot sees pictures and feels what is in its way; it knows "
          "neither where it is nor where its references were taken."};
  return {text, reproduce_navigation(options, session.executor(), progress)};
}

constexpr std::array<std::string_view, 6> papers{"f11", "m03", "m04", "navigation", "s06", "y03"};

void reproduce_paper(const ReproduceArguments& wanted, Session& session) {
  if (std::ranges::find(papers, wanted.paper) == papers.end()) {
    throw OptionError(
        "PAPER is '" + wanted.paper +
        "'; allowed: f11 (visual odometry and maps), m03 (Monte-Carlo "
        "localisation), m04 (localisation), navigation ([M04] figure 18 and beyond), s06 "
        "(homing), y03 (routes), all");
  }
  Progress progress("reproduce " + wanted.paper, 100);
  std::size_t shown_percent = 0;
  const ReproductionProgress report = [&](std::string_view, double fraction) {
    const auto percent = static_cast<std::size_t>(100.0 * fraction);
    if (percent > shown_percent) progress.advance(percent - shown_percent);
    shown_percent = std::max(shown_percent, percent);
  };
  const auto [text, result] = wanted.paper == "m04" ? run_m04(wanted, session, report)
                              : wanted.paper == "navigation"
                                  ? run_navigation(wanted, session, report)
                              : wanted.paper == "m03" ? run_m03(wanted, session, report)
                              : wanted.paper == "f11" ? run_f11(wanted, session, report)
                              : wanted.paper == "y03" ? run_y03(wanted, session, report)
                                                      : run_s06(wanted, session, report);
  progress.clear();
  const std::string json = to_json(result.rows);
  const std::filesystem::path out(wanted.out);
  write_file(out / "results.json", json);
  write_file(out / "results.md", to_markdown(result.rows));
  write_page(out, text, result);
  if (session.json()) {
    session.print(json.substr(0, json.size() - 1));
    return;
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
}

ExitCode reproduce(const ReproduceArguments& wanted, Session& session) {
  if (wanted.paper != "all") {
    reproduce_paper(wanted, session);
    return ExitCode::done;
  }
  refuse(wanted.only.has_value(), "--only", wanted);
  // One after the other, each in a folder of its own.
  for (const std::string_view paper : papers) {
    ReproduceArguments one = wanted;
    one.paper = paper;
    one.out = (std::filesystem::path(wanted.out) / paper).string();
    // What means nothing to a paper.
    if (paper == "m04" || paper == "s06") one.runs = std::nullopt;
    if (paper == "m04") one.data = std::nullopt;
    if (paper != "m04") one.queries = std::nullopt;
    if (paper != "m03" && paper != "m04") one.rows = std::nullopt;
    reproduce_paper(one, session);
  }
  return ExitCode::done;
}

Run declare(Arguments& arguments) {
  auto wanted = std::make_shared<ReproduceArguments>();
  arguments.positional("PAPER", wanted->paper, "f11, m03, m04, navigation, s06, y03 or all");
  arguments.option("-o,--out", wanted->out, "Folder for the report (default: reproduction)");
  arguments.flag("--quick", wanted->quick, "A smoke run: few scenes, few questions or runs");
  const ReproductionOptions m04;
  const TrackingReproductionOptions m03;
  const HomingReproductionOptions s06;
  const MappingReproductionOptions f11;
  const RouteReproductionOptions y03;
  const NavigationReproductionOptions navigation;
  const auto defaults = [](auto f11_value, auto m03_value, auto m04_value, auto navigation_value,
                           auto s06_value, auto y03_value) {
    return " (default: " + std::to_string(f11_value) + " for f11, " + std::to_string(m03_value) +
           " for m03, " + std::to_string(m04_value) + " for m04, " +
           std::to_string(navigation_value) + " for navigation, " + std::to_string(s06_value) +
           " for s06, " + std::to_string(y03_value) + " for y03";
  };
  const auto fallback = [](int value) { return " (default: " + std::to_string(value); };
  arguments.option("--seed", wanted->seed,
                   "First of the scene seeds" +
                       defaults(f11.seed, m03.seed, m04.seed, navigation.seed, s06.seed, y03.seed) +
                       ")");
  arguments.option(
      "--scenes", wanted->scenes, 1,
      "Variants of the scene" +
          defaults(f11.scenes, m03.scenes, m04.scenes, navigation.scenes, s06.scenes, y03.scenes) +
          ")");
  arguments.option("--queries", wanted->queries, 1,
                   "m04: questions in each" + fallback(m04.queries) + "; from 1)");
  arguments.option("--runs", wanted->runs, 2,
                   "m03: runs in each variant of an office" + fallback(m03.runs) +
                       "); f11: paths in each Gazebo world" + fallback(f11.runs) +
                       "); navigation: missions in each kind of place" + fallback(navigation.runs) +
                       "); y03: runs along routes of 60 m in each place" + fallback(y03.runs) +
                       "); from 2");
  arguments.option("--rows", wanted->rows, 1,
                   "m03, m04: rows of the views" + fallback(m03.rows) + "; from 1)");
  arguments.option(
      "--data", wanted->data,
      "f11, m03, navigation, s06, y03: folder with the recordings and Gazebo worlds (default: the "
      "environment's "
      "PANONAV_DATA; without it they are left out)");
  const auto parts = tracking_reproduction_parts();
  arguments.choice("--only", wanted->only, {parts.begin(), parts.end()},
                   "m03: this part of the experiments (default: all)");
  return [wanted](Session& session) { return reproduce(*wanted, session); };
}

}  // namespace

Verb reproduce_verb() {
  return {"reproduce", "Run the experiments of a paper: published figures beside ours",
          "Writes pictures, results.json, results.md and index.html into the folder. The full run "
          "takes some minutes.",
          "  panonav reproduce m03\n  panonav reproduce m04 --quick --json -o smoke\n"
          "  panonav reproduce s06 -o homing\n  panonav reproduce f11 -o maps\n  panonav reproduce "
          "y03 -o routes\n  panonav reproduce navigation --data DATA",
          declare};
}

}  // namespace panonav::command
