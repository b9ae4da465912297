#pragma once

#include <filesystem>
#include <string>

#include "lab/reporting/results_document.hpp"
#include "lab/reproduction.hpp"
#include "runs/reproduced_paper.hpp"

namespace panonav::command {

/// Writes index.html with the results of one paper. Throws FileError.
void write_paper_page(const std::filesystem::path& folder, const ReproducedPaper& paper,
                      const std::string& lead, const lab::Reproduction& reproduction);

/// Writes index.html with the results of all papers. The page of each paper is in the subfolder
/// with its name. Throws FileError.
void write_results_page(const std::filesystem::path& folder, const lab::ResultsDocument& document);

}  // namespace panonav::command
