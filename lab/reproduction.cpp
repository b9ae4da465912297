#include "lab/reproduction.hpp"

#include <algorithm>
#include <array>
#include <system_error>

#include "lab/experiments.hpp"
#include "panonav/core/error.hpp"

namespace panonav::lab {

namespace {

struct Paper {
  std::string_view name;
  ReproductionOptions full;
  ReproductionOptions quick;
  ReproductionPlan (*plan)(const Experiments& context);
};

const Paper& find_paper(std::string_view name) {
  static const std::array<Paper, 7> papers{{
      {"f11",
       {.scenes = 20, .runs = 20},
       {.scenes = 2, .runs = 1, .columns = 256, .max_views = 1000},
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
  }};
  const auto found = std::ranges::find(papers, name, &Paper::name);
  if (found != papers.end()) return *found;
  throw ContractError("paper", name, "f11, m03, m04, navigation, s06, y03, elsewhere");
}

}  // namespace

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
  if (error) throw FileError(options.out.string(), "cannot be made: " + error.message());
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
