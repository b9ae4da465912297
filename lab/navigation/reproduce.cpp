#include <string>
#include <vector>

#include "lab/navigation/experiments.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

ReproductionPlan plan_navigation(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 2}, {"runs", options.runs, options.scenes}});
  NavigationExperiments navigation{context};
  ReproductionPlan plan;
  std::vector<std::string> scenes = simulation::worlds_in(options.data);
  scenes.insert(scenes.begin(), {"loop", "corridor"});
  for (const std::string& scene : scenes) {
    plan.push_back({6.0, [=] { navigation.reproduce_drive_missions(scene); }});
  }
  plan.push_back({4.0, [=] { navigation.reproduce_tours(); }});
  plan.push_back({3.0, [=] { navigation.reproduce_route_missions(); }});
  plan.push_back({2.0, [=] { navigation.reproduce_blocked_missions(); }});
  return plan;
}

}  // namespace panonav::lab
