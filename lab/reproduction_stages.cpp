#include "lab/reproduction_stages.hpp"

#include <system_error>

#include "panonav/core/error.hpp"

namespace panonav::lab {

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw FileError(folder.string(), "cannot be made: " + error.message());
}

void run_stages(std::span<const ReproductionStage> stages, const ReproductionProgress& progress) {
  double all = 0.0;
  for (const ReproductionStage& stage : stages) all += stage.cost;
  double done = 0.0;
  for (const ReproductionStage& stage : stages) {
    if (progress) progress(stage.name, done / all);
    stage.run();
    done += stage.cost;
  }
  if (progress) progress("done", 1.0);
}

}  // namespace panonav::lab
