#include "demo_recordings.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "panonav/camera/find_mirror.hpp"
#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/simulation/mirror.hpp"
#include "simulated_recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

/// Says that the folder is a demo's; written first, so that an interrupted demo can be run again.
constexpr std::string_view mark = "made_by_panonav_demo.txt";

/// Everything else that a demo makes.
constexpr std::array<std::string_view, 19> made{
    "memory_run",     "query_run",          "elsewhere_run",
    "office.panonav", "office.panonav-wal", "office.panonav-shm",
    "mirror.png",     "calibration.png",    "cylinder.png",
    "map.png",        "areas.png",          "similarity.png",
    "homing.png",     "way_home.png",       "arranged.png",
    "drive.png",      "route.png",          "route_panorama.png",
    "index.html"};

SimulationArguments simulation_of(const DemoOptions& options, int stream) {
  SimulationArguments wanted;
  wanted.simulation.scene.seed = static_cast<int>(3 * (options.seed % 100000000) + stream);
  wanted.simulation.scene.scene_seed = static_cast<int>(options.seed % 1000000000);
  // One ray a pixel: unwrapping averages over pixels, and it takes a third of the time.
  wanted.frame.rays_per_axis = 1;
  // What automatic exposure would choose in these rooms.
  wanted.sensor.exposure = 2.0;
  return wanted;
}

/// A scene with the questions or the views to remember, ready to be rendered.
struct PlannedRun {
  SimulatedWorld world;
  std::vector<RecordedPose> poses;
  bool with_path;
};

PlannedRun plan(const std::string& scene, SimulationArguments wanted, Executor& executor) {
  const auto nothing_given = [](const std::string&, const std::string&) { return false; };
  SimulatedWorld world(scene, wanted, nothing_given, executor);
  const auto& settled = world.arguments();
  auto poses =
      plan_recording(world.scene(), world.free_space(), settled.recording, settled.odometry,
                     static_cast<std::uint64_t>(settled.simulation.scene.seed));
  return {std::move(world), std::move(poses), settled.recording.path != RecordingPath::random};
}

std::optional<MirrorCircle> find_mirror_in(const Dataset& recording, int count) {
  std::vector<Image> images;
  // Spread over the run: what stays the same in all of them is the mirror.
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

}  // namespace

void prepare_demo_folder(const fs::path& out) {
  std::error_code error;
  const bool there = fs::exists(out, error);
  if (there && !fs::is_directory(out, error)) {
    throw FileError(out.string(), "is no folder; allowed: a new folder, or one of an earlier demo");
  }
  if (there && !fs::exists(out / mark, error) && !fs::is_empty(out, error)) {
    throw FileError(out.string(),
                    "is there already and was not made by panonav demo; allowed: a new folder, or "
                    "one of an earlier demo");
  }
  fs::create_directories(out, error);
  if (error) throw FileError(out.string(), "cannot be made: " + error.message());
  write_file(out / mark, std::string_view("This folder was made by panonav demo. Running it again "
                                          "with this folder writes its files anew.\n"));
  for (const auto name : made) {
    fs::remove_all(out / name, error);
    if (error) throw FileError((out / name).string(), "cannot be removed: " + error.message());
  }
}

std::optional<DemoRecordings> record_demo(const DemoOptions& options, Session& session) {
  Executor& executor = session.executor();
  SimulationArguments grid = simulation_of(options, 0);
  grid.recording.path = RecordingPath::grid;
  grid.recording.spacing_m = options.spacing_m();
  const auto random = [&](int stream) {
    SimulationArguments wanted = simulation_of(options, stream);
    wanted.recording.path = RecordingPath::random;
    wanted.recording.heading = RecordingHeading::random;
    wanted.recording.poses = options.questions();
    return wanted;
  };
  const PlannedRun office = plan("office", grid, executor);
  const PlannedRun asked = plan("office", random(1), executor);
  const PlannedRun elsewhere = plan("lab", random(2), executor);

  Progress progress("rendering", office.poses.size() + asked.poses.size() + elsewhere.poses.size());
  const auto record_run = [&](const PlannedRun& run, const char* name) {
    return record_dataset(run.world, options.out / name, run.poses, run.with_path, executor,
                          [&] { progress.advance(); });
  };
  DemoRecordings recordings;
  recordings.memory_run = record_run(office, "memory_run");
  recordings.query_run = record_run(asked, "query_run");
  recordings.elsewhere_run = record_run(elsewhere, "elsewhere_run");
  progress.clear();

  recordings.true_camera = simulated_mirror_camera();
  recordings.calibrated_on =
      static_cast<int>(std::min<std::size_t>(6, recordings.memory_run.entries.size()));
  const auto mirror = find_mirror_in(recordings.memory_run, recordings.calibrated_on);
  if (!mirror) return std::nullopt;
  recordings.mirror = *mirror;
  // No picture shows a mirror's shape and how it is mounted; these are known of the robot.
  const Camera camera =
      camera_from_mirror(*mirror, {.model = recordings.true_camera.model,
                                   .direction = recordings.true_camera.direction,
                                   .forward_angle_rad = recordings.true_camera.forward_angle_rad});
  for (Dataset* run : {&recordings.memory_run, &recordings.query_run, &recordings.elsewhere_run}) {
    run->source.camera = camera;
    write_dataset(*run);
  }

  recordings.low = office.world.free_space().low();
  recordings.high = office.world.free_space().high();
  recordings.office_scene = office.world.scene();
  recordings.office = std::make_shared<const Renderer>(office.world.scene(),
                                                       RendererOptions{.channels = 3}, executor);
  recordings.colour_picture = [renderer = recordings.office, frame = office.world.arguments().frame,
                               sensor = grid.sensor, seen_by = recordings.true_camera](
                                  const DatasetEntry& entry, Executor& threads) {
    const Viewpoint viewpoint{.pose = {entry.pose->x_m, entry.pose->y_m, *entry.pose->heading_rad},
                              .height_m = frame.camera_height_m};
    return apply_sensor(renderer->render_image(viewpoint, seen_by, 3, threads), seen_by, sensor, 1);
  };
  return recordings;
}

}  // namespace panonav::command
