#include <string>

#include "lab/f11/experiments.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

ReproductionPlan plan_f11(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 2},
                  {"runs", options.runs, 1},
                  {"views", options.views, 10},
                  {"max_views", options.max_views, 100},
                  {"columns", options.columns, 132}});  // twice the components
  MappingExperiments f11{context};
  ReproductionPlan plan{{6.0 * options.scenes, [=] { f11.reproduce_first_set(); }},
                        {10.0 * options.scenes, [=] { f11.reproduce_second_set(); }},
                        {1.0, [=] { f11.measure_step_time(); }},
                        {15.0, [=] { f11.reproduce_identical_doors(); }}};
  for (const std::string& name : simulation::worlds_in(options.data)) {
    plan.push_back({10.0 * options.runs, [=] { f11.reproduce_world(name); }});
  }
  plan.push_back({5.0, [=] { f11.reproduce_recordings(); }});
  plan.push_back({0.02 * options.max_views, [=] { f11.measure_large_maps(); }});
  return plan;
}

}  // namespace panonav::lab
