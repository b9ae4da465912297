#pragma once

#include <span>
#include <string>
#include <vector>

#include "lab/reporting/table.hpp"

namespace panonav::lab {

/// The result rows of one group of experiments.
struct PaperResults {
  std::string paper;  ///< short: "m04"
  std::string title;
  std::vector<ResultRow> rows;
};

/// The results of all papers, as `reproduce all` writes them.
struct ResultsDocument {
  std::string version;  ///< of the program that made it
  std::string command;  ///< command line that makes it
  std::vector<PaperResults> papers;
};

/// Counts the targets in the results of all papers.
[[nodiscard]] TargetCount count_targets(const ResultsDocument& document);

/// Lists all rows that miss their target, one sentence per row: what, our value, the target, and
/// why it was missed.
[[nodiscard]] std::vector<std::string> list_misses(const ResultsDocument& document);

/// Moves the rows with a target to the front, keeping the order within both groups. Returns the
/// number of rows with a target.
std::size_t move_targets_first(std::vector<ResultRow>& rows);

/// Returns one JSON object: `version`, `command`, `targets`, `held`, and `papers` (an array of rows
/// by the name of each paper).
[[nodiscard]] std::string to_json(const ResultsDocument& document);
/// Returns Markdown: title, command, counts, the rows that miss their target with reasons, then a
/// table per paper of its rows with a target, and the number of rows of the JSON document.
[[nodiscard]] std::string to_markdown(const ResultsDocument& document);

}  // namespace panonav::lab
