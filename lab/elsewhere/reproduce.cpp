#include <algorithm>
#include <string>
#include <vector>

#include "lab/elsewhere/experiments.hpp"
#include "lab/reproduction_stages.hpp"
#include "panonav/core/error.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

ElsewhereReproductionOptions quick_run(ElsewhereReproductionOptions options) {
  options.built_in = {"office", "lab"};
  options.scenes = 1;
  options.queries = 8;
  options.runs = 2;
  options.floors = false;
  options.days = 3;
  options.day_pictures = 20;
  options.walks = 2;
  options.walk_pictures = 40;
  return options;
}

Reproduction reproduce_elsewhere(const ElsewhereReproductionOptions& options, Executor& executor,
                                 const ReproductionProgress& progress) {
  require(options.scenes >= 1, "scenes", options.scenes, ">= 1");
  require(options.queries >= 4, "queries", options.queries, ">= 4");
  require(options.runs >= 2, "runs", options.runs, ">= 2");
  require(options.days >= 1, "days", options.days, ">= 1");
  require(options.day_pictures >= 4, "day_pictures", options.day_pictures, ">= 4");
  require(options.walks >= 2, "walks", options.walks, ">= 2");
  require(options.walk_pictures >= 32, "walk_pictures", options.walk_pictures, ">= 32");
  require(!options.built_in.empty(), "built-in scenes", 0.0, ">= 1");
  make_folder(options.out);
  Reproduction result;
  ElsewhereExperiments elsewhere{options, executor, result};
  std::vector<ReproductionStage> stages;
  for (const std::string& name : elsewhere.ground_names()) {
    stages.push_back(
        {"views of " + name, 10.0, [&elsewhere, name] { elsewhere.record_ground(name); }});
  }
  stages.push_back(
      {"places known and unknown", 100.0, [&] { elsewhere.reproduce_known_places(); }});
  stages.push_back({"tracked poses", 40.0, [&] { elsewhere.reproduce_tracked_poses(); }});
  stages.push_back({"home vectors", 60.0, [&] { elsewhere.reproduce_home_vectors(); }});
  stages.push_back({"tilted robots", 60.0, [&] {
                      elsewhere.grounds.clear();
                      elsewhere.reproduce_tilted_homing();
                    }});
  for (const char* const recording : {"ciirc_b670", "gantry_plants", "indoor_walk_360"}) {
    if (!simulation::has_data(options.data, recording)) continue;
    stages.push_back({recording, 20.0, [&, recording] {
                        elsewhere.reproduce_leave_one_out(options.data / recording);
                      }});
  }
  for (const char* const name : {"office", "small_warehouse"}) {
    if (!simulation::has_scene(options.data, name)) continue;
    stages.push_back({std::string("days in ") + name, 60.0,
                      [&elsewhere, name] { elsewhere.reproduce_days(name); }});
  }
  stages.push_back({"merged memories", 200.0, [&] { elsewhere.reproduce_merging(); }});
  for (const std::string& world : simulation::all_worlds_in(options.data)) {
    for (const double spacing_m : {0.5, 0.3}) {
      if (!options.floors) break;
      stages.push_back({"arrangement of " + world, 60.0, [&elsewhere, world, spacing_m] {
                          elsewhere.reproduce_floor(world, spacing_m);
                        }});
    }
  }
  run_stages(stages, progress);
  return result;
}

}  // namespace panonav::lab
