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

constexpr double radius_m = 4.0;

OdometryView view_at(const ToyWorld& world, const Pose2& pose) {
  return OdometryView(striped_signature(world, pose));
}

std::vector<Point2> positions(const std::vector<Pose2>& poses) {
  std::vector<Point2> points;
  for (const Pose2& pose : poses) points.push_back(pose.position());
  return points;
}

FourierSignature empty_view() {
  return compute_signature(Panorama(1, 256, std::nullopt), 14);
}

TEST(VisualOdometry, ShortStepsAreReadFromTwoViews) {
  const ToyWorld world = striped_round_room(radius_m, 1);
  int steps = 0;
  for (const double direction : {-2.5, -1.0, 0.0, 0.7, 3.0}) {
    for (const double turn : {-1.0, 0.0, 0.4}) {
      const Pose2 before{0.3, -0.2, 0.5};
      const Pose2 motion{0.15 * std::cos(direction), 0.15 * std::sin(direction), turn};
      const auto step = visual_step(view_at(world, before), view_at(world, before * motion),
                                    {.scale_m = radius_m});
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
  const ToyWorld world = striped_round_room(radius_m, 2);
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
  const ToyWorld world = striped_round_room(radius_m, 3);
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
  const ToyWorld world = striped_round_room(radius_m, 3);
  const OdometryView nothing(empty_view());
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
  EXPECT_FALSE(odometry.add(view).has_value());
  EXPECT_EQ(odometry.breaks(), 2);
  EXPECT_EQ(odometry.pose(), Pose2{});
}

TEST(VisualOdometry, FollowsARoundTrip) {
  const ToyWorld world = striped_round_room(radius_m, 4);
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
  const ToyWorld world = striped_round_room(radius_m, 3);
  EXPECT_THROW(OdometryView(striped_signature(world, {}, 2)), ContractError);
  const auto view = view_at(world, {});
  const OdometryView other(striped_signature(world, {}, 9));
  const OdometryView two_rows(compute_signature(Panorama(2, 256, std::nullopt), 14));
  EXPECT_THROW((void)visual_step(view, two_rows), ContractError);
  EXPECT_NO_THROW((void)visual_step(view, other));
}

}  // namespace
}  // namespace panonav::testing
