#include <string>
#include <vector>

#include "lab/m04/experiment.hpp"
#include "lab/navigation/experiments.hpp"
#include "lab/reproduction_stages.hpp"
#include "panonav/core/error.hpp"

namespace panonav::lab {

namespace {

// Other scenes than those of the offices.
constexpr std::uint64_t mission_seeds_above = 1000;

// Relative to one experiment in one office, for the progress.
double cost_of(const MissionGrid& grid) {
  return grid.scene == "garden" ? 80.0 : 15.0;
}

}  // namespace

ReproductionOptions quick_run(ReproductionOptions options) {
  options.scenes = 2;
  options.queries = 15;
  options.fine_lattice_every = 0;
  options.mission_grids = {{"office", 0.3}};
  options.missions = 2;
  options.mission_scenes = 1;
  return options;
}

Reproduction reproduce_m04(const ReproductionOptions& options, Executor& executor,
                           const ReproductionProgress& progress) {
  require(options.scenes >= 2, "scenes", options.scenes, ">= 2");
  require(options.fine_lattice_every >= 0, "fine_lattice_every", options.fine_lattice_every,
          ">= 0");
  require(options.mission_scenes >= 1, "mission_scenes", options.mission_scenes, ">= 1");
  require(options.missions >= options.mission_scenes, "missions", options.missions,
          ">= mission_scenes");
  make_folder(options.out);

  std::vector<std::unique_ptr<Experiment>> experiments;
  experiments.push_back(rotational_invariance_experiment());
  experiments.push_back(power_spectrum_experiment());
  experiments.push_back(discrimination_experiment());
  experiments.push_back(distance_curve_experiment());
  experiments.push_back(similarity_surface_experiment());
  experiments.push_back(hierarchical_areas_experiment());
  experiments.push_back(area_shape_experiment());
  experiments.push_back(component_weights_experiment());
  experiments.push_back(rivals_experiment());

  // Each scene is one step for taking its views, one for every experiment and one for the lattice.
  double steps = options.scenes * (2.0 + static_cast<double>(experiments.size()));
  for (const MissionGrid& grid : options.mission_grids) steps += cost_of(grid);
  double done = 0.0;
  const auto step = [&](const std::string& stage, double cost = 1.0) {
    if (progress) progress(stage, done / steps);
    done += cost;
  };
  for (int s = 0; s < options.scenes; ++s) {
    const std::string name =
        "office " + std::to_string(s + 1) + " of " + std::to_string(options.scenes);
    step(name);
    const simulation::PlaceRecording place =
        simulation::record_place({.scene = "office",
                                  .seed = options.seed + static_cast<std::uint64_t>(s),
                                  .spacing_m = 0.25,
                                  .queries = options.queries,
                                  .rows = options.rows},
                                 executor);
    for (const auto& experiment : experiments) {
      step(name);
      experiment->add(place, executor);
    }
  }
  Reproduction result;
  reproduce_memory_table(result);
  for (const auto& experiment : experiments) experiment->report(options.out, result);
  reproduce_lattice(options, executor, step, result);
  for (const MissionGrid& grid : options.mission_grids) {
    step("missions in " + grid.scene, cost_of(grid));
    const NavigationReproductionOptions missions{.out = options.out,
                                                 .scenes = options.mission_scenes,
                                                 .runs = options.missions,
                                                 .seed = options.seed + mission_seeds_above};
    NavigationExperiments{missions, executor, result}.reproduce_grid_missions(grid.scene,
                                                                              grid.spacing_m);
  }
  if (progress) progress("done", 1.0);
  return result;
}

}  // namespace panonav::lab
