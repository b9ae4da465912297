#pragma once

#include "cli/verb.hpp"
#include "runs/reproduced_paper.hpp"

namespace panonav::command {

class Session;

/// Runs the experiments of a paper and writes its tables, pictures and page into `out`;
/// results.json is written last, so that it is there only when all is. Tells how far it is.
[[nodiscard]] lab::Reproduction reproduce_paper(const ReproducedPaper& paper,
                                                const ReproduceArguments& arguments,
                                                const std::filesystem::path& out, Session& session);

/// Runs all papers, each in a folder of its own, and writes the table of all results. With
/// `continues`, results of papers that an earlier run with the same options and version finished
/// are read instead. Throws OptionError if the earlier run had other options.
ExitCode reproduce_all(const ReproduceArguments& arguments, Session& session);

}  // namespace panonav::command
