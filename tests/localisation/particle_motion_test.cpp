#include "panonav/localisation/internal/particle_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/geometry/angles.hpp"

namespace panonav {
namespace {

TEST(MoveParticles, MovesThemAsTheSamplerOneByOne) {
  for (const DriveKind drive : {DriveKind::differential, DriveKind::holonomic}) {
    const OdometryNoise noise{.drive = drive};
    const StepSampler sampler({0.4, -0.1, 2.0}, noise);
    Random random(1);
    for (const std::size_t count : {0U, 1U, 127U, 128U, 1000U}) {
      Particles particles;
      for (std::size_t i = 0; i < count; ++i) {
        particles.add({random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0),
                       random.uniform(-std::numbers::pi, std::numbers::pi)},
                      0.5);
      }
      auto moved = particles;
      // A holonomic drive takes its two numbers for one particle after the other, too.
      Random first(count);
      Random second(count);
      move_particles(moved, sampler, first);
      for (std::size_t i = 0; i < count; ++i) {
        const Pose2 expected = sampler.move(particles.pose(i), second);
        ASSERT_NEAR(moved.x_m[i], expected.x_m, 1e-6);
        ASSERT_NEAR(moved.y_m[i], expected.y_m, 1e-6);
        ASSERT_NEAR(angle_difference(moved.heading_rad[i], expected.heading_rad), 0.0, 1e-6);
        ASSERT_GE(moved.heading_rad[i], -std::numbers::pi);
        ASSERT_LT(moved.heading_rad[i], std::numbers::pi);
        ASSERT_EQ(moved.weight[i], 0.5);
      }
      EXPECT_EQ(first.next(), second.next());
    }
  }
}

TEST(MoveParticles, AStepOfNoUseLeavesNumbers) {
  const OdometryNoise noise;
  Particles particles;
  particles.resize(20);
  Random random(1);
  move_particles(particles, StepSampler({0.0, 0.0, 1e300}, noise), random);
  for (const double heading_rad : particles.heading_rad) {
    EXPECT_TRUE(std::isfinite(heading_rad));
    EXPECT_LE(std::abs(heading_rad), std::numbers::pi);
  }
}

}  // namespace
}  // namespace panonav
