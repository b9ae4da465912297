#include "lab/reporting/results_document.hpp"

#include <algorithm>
#include <locale>
#include <nlohmann/json.hpp>
#include <sstream>

namespace panonav::lab {

namespace {

std::string format_count(std::size_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

// Escapes the characters that have a special meaning in Markdown.
std::string escape_markdown(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (std::string_view("\\`*_[]<>|").find(c) != std::string_view::npos) result += '\\';
    result += c;
  }
  return result;
}

// Returns a Markdown list item, wrapped at word boundaries.
std::string make_list_item(const std::string& text) {
  constexpr std::size_t width = 120;
  std::string result = "-";
  std::size_t column = result.size();
  std::istringstream words(text);
  words.imbue(std::locale::classic());
  for (std::string word; words >> word;) {
    if (column + 1 + word.size() > width) {
      result += "\n ";
      column = 1;
    }
    result += " " + word;
    column += 1 + word.size();
  }
  return result + "\n";
}

// Returns one line of a Markdown table.
std::string make_table_line(std::span<const std::string> cells) {
  std::string line = "|";
  for (const std::string& cell : cells) line += " " + escape_markdown(cell) + " |";
  return line + "\n";
}

// Returns a Markdown table of the rows with a target.
std::string make_target_table(std::span<const ResultRow> rows) {
  std::string text = make_table_line(table_header()) + "|---|---|---|---|---|---|\n";
  for (const ResultRow& row : rows) {
    if (row.target) text += make_table_line(table_cells(row));
  }
  return text;
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

std::size_t move_targets_first(std::vector<ResultRow>& rows) {
  const auto others = std::stable_partition(
      rows.begin(), rows.end(), [](const ResultRow& row) { return row.target.has_value(); });
  return static_cast<std::size_t>(others - rows.begin());
}

std::vector<std::string> list_misses(const ResultsDocument& document) {
  std::vector<std::string> lines;
  for (const PaperResults& paper : document.papers) {
    for (const ResultRow& row : paper.rows) {
      if (!row.target || row.holds()) continue;
      lines.push_back(paper.paper + ": " + row.what + ": " + format_figure(row) + ", target " +
                      format_target(row) + ": missed " + explain_miss(row) + ".");
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
          format_count(count.judged, "target met", "targets met") + ".**\n\n";
  text += "| experiments | targets | met |\n|---|---|---|\n";
  for (const PaperResults& paper : document.papers) {
    const TargetCount of_paper = count_targets(paper.rows);
    text += "| [" + escape_markdown(paper.title) + "](#" + paper.paper + ") | " +
            std::to_string(of_paper.judged) + " | " + std::to_string(of_paper.held) + " |\n";
  }
  text += "\n## Targets that were not met\n\n";
  const auto misses = list_misses(document);
  for (const std::string& line : misses) text += make_list_item(escape_markdown(line));
  if (misses.empty()) text += "None.\n";
  for (const PaperResults& paper : document.papers) {
    text += "\n<a name=\"" + paper.paper + "\"></a>\n\n## " + escape_markdown(paper.title) + "\n\n";
    text += "`panonav reproduce " + paper.paper + "`\n\n";
    const bool is_judged = count_targets(paper.rows).judged > 0;
    text += is_judged ? make_target_table(paper.rows) : "No row has a target.\n";
  }
  text += "\n`results.json` holds " + format_count(rows, "row", "rows") +
          ", those without a target too.\n";
  return text;
}

}  // namespace panonav::lab
