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

/// A built-in scene whose references are on a grid.
struct MissionGrid {
  std::string scene;
  double spacing_m = 0.0;
};

/// Extent of the experiments of a paper. A paper reads the members that its experiments know;
/// `default_options` gives its own values.
struct ReproductionOptions {
  std::filesystem::path out = {};  ///< folder for images; created if it does not exist
  /// Folder of the recordings and Gazebo worlds (docs/formats.md); empty: these are left out.
  std::filesystem::path data = {};
  std::uint64_t seed = 1;  ///< of the first scene; the others follow it
  int scenes = 20;         ///< variants of a scene; fewer of those that are rarely used
  int runs = 20;           ///< missions, paths, walks or homing runs in each place
  int queries = 50;        ///< in each variant, and pairs of views in each range
  int rows = 80;           ///< of the views
  int columns = 512;       ///< of the views; half as many outside the main scene of [M03]
  /// [M04] figure 17 is repeated with references every 30 cm in every n-th scene; 0: in none.
  int fine_lattice_every = 4;
  /// [M04] figure 18: scenes of missions; their seeds begin 1000 above `seed`.
  std::vector<MissionGrid> mission_grids{{"office", 0.3}, {"hall", 0.4}, {"garden", 0.3}};
  int mission_scenes = 4;       ///< [M04] figure 18: variants of each of them
  int variants = 3;             ///< [M03]: of light and of moved objects in each scene
  std::string only = {};        ///< [M03]: one of `tracking_reproduction_parts`; empty: all
  int goals_every = 1;          ///< [S06]: every n-th place of the first arena is a goal
  int goals_every_further = 4;  ///< [S06]: the same in the other arenas
  double spacing_m = 0.025;     ///< [S06]: of the places, 0.01 .. 0.1
  int starts = 200;             ///< [S06]: of runs home in each Gazebo world; fewer elsewhere
  int views = 200;              ///< [F11]: of the first set; the second has three quarters of them
  int max_views = 10'000;       ///< [F11]: of the largest map
  int swept = 10;               ///< [Y03]: scenes that take part in the sweeps, 1 to scenes
  /// Elsewhere: number of built-in scenes; worlds and recordings are all that exist.
  std::vector<std::string> built_in{"office", "hall", "lab", "loop", "corridor", "garden"};
  bool floors = true;      ///< elsewhere: whole floors of the worlds are arranged
  int days = 30;           ///< elsewhere: that a place changes while its memory learns
  int day_pictures = 120;  ///< elsewhere: of a robot's path on each of them, half a metre apart
  int walks = 20;          ///< elsewhere: through each place whose memories are merged pair by pair
  int walk_pictures = 600;  ///< elsewhere: of each of them, 10 cm apart
};

/// Returns the options of a full run of a paper, or of a smoke run: few scenes and runs. Throws
/// ContractError on an unknown paper.
[[nodiscard]] ReproductionOptions default_options(std::string_view paper, bool quick = false);

/// Parts of the experiments of [M03]: office, corridor, garden, leaving, worlds, recordings.
[[nodiscard]] std::span<const std::string_view> tracking_reproduction_parts();

struct ReproductionPicture {
  std::filesystem::path file;  ///< within `out`
  std::string caption;         ///< what a person should see in it
};

struct Reproduction {
  std::filesystem::path out;  ///< folder of the images
  std::vector<ResultRow> rows{};
  std::vector<ReproductionPicture> pictures{};
};

/// Receives the completed share of the whole, 0 .. 1.
using ReproductionProgress = std::function<void(double fraction)>;

/// Runs the experiments of a paper. Same options: same rows, except for times (units ms, us, s) and
/// their ratios (unit x), and same images on any number of threads. Throws ContractError on an
/// unknown paper or options out of range, OptionError, FileError.
/// - m03: Monte-Carlo localisation [M03 section 4.1]
/// - m04: localisation, the spring lattice and missions [M04]
/// - s06: visual homing and chains of snapshots [S06]
/// - f11: visual odometry and topological maps [F11]
/// - y03: route panoramas [Y03]
/// - navigation: missions [M04 section 3.5] over mapped drives, under changed light and furniture
/// - elsewhere: places, home vectors, tilts and days on data not used for development, with rivals
[[nodiscard]] Reproduction reproduce(std::string_view paper, const ReproductionOptions& options,
                                     Executor& executor, const ReproductionProgress& progress = {});

}  // namespace panonav::lab
