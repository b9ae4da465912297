#include "panonav_ros2/motion_history.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "panonav/core/error.hpp"

namespace panonav::ros2 {
namespace {

constexpr std::int64_t ms = 1'000'000;

TEST(MotionHistory, InterpolatesBetweenMessagesAndNeverBeyond) {
  MotionHistory motion;
  EXPECT_FALSE(motion.newest());
  EXPECT_EQ(motion.add(100 * ms, {1.0, 0.0, 0.0}), MotionHistory::Added::yes);
  EXPECT_EQ(motion.add(200 * ms, {2.0, 1.0, 1.0}), MotionHistory::Added::yes);
  const auto between = motion.at(150 * ms);
  ASSERT_TRUE(between);
  EXPECT_NEAR(between->odom_from_base.x_m, 1.5, 1e-12);
  EXPECT_NEAR(between->odom_from_base.heading_rad, 0.5, 1e-12);
  EXPECT_EQ(motion.at(200 * ms)->odom_from_base, (Pose2{2.0, 1.0, 1.0}));
  EXPECT_FALSE(motion.at(99 * ms));
  EXPECT_FALSE(motion.at(201 * ms));
}

TEST(MotionHistory, AMessageThatComesLateChangesNothing) {
  MotionHistory motion;
  (void)motion.add(500 * ms, {1.0, 0.0, 0.0});
  EXPECT_EQ(motion.add(500 * ms, {9.0, 0.0, 0.0}), MotionHistory::Added::late);
  EXPECT_EQ(motion.add(400 * ms, {9.0, 0.0, 0.0}), MotionHistory::Added::late);
  EXPECT_EQ(motion.newest()->odom_from_base.x_m, 1.0);
}

TEST(MotionHistory, APublisherThatBeginsAnewDoesNotMoveTheRobot) {
  for (const bool clock_too : {false, true}) {
    MotionHistory motion;
    (void)motion.add(5000 * ms, {100.0, 7.0, 1.0});
    const Pose2 before = motion.newest()->path_from_base;
    const std::int64_t again = clock_too ? 10 * ms : 5020 * ms;
    EXPECT_EQ(motion.add(again, {0.0, 0.0, 0.0}), MotionHistory::Added::restarted);
    const Pose2 after = motion.newest()->path_from_base;
    EXPECT_NEAR(distance(before.position(), after.position()), 0.0, 1e-9);
    EXPECT_NEAR(after.heading_rad, before.heading_rad, 1e-9);
    (void)motion.add(again + 100 * ms, {1.0, 0.0, 0.0});  // a metre ahead of where it stood
    EXPECT_NEAR(motion.newest()->path_from_base.x_m, before.x_m + std::cos(1.0), 1e-9);
    EXPECT_EQ(motion.newest()->odom_from_base.x_m, 1.0);
  }
}

TEST(MotionHistory, KeepsSecondsOnlyHoweverManyMessagesCome) {
  MotionHistory motion;
  for (int i = 0; i < 100'000; ++i) (void)motion.add(i * ms, {0.001 * i, 0.0, 0.0});
  EXPECT_TRUE(motion.at(99'999 * ms - MotionHistory::max_age_ns + 2 * ms));
  EXPECT_FALSE(motion.at(99'999 * ms - MotionHistory::max_age_ns - 2 * ms));
  MotionHistory flood;
  for (int i = 0; i < 100'000; ++i) (void)flood.add(i, {});
  EXPECT_FALSE(flood.at(89'000));
  EXPECT_TRUE(flood.at(91'000));
}

recordings::ros::TransformStamped transform(const std::string& parent, const std::string& child,
                                            double x) {
  return {{1, parent}, child, {{x, 0.0, 0.0}, {}}};
}

TEST(FrameTree, ChainsTransformsAndRefusesCycles) {
  FrameTree tree;
  tree.set(transform("odom", "footprint", 1.0));
  EXPECT_FALSE(tree.lookup("odom", "base_link"));
  tree.set(transform("footprint", "base_link", 0.25));
  ASSERT_TRUE(tree.lookup("odom", "base_link"));
  EXPECT_EQ(tree.lookup("odom", "base_link")->position.x, 1.25);
  tree.set(transform("base_link", "footprint", 1.0));
  EXPECT_THROW((void)tree.lookup("odom", "base_link"), ContractError);
}

TEST(FrameTree, HoldsNoMoreThanItsLimit) {
  FrameTree tree;
  for (std::size_t i = 0; i < 2 * FrameTree::max_frames; ++i) {
    tree.set(transform("odom", "frame_" + std::to_string(i), 1.0));
  }
  EXPECT_TRUE(tree.lookup("odom", "frame_" + std::to_string(FrameTree::max_frames - 1)));
  EXPECT_FALSE(tree.lookup("odom", "frame_" + std::to_string(FrameTree::max_frames)));
}

}  // namespace
}  // namespace panonav::ros2
