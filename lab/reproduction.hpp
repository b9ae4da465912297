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

/// A built-in scene whose references lie on a grid.
struct MissionGrid {
  std::string scene;
  double spacing_m = 0.0;
};

struct ReproductionOptions {
  std::filesystem::path out;  ///< folder for pictures; made when it is not there
  int scenes = 20;            ///< variants of the scene, >= 2
  int queries = 50;           ///< in each, >= 1
  int rows = 80;              ///< of the views; 512 columns always
  /// Figure 17 with references every 30 cm in one scene of so many, >= 1; 0: in none.
  int fine_lattice_every = 4;
  /// Kinds of place to go about in (figure 18), with the spacing of their references.
  std::vector<MissionGrid> mission_grids{{"office", 0.3}, {"hall", 0.4}, {"garden", 0.3}};
  int missions = 100;      ///< in each of them, shared by its variants, >= mission_scenes
  int mission_scenes = 4;  ///< variants of each of them, >= 1
  /// Of the first scene; the others follow it. Places to go about in have seeds from 1000 above it
  /// on.
  std::uint64_t seed = 1;
};

/// The same as a smoke run: two scenes, few queries, no lattice of 30 cm, two missions in one
/// office.
[[nodiscard]] ReproductionOptions quick_run(ReproductionOptions options);

struct ReproductionPicture {
  std::filesystem::path file;  ///< within `out`
  std::string caption;         ///< what a person should see in it
};

struct Reproduction {
  std::vector<ResultRow> rows;
  std::vector<ReproductionPicture> pictures;
};

/// Told what is being done and how far the whole is, 0 .. 1.
using ReproductionProgress = std::function<void(std::string_view stage, double fraction)>;

/// The experiments of [M04]: localisation (figures 4 to 10, eq. 6) with table 1 of [M03] and the
/// rivals, over many variants of the office; the spring lattice (figures 12 and 15 to 17) over as
/// many of the hall; missions over such lattices (figure 18) in office, hall and garden. Same
/// options: same rows, but for times (unit ms), and same pictures on any number of threads. Throws
/// ContractError, FileError.
[[nodiscard]] Reproduction reproduce_m04(const ReproductionOptions& options, Executor& executor,
                                         const ReproductionProgress& progress = {});

struct TrackingReproductionOptions {
  std::filesystem::path out;  ///< folder for pictures; made when it is not there
  int scenes = 10;            ///< variants of the office, >= 1; fewer of the other scenes
  int variants = 3;           ///< of light and of moved objects in each, >= 1
  int runs = 4;               ///< in each of those, >= 2
  int rows = 80;              ///< of the views
  int columns = 512;          ///< in the office; half as many elsewhere
  std::uint64_t seed = 601;   ///< of the first scene; the others follow it
  /// Folder of the recordings and Gazebo worlds (docs/formats.md); empty: these are left out.
  std::filesystem::path data;
  std::string only;  ///< one of `tracking_reproduction_parts`; empty: all
};

/// office, corridor, garden, leaving, worlds, recordings.
[[nodiscard]] std::span<const std::string_view> tracking_reproduction_parts();

/// The same as a smoke run: one office, few runs.
[[nodiscard]] TrackingReproductionOptions quick_run(TrackingReproductionOptions options);

/// Monte-Carlo localisation as in [M03] section 4.1 and what its authors only announced: global
/// localisation, tracking without images, the kidnapped robot, with numbers of particles and
/// odometry of several kinds; a corridor of identical doors, changing light outdoors, a robot that
/// leaves the memorised area; Gazebo worlds and real recordings where `data` holds them. Same
/// options: same rows and pictures on any number of threads. Throws OptionError, ContractError,
/// FileError.
[[nodiscard]] Reproduction reproduce_m03(const TrackingReproductionOptions& options,
                                         Executor& executor,
                                         const ReproductionProgress& progress = {});

struct HomingReproductionOptions {
  std::filesystem::path out;    ///< folder for pictures; made when it is not there
  int scenes = 5;               ///< variants of the arena, >= 2; figures are of the first
  int goals_every = 1;          ///< of the first arena's places every so-many-th is a goal, >= 1
  int goals_every_further = 4;  ///< the same in the others
  double spacing_m = 0.025;     ///< of the places, 0.01 .. 0.1
  std::uint64_t seed = 101;     ///< of the first scene; the others follow it
  int starts = 200;             ///< of runs home in each Gazebo world, >= 1; fewer elsewhere
  /// Folder of the Gazebo worlds (docs/formats.md); empty: these are left out.
  std::filesystem::path data;
};

/// The same as a smoke run: two arenas, places 5 cm apart, few goals.
[[nodiscard]] HomingReproductionOptions quick_run(HomingReproductionOptions options);

/// Visual homing as in [S06] sections 2 to 5: figures 3 and 6 to 16, over all pairs of places of
/// the toy house arena, recorded twice; Fourier homing as published and as ours, and homing by
/// expected images. Then what S06 leaves to others: closed-loop runs home in built-in scenes,
/// tilted too, and in Gazebo worlds, and chains of snapshots. Same options: same rows, but for
/// times (unit us) and what is made of them (unit x), and same pictures on any number of threads.
/// Throws ContractError, FileError.
[[nodiscard]] Reproduction reproduce_s06(const HomingReproductionOptions& options,
                                         Executor& executor,
                                         const ReproductionProgress& progress = {});

struct MappingReproductionOptions {
  std::filesystem::path out;  ///< folder for pictures; made when it is not there
  int scenes = 20;            ///< variants of `loop` and of `lab`, >= 2; fewer of the others
  int runs = 20;              ///< paths in each Gazebo world, >= 1
  int views = 200;            ///< of the first set, >= 10; the second has three quarters of them
  int max_views = 10'000;     ///< of the largest map, >= 100
  int columns = 512;          ///< of the views
  std::uint64_t seed = 1;     ///< of the first scene; the others follow it
  /// Folder of the recordings and Gazebo worlds (docs/formats.md); empty: these are left out.
  std::filesystem::path data;
};

/// The same as a smoke run: two scenes, small maps.
[[nodiscard]] MappingReproductionOptions quick_run(MappingReproductionOptions options);

/// Visual odometry and topological maps as in [F11] (figures 4 to 6), and what its authors left to
/// later work: closed loops, maps of many views, other worlds and recordings. Same options: same
/// rows, but for times (units ms, us, s), and same pictures on any number of threads. Throws
/// ContractError, FileError.
[[nodiscard]] Reproduction reproduce_f11(const MappingReproductionOptions& options,
                                         Executor& executor,
                                         const ReproductionProgress& progress = {});

struct RouteReproductionOptions {
  std::filesystem::path out;  ///< folder for pictures; made when it is not there
  int scenes = 50;            ///< variants of the lab, >= 2
  int swept = 10;             ///< of these take part in the sweeps, 1 to scenes
  int runs = 50;              ///< along routes of 60 m in each place, >= 2
  std::uint64_t seed = 801;   ///< of the first scene; the others follow it
  /// Folder of the recording and Gazebo worlds (docs/formats.md); empty: these are left out.
  std::filesystem::path data;
};

/// The same as a smoke run: two variants, two runs.
[[nodiscard]] RouteReproductionOptions quick_run(RouteReproductionOptions options);

/// Route panoramas as in [Y03] section 5: a drive across a straight path through the lab, in the
/// scene as memorised and changed, by the direct fit and by the dual contours as published; sparse
/// lines, a wrong scale of the odometry, a closed loop to a goal off the path; sweeps over the
/// spacing of the lines, the distance from the path and the margin of the contours. Then what the
/// paper leaves to others: routes of 60 m repeated in closed loop through `loop` and Gazebo worlds,
/// their size in a file, a real route. Same options: same rows, but for times (unit ms), and same
/// pictures on any number of threads. Throws ContractError, FileError.
[[nodiscard]] Reproduction reproduce_y03(const RouteReproductionOptions& options,
                                         Executor& executor,
                                         const ReproductionProgress& progress = {});

struct ElsewhereReproductionOptions {
  std::filesystem::path out;  ///< folder for pictures; made when it is not there
  /// Built-in scenes that take part; Gazebo worlds and recordings are those that are there.
  std::vector<std::string> built_in{"office", "hall", "lab", "loop", "corridor", "garden"};
  int scenes = 3;             ///< variants of each, >= 1
  int queries = 60;           ///< in each variant, and pairs of views in each range, >= 4
  int runs = 40;              ///< homing runs and missions in each place, >= 2
  int rows = 80;              ///< of the views
  bool floors = true;         ///< whole floors of the worlds are arranged
  int days = 30;              ///< that a place changes while its memory learns, >= 1
  int day_pictures = 120;     ///< of a robot's way on each of them, half a metre apart, >= 4
  int walks = 20;             ///< through each place whose memories are merged, pair by pair, >= 2
  int walk_pictures = 600;    ///< of each of them, 10 cm apart, >= 32
  std::uint64_t seed = 5001;  ///< of the first variant; the others follow it
  /// Folder of the recordings and Gazebo worlds (docs/formats.md); empty: these are left out.
  std::filesystem::path data;
};

/// The same as a smoke run: one variant of two scenes, few queries and runs, no arranged floors.
[[nodiscard]] ElsewhereReproductionOptions quick_run(ElsewhereReproductionOptions options);

/// How all of it does on ground where it was not made, beside rivals: places known and unknown,
/// stated radii, home vectors between views of one place and of two, robots that tilt, whole floors
/// arranged by similarity, sparse real recordings. Same options: same rows, but for times (unit
/// ms), and same pictures on any number of threads. Throws ContractError, FileError.
[[nodiscard]] Reproduction reproduce_elsewhere(const ElsewhereReproductionOptions& options,
                                               Executor& executor,
                                               const ReproductionProgress& progress = {});

struct NavigationReproductionOptions {
  std::filesystem::path out;  ///< folder for pictures; made when it is not there
  int scenes = 4;             ///< variants of each scene and drives through each world, >= 2
  int runs = 100;             ///< in each kind of place, shared by its variants, >= scenes
  std::uint64_t seed = 1001;  ///< of the first scene; the others follow it
  /// Folder of the Gazebo worlds (docs/formats.md); empty: these are left out.
  std::filesystem::path data;
};

/// The same as a smoke run: two variants, two runs in each kind of place.
[[nodiscard]] NavigationReproductionOptions quick_run(NavigationReproductionOptions options);

/// Going somewhere over the memory as in [M04] section 3.5, where its authors left it to later
/// work: drives through corridors and Gazebo worlds mapped by visual odometry, other light and
/// moved objects, a robot that is kidnapped, tours of several goals, people who walk about, a
/// recorded route, blocked edges. Same options: same rows and pictures on any number of threads.
/// Throws ContractError, FileError.
[[nodiscard]] Reproduction reproduce_navigation(const NavigationReproductionOptions& options,
                                                Executor& executor,
                                                const ReproductionProgress& progress = {});

}  // namespace panonav::lab
