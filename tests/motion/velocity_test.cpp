#include "panonav/motion/velocity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

TEST(Velocity, ArcsComposeToTheWhole) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Velocity v{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-2, 2)};
    const double t = random.uniform(0.0, 1.0);
    const Pose2 whole = integrate_velocity(v, 1.0);
    const Pose2 parts = integrate_velocity(v, t) * integrate_velocity(v, 1.0 - t);
    EXPECT_NEAR(distance(whole.position(), parts.position()), 0.0, 1e-12);
    EXPECT_NEAR(std::remainder(whole.heading_rad - parts.heading_rad, 2.0 * std::numbers::pi), 0.0,
                1e-12);
  }
}

TEST(Velocity, SlowTurnsJoinStraightLines) {
  for (const double turn : {0.0, 1e-7, 9.9e-7, 1.01e-6, 1e-5}) {
    const Pose2 step = integrate_velocity({1.0, 0.0, turn}, 1.0);
    EXPECT_NEAR(step.x_m, 1.0, 1e-10);
    EXPECT_NEAR(step.y_m, 0.5 * turn, 1e-10);
  }
}

TEST(Velocity, BothDrivesReachAnyPointAndKeepTheirLimits) {
  for (const DriveKind drive : {DriveKind::holonomic, DriveKind::differential}) {
    const BaseOptions options{.drive = drive};
    Random random(7);
    for (int i = 0; i < 100; ++i) {
      Point2 target{random.uniform(-2, 2), random.uniform(-2, 2)};
      const double straight_m = std::hypot(target.x_m, target.y_m);
      double way_m = 0.0;
      double time_s = 0.0;
      while (std::hypot(target.x_m, target.y_m) > 0.01 && time_s < 60.0) {
        const Velocity v = compute_command_towards(std::atan2(target.y_m, target.x_m),
                                                   std::hypot(target.x_m, target.y_m), options);
        ASSERT_LE(std::hypot(v.forward_m_s, v.left_m_s), options.speed_m_s + 1e-12);
        ASSERT_LE(std::abs(v.turn_rad_s), options.turn_rad_s + 1e-12);
        if (drive == DriveKind::differential) {
          ASSERT_EQ(v.left_m_s, 0.0);
        } else {
          ASSERT_EQ(v.turn_rad_s, 0.0);
        }
        const Pose2 step = integrate_velocity(v, options.period_s);
        way_m += std::hypot(v.forward_m_s, v.left_m_s) * options.period_s;
        target = inverse(step) * target;
        time_s += options.period_s;
      }
      EXPECT_LT(std::hypot(target.x_m, target.y_m), 0.01);
      EXPECT_LE(way_m, 1.2 * straight_m + 0.01);
    }
  }
}

TEST(Velocity, StandsAtThePointAndRefusesWhatIsNoNumber) {
  EXPECT_EQ(compute_command_towards(1.0, 0.0, {}), Velocity{});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)compute_command_towards(nan, 1.0, {}), ContractError);
  EXPECT_THROW((void)compute_command_towards(0.0, -1.0, {}), ContractError);
  EXPECT_THROW((void)compute_command_towards(0.0, 1.0, {.speed_m_s = 0.0}), OptionError);
  EXPECT_THROW((void)integrate_velocity({}, -1.0), ContractError);
}

}  // namespace
}  // namespace panonav
