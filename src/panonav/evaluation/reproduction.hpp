#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/evaluation/table.hpp"

namespace panonav {

struct ReproductionOptions {
  std::filesystem::path out;  ///< folder for pictures; made when it is not there
  bool quick = false;         ///< a smoke run: fewer scenes and queries
  std::uint64_t seed = 1;
};

struct ReproductionPicture {
  std::filesystem::path file;  ///< within `out`
  std::string caption;         ///< what a person should see in it
};

struct Reproduction {
  std::vector<ResultRow> rows;
  std::vector<ReproductionPicture> pictures;
};

/// Told what is being done and how far the whole is, 0 .. 1.
using ReproductionProgress = std::function<void(std::string_view stage, double fraction)>;

/// The localisation experiments of [M04] (figures 4 to 10) and table 1 of [M03], over several scene
/// variants.
[[nodiscard]] Reproduction reproduce_m04(const ReproductionOptions& options, Executor& executor,
                                         const ReproductionProgress& progress = {});

}  // namespace panonav
