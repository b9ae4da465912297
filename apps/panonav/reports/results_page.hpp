#pragma once

#include <filesystem>
#include <string>

#include "lab/reporting/results_document.hpp"
#include "lab/reproduction.hpp"
#include "runs/reproduced_paper.hpp"

namespace panonav::command {

/// Writes index.html of the experiments of one paper. Throws FileError.
void write_paper_page(const std::filesystem::path& folder, const ReproducedPaper& paper,
                      const std::string& lead, const lab::Reproduction& reproduction);

/// Writes index.html of all papers; the page of each paper is in the folder of its name. Throws
/// FileError.
void write_results_page(const std::filesystem::path& folder, const lab::ResultsDocument& document);

}  // namespace panonav::command
