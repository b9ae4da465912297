#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "lab/navigation/experiments.hpp"
#include "lab/reproduction.hpp"
#include "lab/reproduction_stages.hpp"
#include "panonav/core/error.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

NavigationReproductionOptions quick_run(NavigationReproductionOptions options) {
  options.scenes = 2;
  options.runs = 2;
  return options;
}

Reproduction reproduce_navigation(const NavigationReproductionOptions& options, Executor& executor,
                                  const ReproductionProgress& progress) {
  require(options.scenes >= 2, "scenes", options.scenes, ">= 2");
  require(options.runs >= options.scenes, "runs", options.runs, ">= scenes");
  make_folder(options.out);
  Reproduction result;
  NavigationExperiments navigation{options, executor, result};
  std::vector<ReproductionStage> stages;
  std::vector<std::string> drives{"loop", "corridor"};
  std::ranges::copy(simulation::worlds_in(options.data), std::back_inserter(drives));
  for (const std::string& scene : drives) {
    stages.push_back({"missions in " + scene, 6.0,
                      [&navigation, scene] { navigation.reproduce_drive_missions(scene); }});
  }
  stages.push_back({"tours", 4.0, [&] { navigation.reproduce_tours(); }});
  stages.push_back({"routes", 3.0, [&] { navigation.reproduce_route_missions(); }});
  stages.push_back({"blocked edges", 2.0, [&] { navigation.reproduce_blocked_missions(); }});
  run_stages(stages, progress);
  return result;
}

}  // namespace panonav::lab
