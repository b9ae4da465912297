#include "panonav/pipeline/orientation_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/odometry.hpp"
#include "support/random_views.hpp"
#include "support/skips.hpp"
#include "support/test_cameras.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

Camera equirectangular_camera() {
  Camera camera;
  camera.model = EquirectangularModel{radians(90.0), radians(-90.0)};
  camera.image_size = {640, 320};
  camera.forward_column = 0.8;
  return camera;
}

/// Azimuth of the column at a fraction of the width.
double azimuth_at(const PictureLayout& layout, double column) {
  const double sign = layout.direction == ColumnDirection::counter_clockwise ? 1.0 : -1.0;
  return wrap_angle(sign * 2.0 * std::numbers::pi * (column - layout.forward_column));
}

TEST(CorrectOrientation, OfAPanoramaGivesEachColumnItsTrueAzimuth) {
  for (const auto direction : {ColumnDirection::clockwise, ColumnDirection::counter_clockwise}) {
    for (const OrientationFault& fault : {OrientationFault{false, 1.0}, OrientationFault{true, 0.0},
                                          OrientationFault{true, -2.0}}) {
      const PictureSource stated{
          .layout = {.direction = direction, .forward_column = 0.3}, .camera = {}, .mask = {}};
      const PictureSource corrected = correct_orientation(stated, fault).value();
      EXPECT_GE(corrected.layout.forward_column, 0.0);
      EXPECT_LT(corrected.layout.forward_column, 1.0);
      for (const double column : {0.0, 0.2, 0.7}) {
        const double stated_rad = azimuth_at(stated.layout, column);
        const double true_rad = (fault.is_mirrored ? -stated_rad : stated_rad) + fault.turn_rad;
        EXPECT_NEAR(angle_difference(azimuth_at(corrected.layout, column), true_rad), 0.0, 1e-12);
      }
    }
  }
}

TEST(CorrectOrientation, OfACameraGivesEachPixelItsTrueDirection) {
  const OrientationFault fault{true, 0.7};
  for (const Camera& camera : {mirror_camera(), equirectangular_camera()}) {
    const PictureSource stated{
        .kind = PictureKind::mirror, .layout = {}, .camera = camera, .mask = {}};
    const Camera corrected = correct_orientation(stated, fault).value().camera.value();
    for (const double azimuth_rad : {-3.0, -1.0, 0.0, 2.0}) {
      const auto pixel = project(camera, Direction3::from_angles(azimuth_rad, -0.1));
      ASSERT_TRUE(pixel.has_value());
      const auto direction = unproject(corrected, *pixel);
      ASSERT_TRUE(direction.has_value());
      EXPECT_NEAR(angle_difference(direction->azimuth_rad(), fault.turn_rad - azimuth_rad), 0.0,
                  1e-9);
    }
  }
}

class Pictures : public PictureStore {
 public:
  explicit Pictures(std::vector<Image> images) : images_(std::move(images)) {}
  [[nodiscard]] Image read(std::size_t index) const override { return images_.at(index); }

 private:
  std::vector<Image> images_;
};

constexpr ElevationBand band{radians(-30.0), radians(40.0)};

/// A recording of panoramas at these poses, as `see` shows them.
Dataset record(const std::vector<Pose2>& poses, const std::function<Panorama(const Pose2&)>& see) {
  Dataset recording;
  std::vector<Image> images;
  for (const Pose2& pose : poses) images.push_back(to_picture(see(pose)));
  const int columns = images.front().width();
  recording.source.layout = {.forward_column = picture_forward_column(columns), .elevations = band};
  const auto store = std::make_shared<Pictures>(std::move(images));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    DatasetEntry entry;
    entry.file = std::to_string(i);
    entry.pose = {poses[i].x_m, poses[i].y_m, poses[i].heading_rad};
    entry.store = store;
    entry.store_index = i;
    recording.entries.push_back(std::move(entry));
  }
  return recording;
}

Dataset record(const std::vector<Pose2>& poses, const Room& room) {
  return record(poses, [&](const Pose2& pose) { return room.see(pose); });
}

std::vector<Pose2> walk(const Room& room, std::uint64_t seed) {
  Random random(seed, 7);
  std::vector<Pose2> poses{room.between(room.grid(0.5), 0.0, random)};
  while (poses.size() < 80) {
    const Pose2 next = poses.back() * Pose2{0.15, 0.0, random.normal(0.0, 0.25)};
    const double away_rad = random.uniform(0.5, 1.0) * std::numbers::pi;
    poses.push_back(room.is_free((next * Pose2{0.2, 0.0, 0.0}).position())
                        ? next
                        : poses.back() * Pose2{0.0, 0.0, away_rad});
  }
  return poses;
}

/// Says that columns run in the other direction, that forward is a quarter of a turn off, or both.
PictureSource describe_wrongly(PictureSource source, bool mirrored, bool turned) {
  PictureLayout& layout = source.layout;
  if (mirrored) {
    layout.direction = layout.direction == ColumnDirection::clockwise
                           ? ColumnDirection::counter_clockwise
                           : ColumnDirection::clockwise;
  }
  if (turned) layout.forward_column = std::fmod(layout.forward_column + 0.25, 1.0);
  return source;
}

/// Expects each of the three wrong descriptions to be found and corrected, and none in the right.
void expect_faults_found(Dataset recording, double tolerance_rad) {
  Executor executor(2);
  const PictureSource right = recording.source;
  EXPECT_FALSE(check_orientation(recording, executor).fault.has_value());
  for (const auto& [mirrored, turned] : {std::pair{true, false}, {false, true}, {true, true}}) {
    SCOPED_TRACE(std::to_string(mirrored) + " " + std::to_string(turned));
    recording.source = describe_wrongly(right, mirrored, turned);
    const OrientationCheck check = check_orientation(recording, executor);
    ASSERT_TRUE(check.fault.has_value());
    EXPECT_EQ(check.columns_right, !mirrored);
    EXPECT_EQ(check.forward_right, !turned);
    const PictureLayout& corrected = check.corrected.value().layout;
    EXPECT_EQ(corrected.direction, right.layout.direction);
    const double off = corrected.forward_column - right.layout.forward_column;
    EXPECT_LT(std::abs(wrap_angle(2.0 * std::numbers::pi * off)), tolerance_rad);
    EXPECT_EQ(check.settings.size(), (mirrored ? 1U : 0U) + (turned ? 1U : 0U));
  }
}

TEST(CheckOrientation, FindsWrongDescriptionsByPosesAndByOdometry) {
  const Room room(3, {});
  const Dataset posed = record(walk(room, 3), room);
  expect_faults_found(posed, radians(10.0));
  Dataset driven = posed;
  for (DatasetEntry& entry : driven.entries) {
    entry.odometry = {entry.pose->x_m, entry.pose->y_m, *entry.pose->heading_rad};
    entry.pose.reset();
  }
  expect_faults_found(driven, radians(10.0));
  // One pose among odometry is not the only evidence.
  driven.entries.front().pose = posed.entries.front().pose;
  expect_faults_found(driven, radians(10.0));
}

TEST(CheckOrientation, FindsWrongDescriptionsOfRealRecordings) {
  for (const char* const name : {"ciirc_b670", "gantry_plants", "sussex_route"}) {
    const auto folder = real_data(name);
    PANONAV_REQUIRE_DATA(folder, name);
    SCOPED_TRACE(name);
    expect_faults_found(read_dataset(*folder), radians(15.0));
  }
}

TEST(CheckOrientation, RaisesNoFalseAlarmWhereOdometryDrifts) {
  Executor executor(2);
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Room room(seed, {});
    const std::vector<Pose2> poses = walk(room, seed);
    Dataset recording = record(poses, room);
    Random random(seed, 3);
    const OdometryNoise noise{.rotation_from_rotation = 0.1};
    Pose2 odometry;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (i > 0) {
        odometry = odometry * sample_step(inverse(poses[i - 1]) * poses[i], noise, random);
        odometry = odometry * Pose2{0.0, 0.0, radians(2.0)};  // a gyroscope with a bias
      }
      recording.entries[i].odometry = odometry;
      recording.entries[i].pose.reset();
    }
    const OrientationCheck check = check_orientation(recording, executor);
    EXPECT_GT(check.evidence.turns(), 10U);
    EXPECT_FALSE(check.fault.has_value()) << seed << ": " << check.explanation;
  }
}

TEST(CheckOrientation, SaysNothingOfColumnsWhereTheRobotDrivesStraight) {
  Executor executor(2);
  const Room room(1, {.width_m = 14.0, .depth_m = 10.0, .boxes = 0});
  std::vector<Pose2> poses;
  for (int i = 0; i < 60; ++i) poses.push_back({3.0 + 0.13 * i, 5.0, 0.0});
  Dataset recording = record(poses, room);
  const PictureSource right = recording.source;
  for (const bool mirrored : {false, true}) {
    recording.source = describe_wrongly(right, mirrored, false);
    const OrientationCheck check = check_orientation(recording, executor);
    EXPECT_FALSE(check.columns_right.has_value()) << check.explanation;
    EXPECT_FALSE(check.fault.has_value()) << check.explanation;
  }
}

TEST(CheckOrientation, SaysNothingOfNoiseOrOfViewsThatLookAlike) {
  Executor executor(2);
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Room room(seed, {});
    const std::vector<Pose2> poses = walk(room, seed);
    Random random(seed);
    const auto noise =
        record(poses, [&](const Pose2&) { return random_panorama(random, 16, 96, band); });
    EXPECT_EQ(check_orientation(noise, executor).explanation, "") << seed;
    const auto alike = record(poses, [&](const Pose2&) { return room.see(poses.front()); });
    EXPECT_EQ(check_orientation(alike, executor).explanation, "") << seed;
  }
  const auto grey =
      record(walk(Room(1, {}), 1), [](const Pose2&) { return Panorama(16, 96, band); });
  EXPECT_EQ(check_orientation(grey, executor).explanation, "");
}

TEST(CheckOrientation, SaysNothingWithoutPosesAndOnALineOfPlacesWithOneHeading) {
  Executor executor(2);
  const Room room(2, {.width_m = 14.0, .depth_m = 10.0, .boxes = 0});
  std::vector<Pose2> poses;
  for (int i = 0; i < 20; ++i) poses.push_back({3.0 + 0.4 * i, 5.0, 0.5});
  Dataset recording = record(poses, room);
  recording.source = describe_wrongly(recording.source, true, false);
  const OrientationCheck check = check_orientation(recording, executor);
  EXPECT_EQ(check.evidence.turns(), 0U);
  EXPECT_FALSE(check.columns_right.has_value());
  for (DatasetEntry& entry : recording.entries) entry.pose.reset();
  EXPECT_EQ(check_orientation(recording, executor).explanation, "");
}

TEST(ReplaceOrientation, ChangesOnlyTheFieldsOfTheImages) {
  const std::vector<OrientationSetting> settings{{"columns", "clockwise"},
                                                 {"forward_column", "0.250"}};
  EXPECT_EQ(replace_orientation("# walk\n[images]  # of a robot\nkind = \"panorama\"\n"
                                "  columns=\"counter-clockwise\"\n\n[poses]\ncolumns = 1",
                                settings),
            "# walk\n[images]  # of a robot\ncolumns = \"clockwise\"\nforward_column = 0.250\n"
            "kind = \"panorama\"\n\n[poses]\ncolumns = 1\n");
  EXPECT_EQ(replace_orientation("images.kind = \"panorama\"\n", settings), std::nullopt);
  EXPECT_THROW(write_orientation("unused.toml", {}, {}), ContractError);
}

}  // namespace
}  // namespace panonav::testing
