#include "panonav/mapping/visual_odometry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/motion/odometry.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

OdometryView view_at(const ToyWorld& world, const Pose2& pose) {
  return OdometryView(striped_signature(world, pose));
}

std::vector<Point2> positions(const std::vector<Pose2>& poses) {
  std::vector<Point2> points;
  for (const Pose2& pose : poses) points.push_back(pose.position());
  return points;
}

FourierSignature view_without_structure() {
  return compute_signature(Panorama(1, 256, std::nullopt), 14);
}

TEST(VisualOdometry, ShortStepsAreReadFromTwoViews) {
  const ToyWorld world = striped_round_room(round_room_radius_m, 1);
  int steps = 0;
  for (const double direction : {-2.5, -1.0, 0.0, 0.7, 3.0}) {
    for (const double turn : {-1.0, 0.0, 0.4}) {
      const Pose2 before{0.3, -0.2, 0.5};
      const Pose2 motion{0.15 * std::cos(direction), 0.15 * std::sin(direction), turn};
      const auto step = visual_step(view_at(world, before), view_at(world, before * motion),
                                    {.scale_m = round_room_radius_m});
      ASSERT_TRUE(step.has_value());
      EXPECT_NEAR(step->before_from_after.x_m, motion.x_m, 0.02);
      EXPECT_NEAR(step->before_from_after.y_m, motion.y_m, 0.02);
      EXPECT_NEAR(step->before_from_after.heading_rad, turn, 0.01);
      ++steps;
    }
  }
  EXPECT_EQ(steps, 15);
}

TEST(VisualOdometry, ThereAndBackIsNoMotion) {
  const ToyWorld world = striped_round_room(round_room_radius_m, 2);
  const auto a = view_at(world, {0.0, 0.0, 0.3});
  const auto b = view_at(world, {0.2, 0.1, -0.9});
  const auto there = visual_step(a, b);
  const auto back = visual_step(b, a);
  ASSERT_TRUE(there && back);
  const Pose2 both = there->before_from_after * back->before_from_after;
  EXPECT_GT(there->length_in_views, 0.03);  // guard: there was motion
  EXPECT_NEAR(std::hypot(both.x_m, both.y_m), 0.0, 0.1 * there->length_in_views);
  EXPECT_NEAR(both.heading_rad, 0.0, 0.01);
}

TEST(VisualOdometry, TheSameViewTwiceIsNoMotion) {
  const ToyWorld world = striped_round_room(round_room_radius_m, 3);
  const auto view = view_at(world, {0.5, 0.0, 1.0});
  for (const VisualOdometryOptions::Rule rule :
       {VisualOdometryOptions::Rule::published, VisualOdometryOptions::Rule::home_vector}) {
    const auto step = visual_step(view, view, {.rule = rule});
    ASSERT_TRUE(step.has_value());
    EXPECT_NEAR(step->length_in_views, 0.0, 1e-6);
    EXPECT_NEAR(step->before_from_after.heading_rad, 0.0, 1e-5);
  }
}

TEST(VisualOdometry, ViewsWithoutStructureShowNoStep) {
  const ToyWorld world = striped_round_room(round_room_radius_m, 3);
  const OdometryView nothing(view_without_structure());
  const auto view = view_at(world, {});
  for (const VisualOdometryOptions::Rule rule :
       {VisualOdometryOptions::Rule::published, VisualOdometryOptions::Rule::home_vector}) {
    EXPECT_FALSE(visual_step(nothing, nothing, {.rule = rule}).has_value());
    EXPECT_FALSE(visual_step(view, nothing, {.rule = rule}).has_value());
  }
  VisualOdometry odometry;
  EXPECT_FALSE(odometry.add(view).has_value());
  EXPECT_EQ(odometry.breaks(), 0);
  EXPECT_FALSE(odometry.add(nothing).has_value());
  EXPECT_EQ(odometry.breaks(), 1);
  EXPECT_EQ(odometry.add(view).value().views, 2);
  EXPECT_EQ(odometry.breaks(), 1);
  for (std::size_t i = 0; i < VisualOdometry::max_tried_views; ++i) {
    EXPECT_FALSE(odometry.add(nothing).has_value());
  }
  EXPECT_FALSE(odometry.add(view).has_value());
  EXPECT_EQ(odometry.breaks(), 2 + static_cast<int>(VisualOdometry::max_tried_views));
  EXPECT_NEAR(std::hypot(odometry.pose().x_m, odometry.pose().y_m), 0.0, 1e-9);
}

TEST(VisualOdometry, RefusesStepsBetweenUnrelatedScenes) {
  int believed = 0;
  int unchecked = 0;
  int neighbours = 0;
  constexpr int pairs = 40;
  for (int i = 0; i < pairs; ++i) {
    const OdometryView here = view_at(striped_round_room(round_room_radius_m, 100 + i), {});
    const OdometryView there = view_at(striped_round_room(round_room_radius_m, 200 + i), {});
    const OdometryView near =
        view_at(striped_round_room(round_room_radius_m, 100 + i), {0.1, 0.05, 0.2});
    const VisualOdometryOptions options{.max_residual = 1.0};
    believed += visual_step(here, there, options) ? 1 : 0;
    unchecked += visual_step(here, there, {.max_residual = 1.0, .min_probability = 0.0}) ? 1 : 0;
    neighbours += visual_step(here, near, options) ? 1 : 0;
  }
  EXPECT_LE(4 * believed, unchecked);
  EXPECT_EQ(neighbours, pairs);
}

TEST(VisualOdometry, FollowsARoundTrip) {
  const ToyWorld world = striped_round_room(round_room_radius_m, 4);
  std::vector<Pose2> truth;
  for (int i = 0; i < 80; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 80.0;
    truth.push_back({1.2 * std::sin(angle), 1.2 - 1.2 * std::cos(angle), wrap_angle(angle)});
  }
  // The published rule knows no direction but ahead; ours needs none.
  for (const VisualOdometryOptions::Rule rule :
       {VisualOdometryOptions::Rule::published, VisualOdometryOptions::Rule::home_vector}) {
    VisualOdometry odometry({.rule = rule});
    std::vector<Pose2> found;
    for (const Pose2& pose : truth) {
      odometry.add(view_at(world, pose));
      found.push_back(odometry.pose());
    }
    const double difference = shape_difference(positions(found), positions(truth)).value;
    EXPECT_LT(difference, rule == VisualOdometryOptions::Rule::published ? 0.05 : 0.02);
  }
  VisualOdometry sideways;
  std::vector<Pose2> found;
  for (Pose2 pose : truth) {
    pose.heading_rad = 0.4;
    sideways.add(view_at(world, pose));
    found.push_back(sideways.pose());
  }
  EXPECT_LT(shape_difference(positions(found), positions(truth)).value, 0.02);
}

TEST(VisualOdometry, ExpectsTurnsAsBeforeInASymmetricRoom) {
  constexpr int columns = 256;
  const auto view_of = [&](int turned) {
    Panorama panorama(1, columns, std::nullopt);
    for (int x = 0; x < columns; ++x) {
      // Both halves of the room are alike.
      const double phi = 4.0 * std::numbers::pi * (x + turned) / columns;
      panorama.at(0, x) =
          static_cast<float>(0.5 + 0.2 * std::cos(phi) + 0.1 * std::sin(2.0 * phi + 0.4));
    }
    return OdometryView(compute_signature(panorama, 14));
  };
  VisualOdometry odometry;
  double largest_rad = 0.0;
  for (int i = 0; i < 40; ++i) {
    const auto step = odometry.add(view_of(3 * i % columns));
    if (i == 0) continue;
    ASSERT_TRUE(step.has_value());
    largest_rad = std::max(largest_rad, std::abs(step->before_from_after.heading_rad));
  }
  EXPECT_LT(largest_rad, 0.2);
}

TEST(VisualOdometry, LengthsDoNotDependOnTheSizeOfTheRoom) {
  const auto drive = [](bool steady_speed) {
    VisualOdometry odometry({.scale_m = round_room_radius_m, .steady_speed = steady_speed});
    double last_m = 0.0;
    for (const double room_m : {round_room_radius_m, 2.5 * round_room_radius_m}) {
      const ToyWorld world = striped_round_room(room_m, 3);
      for (int i = 0; i < 20; ++i) {
        const auto step = odometry.add(view_at(world, {-1.0 + 0.1 * i, 0.2, 0.3}));
        if (step) last_m = std::hypot(step->before_from_after.x_m, step->before_from_after.y_m);
      }
    }
    return last_m;
  };
  EXPECT_NEAR(drive(true), 0.1, 0.02);
  EXPECT_NEAR(drive(false), 0.1 / 2.5, 0.01);
}

TEST(MotionPrior, MakesUsualTurnsAndKnownStepsProbable) {
  const MotionPrior prior{.mean_turn_rad = 0.1, .share_right = 0.9};
  EXPECT_GT(prior.log_density(0.0), prior.log_density(0.3));
  EXPECT_GT(prior.log_density(0.3), prior.log_density(std::numbers::pi));
  double sum = 0.0;  // over all turns
  constexpr int parts = 100000;
  for (int i = 0; i < parts; ++i) {
    const double turn = 2.0 * std::numbers::pi * (static_cast<double>(i) / parts - 0.5);
    sum += std::exp(prior.log_density(turn)) * 2.0 * std::numbers::pi / parts;
  }
  EXPECT_NEAR(sum, 1.0, 1e-3);
  EXPECT_DOUBLE_EQ(MotionPrior{}.posterior(0.3), 0.3);
  EXPECT_GT(prior.posterior(0.3), 0.7);
  EXPECT_EQ(prior.posterior(0.0), 0.0);
  EXPECT_EQ(prior.posterior(1.0), 1.0);
}

TEST(VisualOdometry, KnownStepsTellTheScale) {
  EXPECT_FALSE(length_scale_m({}).has_value());
  const std::vector<KnownLength> still{{0.0, 0.0}, {0.1, 0.0}};
  EXPECT_FALSE(length_scale_m(still).has_value());
  // One wrong step of five does not count.
  const std::vector<KnownLength> steps{
      {0.1, 0.2}, {0.1, 0.21}, {0.1, 5.0}, {0.2, 0.4}, {0.1, 0.19}};
  EXPECT_NEAR(length_scale_m(steps).value(), 2.0, 1e-12);
  const std::vector<KnownLength> negative{{0.1, -0.2}};
  EXPECT_THROW((void)length_scale_m(negative), ContractError);
  const std::vector<KnownLength> nan{{std::numeric_limits<double>::quiet_NaN(), 0.2}};
  EXPECT_THROW((void)length_scale_m(nan), ContractError);
}

TEST(VisualOdometry, RefusesWhatHasNoMeaning) {
  EXPECT_THROW(VisualOdometry({.scale_m = 0.0}), OptionError);
  const ToyWorld world = striped_round_room(round_room_radius_m, 3);
  EXPECT_THROW(OdometryView(striped_signature(world, {}, 2)), ContractError);
  const auto view = view_at(world, {});
  const OdometryView other(striped_signature(world, {}, 9));
  const OdometryView two_rows(compute_signature(Panorama(2, 256, std::nullopt), 14));
  EXPECT_THROW((void)visual_step(view, two_rows), ContractError);
  EXPECT_NO_THROW((void)visual_step(view, other));
}

}  // namespace
}  // namespace panonav::testing
