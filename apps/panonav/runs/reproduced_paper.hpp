#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "lab/reproduction.hpp"

namespace panonav::command {

/// The arguments of `reproduce`; unset ones have the paper's defaults.
struct ReproduceArguments {
  std::string paper;
  std::optional<std::string> out;  ///< empty: reproduction/PAPER, `reproduction` for all
  bool quick = false;
  bool continues = false;
  std::optional<std::uint64_t> seed;
  std::optional<int> scenes;
  std::optional<int> queries;
  std::optional<int> runs;
  std::optional<int> rows;
  std::optional<std::string> data;
  std::optional<std::string> only;
};

/// The experiments of a paper, and which options mean something to them.
struct ReproducedPaper {
  std::string_view name;
  std::string_view title;
  std::string_view subject;  ///< in a few words
  bool queries = false;
  bool runs = false;
  bool rows = false;
  bool data = false;
  bool only = false;
  bool single_scene = false;  ///< a single scene will do; else intervals need two
  /// Returns the first paragraph of the report: how much was run.
  std::string (*lead)(const lab::ReproductionOptions& options) = nullptr;
};

/// All, in the order in which `all` runs them.
[[nodiscard]] std::span<const ReproducedPaper> reproduced_papers();

/// Returns the options of the paper's experiments: its defaults, then what the caller set. Throws
/// OptionError, FileError.
[[nodiscard]] lab::ReproductionOptions reproduction_options(const ReproducedPaper& paper,
                                                            const ReproduceArguments& arguments,
                                                            const std::filesystem::path& out);

/// The folder with recordings and worlds: as asked for, else where the environment says; empty:
/// none. Throws FileError when there is no such folder.
[[nodiscard]] std::filesystem::path data_folder(const ReproduceArguments& arguments);

/// Throws OptionError when there are too few variants for `arguments.paper`: intervals need two.
void check_scenes(const ReproduceArguments& arguments);

/// Throws OptionError when an option is given that means nothing to the paper.
void reject_meaningless_options(const ReproducedPaper& paper, const ReproduceArguments& arguments);

}  // namespace panonav::command
