#include "experiments/reproduction_stages.hpp"

namespace panonav {

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

}  // namespace panonav
