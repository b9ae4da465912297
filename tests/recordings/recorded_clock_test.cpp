// Recordings whose clocks restart or differ.
#include "panonav_recordings/recorded_dataset.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <tuple>
#include <utility>
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav_recordings/recorded_poses.hpp"
#include "panonav_recordings/recording_conversion.hpp"
#include "support/picture_samples.hpp"
#include "support/recorded_messages.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::recordings {
using namespace testing;
namespace {

/// A drive of 12 s, with odometry 20 times and a picture 3 times a second. `clock` gives the stamp
/// and the log time of a moment of the drive, for pictures (true) and odometry (false).
class RecordedClocks : public ::testing::TestWithParam<MessageEncoding> {
 protected:
  static constexpr std::int64_t ms = 1'000'000;
  static constexpr std::int64_t start_ns = 1'700'000'000'000 * ms;
  /// Pose of the robot, which turns while it moves.
  static Pose2 pose_at(std::int64_t after_ns) {
    const double s = 1e-9 * static_cast<double>(after_ns);
    return {0.5 * s, -0.25 * s, wrap_angle(2.9 + 0.4 * s)};
  }
  using Clock = std::function<std::pair<std::int64_t, std::int64_t>(bool is_picture, std::int64_t)>;
  static constexpr int picture_count = 36;

  Dataset read_with(const Clock& clock) {
    const auto recorded = std::make_shared<testing::RecordedMessages>(GetParam());
    Random random(5);
    const Image image = random_image(random, 8, 4, 3);
    for (int i = 0; i <= 240; ++i) {
      const std::int64_t after_ns = i * 50 * ms;
      const auto [stamp_ns, log_ns] = clock(false, after_ns);
      ros::Odometry message;
      message.header.stamp_ns = stamp_ns;
      message.pose.pose = ros::to_pose(pose_at(after_ns));
      recorded->add("/odom", log_ns, message);
      if (i % 20 != 1 && i % 20 != 8 && i % 20 != 14) continue;
      const auto [picture_stamp_ns, picture_log_ns] = clock(true, after_ns + 20 * ms);
      ros::Image picture;
      picture.header.stamp_ns = picture_stamp_ns;
      std::tie(picture.width, picture.height, picture.step) = std::tuple{8U, 4U, 24U};
      picture.encoding = "rgb8";
      picture.data = image.pixels();
      recorded->add("/camera", picture_log_ns, picture);
      picture_times_.push_back(after_ns + 20 * ms);
    }
    return read_recording(recorded, "drive.bag", {.kind = PictureKind::equirectangular});
  }
  /// Expects that each picture has the odometry of its own moment, up to `tolerance_s` of the
  /// drive.
  void expect_own_odometry(const Dataset& dataset, double tolerance_s) {
    ASSERT_EQ(dataset.entries.size(), std::size_t{picture_count});
    for (std::size_t i = 0; i < dataset.entries.size(); ++i) {
      const DatasetEntry& entry = dataset.entries[i];
      ASSERT_TRUE(entry.odometry) << i;
      const Pose2 expected = pose_at(picture_times_[i]);
      constexpr double speed_m_s = 0.56;
      EXPECT_LT(distance(entry.odometry->position(), expected.position()),
                speed_m_s * tolerance_s + 1e-9)
          << i;
      EXPECT_GT(*entry.stamp_s, i == 0 ? -1e10 : *dataset.entries[i - 1].stamp_s);
    }
  }
  std::vector<std::int64_t> picture_times_;
};
INSTANTIATE_TEST_SUITE_P(Encodings, RecordedClocks,
                         ::testing::Values(MessageEncoding::ros1, MessageEncoding::cdr));

TEST_P(RecordedClocks, PartsBetweenRestartsFollowEachOther) {
  const Dataset dataset = read_with([](bool, std::int64_t ns) {
    return std::pair{1000 * ms + ns % (7000 * ms), start_ns + ns + 3 * ms};
  });
  expect_own_odometry(dataset, 0.0);
  ASSERT_EQ(dataset.warnings.size(), 1U);
  EXPECT_EQ(dataset.warnings[0],
            "the clock of the images restarts 1 time; the parts follow each other, with stamps "
            "that continue those of the first");
  EXPECT_EQ(dataset.entries[0].file, "1_070000000");
  EXPECT_NEAR(*dataset.entries.back().stamp_s - *dataset.entries[0].stamp_s, 11.65, 1e-6);
}

// Checks the next step that the refusal of poses of several runs recommends.
TEST_P(RecordedClocks, AConvertedRecordingHasThePosesOfAllPartsInOneRun) {
  const Dataset dataset = read_with([](bool, std::int64_t ns) {
    return std::pair{1000 * ms + ns % (7000 * ms), start_ns + ns + 3 * ms};
  });
  const TemporaryFolder folder;
  const std::filesystem::path joined = folder / "joined.mcap";
  static_cast<void>(convert_to_recording(dataset, joined));
  const auto poses = read_recorded_poses(joined, "/odom", PoseUse::ground_truth).poses;
  ASSERT_EQ(poses.size(), dataset.entries.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_NEAR(poses[i].pose.position.x_m, dataset.entries[i].odometry->x_m, 1e-9) << i;
  }
}

TEST_P(RecordedClocks, ASimulatedClockRestartsTheTimesOfRecordingToo) {
  for (const bool has_stamps : {true, false}) {
    picture_times_.clear();
    const Dataset dataset = read_with([&](bool, std::int64_t ns) {
      const std::int64_t now_ns = 1000 * ms + ns % (5000 * ms);
      return std::pair{has_stamps ? now_ns : 0, now_ns};
    });
    expect_own_odometry(dataset, 0.0);
    EXPECT_TRUE(contains(dataset.warnings.back(), "the clock of the images restarts 2 times"));
  }
}

TEST_P(RecordedClocks, AClockThatIsSetBackIsNoOtherPlace) {
  const Dataset dataset = read_with([](bool, std::int64_t ns) {
    return std::pair{start_ns + ns - (ns > 5000 * ms ? 3000 * ms : 0), start_ns + ns};
  });
  expect_own_odometry(dataset, 0.0);
}

TEST_P(RecordedClocks, OfTwoClocksTheTimesOfRecordingMatchTheTopics) {
  const auto delay_ns = [](bool is_picture, std::int64_t ns) {
    return (is_picture ? 10 : 2) * ms + ns / 7 % (30 * ms);  // up to 40 ms
  };
  for (const bool restarts : {false, true}) {
    picture_times_.clear();
    const Dataset dataset = read_with([&](bool is_picture, std::int64_t ns) {
      const std::int64_t uptime_ns = 60'000 * ms + (restarts ? ns % (7000 * ms) : ns);
      return std::pair{is_picture ? uptime_ns : start_ns + ns,
                       start_ns + ns + delay_ns(is_picture, ns)};
    });
    expect_own_odometry(dataset, 0.05);
    ASSERT_FALSE(dataset.warnings.empty());
    EXPECT_EQ(dataset.warnings[0],
              "the stamps of the odometry are of another clock than those of the images; the times "
              "of recording are used to match them");
    EXPECT_EQ(dataset.warnings.size(), restarts ? 2U : 1U);
  }
}

TEST_P(RecordedClocks, ASlowConnectionIsNoOtherClock) {
  const Dataset dataset = read_with([](bool is_picture, std::int64_t ns) {
    return std::pair{start_ns + ns, start_ns + ns + (is_picture ? 2500 * ms : 0)};
  });
  expect_own_odometry(dataset, 0.0);
  EXPECT_TRUE(dataset.warnings.empty()) << dataset.warnings[0];
}

TEST_P(RecordedClocks, WheelsWhoseClockRestartsAloneAreMatched) {
  const Dataset dataset = read_with([](bool is_picture, std::int64_t ns) {
    return std::pair{1000 * ms + (is_picture ? ns : ns % (6000 * ms)), start_ns + ns + 2 * ms};
  });
  expect_own_odometry(dataset, 0.01);
}

}  // namespace
}  // namespace panonav::recordings
