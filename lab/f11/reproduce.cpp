#include <string>
#include <vector>

#include "lab/f11/experiments.hpp"
#include "lab/reproduction_stages.hpp"
#include "panonav/core/error.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

MappingReproductionOptions quick_run(MappingReproductionOptions options) {
  options.scenes = 2;
  options.runs = 1;
  options.max_views = 1000;
  options.columns = 256;
  return options;
}

Reproduction reproduce_f11(const MappingReproductionOptions& options, Executor& executor,
                           const ReproductionProgress& progress) {
  require(options.scenes >= 2, "scenes", options.scenes, ">= 2");
  require(options.runs >= 1, "runs", options.runs, ">= 1");
  require(options.views >= 10, "views", options.views, ">= 10");
  require(options.max_views >= 100, "max_views", options.max_views, ">= 100");
  require(options.columns >= 132, "columns", options.columns, ">= 132, twice the components");
  make_folder(options.out);

  Reproduction result;
  std::vector<ReproductionStage> stages{
      {"first set", 6.0 * options.scenes, [&] { reproduce_first_set(options, executor, result); }},
      {"second set", 10.0 * options.scenes,
       [&] { reproduce_second_set(options, executor, result); }},
      {"time", 1.0, [&] { measure_step_time(options, executor, result); }},
      {"identical doors", 15.0, [&] { reproduce_identical_doors(options, executor, result); }}};
  for (const std::string& name : simulation::worlds_in(options.data)) {
    stages.push_back({name, 10.0 * options.runs,
                      [&, name] { reproduce_mapping_in_world(options, name, executor, result); }});
  }
  stages.push_back(
      {"recordings", 5.0, [&] { reproduce_mapped_recordings(options, executor, result); }});
  stages.push_back({"large maps", 0.02 * options.max_views,
                    [&] { measure_large_maps(options, executor, result); }});

  run_stages(stages, progress);
  return result;
}

}  // namespace panonav::lab
