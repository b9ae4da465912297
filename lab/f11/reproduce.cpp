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
  MappingExperiments f11{options, executor, result};
  std::vector<ReproductionStage> stages{
      {"first set", 6.0 * options.scenes, [&] { f11.reproduce_first_set(); }},
      {"second set", 10.0 * options.scenes, [&] { f11.reproduce_second_set(); }},
      {"time", 1.0, [&] { f11.measure_step_time(); }},
      {"identical doors", 15.0, [&] { f11.reproduce_identical_doors(); }}};
  for (const std::string& name : simulation::worlds_in(options.data)) {
    stages.push_back({name, 10.0 * options.runs, [&f11, name] { f11.reproduce_world(name); }});
  }
  stages.push_back({"recordings", 5.0, [&] { f11.reproduce_recordings(); }});
  stages.push_back({"large maps", 0.02 * options.max_views, [&] { f11.measure_large_maps(); }});
  run_stages(stages, progress);
  return result;
}

}  // namespace panonav::lab
