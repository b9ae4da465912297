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
  std::vector<ReproductionStage> stages;
  std::vector<CatchmentAreas> areas;
  const ArenaOptions first_options{.seed = options.seed, .spacing_m = options.spacing_m};
  std::optional<Arena> first;
  std::unique_ptr<ArenaSurveys> surveys;
  const auto every = static_cast<std::size_t>(options.goals_every);
  const auto further = static_cast<std::size_t>(options.goals_every_further);
  const double all_goals = 1.0 / options.goals_every;
  const double some_goals = 1.0 / options.goals_every_further;

  stages.push_back({"arena 1", 6.0, [&] {
                      first = record_arena(first_options, executor);
                      surveys = std::make_unique<ArenaSurveys>(*first, every, executor);
                      add_row(result, "s06.places", "free places of the first arena",
                              static_cast<double>(first->homes.views.size()), "places",
                              std::nullopt, std::pair(1250.0, 1250.0));
                      measure_homing_times(*first, result);
                    }});
  stages.push_back(
      {"views", 4.0, [&] { reproduce_view_figures(*first, options.out, executor, result); }});
  stages.push_back(
      {"expected images", 60.0 * all_goals, [&] { (void)surveys->expected_images(); }});
  stages.push_back(
      {"catchment areas", 40.0 * all_goals, [&] { areas.push_back(catchment_areas(*surveys)); }});
  stages.push_back({"homing", 60.0 * all_goals,
                    [&] { reproduce_homing_figures(*surveys, options.out, executor, result); }});
  stages.push_back({"one goal", 4.0, [&] {
                      reproduce_goal_figures(*surveys, options.out, result);
                      reproduce_snapshot_bytes(*surveys, result);
                      surveys.reset();
                      first.reset();
                    }});
  const auto add_arena = [&](const std::string& name, ArenaOptions arena_options, auto use) {
    arena_options.spacing_m = options.spacing_m;
    stages.push_back({name, 6.0 + 100.0 * some_goals, [&, arena_options, use] {
                        const Arena arena = record_arena(arena_options, executor);
                        ArenaSurveys of_arena(arena, further, executor);
                        use(arena, catchment_areas(of_arena));
                      }});
  };
  for (int scene = 1; scene < options.scenes; ++scene) {
    add_arena("arena " + std::to_string(scene + 1) + " of " + std::to_string(options.scenes),
              {.seed = options.seed + static_cast<std::uint64_t>(scene)},
              [&](const Arena&, CatchmentAreas of_arena) { areas.push_back(std::move(of_arena)); });
  }
  add_arena("pose noise",
            {.seed = options.seed, .position_noise_m = 0.003, .heading_noise_rad = radians(2.0)},
            [&](const Arena& arena, const CatchmentAreas& of_arena) {
              reproduce_heading_with_pose_noise(arena, result);
              report_variant("pose_noise", "with the tracker's noise (3 mm, 2 degrees)", of_arena,
                             result);
            });
  add_arena("fixed heading", {.seed = options.seed, .heading = ArenaHeading::fixed},
            [&](const Arena&, const CatchmentAreas& of_arena) {
              report_variant("fixed_heading", "all views at one heading", of_arena, result);
            });
  stages.push_back(
      {"comparison", 0.1, [&] { compare_catchment_areas(areas, options.seed, result); }});

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
                        reproduce_homing_in_world(options.data, name, options.out, options.seed,
                                                  options.starts, executor, result);
                      }});
  }

  run_stages(stages, progress);
  return result;
}

}  // namespace panonav::lab
