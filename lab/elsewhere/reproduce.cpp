#include <memory>
#include <string>

#include "lab/elsewhere/experiments.hpp"
#include "panonav/core/error.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

ReproductionPlan plan_elsewhere(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 1},
                  {"queries", options.queries, 4},
                  {"runs", options.runs, 2},
                  {"days", options.days, 1},
                  {"day_pictures", options.day_pictures, 4},
                  {"walks", options.walks, 2},
                  {"walk_pictures", options.walk_pictures, 32}});
  require(!options.built_in.empty(), "built-in scenes", 0.0, ">= 1");
  const auto elsewhere = std::make_shared<ElsewhereExperiments>(context);
  ReproductionPlan plan;
  for (const std::string& name : elsewhere->ground_names()) {
    plan.push_back({10.0, [=] { elsewhere->record_ground(name); }});
  }
  plan.push_back({100.0, [=] { elsewhere->reproduce_known_places(); }});
  plan.push_back({40.0, [=] { elsewhere->reproduce_tracked_poses(); }});
  plan.push_back({60.0, [=] { elsewhere->reproduce_home_vectors(); }});
  plan.push_back({60.0, [=] {
                    elsewhere->grounds.clear();
                    elsewhere->reproduce_tilted_homing();
                  }});
  for (const char* const recording : {"ciirc_b670", "gantry_plants", "indoor_walk_360"}) {
    if (!simulation::has_data(options.data, recording)) continue;
    const std::filesystem::path folder = options.data / recording;
    plan.push_back({20.0, [=] { elsewhere->reproduce_leave_one_out(folder); }});
  }
  for (const char* const name : {"office", "small_warehouse"}) {
    if (!simulation::has_scene(options.data, name)) continue;
    plan.push_back({60.0, [=] { elsewhere->reproduce_days(name); }});
  }
  plan.push_back({200.0, [=] { elsewhere->reproduce_merging(); }});
  if (!options.floors) return plan;
  for (const std::string& world : simulation::all_worlds_in(options.data)) {
    for (const double spacing_m : {0.5, 0.3}) {
      plan.push_back({60.0, [=] { elsewhere->reproduce_floor(world, spacing_m); }});
    }
  }
  return plan;
}

}  // namespace panonav::lab
