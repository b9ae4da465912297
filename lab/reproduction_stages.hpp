#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "lab/reproduction.hpp"

namespace panonav::lab {

/// A part of the experiments of a paper.
struct ReproductionStage {
  std::string name;
  double cost = 1.0;  ///< relative, for the progress
  std::function<void()> run;
};

/// Throws FileError.
void make_folder(const std::filesystem::path& folder);

/// One after the other; tells how far the whole is by their costs.
void run_stages(std::span<const ReproductionStage> stages, const ReproductionProgress& progress);

}  // namespace panonav::lab
