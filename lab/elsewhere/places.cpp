// Recognition of own and foreign places, and the correctness of the stated probability, radius and
// covariance.

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "lab/elsewhere/experiments.hpp"
#include "lab/runs/place_experiment.hpp"
#include "lab/runs/tracking_filter.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/random.hpp"
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

/// Starts of the bins in which stated probabilities of places are compared with what is right.
const std::vector<double> probability_bins{0.0, 0.5, 0.7, 0.9, 0.97};
/// An answer with at least this probability counts as sure.
constexpr double sure_probability = 0.97;

void add_calibration(Reproduction& result, const std::string& id, const std::string& what,
                     const Calibration& calibration) {
  ResultRow& row = add_row(result, id,
                           what +
                               ": mean difference of stated probability and share "
                               "that is right, over five bins",
                           calibration.error(), "", at_most(0.05));
  row.over = std::to_string(calibration.count()) + " answers: " + calibration.describe();
}

/// Statements of a tracker whose robot is kidnapped again and again.
struct KidnapStatements {
  static constexpr double right_radius_m = 1.0;
  static constexpr std::size_t early_images = 3;  ///< after a kidnapping

  Calibration calibration{probability_bins};  ///< of poses that are reported as localised
  Rates sure;                                 ///< share of sure poses that are right
  std::size_t early_sure = 0;                 ///< sure poses among the first images
  std::size_t early_right = 0;                ///< of these, right
  std::size_t kidnappings = 0;
  std::vector<double> images_until_right;  ///< after each kidnapping that a right answer follows

  struct Image {
    std::size_t since_kidnapping = 0;  ///< 1: the first image; 0: before the first kidnapping
    bool localised = false;
    double probability = 0.0;
    bool right = false;
  };
  /// Adds the images of one walk; returns the number of sure ones, and of right ones among them.
  std::pair<std::size_t, std::size_t> add(const std::vector<Image>& images) {
    std::size_t sure_images = 0;
    std::size_t right_images = 0;
    bool is_waiting = false;
    for (const Image& image : images) {
      if (image.since_kidnapping == 1) {
        is_waiting = true;
        ++kidnappings;
      }
      if (!image.localised) continue;
      calibration.add(image.probability, image.right);
      if (is_waiting && image.right) {
        images_until_right.push_back(static_cast<double>(image.since_kidnapping));
        is_waiting = false;
      }
      if (image.probability < sure_probability) continue;
      ++sure_images;
      right_images += image.right ? 1 : 0;
      if (image.since_kidnapping == 0 || image.since_kidnapping > early_images) continue;
      ++early_sure;
      early_right += image.right ? 1 : 0;
    }
    return {sure_images, right_images};
  }
};

/// Tracks a run and compares each estimate with the truth.
std::vector<KidnapStatements::Image> track_kidnapped_run(const TrackingPlace& place,
                                                         const TrackingRun& run,
                                                         std::uint64_t seed) {
  std::vector<KidnapStatements::Image> images;
  std::size_t since_kidnapping = 0;
  static_cast<void>(track_run(
      place, run, {}, seed,
      [&](std::size_t step, const MonteCarloLocaliser&, const MonteCarloEstimate& estimate) {
        const TrackingStep& there = run.steps[step];
        if (step > 0 && !there.moved) {
          since_kidnapping = 1;
        } else if (since_kidnapping > 0) {
          ++since_kidnapping;
        }
        const bool localised = estimate.state == LocalisationState::localised;
        images.push_back(
            {.since_kidnapping = since_kidnapping,
             .localised = localised,
             .probability = estimate.probability,
             .right = localised && distance(*estimate.position, there.truth.position()) <=
                                       KidnapStatements::right_radius_m});
      }));
  return images;
}

void report_kidnappings(const KidnapStatements& found, Reproduction& result) {
  const std::string id = "elsewhere.kidnapped.";
  const std::string what = "walks in pieces that were put into another order: ";
  const std::string sure = what + "poses stated with at least 0.97 that are right within 1 m";
  add_calibration(result, id + "calibration", what + "poses reported as localised",
                  found.calibration);
  if (found.sure.trials > 0) {
    add_rate(result, id + "sure", sure, found.sure.successes, found.sure.trials, at_least(0.97));
    result.rows.back().over += "; " + found.sure.describe_extreme(false);
  }
  if (found.early_sure > 0) {
    add_rate(result, id + "sure_early", sure + ", of the first three images after a kidnapping",
             found.early_right, found.early_sure, at_least(0.97));
  }
  if (found.kidnappings == 0) return;
  add_rate(result, id + "again", what + "kidnappings after which the robot is localised again",
           found.images_until_right.size(), found.kidnappings, at_least(0.9));
  if (found.images_until_right.empty()) return;
  add_row(result, id + "images", what + "images until then",
          median_figure(found.images_until_right), "images", at_most(3.0))
      .over = "median of " + std::to_string(found.images_until_right.size());
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

void ElsewhereExperiments::reproduce_stated_places() {
  const auto all_conditions = place_conditions();
  const std::vector<PlaceCondition> conditions(all_conditions.begin(), all_conditions.begin() + 2);
  Calibration calibration(probability_bins);
  Rates sure;
  std::size_t wrong = 0;
  std::size_t named = 0;
  for (const RecordedGround& ground : grounds) {
    std::size_t sure_answers = 0;
    std::size_t right_answers = 0;
    for (const simulation::PlaceRecording& place : ground.variants) {
      for (const StatedPlace& answer : collect_stated_places(place, conditions, executor)) {
        if (!answer.known) continue;
        calibration.add(answer.probability, answer.right);
        if (answer.probability >= sure_probability) {
          ++sure_answers;
          right_answers += answer.right ? 1 : 0;
        }
        if (answer.right) continue;
        ++wrong;
        named += answer.right_is_named ? 1 : 0;
      }
    }
    if (sure_answers > 0)
      sure.add(ground.name, success_rate(right_answers, sure_answers), sure_answers);
  }
  if (calibration.count() == 0) return;
  const std::string id = "elsewhere.stated.";
  const std::string what = "known places, as memorised and with columns hidden: ";
  add_calibration(result, id + "calibration", what + "nearest reference or beside it", calibration);
  if (sure.trials > 0) {
    add_rate(result, id + "sure", what + "right of those stated with at least 0.97", sure.successes,
             sure.trials, at_least(0.97));
    result.rows.back().over += "; " + sure.describe_extreme(false);
  }
  if (wrong == 0) return;
  add_rate(result, id + "named",
           what + "wrong ones that name the right place as another possibility", named, wrong,
           at_least(0.9));
}

void ElsewhereExperiments::reproduce_shuffled_walks() {
  constexpr std::size_t piece = 10;  // images; 2.5 m
  constexpr int pieces = 6;
  KidnapStatements statements;
  for (const RecordedGround& ground : grounds) {
    const simulation::PlaceRecording& place = ground.variants.front();
    const auto remembered = make_tracking_place(place, executor);
    const auto walks = record_walks(place, *remembered, make_clean_condition(),
                                    {.variants = 1,
                                     .runs_each = std::max(1, options.runs / 4),
                                     .images = pieces * static_cast<int>(piece),
                                     .seed = options.seed + 1},
                                    executor);
    const auto tracked = simulation::make_each(executor, walks.size(), [&](std::size_t i) {
      if (walks[i].steps.size() < 3 * piece) return std::vector<KidnapStatements::Image>{};
      Random random(options.seed + 1, i);
      return track_kidnapped_run(*remembered, shuffle_pieces(walks[i], piece, random),
                                 options.seed + i);
    });
    std::size_t sure = 0;
    std::size_t right = 0;
    for (const auto& images : tracked) {
      const auto [sure_images, right_images] = statements.add(images);
      sure += sure_images;
      right += right_images;
    }
    if (sure > 0) statements.sure.add(ground.name, success_rate(right, sure), sure);
  }
  if (statements.calibration.count() > 0) report_kidnappings(statements, result);
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
