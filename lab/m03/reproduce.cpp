#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "lab/m03/experiments.hpp"
#include "lab/reproduction_stages.hpp"
#include "panonav/core/error.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

std::span<const std::string_view> tracking_reproduction_parts() {
  static constexpr std::array<std::string_view, 6> parts{"office",  "corridor", "garden",
                                                         "leaving", "worlds",   "recordings"};
  return parts;
}

TrackingReproductionOptions quick_run(TrackingReproductionOptions options) {
  options.scenes = 1;
  options.variants = 2;
  options.runs = 3;
  return options;
}

Reproduction reproduce_m03(const TrackingReproductionOptions& options, Executor& executor,
                           const ReproductionProgress& progress) {
  require(options.scenes >= 1, "scenes", options.scenes, ">= 1");
  require(options.variants >= 1, "variants", options.variants, ">= 1");
  require(options.runs >= 2, "runs", options.runs, ">= 2");
  const auto parts = tracking_reproduction_parts();
  if (!options.only.empty() && std::ranges::find(parts, options.only) == parts.end()) {
    throw ContractError("only", options.only,
                        "office, corridor, garden, leaving, worlds, recordings");
  }
  const auto wanted = [&](std::string_view part) {
    return options.only.empty() || options.only == part;
  };
  make_folder(options.out);

  Reproduction result;
  std::vector<OfficeRuns> offices;
  std::vector<ReproductionStage> stages;
  for (int s = 0; wanted("office") && s < options.scenes; ++s) {
    stages.push_back({"office " + std::to_string(s + 1) + " of " + std::to_string(options.scenes),
                      20.0, [&, s] { offices.push_back(record_office(options, s, executor)); }});
  }
  const auto over_offices = [&](const std::string& name, double cost, auto experiment) {
    if (!wanted("office")) return;
    stages.push_back({name, cost * options.scenes,
                      [&, experiment] { experiment(options, offices, executor, result); }});
  };
  over_offices("global localisation", 3.0, reproduce_global_localisation);
  over_offices("position tracking", 1.0, reproduce_position_tracking);
  over_offices("kidnapped robot", 1.0, reproduce_kidnapping);
  over_offices("particles and odometry", 10.0, reproduce_tracking_sweeps);
  if (wanted("corridor")) {
    stages.push_back({"corridor", 10.0 * options.scenes,
                      [&] { reproduce_corridor(options, executor, result); }});
  }
  if (wanted("garden")) {
    stages.push_back(
        {"garden", 10.0 * options.scenes, [&] { reproduce_garden(options, executor, result); }});
  }
  for (const std::string scene : {"hall", "loop"}) {
    if (!wanted("leaving")) break;
    stages.push_back({"leaving the " + scene, 5.0 * options.scenes,
                      [&, scene] { reproduce_leaving(options, scene, executor, result); }});
  }
  for (const std::string& world : simulation::worlds_in(options.data)) {
    if (!wanted("worlds")) break;
    stages.push_back(
        {world, 50.0, [&, world] { reproduce_gazebo_world(options, world, executor, result); }});
  }
  const auto recording = [&](const std::string& name, auto experiment) {
    if (!wanted("recordings") || !simulation::has_data(options.data, name)) return;
    stages.push_back({name, 10.0, [&, experiment] { experiment(options, executor, result); }});
  };
  recording("sussex_route", reproduce_recorded_route);
  recording("gantry_plants", reproduce_gantry);

  run_stages(stages, progress);
  return result;
}

}  // namespace panonav::lab
