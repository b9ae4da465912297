// Routes driven again along chains of snapshots.

#include "experiments/s06/chains.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "experiments/rows.hpp"
#include "experiments/runs/chain_run.hpp"
#include "panonav/core/error.hpp"
#include "panonav/simulation/scenes.hpp"

namespace panonav {

namespace {

constexpr double route_m = 30.0;
constexpr double pose_spacing_m = 0.1;
constexpr double completed_m = 0.2;

}  // namespace

HomingCamera chain_camera() {
  HomingCamera camera;
  camera.rendering = {.rows = 8, .columns = 128, .rays_per_axis = 2};
  camera.components = 12;
  return camera;
}

void reproduce_snapshot_chains(const HomingPlace& place, const std::string& name,
                               std::uint64_t seed, int routes, Executor& executor,
                               Reproduction& reproduction) {
  require(routes >= 1, "routes", routes, ">= 1");
  const auto ways = random_routes(*place.free_space, routes, route_m, pose_spacing_m, seed);
  constexpr std::size_t directions = 2;
  std::vector<SnapshotChain> chains(ways.size());
  std::vector<ChainRun> runs(ways.size() * directions);
  executor.for_chunks(ways.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      chains[i] = record_chain(place, ways[i], {}, {}, {}, seed + i);
      runs[directions * i] = follow_chain(place, chains[i], ways[i], ways[i].front(),
                                          {.direction = ChainDirection::forward}, seed + i);
      runs[directions * i + 1] = follow_chain(place, chains[i], ways[i], ways[i].back(),
                                              {.direction = ChainDirection::back}, seed + i);
    }
  });

  std::size_t completed = 0;
  std::vector<double> mean_m;
  std::vector<double> worst_m;
  for (const ChainRun& run : runs) {
    completed += run.completes(completed_m) ? 1 : 0;
    double sum_m = 0.0;
    for (const double lateral_m : run.lateral_m) sum_m += lateral_m;
    mean_m.push_back(sum_m / static_cast<double>(run.lateral_m.size()));
    worst_m.push_back(*std::max_element(run.lateral_m.begin(), run.lateral_m.end()));
  }
  std::vector<double> spacing_m;
  std::vector<double> bytes;
  for (const SnapshotChain& chain : chains) {
    spacing_m.push_back(chain_length_m(chain) / static_cast<double>(chain.snapshots.size() - 1));
    bytes.push_back(bytes_per_metre(chain));
  }
  const std::string id = "s06.chain." + name;
  const std::string what = "chains of snapshots along 30 m in " + name;
  add_rate(reproduction, id + ".completed",
           what + ", forward and back: driven to within 20 cm of the end", completed, runs.size());
  add_mean(reproduction, id + ".lateral", what + ": mean distance from the route", "m", mean_m);
  add_median(reproduction, id + ".lateral_worst", what + ": largest distance from the route", "m",
             worst_m);
  add_mean(reproduction, id + ".spacing", what + ": way between snapshots", "m", spacing_m);
  add_mean(reproduction, id + ".bytes", what + ": size", "B/m", bytes);
}

void reproduce_snapshot_chains(std::uint64_t seed, int routes, Executor& executor,
                               Reproduction& reproduction) {
  for (const char* const name : {"office", "hall", "loop", "corridor"}) {
    const HomingPlace place =
        make_homing_place(make_scene(name, {.seed = seed}), chain_camera(), executor);
    reproduce_snapshot_chains(place, name, seed, routes, executor, reproduction);
  }
}

}  // namespace panonav
