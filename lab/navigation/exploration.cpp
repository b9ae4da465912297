#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/rows.hpp"
#include "panonav/core/random.hpp"
#include "panonav/navigation/explorer.hpp"
#include "panonav_simulation/exploration.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

namespace {

// Distance of the positions at which the coverage is measured.
constexpr double coverage_grid_m = 0.25;

// Results of all explorations of a scene with one sensor for obstacles.
struct Explorations {
  simulation::ObstacleSensor sensor;
  std::string id;
  std::string what;
  bool is_judged;
  std::vector<double> covered{};
  std::vector<double> relative_lengths{};  // path length over that of the sweep
  std::vector<double> end_distances_m{};
  std::size_t lost = 0;
};

void report(const std::string& scene, const Explorations& kind, Reproduction& result) {
  const std::string id = "navigation.explore." + scene + "." + kind.id;
  const std::string what = "exploration of " + scene + " with " + kind.what + ": ";
  const auto target = [&](const Target& value) {
    return kind.is_judged ? std::optional(value) : std::nullopt;
  };
  add_median(result, id + ".covered",
             what + "share of the free floor from which the robot homes to a view", "",
             kind.covered, target(at_least(0.95)));
  add_median(result, id + ".length", what + "path length against a sweep with true poses", "",
             kind.relative_lengths, target(at_most(1.5)));
  add_median(result, id + ".end", what + "distance from the start at the end", "m",
             kind.end_distances_m);
  add_rate(result, id + ".lost", what + "end lost", kind.lost, kind.covered.size());
}

}  // namespace

void NavigationExperiments::reproduce_explorations(const std::string& scene) const {
  using enum simulation::ObstacleSensor;
  std::array<Explorations, 2> kinds{
      Explorations{ranges, "ranges", "a bumper and eight noisy ranges", true},
      Explorations{bumper, "bumper", "a bumper alone", false}};
  std::vector<double> sweep_covered;
  const ExplorationOptions exploration;
  for (int i = 0; i < options.scenes; ++i) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(i);
    const simulation::MissionPlace place =
        make_place(simulation::make_or_read_scene(options.data, scene, {.seed = seed}));
    const auto measure = [&](const std::vector<Pose2>& views) {
      return simulation::measure_coverage(place, views, exploration.radius_m, coverage_grid_m,
                                          Random(seed, 21).next(), executor);
    };
    const simulation::Sweep sweep = simulation::plan_sweep(*place.free_space, exploration.radius_m);
    sweep_covered.push_back(measure(sweep.views));
    Random random(seed, 22);
    const Pose2 start = place.free_space->random_pose(random);
    for (Explorations& kind : kinds) {
      const simulation::ExplorationRobot robot{.obstacles = kind.sensor};
      Explorer explorer(exploration, place.scene.robot_radius_m, kind.sensor == ranges,
                        robot.motion);
      const auto run =
          simulation::run_exploration(place, explorer, robot, start, Random(seed, 23).next());
      kind.covered.push_back(measure(run.views));
      kind.relative_lengths.push_back(run.explored_m / sweep.length_m);
      kind.end_distances_m.push_back(run.end_distance_m);
      kind.lost += run.end == ExplorationDecision::State::lost ? 1U : 0U;
    }
  }
  for (const Explorations& kind : kinds) report(scene, kind, result);
  add_median(result, "navigation.explore." + scene + ".sweep",
             "sweep of " + scene + " with true poses: share of the free floor that it covers", "",
             sweep_covered);
}

}  // namespace panonav::lab
