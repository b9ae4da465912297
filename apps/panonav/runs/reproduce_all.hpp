#pragma once

#include "cli/verb.hpp"
#include "runs/reproduced_paper.hpp"

namespace panonav::command {

class Session;

/// Runs the experiments of a paper and writes tables, pictures and page into `out`. Writes
/// results.json last, so that it exists only if everything is complete. Shows the progress.
[[nodiscard]] lab::Reproduction reproduce_paper(const ReproducedPaper& paper,
                                                const ReproduceArguments& arguments,
                                                const std::filesystem::path& out, Session& session);

/// Runs all papers, each in a folder of its own, and writes the table of all results. With
/// `continues`, papers that an earlier run with the same options and version has finished are not
/// run again; their results are read. Throws OptionError if the earlier run had other options.
ExitCode reproduce_all(const ReproduceArguments& arguments, Session& session);

}  // namespace panonav::command
