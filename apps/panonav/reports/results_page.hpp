#pragma once

#include <filesystem>
#include <string>

#include "experiments/reproduction.hpp"
#include "reporting/results_document.hpp"
#include "verbs/reproduced_paper.hpp"

namespace panonav::command {

/// Writes index.html of the experiments of one paper. Throws FileError.
void write_paper_page(const std::filesystem::path& folder, const ReproducedPaper& paper,
                      const std::string& lead, const Reproduction& reproduction);

/// Writes index.html of all papers, whose own pages lie in a folder each of their name. Throws
/// FileError.
void write_results_page(const std::filesystem::path& folder, const ResultsDocument& document);

}  // namespace panonav::command
