// [S06] figures 10 to 13: homeward component of home vectors, and catchment areas.

#include <array>
#include <cmath>

#include "lab/rows.hpp"
#include "lab/s06/support.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

namespace {

viewer::Series make_homeward_series(const std::string& label, const HomingSurvey& survey,
                                    double spacing_m) {
  viewer::Series series{.label = label};
  for (const HomingSurvey::Bin& bin : homeward_by_distance(survey, spacing_m)) {
    if (bin.pairs < 20 || bin.distance_m > 0.8) continue;
    series.add(bin.distance_m, bin.component);
  }
  return series;
}

viewer::LinePlot make_homeward_plot(const std::string& title) {
  return {.title = title,
          .x_label = "distance to the goal [m]",
          .y_label = "average homeward component",
          .y_range = std::pair(0.0, 1.0)};
}

// Draws figure 10.
void draw_homeward(ArenaSurveys& surveys, Executor& executor, Reproduction& result) {
  const double spacing_m = surveys.arena().options.spacing_m;
  viewer::LinePlot by_highest = make_homeward_plot("One home vector, no iteration");
  for (const int highest : {1, 2, 3, 5, 10}) {
    by_highest.series.push_back(make_homeward_series(
        "K = " + std::to_string(highest), surveys.survey_published(highest, 0), spacing_m));
  }
  by_highest.series.push_back(
      make_homeward_series("expected images", surveys.survey_expected_images(), spacing_m));
  by_highest.series.push_back(
      make_homeward_series("our rule, K = 10", surveys.survey_own(10), spacing_m));
  add_plot(result, "figure_10_homeward.svg",
           "[S06] figure 10a: how far home vectors point home, by the distance: few frequencies "
           "from afar, many close by.",
           by_highest);

  viewer::LinePlot by_iterations = make_homeward_plot("Iterations, K = 2 and K = 10");
  for (const int highest : {2, 10}) {
    for (const int iterations : {0, 1, 4, 9}) {
      const std::string label =
          "K = " + std::to_string(highest) + ", N + 1 = " + std::to_string(iterations + 1);
      const HomingSurvey survey =
          survey_arena(surveys.arena(), published_homing_options(highest, iterations), executor,
                       2 * surveys.goal_stride());
      by_iterations.series.push_back(make_homeward_series(label, survey, spacing_m));
    }
  }
  add_plot(result, "figure_10_iterations.svg", "[S06] figure 10b: the same with iterations.",
           by_iterations);

  for (const double away_m : {0.1, 0.2, 0.4}) {
    const auto at = [&](const HomingSurvey& survey) {
      for (const HomingSurvey::Bin& bin : homeward_by_distance(survey, spacing_m)) {
        if (std::abs(bin.distance_m - away_m) < 0.25 * spacing_m) return bin.component;
      }
      return std::nan("");
    };
    const auto add = [&](const std::string& name, const std::string& what, double value) {
      add_row(result, "s06.homeward." + name + "_" + format_centimetres_id(away_m),
              "average homeward component at " + format_centimetres(away_m) + ", " + what, value,
              "");
    };
    add("k2", "K = 2, no iteration", at(surveys.survey_published(2, 0)));
    add("k10", "K = 10, no iteration", at(surveys.survey_published(10, 0)));
    add("expected_images", "expected images", at(surveys.survey_expected_images()));
    add("own", "our rule, K = 10", at(surveys.survey_own(10)));
  }
}

std::vector<double> accepted_distances() {
  std::vector<double> accepted;
  for (int i = 0; i <= 40; ++i) accepted.push_back(0.0125 * i);
  return accepted;
}

viewer::Series make_area_series(ArenaSurveys& surveys, const HomingStrategy& strategy) {
  return {.label = strategy.label,
          .x = accepted_distances(),
          .y = surveys.compute_areas(strategy, accepted_distances()),
          .style = viewer::SeriesStyle::lines};
}

viewer::LinePlot make_area_plot(const std::string& title) {
  return {.title = title,
          .x_label = "accepted distance of the end of a run from the goal [m]",
          .y_label = "mean catchment area [places]",
          .series = {},
          .x_range = std::pair(0.0, 0.5)};
}

// Returns the mean number of places within each accepted distance of the goal, as if no run took
// place.
viewer::Series make_no_run_series(const HomingSurvey& survey) {
  viewer::Series series{.label = "no run", .style = viewer::SeriesStyle::lines};
  for (const double accepted : accepted_distances()) {
    double places = 0.0;
    for (const Pose2& goal : survey.goals) {
      for (const Pose2& place : survey.places) {
        places += distance(goal.position(), place.position()) <= accepted + 1e-9 ? 1.0 : 0.0;
      }
    }
    series.add(accepted, places / static_cast<double>(survey.goals.size()));
  }
  return series;
}

// Draws figures 11 and 13.
void draw_areas(ArenaSurveys& surveys, Reproduction& result) {
  viewer::LinePlot single = make_area_plot("Catchment area, one K, 3 solutions a vector");
  for (const int highest : {1, 2, 3, 5, 10}) {
    single.series.push_back(make_area_series(surveys, make_published_strategy({highest})));
  }
  single.series.push_back(make_area_series(surveys, make_expected_image_strategy()));
  single.series.push_back(make_no_run_series(surveys.survey_expected_images()));
  add_plot(result, "figure_11_areas.svg",
           "[S06] figure 11: mean number of places from which runs end near the goal.", single);

  viewer::LinePlot staged = make_area_plot("Catchment area, K rising in stages");
  const std::vector<std::vector<int>> sequences{{2}, {2, 4}, {2, 4, 10}, {1, 2, 4, 10}, {10, 4, 2}};
  for (const auto& sequence : sequences) {
    staged.series.push_back(make_area_series(surveys, make_published_strategy(sequence)));
  }
  staged.series.push_back(make_area_series(surveys, make_expected_image_strategy()));
  staged.series.push_back(make_area_series(surveys, make_library_strategy()));
  staged.series.push_back(make_area_series(surveys, make_own_strategy()));
  add_plot(
      result, "figure_13_stages.svg",
      "[S06] figure 13: the same when more frequencies count where homing stops, the library's "
      "rule and a chain of 20 stages.",
      staged);
}

// Draws figure 12.
void draw_iterations(ArenaSurveys& surveys, Executor& executor, Reproduction& result) {
  constexpr std::array<double, 1> accepted{0.1};
  viewer::LinePlot plot{.title = "Iterations; runs that end within 10 cm",
                        .x_label = "solutions a vector, N + 1",
                        .y_label = "mean catchment area [places]"};
  for (const int highest : {1, 2, 3, 5, 10}) {
    viewer::Series series{.label = "K = " + std::to_string(highest)};
    for (const int solutions : {1, 2, 3, 5, 8}) {
      const HomingSurvey survey =
          survey_arena(surveys.arena(), published_homing_options(highest, solutions - 1), executor,
                       4 * surveys.goal_stride());
      const HomingSurvey* const stage = &survey;
      series.add(solutions,
                 mean_catchment_areas(
                     final_distances({&stage, 1}, survey_options(surveys.arena()), executor),
                     survey.goals.size(), accepted)[0]);
    }
    plot.series.push_back(std::move(series));
  }
  add_plot(result, "figure_12_iterations.svg",
           "[S06] figure 12: mean catchment area by the number of solutions of each home vector.",
           plot);
}

}  // namespace

void reproduce_homing_figures(ArenaSurveys& surveys, const Experiments& context) {
  const auto& [options, executor, result] = context;
  draw_homeward(surveys, executor, result);
  draw_areas(surveys, result);
  draw_iterations(surveys, executor, result);
}

}  // namespace panonav::lab
