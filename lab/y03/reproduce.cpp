#include <string>
#include <string_view>
#include <vector>

#include "lab/reproduction.hpp"
#include "lab/reproduction_stages.hpp"
#include "lab/y03/experiments.hpp"
#include "panonav/core/error.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

RouteReproductionOptions quick_run(RouteReproductionOptions options) {
  options.scenes = 2;
  options.swept = 1;
  options.runs = 2;
  return options;
}

Reproduction reproduce_y03(const RouteReproductionOptions& options, Executor& executor,
                           const ReproductionProgress& progress) {
  require(options.scenes >= 2, "scenes", options.scenes, ">= 2");
  require(options.swept >= 1 && options.swept <= options.scenes, "swept", options.swept,
          "1 to scenes");
  require(options.runs >= 2, "runs", options.runs, ">= 2");
  make_folder(options.out);
  Reproduction result;
  const double drives = 3.0 * options.scenes;
  const double routes = 3.0 * options.runs;
  double share = 1.0;
  RouteExperiments y03{options, executor, result};
  std::vector<ReproductionStage> stages;
  stages.push_back({"drives across a path", drives, [&] {
                      y03.reproduce_lab_drives([&](std::string_view name, double at) {
                        if (progress) progress(name, share * at);
                      });
                    }});
  stages.push_back({"routes through loop", routes, [&] { y03.reproduce_loop_routes(); }});
  for (const std::string& world : simulation::worlds_in(options.data)) {
    stages.push_back(
        {"routes through " + world, routes, [&y03, world] { y03.reproduce_world_routes(world); }});
  }
  if (simulation::has_data(options.data, "sussex_route")) {
    stages.push_back({"a real route", 1.0, [&] { y03.reproduce_real_route(); }});
  }
  double all = 0.0;
  for (const ReproductionStage& stage : stages) all += stage.cost;
  share = drives / all;
  run_stages(stages, progress);
  return result;
}

}  // namespace panonav::lab
