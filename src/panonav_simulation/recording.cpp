#include "panonav_simulation/recording.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/panorama/unwarper.hpp"
#include "panonav_simulation/mirror.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::simulation {

namespace {

// Numbers of the random streams of one recording.
constexpr std::uint64_t pose_stream = 0;
constexpr std::uint64_t heading_stream = 1;

std::uint64_t frame_seed(std::uint64_t seed, std::uint64_t number) {
  return Random(seed, 1000 + number).next();
}

double direction(Point2 from, Point2 to) {
  return std::atan2(to.y_m - from.y_m, to.x_m - from.x_m);
}

std::string format_point(Point2 p) {
  return "(" + to_text(p.x_m) + ", " + to_text(p.y_m) + ")";
}

std::vector<Pose2> plan_tour(const Scene& scene, const FreeSpace& space,
                             std::span<const Point2> way_points, double spacing_m) {
  std::vector<Point2> way_points_of_tour(way_points.begin(), way_points.end());
  if (way_points_of_tour.empty() && !scene.tour.empty()) {
    way_points_of_tour = scene.tour;
    way_points_of_tour.push_back(way_points_of_tour.front());
  }
  require(
      way_points_of_tour.size() >= 2, "waypoints of a tour",
      static_cast<double>(way_points_of_tour.size()),
      ">= 2, or a scene that has a tour; for other scenes use --path walk, --path zigzag, --grid "
      "or --trajectory");
  std::vector<Pose2> line;
  for (std::size_t i = 1; i < way_points_of_tour.size(); ++i) {
    const auto path =
        space.is_free_between(way_points_of_tour[i - 1], way_points_of_tour[i])
            ? std::optional(std::vector<Point2>{way_points_of_tour[i - 1], way_points_of_tour[i]})
            : space.shortest_path(way_points_of_tour[i - 1], way_points_of_tour[i]);
    if (!path) {
      const Point2 blocked =
          space.is_free(way_points_of_tour[i]) ? way_points_of_tour[i - 1] : way_points_of_tour[i];
      throw ContractError("waypoint", format_point(blocked), "a free place of the scene");
    }
    for (const Point2 point : *path) line.push_back({point.x_m, point.y_m, 0.0});
  }
  return resample(line, spacing_m);
}

std::vector<Pose2> plan_positions(const Scene& scene, const FreeSpace& space,
                                  const RecordingOptions& options,
                                  std::span<const Point2> way_points, Random& random) {
  std::vector<Pose2> poses;
  switch (options.path) {
    case RecordingPath::grid:
    case RecordingPath::zigzag: {
      const GridOrder order =
          options.path == RecordingPath::grid ? GridOrder::raster : GridOrder::zigzag;
      for (const auto& place : space.grid(options.spacing_m, order)) {
        poses.push_back({place.position.x_m, place.position.y_m, 0.0});
      }
      require(!poses.empty(), "free places of a grid of spacing_m " + to_text(options.spacing_m),
              0.0, ">= 1; use a smaller spacing");
      return poses;
    }
    case RecordingPath::tour:
      return plan_tour(scene, space, way_points, options.spacing_m);
    case RecordingPath::walk: {
      const FreePredicate is_free = [&space](Point2 p) { return space.is_free(p); };
      return random_walk(space.random_pose(random), is_free,
                         {.poses = options.poses, .step_m = options.spacing_m}, random);
    }
    case RecordingPath::random:
      break;
  }
  for (int i = 0; i < options.poses; ++i) poses.push_back(space.random_pose(random));
  return poses;
}

void set_headings(std::vector<Pose2>& poses, const RecordingOptions& options, Random& random) {
  const std::vector<Pose2> where = poses;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    switch (options.heading) {
      case RecordingHeading::fixed:
        poses[i].heading_rad = wrap_angle(options.heading_rad);
        break;
      case RecordingHeading::random:
        poses[i].heading_rad = wrap_angle(random.uniform(-std::numbers::pi, std::numbers::pi));
        break;
      case RecordingHeading::path: {
        // Use the direction of the chord between the neighbours on the path.
        const std::size_t before = i == 0 ? 0 : i - 1;
        const std::size_t after = std::min(i + 1, where.size() - 1);
        if (distance(where[before].position(), where[after].position()) > 0.0) {
          poses[i].heading_rad =
              wrap_angle(direction(where[before].position(), where[after].position()));
        }
        break;
      }
    }
  }
}

Viewpoint make_viewpoint(const Pose2& pose, const FrameOptions& options, std::uint64_t seed) {
  const Tilt tilt = sample_tilt(options, seed);
  return {.pose = pose,
          .height_m = options.camera_height_m,
          .roll_rad = tilt.roll_rad,
          .pitch_rad = tilt.pitch_rad};
}

}  // namespace

void visit_options(RecordingOptions& options, OptionVisitor& visitor) {
  using T = RecordingOptions;
  constexpr OptionTable table{
      choice<&T::path>("positions at which the robot takes images", "grid", "zigzag", "tour",
                       "walk", "random"),
      choice<&T::heading>("heading of the robot at each position", "fixed", "path", "random"),
      option<&T::heading_rad>("heading of the robot if --heading is fixed"),
      option<&T::spacing_m>("spacing of the grid, or distance between images along the path", 0.001,
                            1000),
      option<&T::poses>("number of poses of a walk, or number of random poses", 1, 1e7),
      option<&T::speed_m_s>(
          "speed of the robot, from which the time stamps of the images are computed", 0.001, 100),
  };
  table.visit(options, visitor);
}

void visit_options(FrameOptions& options, OptionVisitor& visitor) {
  using T = FrameOptions;
  constexpr OptionTable table{
      option<&T::camera_height_m>("height of the camera above the floor", above(0), 100),
      option<&T::tilt_rad>(
          "tilt angle of the robot; the direction of the tilt is random at each place", 0, 0.5),
      option<&T::rays_per_axis>("number of rays per pixel along each image axis", 1, 8),
  };
  table.visit(options, visitor);
}

Tilt sample_tilt(const FrameOptions& options, std::uint64_t seed) {
  Random random(seed, 1);
  const double tilt_direction_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
  return {options.tilt_rad * std::sin(tilt_direction_rad),
          options.tilt_rad * std::cos(tilt_direction_rad)};
}

std::vector<RecordedPose> plan_recording(const Scene& scene, const FreeSpace& space,
                                         const RecordingOptions& options,
                                         const OdometryNoise& odometry, std::uint64_t seed,
                                         std::span<const Point2> way_points) {
  validate(options);
  Random pose_random(seed, pose_stream);
  Random heading_random(seed, heading_stream);
  std::vector<Pose2> poses = plan_positions(scene, space, options, way_points, pose_random);
  set_headings(poses, options, heading_random);
  const std::vector<Pose2> readings = simulate_odometry(poses, odometry, seed);
  std::vector<RecordedPose> result;
  double stamp_s = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i > 0) {
      // Standing still also takes time, so that the stamps ascend.
      stamp_s += std::max(
          1e-3, distance(poses[i - 1].position(), poses[i].position()) / options.speed_m_s);
    }
    result.push_back({stamp_s, poses[i], readings[i]});
  }
  return result;
}

void face_path(std::vector<Pose2>& poses) {
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    poses[i].heading_rad = direction(poses[i].position(), poses[i + 1].position());
  }
  if (poses.size() > 1) poses.back().heading_rad = poses[poses.size() - 2].heading_rad;
}

Panorama capture_panorama(const Renderer& renderer, const Pose2& pose,
                          const PanoramaRendering& rendering, const FrameOptions& options,
                          const SensorOptions& sensor, std::uint64_t seed, Executor& executor) {
  if (rendering.unwarper != nullptr && rendering.rays != nullptr) {
    validate(options);
    const Radiance light =
        renderer.render_image(make_viewpoint(pose, options, seed), *rendering.rays, executor);
    const Image image =
        apply_sensor(light, rendering.unwarper->camera(), sensor, seed, rendering.rays->pixels());
    return rendering.unwarper->unwrap(image.view());
  }
  if (rendering.unwarper != nullptr) {
    FrameOptions frame = options;
    frame.rays_per_axis = rendering.rays_per_axis;
    const Image image =
        capture_image(renderer, pose, rendering.unwarper->camera(), frame, sensor, seed, executor);
    return rendering.unwarper->unwrap(image.view());
  }
  validate(options);
  return apply_sensor(
      renderer.render_panorama(make_viewpoint(pose, options, seed), rendering, executor), sensor,
      seed);
}

PanoramaRendering make_mirror_rendering(int rows, int columns,
                                        std::optional<ElevationBand> elevations, int pixel_size) {
  require(pixel_size >= 1 && pixel_size <= 8, "pixel_size", pixel_size, "1 .. 8");
  Camera camera = make_simulated_mirror_camera();
  camera.image_size = {camera.image_size.width / pixel_size, camera.image_size.height / pixel_size};
  camera.centre = {camera.centre.u_px / pixel_size, camera.centre.v_px / pixel_size};
  camera.rim_radius_px /= pixel_size;
  camera.inner_radius_px /= pixel_size;
  std::get<HyperboloidalModel>(camera.model).focal_length_px /= pixel_size;
  const auto unwarper = std::make_shared<const Unwarper>(
      camera, UnwarperOptions{.rows = rows, .columns = columns, .elevations = elevations});
  return {.rows = rows,
          .columns = columns,
          .elevations = unwarper->elevations(),
          .rays_per_axis = 1,
          .unwarper = unwarper,
          .rays = std::make_shared<const PixelRays>(camera, unwarper->find_read_pixels(), 1)};
}

Image capture_image(const Renderer& renderer, const Pose2& pose, const RecordingCamera& camera,
                    const FrameOptions& options, const SensorOptions& sensor, std::uint64_t seed,
                    Executor& executor) {
  if (const auto* rendering = std::get_if<PanoramaRendering>(&camera)) {
    return to_picture(
        capture_panorama(renderer, pose, *rendering, options, sensor, seed, executor));
  }
  validate(options);
  const auto& camera_model = std::get<Camera>(camera);
  return apply_sensor(renderer.render_image(make_viewpoint(pose, options, seed), camera_model,
                                            options.rays_per_axis, executor),
                      camera_model, sensor, seed);
}

void record(const Renderer& renderer, std::span<const RecordedPose> poses,
            const RecordingCamera& camera, const FrameOptions& options, const SensorOptions& sensor,
            std::uint64_t seed, Executor& executor,
            const std::function<void(const RecordedFrame&)>& frame) {
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::uint64_t seed_of_frame = frame_seed(seed, i);
    const Image picture =
        capture_image(renderer, poses[i].pose, camera, options, sensor, seed_of_frame, executor);
    frame({i, poses[i], sample_tilt(options, seed_of_frame), picture});
  }
}

}  // namespace panonav::simulation
