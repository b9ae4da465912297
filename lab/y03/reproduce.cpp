#include <memory>
#include <string>

#include "lab/y03/experiments.hpp"
#include "panonav/core/error.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

ReproductionPlan plan_y03(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 2}, {"runs", options.runs, 2}});
  require(options.swept >= 1 && options.swept <= options.scenes, "swept", options.swept,
          "1 to scenes");
  const double routes = 3.0 * options.runs;
  const RouteExperiments y03{context};
  ReproductionPlan plan{{3.0 * options.scenes, [=] { y03.reproduce_lab_drives(); }},
                        {routes, [=] { y03.reproduce_loop_routes(); }}};
  for (const std::string& world : simulation::worlds_in(options.data)) {
    plan.push_back({routes, [=] { y03.reproduce_world_routes(world); }});
  }
  if (simulation::has_data(options.data, "sussex_route")) {
    plan.push_back({1.0, [=] { y03.reproduce_real_route(); }});
  }
  return plan;
}

}  // namespace panonav::lab
