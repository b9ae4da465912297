#include "panonav/pipeline/robot_explorer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav_simulation/simulated_odometry.hpp"
#include "support/remembered_worlds.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

using State = ExplorationDecision::State;
constexpr double robot_radius_m = 0.2;

/// A robot in the first of two rooms, which feels contact ahead.
class RobotExploring : public ::testing::Test {
 protected:
  static Image picture(const Pose2& pose) {
    return to_picture(world.panorama(pose, 24, 128, band));
  }
  static PictureSource source() {
    PictureSource source{.kind = PictureKind::panorama};
    source.layout.elevations = band;
    return source;
  }
  [[nodiscard]] RobotExplorer make_explorer(double max_metres) const {
    return {memory,
            source(),
            {.exploration = {.radius_m = 0.4, .max_metres = max_metres},
             .robot_radius_m = robot_radius_m}};
  }
  [[nodiscard]] Observation observe() const {
    Observation seen(picture(robot));
    seen.odometry = wheels.pose();
    seen.pose = ReferencePose{9.0, 9.0, 9.0};  // a true pose would be of no use to it
    return seen;
  }
  /// Drives for a period; true if a wall stops the robot.
  bool drive(const Velocity& velocity) {
    Pose2 moved = integrate_velocity(velocity, BaseOptions{}.period_s);
    const bool is_stopped = world.clearance_m((robot * moved).position()) < robot_radius_m;
    if (is_stopped) moved = {0.0, 0.0, moved.heading_rad};
    robot = robot * moved;
    wheels.advance(moved);
    return is_stopped && velocity.forward_m_s > 0.0;
  }

  static constexpr ElevationBand band{-0.45, 0.6};
  inline static const ToyWorld world = two_rooms(3, false);
  TemporaryFolder folder;
  std::filesystem::path memory = folder / "explored.panonav";
  Pose2 robot{0.8, 0.8, 0.3};
  simulation::SimulatedOdometry wheels{{}, 5};
};

TEST_F(RobotExploring, WritesTheViewsAndTheirMapAndReturns) {
  const Pose2 start = robot;
  std::vector<Pose2> views;  // true poses
  int contacts = 0;
  {
    RobotExplorer explorer = make_explorer(6.0);
    bool is_contact = false;
    RobotExplorer::Step step;
    for (int i = 0; i < 3000; ++i) {
      step =
          explorer.step(observe(), {.contact_rad = is_contact ? std::optional(0.0) : std::nullopt});
      if (step.decided && step.decision.memorise) views.push_back(robot);
      if (step.decision.state == State::done || step.decision.state == State::lost) break;
      is_contact = drive(step.velocity);
      contacts += is_contact ? 1 : 0;
    }
    EXPECT_EQ(step.decision.state, State::done);
    EXPECT_EQ(step.velocity, Velocity{});
    explorer.finish();
    const ExplorationProgress progress = explorer.explorer().progress();
    EXPECT_GT(progress.covered_m2, 1.0);
    EXPECT_GE(progress.floor_m2, progress.covered_m2);
    EXPECT_FALSE(progress.is_complete);  // the distance ended it
    EXPECT_LT(distance((start * explorer.map_from_odometry() * wheels.pose()).position(),
                       robot.position()),
              0.3);
  }
  EXPECT_LT(distance(start.position(), robot.position()), 0.3);
  EXPECT_GE(contacts, 1);
  EXPECT_GE(views.size(), 8U);  // fewer have no positions
  const MemoryFile file = MemoryFile::open(memory, Access::read_only);
  EXPECT_EQ(read_length_unit(file), LengthUnit::metres);
  const VisualMemory stored = file.load();
  ASSERT_EQ(stored.views().size(), views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto& info = stored.info(stored.views()[i]);
    EXPECT_EQ(info.name, "view_" + std::to_string(i + 1));
    ASSERT_TRUE(info.pose);
    EXPECT_LT(distance((start * Pose2{info.pose->x_m, info.pose->y_m, 0.0}).position(),
                       views[i].position()),
              0.4);
  }
}

TEST_F(RobotExploring, BacksOffAfterAContactAndIfItIsStuck) {
  for (const bool is_felt : {true, false}) {
    SCOPED_TRACE(is_felt);
    std::filesystem::remove(memory);
    RobotExplorer explorer = make_explorer(100.0);
    RobotExplorer::Step step = explorer.step(observe());
    ASSERT_TRUE(step.decided && step.decision.memorise);
    while (step.velocity.forward_m_s == 0.0) {
      (void)drive(step.velocity);
      step = explorer.step(observe());
    }
    // The robot stands although it is commanded to drive.
    int images = 0;
    while (step.velocity.forward_m_s >= 0.0 && images < 200) {
      step = explorer.step(observe(), {.contact_rad = is_felt ? std::optional(0.0) : std::nullopt});
      ++images;
    }
    EXPECT_LT(step.velocity.forward_m_s, 0.0);
    EXPECT_EQ(images == 1, is_felt);
    EXPECT_FALSE(step.decided);
    const Pose2 before = wheels.pose();
    for (int i = 0; i < 10 && !step.decided; ++i) {
      (void)drive(step.velocity);
      step = explorer.step(observe());
    }
    EXPECT_TRUE(step.decided);
    const Pose2 moved = inverse(before) * wheels.pose();
    EXPECT_NEAR(moved.x_m, -0.1 * robot_radius_m, 0.01);
  }
}

TEST_F(RobotExploring, RefusesFilesThatExistAndImagesWithoutOdometry) {
  {
    RobotExplorer explorer = make_explorer(100.0);
    EXPECT_THROW((void)explorer.step(picture(robot)), ContractError);
    explorer.finish();  // without a view
    EXPECT_FALSE(std::filesystem::exists(memory));
    (void)explorer.step(observe());
    explorer.finish();
  }
  EXPECT_THROW((void)make_explorer(100.0), FileError);
  memory = folder / "other.panonav";
  EXPECT_THROW((void)make_explorer(-1.0), OptionError);
}

}  // namespace
}  // namespace panonav::testing
