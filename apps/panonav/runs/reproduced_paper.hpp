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
  std::optional<std::string> optics;  ///< "mirror" or "panorama"
};

/// The experiments of a paper, and the options that they use.
struct ReproducedPaper {
  std::string_view name;
  std::string_view title;
  std::string_view subject;  ///< short description
  bool queries = false;
  bool runs = false;
  bool rows = false;
  bool data = false;
  bool only = false;
  bool optics = false;
  bool allows_single_scene =
      false;  ///< one scene is enough; otherwise two are needed for intervals
  /// Returns the first paragraph of the report, with the number of scenes and runs.
  std::string (*lead)(const lab::ReproductionOptions& options) = nullptr;
};

/// Returns the first paragraph of the report on a paper: its lead, and the optics of its views.
[[nodiscard]] std::string describe_experiments(const ReproducedPaper& paper,
                                               const lab::ReproductionOptions& options);

/// Returns all papers, in the order in which `reproduce all` runs them.
[[nodiscard]] std::span<const ReproducedPaper> list_reproduced_papers();

/// Returns the options of the paper's experiments: its defaults, then what the caller set. Throws
/// OptionError, FileError.
[[nodiscard]] lab::ReproductionOptions make_reproduction_options(
    const ReproducedPaper& paper, const ReproduceArguments& arguments,
    const std::filesystem::path& out);

/// Returns the folder with recordings and worlds: that of --data, or else PANONAV_DATA; empty if
/// neither is set. Throws FileError if --data is no folder.
[[nodiscard]] std::filesystem::path find_data_folder(const ReproduceArguments& arguments);

/// Throws OptionError if --scenes is below 2, the minimum for confidence intervals.
void require_enough_scenes(const ReproduceArguments& arguments);

/// Throws OptionError if an option is set that the paper's experiments do not use.
void reject_meaningless_options(const ReproducedPaper& paper, const ReproduceArguments& arguments);

}  // namespace panonav::command
