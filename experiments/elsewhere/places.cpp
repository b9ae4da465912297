// Own places, foreign places, and the radius that is stated.

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "experiments/elsewhere/experiments.hpp"
#include "experiments/runs/place_experiment.hpp"
#include "experiments/runs/worlds.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/simulation/scenes.hpp"

namespace panonav {

namespace {

constexpr int columns = 256;
constexpr double spacing_m = 0.5;

std::string ground_of(const std::string& place) {
  return place.substr(0, place.rfind(' '));
}

/// Rates of the same kind over several places.
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
  [[nodiscard]] std::string extreme(bool highest) const {
    const auto by_value = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto found = highest ? std::ranges::max_element(named, by_value)
                               : std::ranges::min_element(named, by_value);
    if (found == named.end()) return {};
    const auto percent = static_cast<int>(100.0 * found->second + 0.5);
    return (highest ? "the highest is " : "the lowest is ") + std::to_string(percent) + " %, of " +
           found->first;
  }
};

/// The median over the variants, with the interval of all together.
void add_rates(Reproduction& result, const std::string& id, const std::string& what,
               const Rates& rates, Target target) {
  const Proportion all = success_rate(rates.successes, rates.trials);
  ResultRow& row =
      add_row(result, id, what, {median(rates.each), std::pair{all.low, all.high}}, "", target);
  row.over = "median of " + std::to_string(rates.each.size()) + ", of " +
             std::to_string(rates.trials) + " places in all; " + rates.extreme(false);
}

}  // namespace

std::vector<std::string> elsewhere_grounds(const ElsewhereReproductionOptions& options) {
  std::vector<std::string> names(options.built_in.begin(), options.built_in.end());
  for (const std::string& world : all_worlds_in(options.data)) names.push_back(world);
  return names;
}

RecordedGround record_ground(const ElsewhereReproductionOptions& options, const std::string& name,
                             Executor& executor) {
  RecordedGround ground{.name = name};
  ground.built_in = std::ranges::find(scene_names(), name) != scene_names().end();
  for (int i = 0; i < (ground.built_in ? options.scenes : 1); ++i) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(i);
    Scene scene =
        ground.built_in ? make_scene(name, {.seed = seed}) : read_world(options.data, name);
    scene.name = name;
    ground.variants.push_back(record_place(std::move(scene),
                                           {.seed = seed,
                                            .spacing_m = spacing_m,
                                            .queries = options.queries,
                                            .rows = options.rows,
                                            .columns = columns},
                                           executor));
  }
  return ground;
}

void reproduce_known_places(const ElsewhereReproductionOptions& options,
                            const std::vector<RecordedGround>& grounds, Executor& executor,
                            Reproduction& result) {
  const auto asked = static_cast<std::size_t>(options.queries);
  const auto all_conditions = place_conditions();
  const std::vector<PlaceCondition> conditions(all_conditions.begin(), all_conditions.begin() + 2);
  const std::array<std::string, 2> ids{"clean", "hard"};
  const std::array<double, 2> targets{0.97, 0.93};
  std::vector<const PlaceRecording*> places;
  for (const RecordedGround& ground : grounds) {
    std::array<Rates, 2> known;
    std::array<Rates, 2> near;
    Rates inside;
    for (const PlaceRecording& place : ground.variants) {
      places.push_back(&place);
      const std::string name = ground.name + " " + std::to_string(place.seed);
      const auto measured = run_place_experiment(place, conditions, executor);
      for (std::size_t c = 0; c < conditions.size(); ++c) {
        known[c].add(name, measured[c].known, asked);
        near[c].add(name, measured[c].nearest_or_next, asked);
      }
      inside.add(name, measured[0].inside, asked);
    }
    for (std::size_t c = 0; c < conditions.size(); ++c) {
      const std::string id = "elsewhere.places." + ground.name + "." + ids[c];
      const std::string where =
          ground.name + ", references every " + centimetres(spacing_m) + ", " + conditions[c].name;
      add_rates(result, id + ".known", where + ": own places known", known[c],
                at_least(targets[c]));
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

  Rates other;
  Rates variant;
  for (const RecognitionRate& rate : recognition_rates(places, executor)) {
    if (rate.memory == rate.queries) continue;
    const std::string name = rate.queries + " in " + rate.memory;
    (ground_of(rate.memory) == ground_of(rate.queries) ? variant : other)
        .add(name, rate.known, asked);
  }
  const auto add_foreign = [&](const std::string& id, const std::string& what, const Rates& rates,
                               double most) {
    if (rates.trials == 0) return;
    add_rate(result, "elsewhere.places." + id, what, rates.successes, rates.trials, at_most(most));
    result.rows.back().over += "; " + rates.extreme(true);
  };
  add_foreign("other", "places of other scenes and worlds taken for own", other, 0.01);
  add_foreign("variant", "places of another variant of the same scene taken for own", variant,
              0.05);
}

}  // namespace panonav
