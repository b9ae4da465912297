#include "demo/recordings.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "panonav/camera/find_mirror.hpp"
#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_simulation/mirror.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

/// Name of the file that marks the folder of a demo. It is written first, so that an interrupted
/// demo can be run again.
constexpr std::string_view marker_file_name = "made_by_panonav_demo.txt";

/// Names of all other files and folders that a demo writes, or wrote in earlier versions.
constexpr std::array<std::string_view, 32> demo_file_names{"memory_run",
                                                           "query_run",
                                                           "elsewhere_run",
                                                           "corridor_run",
                                                           "walk_run",
                                                           "office.panonav",
                                                           "office.panonav-wal",
                                                           "office.panonav-shm",
                                                           "corridor.panonav",
                                                           "corridor.panonav-wal",
                                                           "corridor.panonav-shm",
                                                           "mirror.png",
                                                           "calibration.png",
                                                           "cylinder.png",
                                                           "map.svg",
                                                           "areas.svg",
                                                           "similarity.svg",
                                                           "tracked.svg",
                                                           "particles.svg",
                                                           "track.html",
                                                           "arranged.svg",
                                                           "drive.svg",
                                                           "homing.svg",
                                                           "way_home.png",
                                                           "route.svg",
                                                           "route_panorama.svg",
                                                           "mission.svg",
                                                           "mission.log",
                                                           "mission_kidnapped.svg",
                                                           "mission_screen.svg",
                                                           "missions.svg",
                                                           "index.html"};

/// A world with the planned poses of one recording.
struct PlannedRun {
  simulation::SimulatedWorld world;
  std::vector<simulation::RecordedPose> poses;
  bool with_path;
};

PlannedRun plan(simulation::SimulatedWorld world) {
  auto poses = world.plan();
  const bool with_path = world.options().recording.path != simulation::RecordingPath::random;
  return {std::move(world), std::move(poses), with_path};
}

simulation::SimulatedWorld make_world(const std::string& scene,
                                      const simulation::SimulatedWorldOptions& world_options,
                                      Executor& executor) {
  return {scene, world_options, [](const auto&, const auto&) { return std::nullopt; }, executor};
}

/// Returns a camera with the same field of view and half the pixels in each direction.
Camera halve_resolution(Camera camera) {
  std::get<HyperboloidalModel>(camera.model).focal_length_px *= 0.5;
  camera.image_size = {camera.image_size.width / 2, camera.image_size.height / 2};
  camera.centre = {0.5 * camera.centre.u_px, 0.5 * camera.centre.v_px};
  camera.rim_radius_px *= 0.5;
  camera.inner_radius_px *= 0.5;
  return camera;
}

std::optional<MirrorCircle> find_mirror_in_recording(const Dataset& recording, int count) {
  std::vector<Image> images;
  // Takes images at equal intervals, so that only the mirror is the same in all of them.
  for (int i = 0; i < count; ++i) {
    const auto index =
        recording.entries.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(count);
    images.push_back(read_image(recording.entries[index].path));
  }
  const std::vector<ImageView> views = [&] {
    std::vector<ImageView> all;
    for (const auto& image : images) all.push_back(image.view());
    return all;
  }();
  return find_mirror(views);
}

/// Joins two drives to one recording. Between them the robot is carried to another place; the
/// odometry continues without this motion.
std::vector<simulation::RecordedPose> join_drives(
    std::vector<simulation::RecordedPose> walk,
    const std::vector<simulation::RecordedPose>& after) {
  const simulation::RecordedPose last = walk.back();
  for (simulation::RecordedPose next : after) {
    next.stamp_s += last.stamp_s + 1.0;
    next.odometry = last.odometry * (inverse(after.front().odometry) * next.odometry);
    walk.push_back(next);
  }
  return walk;
}

/// Plans a drive along the straight lines between the waypoints, heading forward.
PlannedRun plan_drive(const simulation::SimulatedWorld& world, double spacing_m, int seed,
                      const std::vector<Point2>& way_points) {
  simulation::SimulatedWorld there = world.with({.path = simulation::RecordingPath::tour,
                                                 .heading = simulation::RecordingHeading::path,
                                                 .spacing_m = spacing_m},
                                                seed);
  auto poses = there.plan(way_points);
  return {std::move(there), std::move(poses), true};
}

// Plans the stored path through the corridor: a ring of 12 m by 8 m and two narrow crossings. A
// robot in a crossing has four possible poses: both crossings look the same, and the floor plan is
// the same after half a turn.
PlannedRun plan_remembered_ring(const simulation::SimulatedWorld& corridor, int seed) {
  constexpr double reference_spacing_m = 0.35;
  PlannedRun ring = plan_drive(corridor, reference_spacing_m, seed,
                               {{0.0, 0.0}, {12.0, 0.0}, {12.0, 8.0}, {0.0, 8.0}, {0.0, 0.4}});
  for (const double x : {4.0, 8.0}) {
    const auto cross_drive = plan_drive(corridor, reference_spacing_m, seed, {{x, 0.4}, {x, 7.6}});
    ring.poses = join_drives(std::move(ring.poses), cross_drive.poses);
  }
  return ring;
}

// Plans a walk 10 cm beside the stored path, in two parts of at most `images` images. The robot is
// carried from the end of the first part to the start of the second. Also returns the index of the
// last image of the first part.
std::pair<PlannedRun, std::size_t> plan_kidnapped_walk(const simulation::SimulatedWorld& corridor,
                                                       std::size_t images, int walk_seed,
                                                       int after_seed) {
  constexpr double walk_spacing_m = 0.25;
  PlannedRun walk =
      plan_drive(corridor, walk_spacing_m, walk_seed, {{4.1, 6.0}, {4.1, 7.9}, {12.0, 7.9}});
  auto after =
      plan_drive(corridor, walk_spacing_m, after_seed, {{7.9, 2.0}, {7.9, 0.1}, {12.0, 0.1}});
  walk.poses.resize(std::min(walk.poses.size(), images));
  after.poses.resize(std::min(after.poses.size(), images));
  const std::size_t kidnapped_after = walk.poses.size() - 1;
  walk.poses = join_drives(std::move(walk.poses), after.poses);
  return {std::move(walk), kidnapped_after};
}

// Writes the calibrated camera into all data sets.
void set_calibrated_camera(DemoRecordings& recordings, const MirrorCircle& mirror) {
  // Shape and mounting of the mirror cannot be found from images, so the true values are used.
  const Camera camera =
      camera_from_mirror(mirror, {.model = recordings.true_camera.model,
                                  .direction = recordings.true_camera.direction,
                                  .forward_angle_rad = recordings.true_camera.forward_angle_rad});
  for (Dataset* run : {&recordings.memory_run, &recordings.query_run, &recordings.elsewhere_run,
                       &recordings.corridor_run, &recordings.walk_run}) {
    run->source.camera = camera;
    write_dataset(*run);
  }
}

// Returns a function that renders the robot's views in colour, for the page.
std::function<Image(const DatasetEntry&, Executor&)> make_colour_camera(
    const simulation::SimulatedWorld& world, const Camera& camera,
    const simulation::SensorOptions& sensor_options, Executor& executor) {
  auto colour_renderer = std::make_shared<const simulation::Renderer>(
      world.scene(), simulation::RendererOptions{.channels = 3}, executor);
  return [renderer = std::move(colour_renderer), frame = world.options().frame,
          sensor = sensor_options,
          mirror_camera = camera](const DatasetEntry& entry, Executor& threads) {
    const simulation::Viewpoint viewpoint{
        .pose = {entry.pose->x_m, entry.pose->y_m, *entry.pose->heading_rad},
        .height_m = frame.camera_height_m};
    return simulation::apply_sensor(renderer->render_image(viewpoint, mirror_camera, 3, threads),
                                    mirror_camera, sensor, 1);
  };
}

}  // namespace

simulation::SimulatedWorldOptions demo_world_options(const DemoOptions& options, int stream) {
  simulation::SimulatedWorldOptions world_options;
  world_options.simulation.scene.seed = static_cast<int>(3 * (options.seed % 100000000) + stream);
  world_options.simulation.scene.scene_seed = static_cast<int>(options.seed % 1000000000);
  // One ray per pixel is enough, as unwrapping averages over pixels; rendering takes a third of the
  // time then.
  world_options.frame.rays_per_axis = 1;
  // Value that automatic exposure chooses in these rooms.
  world_options.sensor.exposure = 2.0;
  if (options.quick)
    world_options.mirror = halve_resolution(simulation::make_simulated_mirror_camera());
  return world_options;
}

void prepare_demo_folder(const fs::path& out) {
  std::error_code error;
  const bool there = fs::exists(out, error);
  if (there && !fs::is_directory(out, error)) {
    throw FileError(out.string(),
                    "is not a folder; allowed: a new folder, or the folder of an earlier demo");
  }
  if (there && !fs::exists(out / marker_file_name, error) && !fs::is_empty(out, error)) {
    throw FileError(out.string(),
                    "exists and was not made by panonav demo; allowed: a new folder, or the folder "
                    "of an earlier demo");
  }
  fs::create_directories(out, error);
  if (error) throw FileError(out.string(), "cannot be created: " + error.message());
  write_file(
      out / marker_file_name,
      std::string_view(
          "panonav demo made this folder. Another run with this folder replaces its files.\n"));
  for (const auto name : demo_file_names) {
    fs::remove_all(out / name, error);
    if (error) throw FileError((out / name).string(), "cannot be removed: " + error.message());
  }
}

std::optional<DemoRecordings> record_demo(const DemoOptions& options, Session& session) {
  Executor& executor = session.executor();
  simulation::SimulatedWorldOptions grid = demo_world_options(options, 0);
  grid.recording.path = simulation::RecordingPath::grid;
  grid.recording.spacing_m = options.spacing_m();
  const simulation::RecordingOptions random_recording_options{
      .path = simulation::RecordingPath::random,
      .heading = simulation::RecordingHeading::random,
      .poses = options.query_count()};
  const auto seed_of = [&](int stream) {
    return demo_world_options(options, stream).simulation.scene.seed;
  };
  const PlannedRun office = plan(make_world("office", grid, executor));
  const PlannedRun queries = plan(office.world.with(random_recording_options, seed_of(1)));
  const PlannedRun elsewhere = plan(make_world("lab", demo_world_options(options, 2), executor)
                                        .with(random_recording_options, seed_of(2)));
  const simulation::SimulatedWorld corridor =
      make_world("corridor", demo_world_options(options, 5), executor);
  const PlannedRun ring = plan_remembered_ring(corridor, seed_of(5));
  const auto [walk, kidnapped_after] = plan_kidnapped_walk(
      corridor, static_cast<std::size_t>(options.walk_image_count() / 2), seed_of(3), seed_of(4));

  Progress progress(session, "rendering",
                    office.poses.size() + queries.poses.size() + elsewhere.poses.size() +
                        ring.poses.size() + walk.poses.size());
  const auto record_run = [&](const PlannedRun& run, const char* name) {
    return simulation::record_dataset(
        run.world, options.out / name, run.poses, run.with_path, executor,
        [&](const DatasetEntry&, const Image&) { progress.advance(); });
  };
  DemoRecordings recordings;
  recordings.memory_run = record_run(office, "memory_run");
  recordings.query_run = record_run(queries, "query_run");
  recordings.elsewhere_run = record_run(elsewhere, "elsewhere_run");
  recordings.corridor_run = record_run(ring, "corridor_run");
  recordings.walk_run = record_run(walk, "walk_run");
  recordings.kidnapped_after = kidnapped_after;
  progress.clear();

  recordings.true_camera = std::get<Camera>(office.world.camera());
  recordings.calibration_image_count =
      static_cast<int>(std::min<std::size_t>(6, recordings.memory_run.entries.size()));
  const auto mirror =
      find_mirror_in_recording(recordings.memory_run, recordings.calibration_image_count);
  if (!mirror) return std::nullopt;
  recordings.mirror = *mirror;
  set_calibrated_camera(recordings, *mirror);

  recordings.office_scene = office.world.scene();
  recordings.corridor_scene = corridor.scene();
  recordings.colour_picture =
      make_colour_camera(office.world, recordings.true_camera, grid.sensor, executor);
  recordings.office_world = std::make_shared<const simulation::SimulatedWorld>(office.world);
  return recordings;
}

}  // namespace panonav::command
