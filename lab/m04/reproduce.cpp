#include <memory>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/m04/experiment.hpp"

namespace panonav::lab {

namespace {

// Added to the seed, so that missions use other scenes than the office experiments.
constexpr std::uint64_t mission_seed_offset = 1000;

using FigureExperiments = std::vector<std::unique_ptr<Experiment>>;

FigureExperiments make_experiments() {
  FigureExperiments experiments;
  for (auto* const make :
       {make_rotational_invariance_experiment, make_power_spectrum_experiment,
        make_discrimination_experiment, make_distance_curve_experiment,
        make_similarity_surface_experiment, make_hierarchical_areas_experiment,
        make_area_shape_experiment, make_component_weights_experiment, make_rivals_experiment}) {
    experiments.push_back(make());
  }
  return experiments;
}

void add_office(const FigureExperiments& experiments, std::uint64_t seed,
                const Experiments& context) {
  const simulation::PlaceRecording place =
      simulation::record_place({.scene = "office",
                                .seed = seed,
                                .spacing_m = 0.25,
                                .queries = context.options.queries,
                                .rows = context.options.rows,
                                .mirror = context.options.optics == Optics::mirror},
                               context.executor);
  for (const auto& experiment : experiments) experiment->add(place, context.executor);
}

void reproduce_missions(const MissionGrid& grid, const Experiments& context) {
  const ReproductionOptions missions{.optics = context.options.optics,
                                     .seed = context.options.seed + mission_seed_offset,
                                     .scenes = context.options.mission_scenes,
                                     .runs = context.options.runs};
  NavigationExperiments{{missions, context.executor, context.result}}.reproduce_grid_missions(
      grid.scene, grid.spacing_m);
}

}  // namespace

ReproductionPlan plan_m04(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 2},
                  {"fine_lattice_every", options.fine_lattice_every, 0},
                  {"mission_scenes", options.mission_scenes, 1},
                  {"runs", options.runs, options.mission_scenes}});
  const auto experiments = std::make_shared<const FigureExperiments>(make_experiments());
  ReproductionPlan plan;
  for (int s = 0; s < options.scenes; ++s) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(s);
    plan.push_back({10.0, [=] { add_office(*experiments, seed, context); }});
  }
  plan.push_back({1.0 * options.scenes, [=] {
                    reproduce_memory_table(context.result);
                    for (const auto& experiment : *experiments) experiment->report(context.result);
                    reproduce_lattice(context);
                    reproduce_magnitudes_alone(context);
                  }});
  for (const MissionGrid& grid : options.mission_grids) {
    plan.push_back(
        {grid.scene == "garden" ? 80.0 : 15.0, [=] { reproduce_missions(grid, context); }});
  }
  return plan;
}

}  // namespace panonav::lab
