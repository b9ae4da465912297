#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lab/reporting/table.hpp"
#include "panonav/core/executor.hpp"

namespace panonav::lab {

/// A built-in scene for missions, with references on a grid of `spacing_m`.
struct MissionGrid {
  std::string scene;
  double spacing_m = 0.0;
};

/// Optics of the views in the experiments of a paper.
enum class Optics {
  mirror,   ///< images of the simulated mirror camera, 640 x 480, unwarped as those of a robot
  panorama  ///< panoramas that are rendered directly: no mirror, three to six times as fast
};

/// Extent of the experiments of a paper. The experiments of each paper read only some of the
/// members; `default_options` returns the values of a paper.
struct ReproductionOptions {
  std::filesystem::path out = {};  ///< folder for images; created if it does not exist
  /// Folder of the recordings and Gazebo worlds (docs/formats.md); if empty, their experiments are
  /// skipped.
  std::filesystem::path data = {};
  /// Not used by [F11], which measures both, by [Y03], whose lines are always those of a mirror,
  /// and by the experiments elsewhere.
  Optics optics = Optics::panorama;
  std::uint64_t seed = 1;  ///< of the first scene; each next scene adds 1
  int scenes = 20;         ///< variants of a scene; fewer for some experiments
  /// Missions, paths, walks or homing runs in each place; routes of the shortest length, of which
  /// each next length has half as many.
  int runs = 20;
  int queries = 50;   ///< per variant; also pairs of views per distance range
  int rows = 80;      ///< of the views
  int columns = 512;  ///< of the views; half as many outside the main scene of [M03]
  /// [M04] figure 17 is repeated with references every 30 cm in every n-th scene; 0 skips it.
  int fine_lattice_every = 4;
  /// [M04] figure 18: kind of scene and grid spacing in metres for each group of missions. The
  /// first scene has the seed `seed` + 1000.
  std::vector<MissionGrid> mission_grids{{"office", 0.3}, {"hall", 0.4}, {"garden", 0.3}};
  int mission_scenes = 4;       ///< [M04] figure 18: variants of each scene
  int variants = 3;             ///< [M03]: of light and moved objects, per scene
  std::string only = {};        ///< [M03]: one of `tracking_reproduction_parts`; empty: all
  int goals_every = 1;          ///< [S06]: every n-th place of the first arena is a goal
  int goals_every_further = 4;  ///< [S06]: the same for the other arenas
  double spacing_m = 0.025;     ///< [S06]: between places, 0.01 .. 0.1
  int starts = 200;             ///< [S06]: homing runs per Gazebo world; fewer elsewhere
  int views = 200;              ///< [F11]: of the first set; three quarters in the second
  int max_views = 10'000;       ///< [F11]: of the largest map
  int swept = 10;               ///< [Y03]: scenes used in the sweeps, 1 to scenes
  /// Elsewhere: the built-in scenes used, beside all available worlds and recordings. Routes: the
  /// scenes and worlds used, as far as they are available; the first one, `street`, `garden` and
  /// `industrial_hall` also in other light, the last three also for long routes.
  std::vector<std::string> built_in{"office", "hall", "lab", "loop", "corridor", "garden"};
  bool floors = true;       ///< elsewhere: also arrange whole floors of the worlds
  int days = 30;            ///< elsewhere: simulated days of a changing place
  int day_pictures = 120;   ///< elsewhere: per day and robot, half a metre apart
  int walks = 20;           ///< elsewhere: per place; their memories are merged pairwise
  int walk_pictures = 600;  ///< elsewhere: per walk, 10 cm apart
  std::vector<double> route_lengths_m{60.0, 200.0, 500.0};  ///< routes: the shortest one first
};

/// Returns the options of a full run of a paper, or with `quick` of a smoke test with few scenes
/// and runs. Throws ContractError on an unknown paper.
[[nodiscard]] ReproductionOptions default_options(std::string_view paper, bool quick = false);

/// Parts of the experiments of [M03]: office, corridor, sparse, garden, leaving, worlds,
/// recordings.
[[nodiscard]] std::span<const std::string_view> tracking_reproduction_parts();

struct ReproductionPicture {
  std::filesystem::path file;  ///< within `out`
  std::string caption;         ///< what the reader should notice in it
};

struct Reproduction {
  std::filesystem::path out;  ///< folder of the images
  std::vector<ResultRow> rows{};
  std::vector<ReproductionPicture> pictures{};
};

/// Receives the completed fraction of the work, 0 .. 1.
using ReproductionProgress = std::function<void(double fraction)>;

/// Runs the experiments of a paper. Same options: same rows, except for times (units ms, us, s) and
/// their ratios (unit x), and same images on any number of threads. Throws ContractError,
/// OptionError, FileError.
/// - m03: Monte-Carlo localisation [M03 section 4.1]
/// - m04: localisation, the spring lattice and missions [M04]
/// - s06: visual homing and chains of snapshots [S06]
/// - f11: visual odometry and topological maps [F11]
/// - y03: route panoramas [Y03]
/// - navigation: missions [M04 section 3.5] over mapped drives, under changed light and furniture
/// - routes: memories of routes and their rivals
/// - elsewhere: places, home vectors, tilts and days on data not used for development, with rivals
[[nodiscard]] Reproduction reproduce(std::string_view paper, const ReproductionOptions& options,
                                     Executor& executor, const ReproductionProgress& progress = {});

}  // namespace panonav::lab
