// Catchment areas of all homing rules, over variants of the arena.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "lab/rows.hpp"
#include "lab/s06/support.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"

namespace panonav::lab {

namespace {

const std::string coarse_to_fine = "K = 2, 4, 10";
const std::string reversed = "K = 10, 4, 2";
const std::string own_vector_label = "our home vector alone";

constexpr std::array<int, 5> compared_frequencies{1, 2, 3, 5, 10};

double best_single_area(const CatchmentAreas& areas, std::size_t accepted) {
  double best = 0.0;
  for (const int highest : compared_frequencies) {
    best = std::max(best, areas.at(make_published_strategy({highest}).label)[accepted]);
  }
  return best;
}

}  // namespace

CatchmentAreas measure_catchment_areas(ArenaSurveys& surveys) {
  std::vector<HomingStrategy> strategies{make_expected_image_strategy(),
                                         make_own_strategy(),
                                         make_library_strategy(),
                                         make_published_strategy({2, 4, 10}),
                                         make_published_strategy({10, 4, 2}),
                                         make_published_strategy({1, 2, 3, 4, 6, 10})};
  for (const int highest : compared_frequencies)
    strategies.push_back(make_published_strategy({highest}));
  CatchmentAreas areas;
  for (const auto& strategy : strategies) {
    const auto values = surveys.compute_areas(strategy, s06_accepted_m);
    std::ranges::copy(values, areas[strategy.label].begin());
  }
  const HomingSurvey* const alone = &surveys.survey_own(10);
  const auto values = mean_catchment_areas(surveys.compute_final_distances(std::span(&alone, 1)),
                                           alone->goals.size(), s06_accepted_m);
  std::ranges::copy(values, areas[own_vector_label].begin());
  return areas;
}

void compare_catchment_areas(std::span<const CatchmentAreas> arenas, const Experiments& context) {
  const std::string chain = make_own_strategy().label;
  const std::string own = make_library_strategy().label;
  const std::string images = make_expected_image_strategy().label;
  const std::string many_stages = make_published_strategy({1, 2, 3, 4, 6, 10}).label;
  for (std::size_t i = 0; i < s06_accepted_m.size(); ++i) {
    const std::string id = format_centimetres_id(s06_accepted_m[i]);
    const std::string within = ", runs that end within " + format_centimetres(s06_accepted_m[i]);
    const auto add = [&](const std::string& name, const std::string& what, const std::string& unit,
                         auto figure, std::optional<Target> target,
                         std::optional<std::pair<double, double>> published = std::nullopt) {
      std::vector<double> values;
      for (const auto& areas : arenas) values.push_back(figure(areas));
      add_row(context.result, "s06." + name + "_" + id, what + within,
              mean_figure(values, context.options.seed), unit, target, published);
    };
    const auto ratio = [&](const std::string& name, const std::string& what,
                           const std::string& above, const std::string& below) {
      add(
          name, what, "", [&](const auto& a) { return a.at(above)[i] / a.at(below)[i]; },
          above == chain ? std::nullopt : std::optional(at_least(1.0)));
    };
    add(
        "area_expected_images", "mean catchment area, expected images", "places",
        [&](const auto& a) { return a.at(images)[i]; }, std::nullopt);
    add(
        "area_coarse_to_fine", "mean catchment area, " + coarse_to_fine, "places",
        [&](const auto& a) { return a.at(coarse_to_fine)[i]; }, std::nullopt);
    add(
        "area_own", "mean catchment area, " + own, "places",
        [&](const auto& a) { return a.at(own)[i]; }, std::nullopt);
    add(
        "single_against_expected_images",
        "mean catchment area of the best single K less that of expected images", "%",
        [&](const auto& a) { return 100.0 * (best_single_area(a, i) / a.at(images)[i] - 1.0); },
        std::nullopt,
        s06_accepted_m[i] == 0.1 ? std::optional(std::pair(-20.0, -20.0)) : std::nullopt);
    add(
        "coarse_to_fine_against_single",
        "mean catchment area, " + coarse_to_fine + " over the best single K", "",
        [&](const auto& a) { return a.at(coarse_to_fine)[i] / best_single_area(a, i); },
        at_least(1.0));
    ratio("coarse_to_fine_against_reverse",
          "mean catchment area, " + coarse_to_fine + " over " + reversed, coarse_to_fine, reversed);
    using NamedRule = std::pair<std::string, std::string>;
    for (const auto& [name, rule] : {NamedRule{"own", own}, NamedRule{"chain", chain}}) {
      const std::string what = "mean catchment area, " + rule + " over ";
      ratio(name + "_against_expected_images", what + images, rule, images);
      ratio(name + "_against_coarse_to_fine", what + coarse_to_fine, rule, coarse_to_fine);
      ratio(name + "_against_reverse", what + reversed, rule, reversed);
    }
    add(
        "many_stages_against_expected_images",
        "mean catchment area, " + many_stages + " over expected images", "",
        [&](const auto& a) { return a.at(many_stages)[i] / a.at(images)[i]; }, std::nullopt);
    add(
        "own_vector_against_expected_images",
        "mean catchment area, our home vector alone (K = 10) over expected images", "",
        [&](const auto& a) { return a.at(own_vector_label)[i] / a.at(images)[i]; }, std::nullopt);
  }
}

void report_variant(const std::string& id, const std::string& what, const CatchmentAreas& areas,
                    Reproduction& result) {
  for (std::size_t i = 0; i < s06_accepted_m.size(); ++i) {
    const std::string within = ", runs that end within " + format_centimetres(s06_accepted_m[i]);
    const HomingStrategy rule = make_library_strategy();
    const double own = areas.at(rule.label)[i];
    add_row(
        result,
        "s06." + id + ".own_against_expected_images_" + format_centimetres_id(s06_accepted_m[i]),
        what + ": mean catchment area, " + rule.label + " over expected images" + within,
        own / areas.at(make_expected_image_strategy().label)[i], "");
    add_row(result,
            "s06." + id + ".own_against_coarse_to_fine_" + format_centimetres_id(s06_accepted_m[i]),
            what + ": mean catchment area, " + rule.label + " over " + coarse_to_fine + within,
            own / areas.at(coarse_to_fine)[i], "");
  }
}

void reproduce_snapshot_bytes(ArenaSurveys& surveys, Reproduction& result) {
  const std::size_t places = surveys.arena().currents.views.size();
  constexpr float accepted_m = 0.1F + 1e-6F;
  // Returns per goal and place whether the place is in the goal's catchment area.
  const auto find_catchments = [&](const HomingStrategy& strategy) {
    const auto distances = surveys.compute_final_distances(strategy);
    std::vector<std::vector<bool>> areas(distances.size() / places, std::vector<bool>(places));
    for (std::size_t i = 0; i < distances.size(); ++i) {
      areas[i / places][i % places] = distances[i] <= accepted_m;
    }
    return areas;
  };
  const auto size = [](const std::vector<bool>& area) {
    return static_cast<double>(std::ranges::count(area, true));
  };
  const auto unite = [](std::vector<bool> a, const std::vector<bool>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] = a[i] || b[i];
    return a;
  };
  const auto images = find_catchments(make_expected_image_strategy());
  const auto snapshots = find_catchments(make_published_strategy({3}));

  double mean_image = 0.0;
  double best_image = 0.0;
  for (const auto& area : images) {
    mean_image += size(area) / static_cast<double>(images.size());
    best_image = std::max(best_image, size(area));
  }
  Random random(surveys.arena().options.seed, 3);
  constexpr int trials = 1000;
  double mean_three = 0.0;
  for (int i = 0; i < trials; ++i) {
    std::vector<bool> all(places);
    for (int j = 0; j < 3; ++j)
      all = unite(std::move(all), snapshots[random.index(snapshots.size())]);
    mean_three += size(all) / trials;
  }
  std::vector<bool> chosen(places);
  for (int j = 0; j < 3; ++j) {
    std::vector<bool> best = chosen;
    for (const auto& area : snapshots) {
      auto candidate = unite(chosen, area);
      if (size(candidate) > size(best)) best = std::move(candidate);
    }
    chosen = std::move(best);
  }
  add_row(result, "s06.bytes.three_anywhere",
          "places from which one of three snapshots of K = 3 (72 bytes together) is reached, over "
          "those of one image of 72 bytes by expected images; places chosen at random",
          mean_three / mean_image, "");
  add_row(result, "s06.bytes.three_chosen",
          "the same, both at the best places (three: one after the other)",
          size(chosen) / best_image, "");
}

void measure_homing_times(const Arena& arena, Reproduction& result) {
  using Clock = std::chrono::steady_clock;
  // Take the shortest of many measurements, because other load of the machine only makes them
  // longer.
  const auto measure_microseconds = [](int repeats, int calls, auto&& work) {
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < repeats; ++i) {
      const auto begin = Clock::now();
      for (int call = 0; call < calls; ++call) work(static_cast<std::size_t>(call));
      const std::chrono::duration<double, std::micro> duration = Clock::now() - begin;
      best = std::min(best, duration.count() / calls);
    }
    return best;
  };
  const auto& homes = arena.homes;
  const auto& currents = arena.currents;
  const std::size_t count = currents.views.size();
  double sum = 0.0;  // uses all results, so the compiler keeps the calls
  const FourierHomingOptions published = published_homing_options(5);
  const double vector_us = measure_microseconds(200, 200, [&](std::size_t i) {
    sum += home_vector_unchecked(homes.views[i % count].view, currents.views[7 * i % count].view,
                                 published)
               .xi;
  });
  const FourierHomingOptions own{.highest = 5};
  const double own_us = measure_microseconds(200, 200, [&](std::size_t i) {
    sum +=
        home_vector_unchecked(homes.views[i % count].view, currents.views[7 * i % count].view, own)
            .xi;
  });
  // Repeat each of the 72 pixels five times; the values do not influence the run time.
  constexpr int columns = 360;
  const auto widen = [](const std::vector<float>& row) {
    std::vector<float> wide;
    for (int c = 0; c < columns; ++c) {
      wide.push_back(row[static_cast<std::size_t>(c) * row.size() / columns]);
    }
    return wide;
  };
  const ExpectedImageHoming images(columns);
  const auto home = widen(homes.rows[0]);
  const auto current = widen(currents.rows[count / 2]);
  const double images_us = measure_microseconds(
      20, 3, [&](std::size_t) { sum += images.home_vector(home, current).xi; });
  const bool used = std::isfinite(sum);
  const auto add = [&](const std::string& id, const std::string& what, double value,
                       const std::string& unit, std::optional<Target> target,
                       std::optional<std::pair<double, double>> by_authors) {
    add_row(result, "s06.time." + id, what, used ? value : std::numeric_limits<double>::quiet_NaN(),
            unit, target, by_authors);
  };
  add("home_vector", "one home vector from coefficients, K = 5, no iteration (published: 700 MHz)",
      vector_us, "us", at_most(1.0), std::pair(1000.0, 1000.0));
  add("home_vector_own", "the same by our rule", own_us, "us", std::nullopt, std::nullopt);
  add("expected_images", "one home vector by expected images, N = 360, P = 197", images_us, "us",
      std::nullopt, std::pair(1e5, 1e5));
  add("ratio", "time by expected images over time from coefficients", images_us / vector_us, "x",
      at_least(100.0), std::pair(100.0, 100.0));
}

}  // namespace panonav::lab
