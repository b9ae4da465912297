// The published odometry of [F11] and what its study changes in it.

#include "lab/f11/published_rule.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::lab {
namespace {

constexpr int components = 64;
constexpr PublishedFigure figure{.shape_difference = 0.04, .k1 = 26, .k2 = 20};

class PublishedRule : public ::testing::Test {
 protected:
  Executor executor{2};
  const simulation::PlaceRecording place =
      simulation::make_empty_place(simulation::make_scene("loop", {.seed = 71}), 71,
                                   {.columns = 132, .rays_per_axis = 1}, executor);
  /// Along the first side of the tour and around its corner.
  const std::vector<Pose2> plan = [this] {
    std::vector<Pose2> poses = simulation::drive(place, {}, 0.2, 40);
    simulation::face_path(poses);
    return poses;
  }();
  const simulation::MappingRecording recording =
      simulation::record_for_mapping(place, plan, components, {}, 5, executor);

  PublishedRuleErrors measure(const PublishedRuleVariant& variant) {
    return measure_published_rule(recording, variant, figure, executor);
  }
};

TEST_F(PublishedRule, AgreesWithTheRuleOfTheLibrary) {
  const VisualOdometryOptions options{.rule = VisualOdometryOptions::Rule::published,
                                      .distance_components = figure.k1,
                                      .turn_components = figure.k2};
  Pose2 pose;
  std::vector<Point2> path{pose.position()};
  double heading_error_rad = 0.0;
  std::vector<double> heading_errors_deg;
  for (std::size_t i = 0; i + 1 < recording.views.size(); ++i) {
    const auto step = visual_step(OdometryView(recording.views[i]),
                                  OdometryView(recording.views[i + 1]), options);
    ASSERT_TRUE(step);
    pose = pose * step->before_from_after;
    path.push_back(pose.position());
    const Pose2 motion = inverse(plan[i]) * plan[i + 1];
    heading_errors_deg.push_back(degrees(heading_error_rad));
    heading_error_rad += angle_difference(step->before_from_after.heading_rad, motion.heading_rad);
  }
  const PublishedRuleErrors errors = measure({});
  EXPECT_NEAR(errors.fixed, simulation::shape_error(path, positions_of(recording.truth)), 1e-5);
  const double mean_deg = mean(heading_errors_deg);
  double variance = 0.0;
  for (const double error_deg : heading_errors_deg)
    variance += (error_deg - mean_deg) * (error_deg - mean_deg) /
                static_cast<double>(heading_errors_deg.size());
  EXPECT_NEAR(errors.heading_deg, std::sqrt(variance), 0.01);
  EXPECT_GT(errors.fixed, 1e-4);
  EXPECT_LE(errors.smallest, errors.fixed);
}

TEST_F(PublishedRule, HasNoErrorIfItsStepsAreTrue) {
  const PublishedRuleErrors errors =
      measure({.direction = PublishedRuleVariant::TravelDirection::first_heading,
               .length_error = 0.0,
               .turn_error = 0.0});
  EXPECT_LT(errors.fixed, 1e-9) << "each pose faces the next one";
  const double turned = measure({.length_error = 0.0}).fixed;
  const double half = measure({.length_error = 0.0, .turn_error = 0.5}).fixed;
  EXPECT_LT(half, turned);
  EXPECT_LT(errors.fixed, half);
  EXPECT_GT(measure({.turn_error = 0.0}).fixed, 1e-6) << "lengths still err";
}

TEST_F(PublishedRule, ChangesOneThingAtATime) {
  const double rule = measure({}).fixed;
  EXPECT_NEAR(measure({.root = true}).fixed, std::sqrt(rule), 1e-12);
  EXPECT_LE(measure({.reflection = true}).fixed, rule + 1e-12);
  using enum PublishedRuleVariant::UsedRows;
  using enum PublishedRuleVariant::TravelDirection;
  for (const PublishedRuleVariant& variant :
       {PublishedRuleVariant{.unit_phases = true}, PublishedRuleVariant{.unit_signatures = true},
        PublishedRuleVariant{.rows = above_horizon}, PublishedRuleVariant{.rows = below_horizon},
        PublishedRuleVariant{.rows_per_band = 20}, PublishedRuleVariant{.direction = last_heading}})
    EXPECT_NE(measure(variant).fixed, rule);
}

TEST_F(PublishedRule, FollowsAViewThatTurnsOnTheSpot) {
  std::vector<Pose2> poses;
  for (int i = 0; i < 8; ++i) poses.push_back({1.0, 0.0, 0.3 * i});
  const auto turning = simulation::record_for_mapping(place, poses, components, {}, 9, executor);
  const PublishedRuleErrors errors = measure_published_rule(turning, {}, figure, executor);
  EXPECT_LT(errors.heading_deg, 0.5);
  EXPECT_EQ(errors.fixed, 1.0) << "a single place has no shape";
}

TEST_F(PublishedRule, RefusesWhatItCannotMeasure) {
  EXPECT_THROW((void)measure_published_rule(recording, {}, {.k1 = 3}, executor), ContractError);
  EXPECT_THROW((void)measure_published_rule(recording, {}, {.k2 = 3}, executor), ContractError);
  const auto one = simulation::thin_recording(recording, recording.views.size());
  EXPECT_THROW((void)measure_published_rule(one, {}, figure, executor), ContractError);
  const auto few = simulation::record_for_mapping(place, plan, 15, {}, 5, executor);
  EXPECT_THROW((void)measure_published_rule(few, {}, figure, executor), ContractError);
}

TEST_F(PublishedRule, DrivesWithAMirrorNearThePlan) {
  const std::vector<Pose2> start(plan.begin(), plan.begin() + 8);
  const auto noisy =
      record_by_mirror(place, start, 15, simulation::make_noisy_wheels(), 3, executor);
  ASSERT_EQ(noisy.truth.size(), start.size());
  ASSERT_EQ(noisy.views.size(), start.size());
  double largest_m = 0.0;
  for (std::size_t i = 0; i < start.size(); ++i) {
    EXPECT_TRUE(place.free_space->is_free(noisy.truth[i].position()));
    const double off_m = distance(noisy.truth[i].position(), start[i].position());
    largest_m = std::max(largest_m, off_m);
  }
  EXPECT_GT(largest_m, 1e-4);
  EXPECT_LT(largest_m, 0.2);
  const OdometryNoise none{.translation_from_translation = 0.0,
                           .translation_from_rotation = 0.0,
                           .rotation_from_translation = 0.0,
                           .rotation_from_rotation = 0.0,
                           .translation_scale_error = 0.0,
                           .rotation_scale_error = 0.0};
  const auto exact = record_by_mirror(place, start, 15, none, 3, executor);
  for (std::size_t i = 0; i < start.size(); ++i)
    EXPECT_LT(distance(exact.truth[i].position(), start[i].position()), 1e-9);
}

}  // namespace
}  // namespace panonav::lab
