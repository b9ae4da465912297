#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lab/reproduction_stages.hpp"
#include "lab/s06/chains.hpp"
#include "lab/s06/support.hpp"
#include "lab/s06/worlds.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

HomingReproductionOptions quick_run(HomingReproductionOptions options) {
  options.scenes = 2;
  options.spacing_m = 0.05;
  options.goals_every = 4;
  options.goals_every_further = 8;
  options.starts = 20;
  return options;
}

namespace {

/// The arenas of a run, one after the other; what is known of them and not yet reported.
struct ArenaExperiments {
  const HomingReproductionOptions& options;
  Executor& executor;
  Reproduction& result;
  std::optional<Arena> first{};
  std::unique_ptr<ArenaSurveys> surveys{};  ///< of the first
  std::vector<CatchmentAreas> areas{};

  void record_first() {
    first = record_arena({.seed = options.seed, .spacing_m = options.spacing_m}, executor);
    surveys = std::make_unique<ArenaSurveys>(*first, static_cast<std::size_t>(options.goals_every),
                                             executor);
    add_row(result, "s06.places", "free places of the first arena",
            static_cast<double>(first->homes.views.size()), "places", std::nullopt,
            std::pair(1250.0, 1250.0));
    measure_homing_times(*first, result);
  }

  void finish_first() {
    reproduce_goal_figures(*surveys, options.out, result);
    reproduce_snapshot_bytes(*surveys, result);
    surveys.reset();
    first.reset();
  }

  CatchmentAreas survey_further(const Arena& arena) const {
    ArenaSurveys of_arena(arena, static_cast<std::size_t>(options.goals_every_further), executor);
    return catchment_areas(of_arena);
  }

  void add_variant(int number) {
    areas.push_back(survey_further(record_arena(
        {.seed = options.seed + static_cast<std::uint64_t>(number), .spacing_m = options.spacing_m},
        executor)));
  }

  void add_pose_noise() {
    const Arena arena = record_arena({.seed = options.seed,
                                      .position_noise_m = 0.003,
                                      .heading_noise_rad = radians(2.0),
                                      .spacing_m = options.spacing_m},
                                     executor);
    const CatchmentAreas noisy = survey_further(arena);
    reproduce_heading_with_pose_noise(arena, result);
    report_variant("pose_noise", "with the tracker's noise (3 mm, 2 degrees)", noisy, result);
  }

  void add_fixed_heading() {
    const Arena arena = record_arena(
        {.seed = options.seed, .heading = ArenaHeading::fixed, .spacing_m = options.spacing_m},
        executor);
    report_variant("fixed_heading", "all views at one heading", survey_further(arena), result);
  }
};

}  // namespace

Reproduction reproduce_s06(const HomingReproductionOptions& options, Executor& executor,
                           const ReproductionProgress& progress) {
  require(options.scenes >= 2, "scenes", options.scenes, ">= 2");
  require(options.goals_every >= 1, "goals_every", options.goals_every, ">= 1");
  require(options.goals_every_further >= 1, "goals_every_further", options.goals_every_further,
          ">= 1");
  require(options.starts >= 1, "starts", options.starts, ">= 1");
  require(options.spacing_m >= 0.01 && options.spacing_m <= 0.1, "spacing_m", options.spacing_m,
          "0.01 .. 0.1");
  make_folder(options.out);

  Reproduction result;
  ArenaExperiments arenas{options, executor, result};
  const double all_goals = 1.0 / options.goals_every;
  const double further = 6.0 + 100.0 / options.goals_every_further;
  const auto& out = options.out;
  std::vector<ReproductionStage> stages{
      {"arena 1", 6.0, [&] { arenas.record_first(); }},
      {"views", 4.0, [&] { reproduce_view_figures(*arenas.first, out, executor, result); }},
      {"expected images", 60.0 * all_goals, [&] { (void)arenas.surveys->expected_images(); }},
      {"catchment areas", 40.0 * all_goals,
       [&] { arenas.areas.push_back(catchment_areas(*arenas.surveys)); }},
      {"homing", 60.0 * all_goals,
       [&] { reproduce_homing_figures(*arenas.surveys, out, executor, result); }},
      {"one goal", 4.0, [&] { arenas.finish_first(); }}};
  for (int scene = 1; scene < options.scenes; ++scene) {
    stages.push_back(
        {"arena " + std::to_string(scene + 1) + " of " + std::to_string(options.scenes), further,
         [&arenas, scene] { arenas.add_variant(scene); }});
  }
  stages.push_back({"pose noise", further, [&] { arenas.add_pose_noise(); }});
  stages.push_back({"fixed heading", further, [&] { arenas.add_fixed_heading(); }});
  stages.push_back(
      {"comparison", 0.1, [&] { compare_catchment_areas(arenas.areas, options.seed, result); }});
  const int few_starts = (options.starts + 19) / 20;
  stages.push_back({"runs home", 2.0 * few_starts, [&] {
                      reproduce_homing_in_scenes(options.seed, few_starts, executor, result);
                    }});
  stages.push_back({"chains of snapshots", 10.0, [&] {
                      reproduce_snapshot_chains(options.seed, (options.starts + 99) / 100, executor,
                                                result);
                    }});
  for (const std::string& name : simulation::worlds_in(options.data)) {
    stages.push_back({name, 0.1 * options.starts, [&, name] {
                        reproduce_homing_in_world(options.data, name, out, options.seed,
                                                  options.starts, executor, result);
                      }});
  }
  run_stages(stages, progress);
  return result;
}

}  // namespace panonav::lab
