#include "panonav_simulation/recording.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/panorama/unwarper.hpp"
#include "panonav_simulation/mirror.hpp"
#include "panonav_simulation/scenes.hpp"
#include "support/scene_views.hpp"

namespace panonav::simulation {
namespace {

class Recording : public ::testing::Test {
 protected:
  const Scene scene_ = make_scene("lab");
  const FreeSpace space_{scene_};
  Executor executor_{1};
  PanoramaRendering small_{.rows = 10, .columns = 64, .rays_per_axis = 1};
};

TEST_F(Recording, EveryKindOfPathIsFreeAndRepeatsWithItsSeed) {
  RecordingOptions options;
  options.poses = 50;
  std::vector<Point2> way_points;
  Random random(1);
  for (int i = 0; i < 4; ++i) way_points.push_back(space_.random_pose(random).position());
  for (const RecordingPath path : {RecordingPath::grid, RecordingPath::zigzag, RecordingPath::tour,
                                   RecordingPath::walk, RecordingPath::random}) {
    for (const RecordingHeading heading :
         {RecordingHeading::fixed, RecordingHeading::path, RecordingHeading::random}) {
      options.path = path;
      options.heading = heading;
      options.spacing_m = 0.25;
      const auto poses = plan_recording(scene_, space_, options, {}, 7, way_points);
      ASSERT_GT(poses.size(), 10U) << static_cast<int>(path);
      EXPECT_EQ(poses, plan_recording(scene_, space_, options, {}, 7, way_points));
      EXPECT_NE(poses, plan_recording(scene_, space_, options, {}, 8, way_points));
      EXPECT_EQ(poses[0].odometry, Pose2{});
      for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_TRUE(space_.is_free(poses[i].pose.position()));
        if (i > 0) {
          EXPECT_GT(poses[i].stamp_s, poses[i - 1].stamp_s);
        }
      }
    }
  }
}

TEST_F(Recording, OdometryFollowsTheTrueMotion) {
  RecordingOptions options{.path = RecordingPath::walk, .heading = RecordingHeading::path};
  const OdometryNoise exact = testing::exact_odometry();
  options.spacing_m = 0.1;
  const auto poses = plan_recording(scene_, space_, options, exact, 3);
  for (const auto& recorded : poses) {
    const Pose2 found = poses[0].pose * recorded.odometry;
    EXPECT_NEAR(distance(found.position(), recorded.pose.position()), 0.0, 1e-9);
    EXPECT_NEAR(angle_difference(found.heading_rad, recorded.pose.heading_rad), 0.0, 1e-9);
  }
  const auto noisy = plan_recording(scene_, space_, options, {}, 3);
  EXPECT_EQ(noisy.back().pose, poses.back().pose);  // noise of the odometry does not move the robot
  EXPECT_NE(noisy.back().odometry, poses.back().odometry);
}

TEST_F(Recording, StampsGiveTheSpeed) {
  RecordingOptions options{.path = RecordingPath::zigzag};
  options.speed_m_s = 0.5;
  const auto poses = plan_recording(scene_, space_, options, {}, 1);
  double length = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    length += distance(poses[i - 1].pose.position(), poses[i].pose.position());
  }
  EXPECT_NEAR(poses.back().stamp_s, length / 0.5, 1e-6);
}

TEST_F(Recording, FramesAreTheSameOneByOneAndInARow) {
  const Renderer renderer(scene_);
  RecordingOptions options{.path = RecordingPath::random};
  options.poses = 3;
  const auto poses = plan_recording(scene_, space_, options, {}, 2);
  std::vector<Image> first;
  record(renderer, poses, small_, {}, {}, 5, executor_, [&](const RecordedFrame& frame) {
    EXPECT_EQ(frame.number, first.size());
    EXPECT_EQ(frame.pose, poses[frame.number]);
    EXPECT_EQ(frame.tilt, Tilt{});
    first.push_back(frame.picture);
  });
  ASSERT_EQ(first.size(), 3U);
  EXPECT_EQ(first[0].size(), (ImageSize{64, 10}));
  EXPECT_NE(first[0], first[1]);
  Executor two(2);
  record(renderer, poses, small_, {}, {}, 5, two,
         [&](const RecordedFrame& frame) { EXPECT_EQ(frame.picture, first[frame.number]); });
  record(renderer, poses, small_, {}, {}, 6, executor_,
         [&](const RecordedFrame& frame) { EXPECT_NE(frame.picture, first[frame.number]); });
}

TEST_F(Recording, TiltChangesTheViewAndNothingElseDoes) {
  const Renderer renderer(scene_);
  Random random(4);
  const Pose2 pose = space_.random_pose(random);
  const SensorOptions ideal{.read_noise = 0.0, .full_well = 1e12, .eight_bit = false};
  const auto level = capture_panorama(renderer, pose, small_, {}, ideal, 1, executor_);
  const auto again = capture_panorama(renderer, pose, small_, {}, ideal, 2, executor_);
  const auto tilted =
      capture_panorama(renderer, pose, small_, {.tilt_rad = radians(5.0)}, ideal, 1, executor_);
  double largest_again = 0.0;
  double mean_tilted = 0.0;
  for (std::size_t i = 0; i < level.values().size(); ++i) {
    const auto value = static_cast<double>(level.values()[i]);
    largest_again =
        std::max(largest_again, std::abs(value - static_cast<double>(again.values()[i])));
    mean_tilted += std::abs(value - static_cast<double>(tilted.values()[i]));
  }
  EXPECT_LT(largest_again, 1e-4);
  EXPECT_GT(mean_tilted / static_cast<double>(level.values().size()), 0.005);
}

// A black floor without end below a white sky, and a black wall all round, 2 m away and 1 m high.
Scene plain_and_round_wall(bool with_wall) {
  Scene scene;
  scene.background = {1.0F, 1.0F, 1.0F};
  scene.materials.push_back({.colour = {0.0F, 0.0F, 0.0F}, .texture = nullptr, .emission = 1.0F});
  scene.materials.push_back({.colour = {0.5F, 0.5F, 0.5F}, .texture = nullptr, .emission = 1.0F});
  const double far = 1e4;
  scene.meshes.push_back({"floor",
                          0,
                          {{-far, -far, 0.0}, {far, -far, 0.0}, {far, far, 0.0}, {-far, far, 0.0}},
                          {},
                          {{0, 1, 2}, {0, 2, 3}}});
  constexpr std::uint32_t facets = 256;
  Mesh wall{"wall", 1, {}, {}, {}};
  for (std::uint32_t i = 0; with_wall && i < facets; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / facets;
    wall.vertices.push_back({2.0 * std::cos(angle), 2.0 * std::sin(angle), 0.0});
    wall.vertices.push_back({2.0 * std::cos(angle), 2.0 * std::sin(angle), 1.0});
    const std::uint32_t next = (i + 1) % facets;
    wall.triangles.push_back({2 * i, 2 * next, 2 * i + 1});
    wall.triangles.push_back({2 * next, 2 * next + 1, 2 * i + 1});
  }
  if (with_wall) scene.meshes.push_back(wall);
  scene.floor_low = {-3.0, -3.0};
  scene.floor_high = {3.0, 3.0};
  return scene;
}

TEST_F(Recording, TiltLeansTheHorizonByItsAngleInAnyDirection) {
  const Renderer renderer(plain_and_round_wall(false));
  const PanoramaRendering fine{
      .rows = 60, .columns = 72, .elevations = {-0.3, 0.3}, .rays_per_axis = 4};
  const SensorOptions ideal{.read_noise = 0.0, .full_well = 1e12, .eight_bit = false};
  const double tilt = radians(7.0);
  double east = 0.0;
  double north = 0.0;
  constexpr int pictures = 40;
  for (int i = 0; i < pictures; ++i) {
    const Panorama view = capture_panorama(renderer, {0.0, 0.0, 0.5}, fine, {.tilt_rad = tilt},
                                           ideal, static_cast<std::uint64_t>(i), executor_);
    // Height of the horizon in each column, and its first harmonic.
    double cosine = 0.0;
    double sine = 0.0;
    for (int c = 0; c < view.columns(); ++c) {
      double sky = 0.0;
      for (int y = 0; y < view.rows(); ++y) sky += static_cast<double>(view.at(y, c)) / view.rows();
      const double horizon_rad = 0.3 - 0.6 * sky;
      cosine += 2.0 * horizon_rad * std::cos(view.azimuth_rad(c)) / view.columns();
      sine += 2.0 * horizon_rad * std::sin(view.azimuth_rad(c)) / view.columns();
    }
    EXPECT_NEAR(std::hypot(cosine, sine), tilt, 0.02 * tilt) << "picture " << i;
    east += cosine / tilt / pictures;
    north += sine / tilt / pictures;
  }
  // Directions are drawn evenly: their mean is longer than 0.5 once in e^-10.
  EXPECT_LT(std::hypot(east, north), 0.5);
}

TEST_F(Recording, TheCameraStandsAtItsHeight) {
  const Renderer renderer(plain_and_round_wall(true));
  const PanoramaRendering fine{
      .rows = 400, .columns = 8, .elevations = {-0.9, 0.9}, .rays_per_axis = 2};
  const SensorOptions ideal{.read_noise = 0.0, .full_well = 1e12, .eight_bit = false};
  for (const double height_m : {0.08, 0.6, 0.9}) {
    const Panorama view =
        capture_panorama(renderer, {}, fine, {.camera_height_m = height_m}, ideal, 1, executor_);
    const double row_rad = 1.8 / view.rows();
    int sky = 0;
    int floor = 0;
    for (int y = 0; y < view.rows(); ++y) {
      sky += view.at(y, 3) > 0.9F ? 1 : 0;
      floor += view.at(y, 3) < 0.1F ? 1 : 0;
    }
    EXPECT_NEAR(0.9 - sky * row_rad, std::atan2(1.0 - height_m, 2.0), 1.5 * row_rad);
    EXPECT_NEAR(0.9 - floor * row_rad, std::atan2(height_m, 2.0), 1.5 * row_rad);
  }
}

/// Returns the mean absolute difference of two panoramas of equal size.
double compute_mean_difference(const Panorama& a, const Panorama& b) {
  double sum = 0.0;
  for (int y = 0; y < a.rows(); ++y) {
    for (int c = 0; c < a.columns(); ++c)
      sum += std::abs(static_cast<double>(a.at(y, c)) - static_cast<double>(b.at(y, c)));
  }
  return sum / (a.rows() * a.columns());
}

TEST_F(Recording, AMirrorShowsTheSameSurroundingsAsAPanorama) {
  const Renderer renderer(scene_);
  const PanoramaRendering mirror = make_mirror_rendering(20, 128);
  const PanoramaRendering coarse = make_mirror_rendering(20, 128, std::nullopt, 2);
  EXPECT_EQ(coarse.unwarper->camera().image_size.width, 320);
  PanoramaRendering direct = mirror;
  direct.unwarper = nullptr;
  direct.rays_per_axis = 4;
  const FrameOptions frame{.camera_height_m = scene_.camera_height_m, .tilt_rad = radians(3.0)};
  Random random(5);
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    const Pose2 pose = space_.random_pose(random);
    const auto capture = [&](const Pose2& at, const PanoramaRendering& rendering) {
      return capture_panorama(renderer, at, rendering, frame, {}, seed, executor_);
    };
    const Panorama reflected = capture(pose, mirror);
    ASSERT_EQ(reflected.rows(), 20);
    ASSERT_EQ(reflected.columns(), 128);
    EXPECT_EQ(reflected.elevations(), mirror.elevations);
    // A pixel of the panorama covers 2.8 degrees: optics change less than a turn by half of that.
    const double optics = compute_mean_difference(reflected, capture(pose, direct));
    const Pose2 turned{pose.x_m, pose.y_m, pose.heading_rad + radians(1.4)};
    const double turn = compute_mean_difference(reflected, capture(turned, direct));
    EXPECT_LT(optics, turn);
    EXPECT_LT(compute_mean_difference(capture(pose, coarse), reflected), turn);
  }
  const auto around_horizon = make_mirror_rendering(4, 36, ElevationBand{-0.1, 0.1});
  EXPECT_EQ(around_horizon.elevations, (ElevationBand{-0.1, 0.1}));
  EXPECT_THROW((void)renderer.render_panorama({}, mirror, executor_), ContractError);
  EXPECT_THROW((void)make_mirror_rendering(0, 36), OptionError);
}

TEST_F(Recording, PixelsThatAreRenderedAloneAreThoseOfTheWholeImage) {
  const Renderer renderer(scene_);
  Executor two(2);
  const Camera dual = make_simulated_dual_fisheye(4, 0.02);
  for (const Camera& camera : {make_simulated_mirror_camera(), dual}) {
    std::vector<std::uint32_t> pixels;
    const auto count = static_cast<std::uint32_t>(camera.image_size.width) *
                       static_cast<std::uint32_t>(camera.image_size.height);
    for (std::uint32_t pixel = 3; pixel < count; pixel += 7) pixels.push_back(pixel);
    const PixelRays rays(camera, pixels, 2);
    Random random(5);
    for (int k = 0; k < 3; ++k) {
      const Viewpoint viewpoint{.pose = space_.random_pose(random), .roll_rad = 0.05};
      const Radiance whole = renderer.render_image(viewpoint, camera, 2, two);
      const Radiance alone = renderer.render_image(viewpoint, rays, two);
      EXPECT_EQ(alone.values, renderer.render_image(viewpoint, rays, executor_).values);
      ASSERT_EQ(alone.values.size(), whole.values.size());
      double difference = 0.0;
      double light = 0.0;
      for (const std::uint32_t pixel : pixels) {
        difference += std::abs(static_cast<double>(alone.values[pixel]) - whole.values[pixel]);
        light += whole.values[pixel];
      }
      EXPECT_GT(light, 0.1 * static_cast<double>(pixels.size()));
      EXPECT_LT(difference, 1e-4 * light);  // a ray at an edge falls on the other side of it
      for (std::uint32_t pixel = 0; pixel < count; ++pixel) {
        if (pixel % 7 != 3) {
          ASSERT_EQ(alone.values[pixel], 0.0F);
        }
      }
    }
    EXPECT_THROW(PixelRays(camera, std::vector<std::uint32_t>{count}, 1), ContractError);
    EXPECT_THROW(PixelRays(camera, pixels, 9), ContractError);
  }
}

TEST_F(Recording, BadInputIsNamed) {
  RecordingOptions options;
  options.spacing_m = 0.0;
  EXPECT_THROW((void)plan_recording(scene_, space_, options, {}, 1), OptionError);
  options = {.path = RecordingPath::tour};
  const std::vector<Point2> outside{{1e3, 0.0}, {0.0, 0.0}};
  EXPECT_THROW((void)plan_recording(scene_, space_, options, {}, 1, outside), ContractError);
  const std::vector<Point2> one{{0.0, 0.0}};
  EXPECT_THROW((void)plan_recording(scene_, space_, options, {}, 1, one), ContractError);
  const Renderer renderer(scene_);
  EXPECT_THROW(
      (void)capture_image(renderer, {}, small_, {.camera_height_m = -1.0}, {}, 1, executor_),
      OptionError);
}

}  // namespace
}  // namespace panonav::simulation
