#pragma once

#include <span>
#include <string>
#include <vector>

#include "lab/reporting/table.hpp"

namespace panonav::lab {

/// The rows of a group of experiments.
struct PaperResults {
  std::string paper;  ///< short: "m04"
  std::string title;
  std::vector<ResultRow> rows;
};

/// The results of all papers, as `reproduce all` writes them.
struct ResultsDocument {
  std::string version;  ///< of the program that made it
  std::string command;  ///< that makes it, as typed
  std::vector<PaperResults> papers;
};

/// Counts the targets of all papers.
[[nodiscard]] TargetCount count_targets(const ResultsDocument& document);

/// Lists every row that misses its target, a sentence each: what, ours against the target, and why.
[[nodiscard]] std::vector<std::string> list_misses(const ResultsDocument& document);

/// Moves the rows with a target before the others; keeps their order. Returns their number.
std::size_t move_targets_first(std::vector<ResultRow>& rows);

/// Returns one object: `version`, `command`, `targets`, `held`, `papers` (by name, an array of rows
/// each).
[[nodiscard]] std::string to_json(const ResultsDocument& document);
/// Returns Markdown: title, command, counts, the rows that do not hold with their reasons, then for
/// each paper a table of its rows with a target, and how many rows the JSON document holds.
[[nodiscard]] std::string to_markdown(const ResultsDocument& document);

}  // namespace panonav::lab
