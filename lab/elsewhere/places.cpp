// Recognition of own and foreign places, and the correctness of the stated radius and covariance.

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "lab/elsewhere/experiments.hpp"
#include "lab/runs/place_experiment.hpp"
#include "lab/runs/tracking_filter.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

namespace {

constexpr int columns = 256;
constexpr double spacing_m = 0.5;

std::string parse_ground_name(const std::string& place) {
  return place.substr(0, place.rfind(' '));
}

/// Recognition rates of one kind for several places.
struct Rates {
  std::size_t successes = 0;
  std::size_t trials = 0;
  std::vector<double> each;
  std::map<std::string, double> named;

  void add(const std::string& name, const Proportion& rate, std::size_t count) {
    trials += count;
    successes += static_cast<std::size_t>(rate.value * static_cast<double>(count) + 0.5);
    each.push_back(rate.value);
    named[name] = rate.value;
  }
  [[nodiscard]] std::string describe_extreme(bool highest) const {
    const auto by_value = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto found = highest ? std::ranges::max_element(named, by_value)
                               : std::ranges::min_element(named, by_value);
    if (found == named.end()) return {};
    const auto percent = static_cast<int>(100.0 * found->second + 0.5);
    return (highest ? "the highest is " : "the lowest is ") + std::to_string(percent) + " %, of " +
           found->first;
  }
};

/// Adds the median rate over the variants, with the confidence interval of all trials together.
void add_rates(Reproduction& result, const std::string& id, const std::string& what,
               const Rates& rates, Target target) {
  const Proportion all = success_rate(rates.successes, rates.trials);
  ResultRow& row =
      add_row(result, id, what, {median(rates.each), std::pair{all.low, all.high}}, "", target);
  row.over = "median of " + std::to_string(rates.each.size()) + ", of " +
             std::to_string(rates.trials) + " places in all; " + rates.describe_extreme(false);
}

/// Adds the results for own places of one ground, in clean and in hard conditions.
void add_own_places(const ElsewhereExperiments& elsewhere, const RecordedGround& ground) {
  const auto all_conditions = place_conditions();
  const std::vector<PlaceCondition> conditions(all_conditions.begin(), all_conditions.begin() + 2);
  const std::array<std::string, 2> ids{"clean", "hard"};
  const std::array<double, 2> targets{0.97, 0.93};
  const auto query_count = static_cast<std::size_t>(elsewhere.options.queries);
  std::array<Rates, 2> known;
  std::array<Rates, 2> near;
  Rates inside;
  for (const simulation::PlaceRecording& place : ground.variants) {
    const std::string name = ground.name + " " + std::to_string(place.seed);
    const auto measured = run_place_experiment(place, conditions, elsewhere.executor);
    for (std::size_t c = 0; c < conditions.size(); ++c) {
      known[c].add(name, measured[c].known, query_count);
      near[c].add(name, measured[c].nearest_or_neighbour, query_count);
    }
    inside.add(name, measured[0].inside, query_count);
  }
  Reproduction& result = elsewhere.result;
  for (std::size_t c = 0; c < conditions.size(); ++c) {
    const std::string id = "elsewhere.places." + ground.name + "." + ids[c];
    const std::string where = ground.name + ", references every " + format_centimetres(spacing_m) +
                              ", " + conditions[c].name;
    add_rates(result, id + ".known", where + ": own places known", known[c], at_least(targets[c]));
    add_rates(result, id + ".near",
              where + ": the best match is the nearest reference or beside it", near[c],
              at_least(0.9));
  }
  const std::string id = "elsewhere.places." + ground.name + ".radius";
  const std::string what = ground.name + ": positions within the stated 95 % radius";
  add_rates(result, id, what, inside, at_least(0.9));
  add_rates(result, id + "_not_too_wide", what + " (more: wider than need be)", inside,
            at_most(0.98));
}

}  // namespace

std::vector<std::string> ElsewhereExperiments::list_ground_names() const {
  std::vector<std::string> names = options.built_in;
  for (const std::string& world : simulation::list_available_worlds(options.data))
    names.push_back(world);
  return names;
}

void ElsewhereExperiments::record_ground(const std::string& name) {
  RecordedGround ground{.name = name};
  const bool is_built_in =
      std::ranges::find(simulation::scene_names(), name) != simulation::scene_names().end();
  for (int i = 0; i < (is_built_in ? options.scenes : 1); ++i) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(i);
    simulation::Scene scene = simulation::make_or_read_scene(options.data, name, {.seed = seed});
    scene.name = name;
    ground.variants.push_back(simulation::record_place(std::move(scene),
                                                       {.seed = seed,
                                                        .spacing_m = spacing_m,
                                                        .queries = options.queries,
                                                        .rows = options.rows,
                                                        .columns = columns},
                                                       executor));
  }
  grounds.push_back(std::move(ground));
}

void ElsewhereExperiments::reproduce_known_places() {
  std::vector<const simulation::PlaceRecording*> places;
  for (const RecordedGround& ground : grounds) {
    for (const simulation::PlaceRecording& place : ground.variants) places.push_back(&place);
    add_own_places(*this, ground);
  }
  Rates other;
  Rates variant;
  for (const RecognitionRate& rate : measure_recognition_rates(places, executor)) {
    if (rate.memory == rate.queries) continue;
    const std::string name = rate.queries + " in " + rate.memory;
    (parse_ground_name(rate.memory) == parse_ground_name(rate.queries) ? variant : other)
        .add(name, rate.known, static_cast<std::size_t>(options.queries));
  }
  const auto add_foreign = [&](const std::string& id, const std::string& what, const Rates& rates,
                               double max_rate) {
    if (rates.trials == 0) return;
    add_rate(result, "elsewhere.places." + id, what, rates.successes, rates.trials,
             at_most(max_rate));
    result.rows.back().over += "; " + rates.describe_extreme(true);
  };
  add_foreign("other", "places of other scenes and worlds recognised as own", other, 0.01);
  add_foreign("variant", "places of another variant of the same scene recognised as own", variant,
              0.05);
}

void ElsewhereExperiments::reproduce_buildings() {
  Rates known;
  Rates right;
  Rates inside;
  double max_spacing_ratio = 0.0;
  for (const RecordedGround& ground : grounds) {
    if (ground.variants.size() < 2) continue;
    const std::array floors{&ground.variants[0], &ground.variants[1]};
    const BuildingResult found = run_building_experiment(floors, executor);
    known.add(ground.name, success_rate(found.known, found.queries), found.queries);
    if (found.known > 0)
      right.add(ground.name, success_rate(found.right_floor, found.known), found.known);
    if (found.stated > 0)
      inside.add(ground.name, success_rate(found.inside, found.stated), found.stated);
    max_spacing_ratio = std::max(max_spacing_ratio, std::max(found.learnt_spacing_m / spacing_m,
                                                             spacing_m / found.learnt_spacing_m));
  }
  if (known.trials == 0) return;
  const auto add = [&](const std::string& id, const std::string& what, const Rates& rates,
                       double min_rate) {
    add_rate(result, "elsewhere.buildings." + id,
             "two variants of a scene as floors of one building: " + what, rates.successes,
             rates.trials, at_least(min_rate));
    result.rows.back().over += "; " + rates.describe_extreme(false);
  };
  constexpr double min_right = 239.0 / 240.0;
  add("known", "places known", known, 0.97);
  add("floor", "known places on the right floor", right, min_right);
  add("radius", "positions on the right floor and within the stated 95 % radius", inside, 0.9);
  add_row(result, "elsewhere.buildings.spacing",
          "the same: largest ratio of learnt and true spacing of the references", max_spacing_ratio,
          "", at_most(1.01));
}

void ElsewhereExperiments::reproduce_tracked_poses() {
  // Quantiles of chi squared with two degrees of freedom.
  constexpr double quantile_95 = 5.991;
  constexpr double quantile_50 = 1.386;
  for (const RecordedGround& ground : grounds) {
    const simulation::PlaceRecording& place = ground.variants.front();
    const auto remembered = make_tracking_place(place, executor);
    const auto walks = record_walks(
        place, *remembered, make_clean_condition(),
        {.variants = 1, .runs_each = std::max(1, options.runs / 2), .seed = options.seed},
        executor);
    const auto squares = simulation::make_each(executor, walks.size(), [&](std::size_t i) {
      std::vector<double> found;
      const auto observe = [&](std::size_t step, const MonteCarloLocaliser&,
                               const MonteCarloEstimate& estimate) {
        const TrackingStep& there = walks[i].steps[step];
        if (estimate.state != LocalisationState::localised || !there.view) return;
        const PoseMode& mode = estimate.modes.front();
        const auto& c = mode.covariance;  // of 3 x 3, row-major
        const double x_m = there.truth.x_m - mode.mean.x_m;
        const double y_m = there.truth.y_m - mode.mean.y_m;
        found.push_back((c[4] * x_m * x_m - 2.0 * c[1] * x_m * y_m + c[0] * y_m * y_m) /
                        (c[0] * c[4] - c[1] * c[1]));
      };
      static_cast<void>(track_run(*remembered, walks[i], {}, options.seed + i, observe));
      return found;
    });
    std::vector<double> all;
    for (const auto& some : squares) all.insert(all.end(), some.begin(), some.end());
    if (all.empty()) continue;
    const auto inside = count_where(all, [](double square) { return square <= quantile_95; });
    const std::string id = "elsewhere.tracks." + ground.name;
    add_rate(result, id + ".ellipse",
             ground.name + ", walks: tracked poses within the 95 % ellipse of their covariance",
             inside, all.size(), at_least(0.9));
    result.rows.back().over += "; the median squared error is " +
                               format_fixed(median(all) / quantile_50, 2) +
                               " times that of a Gaussian with this covariance";
  }
}

}  // namespace panonav::lab
