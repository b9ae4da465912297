#include "panonav/homing/homing_survey.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

constexpr double spacing_m = 0.025;

std::vector<Pose2> grid(int columns, int rows) {
  Random random(5);
  std::vector<Pose2> poses;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      poses.push_back(
          {x * spacing_m, y * spacing_m, random.uniform(-std::numbers::pi, std::numbers::pi)});
    }
  }
  return poses;
}

// The true vector, in units of R, turned by `error_rad`.
HomeVector true_vector(const Pose2& goal, const Pose2& here, double typical_m, double error_rad) {
  const double x = (goal.x_m - here.x_m) / typical_m;
  const double y = (goal.y_m - here.y_m) / typical_m;
  const double turn = error_rad - here.heading_rad;
  HomeVector vector;
  vector.xi = std::cos(turn) * x - std::sin(turn) * y;
  vector.eta = std::sin(turn) * x + std::cos(turn) * y;
  return vector;
}

TEST(HomingSurvey, PerfectVectorsLeadHomeFromEverywhereWhateverTheHeadings) {
  const auto poses = grid(12, 9);
  Executor executor(2);
  const HomingSurveyOptions options;
  const auto survey = survey_homing(
      poses, poses,
      [&](std::size_t g, std::size_t p) {
        return true_vector(poses[g], poses[p], options.typical_distance_m, 0.0);
      },
      options, executor);
  const HomingSurvey* const stage = &survey;
  const auto distances = final_distances({&stage, 1}, options, executor);
  ASSERT_EQ(distances.size(), poses.size() * poses.size());
  const auto areas = mean_catchment_areas(distances, poses.size(), std::array{0.0, 0.1});
  EXPECT_EQ(areas[0], 108.0);
  EXPECT_EQ(areas[1], 108.0);
  EXPECT_NEAR(mean_homeward_component(survey, 1.0), 1.0, 1e-6);
  const auto bins = homeward_by_distance(survey, spacing_m);
  ASSERT_GT(bins.size(), 3U);
  EXPECT_EQ(bins[0].pairs, 0U);
  EXPECT_TRUE(std::isnan(bins[0].component));
  // Each place has neighbours at one spacing and at the diagonal of a cell (1.41, in the bin of 1).
  EXPECT_EQ(bins[1].pairs, 2U * (11 * 9 + 12 * 8) + 4U * 11 * 8);
  EXPECT_NEAR(bins[2].component, 1.0, 1e-6);
}

TEST(HomingSurvey, HomewardComponentIsTheCosineOfTheError) {
  const auto poses = grid(6, 6);
  Executor executor(1);
  const auto survey = survey_homing(
      poses, poses,
      [&](std::size_t g, std::size_t p) { return true_vector(poses[g], poses[p], 0.5, 1.0); }, {},
      executor);
  EXPECT_NEAR(mean_homeward_component(survey, 0.5), std::cos(1.0), 1e-6);
  EXPECT_TRUE(std::isnan(survey.homeward_of(3)[3]));
  EXPECT_TRUE(std::isnan(mean_homeward_component(survey, 0.01)));
}

TEST(HomingSurvey, ZeroVectorsStopAndCountAsNoComponent) {
  const auto poses = grid(4, 3);
  Executor executor(1);
  const auto survey = survey_homing(
      poses, poses, [](std::size_t, std::size_t) { return HomeVector{}; }, {}, executor);
  EXPECT_EQ(mean_homeward_component(survey, 1.0), 0.0);
  const HomingSurvey* const stage = &survey;
  const auto distances = final_distances({&stage, 1}, {}, executor);
  EXPECT_EQ(mean_catchment_areas(distances, poses.size(), std::array{0.0}).at(0), 1.0);
}

TEST(HomingSurvey, StepsLeadToTheNearestPlaceAsBruteForceFindsIt) {
  Random random(9);
  std::vector<Pose2> places;
  for (int i = 0; i < 150; ++i) {
    places.push_back({random.uniform(-0.3, 0.3), random.uniform(-0.2, 0.2), random.uniform(-3, 3)});
  }
  const std::vector<Pose2> goals(places.begin(), places.begin() + 20);
  HomingSurveyOptions options;
  Executor executor(1);
  const auto rule = [&](std::size_t g, std::size_t p) {
    return true_vector(goals[g], places[p], options.typical_distance_m, 0.4);
  };
  const auto survey = survey_homing(goals, places, rule, options, executor);
  std::size_t moved = 0;
  for (std::size_t g = 0; g < goals.size(); ++g) {
    for (std::size_t p = 0; p < places.size(); ++p) {
      const double away = distance(goals[g].position(), places[p].position());
      const double angle = std::atan2(goals[g].y_m - places[p].y_m, goals[g].x_m - places[p].x_m);
      const double step = std::min(options.max_step_m, away);
      const Point2 to{places[p].x_m + step * std::cos(angle + 0.4),
                      places[p].y_m + step * std::sin(angle + 0.4)};
      std::size_t nearest = p;
      double best = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < places.size(); ++i) {
        const double d = distance(places[i].position(), to);
        if (d < best) {
          best = d;
          nearest = i;
        }
      }
      EXPECT_EQ(survey.next_of(g)[p], best <= options.obstacle_m ? nearest : p);
      moved += survey.next_of(g)[p] != p ? 1 : 0;
    }
  }
  EXPECT_GT(moved, 1000U);
}

TEST(HomingSurvey, NoStepLeadsOverAGapAndStagesGoOnWhereTheLastStopped) {
  std::vector<Pose2> places;
  for (int x = 0; x < 12; ++x) {
    if (x < 4 || x > 6) places.push_back({x * spacing_m, 0.0, 0.0});
  }
  const std::vector<Pose2> goals{{0.0, 0.0, 0.0}};
  HomingSurveyOptions options{.max_step_m = 0.025};
  Executor executor(1);
  // The first stage stops 2 spacings before the goal, the second continues to it.
  const auto survey_until = [&](double stop_m) {
    return survey_homing(
        goals, places,
        [&, stop_m](std::size_t g, std::size_t p) {
          const HomeVector vector = true_vector(goals[g], places[p], 0.5, 0.0);
          return vector.length() * 0.5 > stop_m ? vector : HomeVector{};
        },
        options, executor);
  };
  const HomingSurvey coarse = survey_until(0.06);
  const HomingSurvey fine = survey_until(0.0);
  const std::array<const HomingSurvey*, 2> stages{&coarse, &fine};
  EXPECT_EQ(final_places(std::span(stages).first(1), 0),
            (std::vector<std::uint32_t>{0, 1, 2, 2, 4, 4, 4, 4, 4}));
  EXPECT_EQ(final_places(stages, 0), (std::vector<std::uint32_t>{0, 0, 0, 0, 4, 4, 4, 4, 4}));
  options.max_steps = 1;
  EXPECT_EQ(final_places(stages, 0, options),
            (std::vector<std::uint32_t>{0, 0, 1, 1, 4, 4, 4, 5, 6}));
}

TEST(HomingSurvey, SameBitsOnAnyNumberOfThreads) {
  const auto poses = grid(7, 5);
  const auto rule = [&](std::size_t g, std::size_t p) {
    Random random(g, p);
    return true_vector(poses[g], poses[p], 0.5, random.normal());
  };
  Executor one(1);
  Executor two(2);
  double reported = 0.0;
  const auto a = survey_homing(poses, poses, rule, {}, one, [&](double done) { reported = done; });
  const auto b = survey_homing(poses, poses, rule, {}, two);
  EXPECT_EQ(reported, 1.0);
  EXPECT_EQ(a.next, b.next);
  EXPECT_EQ(mean_homeward_component(a, 0.2), mean_homeward_component(b, 0.2));
}

TEST(HomingSurvey, RefusesWhatMakesNoSense) {
  const auto poses = grid(2, 2);
  const HomingRule rule = [](std::size_t, std::size_t) { return HomeVector{}; };
  Executor executor(1);
  const std::vector<Pose2> none;
  EXPECT_THROW((void)survey_homing(none, poses, rule, {}, executor), ContractError);
  EXPECT_THROW((void)survey_homing(poses, none, rule, {}, executor), ContractError);
  EXPECT_THROW((void)survey_homing(poses, poses, rule, {.max_step_m = 0.0}, executor), OptionError);
  const std::vector<Pose2> far{{std::nan(""), 0.0, 0.0}};
  EXPECT_THROW((void)survey_homing(far, poses, rule, {}, executor), ContractError);
  EXPECT_THROW((void)final_places({}, 0), ContractError);
  const HomingSurvey survey = survey_homing(poses, poses, rule, {}, executor);
  for (const double bin_m : {0.0, -1.0, 1e-9, 1e9, std::nan("")}) {
    EXPECT_THROW((void)homeward_by_distance(survey, bin_m), ContractError) << bin_m;
  }
}

}  // namespace
}  // namespace panonav
