#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lab/s06/chains.hpp"
#include "lab/s06/home_areas.hpp"
#include "lab/s06/support.hpp"
#include "lab/s06/worlds.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

namespace {

/// Experiments over the arenas, run one after the other. Holds the first arena while it is needed,
/// and the results of all arenas until they are compared.
struct ArenaExperiments : Experiments {
  const simulation::PanoramaRendering rendering = make_arena_rendering(options.optics);
  std::optional<Arena> first_arena{};
  std::unique_ptr<ArenaSurveys> first_surveys{};  ///< surveys of the first arena
  std::vector<CatchmentAreas> areas{};

  void record_first() {
    first_arena = record_arena(
        {.seed = options.seed, .spacing_m = options.spacing_m, .rendering = rendering}, executor);
    first_surveys = std::make_unique<ArenaSurveys>(
        *first_arena, static_cast<std::size_t>(options.goals_every), executor);
    add_row(result, "s06.places", "free places of the first arena",
            static_cast<double>(first_arena->homes.views.size()), "places", std::nullopt,
            std::pair(1250.0, 1250.0));
    measure_homing_times(*first_arena, result);
  }

  void finish_first() {
    reproduce_goal_figures(*first_surveys, result);
    reproduce_snapshot_bytes(*first_surveys, result);
    first_surveys.reset();
    first_arena.reset();
  }

  CatchmentAreas measure_further_arena(const Arena& arena) const {
    ArenaSurveys surveys(arena, static_cast<std::size_t>(options.goals_every_further), executor);
    return measure_catchment_areas(surveys);
  }

  void add_variant(int number) {
    areas.push_back(measure_further_arena(
        record_arena({.seed = options.seed + static_cast<std::uint64_t>(number),
                      .spacing_m = options.spacing_m,
                      .rendering = rendering},
                     executor)));
  }

  void add_pose_noise() {
    const Arena arena = record_arena({.seed = options.seed,
                                      .position_noise_m = 0.003,
                                      .heading_noise_rad = radians(2.0),
                                      .spacing_m = options.spacing_m,
                                      .rendering = rendering},
                                     executor);
    const CatchmentAreas noisy = measure_further_arena(arena);
    reproduce_heading_with_pose_noise(arena, result);
    report_variant("pose_noise", "with the tracker's noise (3 mm, 2 degrees)", noisy, result);
  }

  void add_fixed_heading() {
    const Arena arena = record_arena({.seed = options.seed,
                                      .heading = ArenaHeading::fixed,
                                      .spacing_m = options.spacing_m,
                                      .rendering = rendering},
                                     executor);
    report_variant("fixed_heading", "all views at one heading", measure_further_arena(arena),
                   result);
  }
};

}  // namespace

ReproductionPlan plan_s06(const Experiments& context) {
  const auto& [options, executor, result] = context;
  require_minima({{"scenes", options.scenes, 2},
                  {"goals_every", options.goals_every, 1},
                  {"goals_every_further", options.goals_every_further, 1},
                  {"starts", options.starts, 1}});
  require(options.spacing_m >= 0.01 && options.spacing_m <= 0.1, "spacing_m", options.spacing_m,
          "0.01 .. 0.1");
  const auto arenas = std::make_shared<ArenaExperiments>(context);
  const double all_goals = 1.0 / options.goals_every;
  const double further = 6.0 + 100.0 / options.goals_every_further;
  ReproductionPlan plan{
      {6.0, [=] { arenas->record_first(); }},
      {4.0, [=] { reproduce_view_figures(*arenas->first_arena, context); }},
      {60.0 * all_goals, [=] { (void)arenas->first_surveys->survey_expected_images(); }},
      {40.0 * all_goals,
       [=] { arenas->areas.push_back(measure_catchment_areas(*arenas->first_surveys)); }},
      {60.0 * all_goals, [=] { reproduce_homing_figures(*arenas->first_surveys, context); }},
      {4.0, [=] { arenas->finish_first(); }}};
  for (int scene = 1; scene < options.scenes; ++scene) {
    plan.push_back({further, [=] { arenas->add_variant(scene); }});
  }
  plan.push_back({further, [=] { arenas->add_pose_noise(); }});
  plan.push_back({further, [=] { arenas->add_fixed_heading(); }});
  plan.push_back({0.1, [=] { compare_catchment_areas(arenas->areas, context); }});
  const int few_starts = (options.starts + 19) / 20;
  plan.push_back({2.0 * few_starts, [=] { reproduce_homing_in_scenes(few_starts, context); }});
  plan.push_back(
      {10.0, [=] { reproduce_snapshot_chains((context.options.starts + 99) / 100, context); }});
  plan.push_back(
      {15.0, [=] { reproduce_home_areas((context.options.starts + 19) / 20, context); }});
  for (const std::string& name : simulation::find_worlds(options.data)) {
    plan.push_back({0.1 * options.starts, [=] { reproduce_homing_in_world(name, context); }});
  }
  return plan;
}

}  // namespace panonav::lab
