#include "reporting/results_document.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace panonav {

namespace {

std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

// Characters that Markdown would take for its own.
std::string plain(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (std::string_view("\\`*_[]<>").find(c) != std::string_view::npos) result += '\\';
    result += c;
  }
  return result;
}

}  // namespace

TargetCount count_targets(const ResultsDocument& document) {
  TargetCount all;
  for (const PaperResults& paper : document.papers) {
    const TargetCount count = count_targets(paper.rows);
    all.judged += count.judged;
    all.held += count.held;
  }
  return all;
}

std::size_t put_targets_first(std::vector<ResultRow>& rows) {
  const auto others = std::stable_partition(
      rows.begin(), rows.end(), [](const ResultRow& row) { return row.target.has_value(); });
  return static_cast<std::size_t>(others - rows.begin());
}

std::vector<std::string> miss_lines(const ResultsDocument& document) {
  std::vector<std::string> lines;
  for (const PaperResults& paper : document.papers) {
    for (const ResultRow& row : paper.rows) {
      if (!row.target || row.holds()) continue;
      lines.push_back(paper.paper + ": " + row.what + ": " + shown_figure(row) + ", target " +
                      shown_target(row) + ": missed " + miss_text(row) + ".");
    }
  }
  return lines;
}

std::string to_json(const ResultsDocument& document) {
  const TargetCount count = count_targets(document);
  nlohmann::ordered_json papers = nlohmann::ordered_json::object();
  for (const PaperResults& paper : document.papers) {
    papers[paper.paper] = nlohmann::ordered_json::parse(to_json(paper.rows));
  }
  const nlohmann::ordered_json object{{"version", document.version},
                                      {"command", document.command},
                                      {"targets", count.judged},
                                      {"held", count.held},
                                      {"papers", papers}};
  return object.dump(1) + "\n";
}

std::string to_markdown(const ResultsDocument& document) {
  const TargetCount count = count_targets(document);
  std::size_t rows = 0;
  for (const PaperResults& paper : document.papers) rows += paper.rows.size();
  std::string text = "# Results: published and measured\n\n";
  text += "Written by panonav " + document.version + ":\n\n    " + document.command + "\n\n";
  text += "**" + std::to_string(count.held) + " of " +
          counted(count.judged, "target holds", "targets hold") + ".** " +
          std::to_string(rows - count.judged) + " more figures are reported without a target.\n\n";
  text += "| experiments | targets | hold | figures without a target |\n|---|---|---|---|\n";
  for (const PaperResults& paper : document.papers) {
    const TargetCount of_paper = count_targets(paper.rows);
    text += "| [" + plain(paper.title) + "](#" + paper.paper + ") | " +
            std::to_string(of_paper.judged) + " | " + std::to_string(of_paper.held) + " | " +
            std::to_string(paper.rows.size() - of_paper.judged) + " |\n";
  }
  text += "\n## Rows that do not hold\n\n";
  const auto misses = miss_lines(document);
  for (const std::string& line : misses) text += "- " + plain(line) + "\n";
  if (misses.empty()) text += "None.\n";
  for (const PaperResults& paper : document.papers) {
    std::vector<ResultRow> ordered = paper.rows;
    const std::size_t judged = put_targets_first(ordered);
    const std::span<const ResultRow> all(ordered);
    text += "\n<a name=\"" + paper.paper + "\"></a>\n\n## " + plain(paper.title) + "\n\n";
    text += "`panonav reproduce " + paper.paper + "`\n\n";
    if (judged > 0) text += to_markdown(all.first(judged)) + "\n";
    if (judged == all.size()) continue;
    text += "<details><summary>" + counted(all.size() - judged, "figure", "figures") +
            " without a target</summary>\n\n" + to_markdown(all.subspan(judged)) + "\n</details>\n";
  }
  return text;
}

}  // namespace panonav
