#include "lab/reproduction.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <system_error>

#include "lab/elsewhere/experiments.hpp"
#include "lab/experiments.hpp"
#include "lab/m03/experiments.hpp"
#include "panonav/core/error.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

namespace {

ReproductionPlan plan_f11(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 2},
                  {"runs", options.runs, 1},
                  {"views", options.views, 10},
                  {"max_views", options.max_views, 100}});
  require(options.columns >= 132, "columns", options.columns, ">= 132, twice the components");
  MappingExperiments f11{context};
  ReproductionPlan plan{{12.0 * options.scenes, [=] { f11.reproduce_first_set(); }},
                        {14.0 * options.scenes, [=] { f11.reproduce_second_set(); }},
                        {4.0 * options.scenes, [=] { f11.measure_wide_room(); }},
                        {1.0, [=] { f11.measure_step_time(); }},
                        {15.0, [=] { f11.reproduce_identical_doors(); }}};
  for (const std::string& name : simulation::find_worlds(options.data)) {
    plan.push_back({10.0 * options.runs, [=] { f11.reproduce_world(name); }});
  }
  plan.push_back({5.0, [=] { f11.reproduce_recordings(); }});
  plan.push_back({0.02 * options.max_views, [=] { f11.measure_large_maps(); }});
  return plan;
}

ReproductionPlan plan_navigation(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 2}, {"runs", options.runs, options.scenes}});
  NavigationExperiments navigation{context};
  ReproductionPlan plan;
  std::vector<std::string> scenes = simulation::find_worlds(options.data);
  scenes.insert(scenes.begin(), {"loop", "corridor"});
  for (const std::string& scene : scenes) {
    plan.push_back({9.0, [=] { navigation.reproduce_drive_missions(scene); }});
  }
  plan.push_back({4.0, [=] { navigation.reproduce_tours(); }});
  plan.push_back({3.0, [=] { navigation.reproduce_route_missions(); }});
  plan.push_back({2.0, [=] { navigation.reproduce_blocked_missions(); }});
  std::vector<std::string> explored{"office", "lab", "loop"};
  if (simulation::has_scene(options.data, "small_house")) explored.emplace_back("small_house");
  for (const std::string& scene : explored) {
    plan.push_back({2.0, [=] { navigation.reproduce_explorations(scene); }});
  }
  return plan;
}

ReproductionPlan plan_y03(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 2}, {"runs", options.runs, 2}});
  require(options.swept >= 1 && options.swept <= options.scenes, "swept", options.swept,
          "1 to scenes");
  const double routes = 3.0 * options.runs;
  const RouteExperiments y03{context};
  ReproductionPlan plan{{3.0 * options.scenes, [=] { y03.reproduce_lab_drives(); }},
                        {routes, [=] { y03.reproduce_loop_routes(); }}};
  for (const std::string& world : simulation::find_worlds(options.data)) {
    plan.push_back({routes, [=] { y03.reproduce_world_routes(world); }});
  }
  if (simulation::has_data(options.data, "sussex_route")) {
    plan.push_back({1.0, [=] { y03.reproduce_real_route(); }});
  }
  return plan;
}

ReproductionPlan plan_routes(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 1}, {"runs", options.runs, options.scenes}});
  require(!options.built_in.empty(), "built-in scenes", 0.0, ">= 1");
  const RouteMethodExperiments scenes{context};
  const RouteMethodExperiments worlds{context};
  // Worlds of a few rooms have no room for long routes.
  const auto is_large = [](const std::string& scene) {
    return scene == "street" || scene == "industrial_hall" || scene == "garden";
  };
  ReproductionPlan plan;
  for (const std::string& scene : options.built_in) {
    if (!simulation::has_scene(options.data, scene)) continue;
    const RouteMethodExperiments routes = is_large(scene) ? scenes : worlds;
    int count = options.runs;
    for (const double length_m : options.route_lengths_m) {
      if (length_m <= 60.0 || is_large(scene)) {
        plan.push_back({count * length_m, [=] { routes.compare_routes(scene, length_m, count); }});
      }
      count = (count + 1) / 2;
    }
  }
  plan.push_back({1.0, [=] { scenes.report_all_routes(); }});
  const double length_m = options.route_lengths_m.front();
  for (const std::string& scene : options.built_in) {
    if (!is_large(scene) && scene != options.built_in.front()) continue;
    if (!simulation::has_scene(options.data, scene)) continue;
    plan.push_back(
        {7.0 * options.runs * length_m, [=] { scenes.compare_conditions(scene, length_m); }});
  }
  return plan;
}

ReproductionPlan plan_elsewhere(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 1},
                  {"queries", options.queries, 4},
                  {"runs", options.runs, 2},
                  {"days", options.days, 1},
                  {"day_pictures", options.day_pictures, 4},
                  {"walks", options.walks, 2},
                  {"walk_pictures", options.walk_pictures, 32}});
  require(!options.built_in.empty(), "built-in scenes", 0.0, ">= 1");
  const auto elsewhere = std::make_shared<ElsewhereExperiments>(ElsewhereExperiments{context});
  ReproductionPlan plan;
  for (const std::string& name : elsewhere->list_ground_names()) {
    plan.push_back({10.0, [=] { elsewhere->record_ground(name); }});
  }
  plan.push_back({100.0, [=] { elsewhere->reproduce_known_places(); }});
  plan.push_back({40.0, [=] { elsewhere->reproduce_stated_places(); }});
  plan.push_back({20.0, [=] { elsewhere->reproduce_buildings(); }});
  plan.push_back({40.0, [=] { elsewhere->reproduce_tracked_poses(); }});
  plan.push_back({50.0, [=] { elsewhere->reproduce_shuffled_walks(); }});
  plan.push_back({80.0, [=] { elsewhere->reproduce_drives(); }});
  plan.push_back({60.0, [=] { elsewhere->reproduce_home_vectors(); }});
  plan.push_back({60.0, [=] {
                    elsewhere->grounds.clear();
                    elsewhere->reproduce_tilted_homing();
                  }});
  for (const char* const recording : {"ciirc_b670", "gantry_plants", "indoor_walk_360"}) {
    if (!simulation::has_data(options.data, recording)) continue;
    const std::filesystem::path folder = options.data / recording;
    plan.push_back({20.0, [=] { elsewhere->reproduce_leave_one_out(folder); }});
  }
  std::vector<std::filesystem::path> posed;
  for (const char* const recording : {"ciirc_b670", "gantry_plants", "sussex_route"}) {
    if (simulation::has_data(options.data, recording)) posed.push_back(options.data / recording);
  }
  if (!posed.empty()) plan.push_back({3.0, [=] { elsewhere->reproduce_orientation(posed); }});
  for (const char* const name : {"office", "small_warehouse"}) {
    if (!simulation::has_scene(options.data, name)) continue;
    plan.push_back({60.0, [=] { elsewhere->reproduce_days(name); }});
  }
  plan.push_back({200.0, [=] { elsewhere->reproduce_merging(); }});
  if (!options.floors) return plan;
  for (const std::string& world : simulation::list_available_worlds(options.data)) {
    for (const double spacing_m : {0.5, 0.3}) {
      plan.push_back({60.0, [=] { elsewhere->reproduce_floor(world, spacing_m); }});
    }
  }
  return plan;
}

ReproductionPlan plan_m03(const Experiments& context) {
  const ReproductionOptions& options = context.options;
  require_minima({{"scenes", options.scenes, 1},
                  {"variants", options.variants, 1},
                  {"runs", options.runs, 2}});
  const auto parts = tracking_reproduction_parts();
  if (!options.only.empty() && std::ranges::find(parts, options.only) == parts.end()) {
    throw ContractError("only", options.only,
                        "office, corridor, sparse, garden, leaving, worlds, recordings");
  }
  const auto m03 = std::make_shared<TrackingExperiments>(TrackingExperiments{context});
  ReproductionPlan plan;
  const auto add = [&](std::string_view part, double cost, std::function<void()> run) {
    if (options.only.empty() || options.only == part) plan.push_back({cost, std::move(run)});
  };
  const double scenes = options.scenes;
  for (int s = 0; s < options.scenes; ++s) add("office", 20.0, [=] { m03->record_office(s); });
  add("office", 3.0 * scenes, [=] { m03->reproduce_global_localisation(); });
  add("office", scenes, [=] { m03->reproduce_position_tracking(); });
  add("office", scenes, [=] { m03->reproduce_kidnapping(); });
  add("office", 10.0 * scenes, [=] { m03->reproduce_sweeps(); });
  add("corridor", 10.0 * scenes, [=] { m03->reproduce_corridor(); });
  add("sparse", scenes, [=] { m03->reproduce_sparse_corridor(); });
  add("garden", 10.0 * scenes, [=] { m03->reproduce_garden(); });
  for (const char* const scene : {"hall", "loop"}) {
    add("leaving", 5.0 * scenes, [=] { m03->reproduce_leaving(scene); });
  }
  for (const std::string& world : simulation::find_worlds(options.data)) {
    add("worlds", 50.0, [=] { m03->reproduce_gazebo_world(world); });
  }
  if (simulation::has_data(options.data, "sussex_route")) {
    add("recordings", 10.0, [=] { m03->reproduce_recorded_route(); });
  }
  if (simulation::has_data(options.data, "gantry_plants")) {
    add("recordings", 10.0, [=] { m03->reproduce_gantry(); });
  }
  return plan;
}

struct Paper {
  std::string_view name;
  ReproductionOptions full;
  ReproductionOptions quick;
  ReproductionPlan (*plan)(const Experiments& context);
};

const Paper& find_paper(std::string_view name) {
  static const std::array<Paper, 8> papers{{
      {"f11",
       {.seed = 901, .scenes = 20, .runs = 20},
       {.seed = 901, .scenes = 2, .runs = 1, .columns = 256, .max_views = 1000},
       plan_f11},
      {"m03",
       {.seed = 601, .scenes = 10, .runs = 4},
       {.seed = 601, .scenes = 1, .runs = 3, .variants = 2},
       plan_m03},
      {"m04",
       {.scenes = 20, .runs = 100},
       {.scenes = 2,
        .runs = 2,
        .queries = 15,
        .fine_lattice_every = 0,
        .mission_grids = {{"office", 0.3}},
        .mission_scenes = 1},
       plan_m04},
      {"navigation",
       {.seed = 1001, .scenes = 4, .runs = 100},
       {.seed = 1001, .scenes = 2, .runs = 2},
       plan_navigation},
      {"s06",
       {.seed = 101, .scenes = 5},
       {.seed = 101,
        .scenes = 2,
        .goals_every = 4,
        .goals_every_further = 8,
        .spacing_m = 0.05,
        .starts = 20},
       plan_s06},
      {"y03",
       {.seed = 801, .scenes = 50, .runs = 50},
       {.seed = 801, .scenes = 2, .runs = 2, .swept = 1},
       plan_y03},
      {"elsewhere",
       {.seed = 5001, .scenes = 3, .runs = 40, .queries = 60},
       {.seed = 5001,
        .scenes = 1,
        .runs = 2,
        .queries = 8,
        .built_in = {"office", "lab"},
        .floors = false,
        .days = 3,
        .day_pictures = 20,
        .walks = 2,
        .walk_pictures = 40},
       plan_elsewhere},
      {"routes",
       {.seed = 9001,
        .scenes = 2,
        .runs = 8,
        .built_in = {"industrial_hall", "street", "garden", "industrial_warehouse",
                     "small_warehouse", "small_house"}},
       {.seed = 9001, .scenes = 1, .runs = 1, .built_in = {"hall"}, .route_lengths_m = {15.0}},
       plan_routes},
  }};
  const auto found = std::ranges::find(papers, name, &Paper::name);
  if (found != papers.end()) return *found;
  throw ContractError("paper", name, "f11, m03, m04, navigation, s06, y03, elsewhere, routes");
}

}  // namespace

simulation::PanoramaRendering Experiments::make_rendering(int rows, int columns,
                                                          int pixel_size) const {
  if (options.optics == Optics::mirror)
    return simulation::make_mirror_rendering(rows, columns, std::nullopt, pixel_size);
  return {.rows = rows, .columns = columns, .rays_per_axis = 1};
}

std::optional<simulation::PanoramaRendering> Experiments::make_common_rendering(int rows,
                                                                                int columns) const {
  if (options.optics != Optics::mirror) return std::nullopt;
  const ElevationBand mirror = simulation::make_mirror_rendering(rows, columns).elevations;
  const ElevationBand panorama = simulation::PanoramaRendering{}.elevations;
  return simulation::make_mirror_rendering(
      rows, columns,
      ElevationBand{std::max(mirror.bottom_rad, panorama.bottom_rad),
                    std::min(mirror.top_rad, panorama.top_rad)});
}

void require_minima(std::initializer_list<OptionMinimum> options) {
  for (const auto& [name, value, min] : options) {
    require(value >= min, name, value, ">= " + std::to_string(min));
  }
}

ReproductionOptions default_options(std::string_view paper, bool quick) {
  const Paper& found = find_paper(paper);
  return quick ? found.quick : found.full;
}

Reproduction reproduce(std::string_view paper, const ReproductionOptions& options,
                       Executor& executor, const ReproductionProgress& progress) {
  Reproduction result{.out = options.out};
  const ReproductionPlan stages = find_paper(paper).plan({options, executor, result});
  std::error_code error;
  std::filesystem::create_directories(options.out, error);
  if (error) throw FileError(options.out.string(), "cannot be created: " + error.message());
  double all = 0.0;
  for (const ReproductionStage& stage : stages) all += stage.cost;
  double done = 0.0;
  for (const ReproductionStage& stage : stages) {
    if (progress) progress(done / all);
    stage.run();
    done += stage.cost;
  }
  if (progress) progress(1.0);
  return result;
}

}  // namespace panonav::lab
