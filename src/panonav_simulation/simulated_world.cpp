#include "panonav_simulation/simulated_world.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/unfinished_folder.hpp"
#include "panonav_simulation/floor.hpp"
#include "panonav_simulation/internal/photo_sphere.hpp"
#include "panonav_simulation/load_gazebo.hpp"
#include "panonav_simulation/load_mesh.hpp"
#include "panonav_simulation/mirror.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::simulation {

namespace {

namespace fs = std::filesystem;

/// Rejects options that vary only built-in scenes if the scene is read from a file.
void reject_variations_of_file(const std::string& file, const FindSetOption& find_set_option) {
  for (const char* name : {"scene_seed", "moved_objects", "moved_seed"}) {
    if (const auto option_name = find_set_option("simulation", name)) {
      throw OptionError(*option_name + " varies built-in scenes only; '" + file +
                        "' is a file, leave it out");
    }
  }
}

/// Value of SimulationOptions::kind for equirectangular images.
constexpr int equirectangular_kind = 3;

/// Limits of the process that reads a world or a mesh: seconds of processor time, bytes of memory.
constexpr unsigned max_read_seconds = 60;
constexpr rlim_t max_read_memory_bytes = rlim_t{4} << 30U;

void limit_process_resources() {
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const rlimit seconds{max_read_seconds, max_read_seconds};
  setrlimit(RLIMIT_CPU, &seconds);
  alarm(2 * max_read_seconds);  // also ends a process that only waits
  rlim_t pages_now = 0;
  std::ifstream("/proc/self/statm") >> pages_now;
  const rlim_t bytes =
      pages_now * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + max_read_memory_bytes;
  const rlimit memory{bytes, bytes};
  setrlimit(RLIMIT_AS, &memory);
}

/// Called before each mesh file of a world is read; throws to leave it out.
using BeforeMesh = std::function<void(const fs::path&)>;
/// Reads a scene file; the first argument reads its textures. If it is empty, surfaces get plain
/// colours.
using ReadScene = std::function<Scene(const TextureReader&, const BeforeMesh&)>;

/// A path in memory that this process shares with its child processes.
class SharedPath {
 public:
  SharedPath()
      : text_(static_cast<char*>(
            mmap(nullptr, max_bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {
    if (text_ == MAP_FAILED) throw Error("no memory left to start a process");
  }
  ~SharedPath() { munmap(text_, max_bytes); }
  SharedPath(const SharedPath&) = delete;
  SharedPath& operator=(const SharedPath&) = delete;

  /// A path that is too long counts as none.
  void set(const fs::path& path) {
    const std::string& text = path.native();
    text_[text.size() < max_bytes ? text.copy(text_, max_bytes - 1) : 0] = '\0';
  }
  [[nodiscard]] fs::path get() const { return text_; }

 private:
  static constexpr std::size_t max_bytes = 4096;
  char* text_;
};

/// Reads a scene and exits with code 0; on an error writes its message to `message_pipe` and exits
/// with 1.
[[noreturn]] void read_and_exit(const ReadScene& read, const BeforeMesh& before_mesh,
                                int message_pipe) {
  limit_process_resources();
  std::string message;
  try {
    (void)read({}, before_mesh);
  } catch (const Error& error) {
    message = error.what();
  } catch (const std::exception& error) {
    message = std::string("the reader of the format failed: ") + error.what();
  }
  const ssize_t written = write(message_pipe, message.data(), message.size());
  _exit(message.empty() || written < 0 ? 0 : 1);
}

/// Reads a scene file in a child process. Returns how the child ended if it crashed or took too
/// long; empty: it can be read. Throws the error of a file that cannot be read. Between fork and
/// _exit only this thread runs in the child; the executor's threads wait for work and hold no lock.
std::string try_in_child(const std::string& file, const ReadScene& read,
                         const BeforeMesh& before_mesh) {
  std::array<int, 2> message_pipe{-1, -1};
  if (pipe2(message_pipe.data(), O_CLOEXEC) != 0)
    throw FileError(file, "cannot be read: no pipe left");
  const pid_t child = fork();
  if (child == 0) read_and_exit(read, before_mesh, message_pipe[1]);
  close(message_pipe[1]);
  std::string message;
  std::array<char, 4096> buffer{};
  ssize_t count = 0;
  while ((count = ::read(message_pipe[0], buffer.data(), buffer.size())) > 0 ||
         (count < 0 && errno == EINTR)) {
    if (count > 0) message.append(buffer.data(), static_cast<std::size_t>(count));
  }
  close(message_pipe[0]);
  if (child < 0) throw FileError(file, "cannot be read: the system starts no process");
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!message.empty()) throw Error(message);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGXCPU || signal == SIGALRM || signal == SIGKILL)
    return "takes more than " + std::to_string(max_read_seconds) + " s to read";
  return "is damaged: the reader of its format crashes on it";
}

/// Reads a scene file in a child process first, because the third-party readers of meshes crash on
/// some damaged files and never return on others. A mesh of a world that ends the child is left out
/// and the world is tried again without it; otherwise this process reports a clear error. A file
/// that can be read is read again here, with its textures.
Scene read_in_child_first(const std::string& file, const ReadScene& read) {
  constexpr std::size_t max_left_out = 8;  // each may take a minute
  std::map<fs::path, std::string> left_out;
  SharedPath current_mesh;
  const BeforeMesh before_mesh = [&](const fs::path& mesh) {
    const auto known = left_out.find(mesh);
    if (known != left_out.end()) throw FileError(mesh.string(), known->second);
    current_mesh.set(mesh);
  };
  while (true) {
    current_mesh.set({});
    const std::string fault = try_in_child(file, read, before_mesh);
    if (fault.empty())
      return read([](const fs::path& path) { return read_image(path); }, before_mesh);
    const fs::path mesh = current_mesh.get();
    if (mesh.empty() || left_out.size() == max_left_out || !left_out.emplace(mesh, fault).second)
      throw FileError(file, fault);
  }
}

bool is_built_in(const std::string& name) {
  return std::ranges::find(scene_names(), name) != scene_names().end();
}

/// True if a file is read as a Gazebo world, false if as a mesh.
bool is_gazebo_file(const std::string& name) {
  const std::string ending = to_lower_case(fs::path(name).extension().string());
  return ending == ".world" || ending == ".sdf";
}

Scene load_scene(const std::string& name, const SceneOptions& options,
                 const FindSetOption& find_set_option) {
  if (is_built_in(name)) {
    return make_scene(name, {.seed = static_cast<std::uint64_t>(options.scene_seed),
                             .moved_objects = options.moved_objects,
                             .moved_seed = static_cast<std::uint64_t>(options.moved_seed),
                             .light = options.light});
  }
  std::error_code ignored;
  if (!fs::is_regular_file(name, ignored)) {
    std::string all;
    for (const auto known : scene_names()) all += (all.empty() ? "" : ", ") + std::string(known);
    throw OptionError("'" + name + "' is neither a file nor a built-in scene; allowed: " + all);
  }
  reject_variations_of_file(name, find_set_option);
  Scene scene;
  if (is_gazebo_file(name)) {
    GazeboOptions gazebo;
    gazebo.model_folders = gazebo_model_folders_of_environment();
    scene = read_in_child_first(name, [&](const TextureReader& textures, const BeforeMesh& before) {
      gazebo.textures.read = textures;
      gazebo.before_mesh = before;
      return load_gazebo(name, gazebo);
    });
  } else {
    MeshOptions mesh;
    scene = read_in_child_first(name, [&](const TextureReader& textures, const BeforeMesh&) {
      mesh.textures.read = textures;
      return load_mesh(name, mesh);
    });
  }
  scale_light(scene, options.light);
  return scene;
}

std::string image_file_name(std::size_t index, const char* ending) {
  const std::string digits = std::to_string(index);
  constexpr std::size_t width = 5;
  return "view_" + std::string(width - std::min(width, digits.size()), '0') + digits + ending;
}

}  // namespace

void visit_options(SceneOptions& options, OptionVisitor& visitor) {
  using T = SceneOptions;
  constexpr OptionTable table{
      option<&T::seed>("seed of the random poses, image noise, camera tilt and odometry errors", 0),
      option<&T::scene_seed>("seed of the textures and furniture of built-in scenes", 0),
      option<&T::moved_objects>("share of the movable objects that are moved to another position",
                                0, 1),
      option<&T::moved_seed>("seed for the choice and the new positions of moved objects", 0),
      option<&T::light>("factor for the brightness of all lamps and the sky", above(0), 100),
  };
  table.visit(options, visitor);
}

void visit_options(SimulationOptions& options, OptionVisitor& visitor) {
  using T = SimulationOptions;
  constexpr OptionTable table{
      choice<&T::kind>(
          "type of the images; dual-fisheye: the image of a 360 degree camera before stitching; "
          "equirectangular: after stitching, the whole sphere",
          "mirror", "panorama", "dual-fisheye", "equirectangular"),
      option<&T::rows>("rows of panoramas", 1, 4096),
      option<&T::columns>("columns of panoramas; of equirectangular images an even number", 4,
                          16384),
      option<&T::elevation_low_deg>("lower edge of panoramas", -90, 90),
      option<&T::elevation_high_deg>("upper edge of panoramas", -90, 90),
      option<&T::lens_seed>("seed of the random misalignment and differences of the two lenses; 0: "
                            "aligned and equal lenses",
                            0),
      option<&T::lens_distance_m>(
          "distance between the two lenses; a distance causes parallax of near objects", 0, 1),
      options_of<&T::scene>(),
  };
  table.visit(options, visitor);
}

RecordingHeading default_heading(RecordingPath path) noexcept {
  switch (path) {
    case RecordingPath::tour:
    case RecordingPath::walk:
      return RecordingHeading::path;
    case RecordingPath::random:
      return RecordingHeading::random;
    case RecordingPath::grid:
    case RecordingPath::zigzag:
      break;
  }
  return RecordingHeading::fixed;
}

SimulatedWorld::SimulatedWorld(const std::string& scene, SimulatedWorldOptions options,
                               const FindSetOption& find_set_option, Executor& executor,
                               const SceneWarning& on_warning)
    : options_(std::move(options)),
      scene_(load_scene(scene, options_.simulation.scene, find_set_option)) {
  if (on_warning) std::ranges::for_each(scene_.warnings, on_warning);
  const auto& simulation = options_.simulation;
  if (simulation.elevation_low_deg >= simulation.elevation_high_deg) {
    throw OptionError("elevation_low_deg is " + to_text(simulation.elevation_low_deg) +
                      "; allowed: below elevation_high_deg, which is " +
                      to_text(simulation.elevation_high_deg));
  }
  if (simulation.kind == equirectangular_kind && simulation.columns % 2 != 0) {
    throw OptionError("columns is " + std::to_string(simulation.columns) +
                      "; allowed for equirectangular images: an even number, twice the rows");
  }
  if (!find_set_option("frame", "camera_height_m"))
    options_.frame.camera_height_m = scene_.camera_height_m;
  // Use the values of the robot for which the scene is made, unless the user set an option.
  const FreeSpaceOptions defaults =
      free_space_options(scene_.robot_radius_m, options_.frame.camera_height_m);
  FreeSpaceOptions& robot = options_.free_space;
  if (!find_set_option("free_space", "robot_radius_m"))
    robot.robot_radius_m = defaults.robot_radius_m;
  if (!find_set_option("free_space", "robot_height_m"))
    robot.robot_height_m = defaults.robot_height_m;
  if (!find_set_option("free_space", "step_height_m")) robot.step_height_m = defaults.step_height_m;
  if (!find_set_option("free_space", "cell_m")) robot.cell_m = defaults.cell_m;
  if (is_built_in(scene)) {
    free_space_ = std::make_shared<const FreeSpace>(scene_, robot);
  } else {
    const FloorKnowledge known{
        .is_height_known = find_set_option("free_space", "floor_height_m").has_value(),
        .is_cell_known = find_set_option("free_space", "cell_m").has_value(),
        .may_be_room = !is_gazebo_file(scene)};
    const std::size_t reported = scene_.warnings.size();
    free_space_ = std::make_shared<const FreeSpace>(find_free_space(scene_, robot, known));
    for (std::size_t i = reported; i < scene_.warnings.size(); ++i) {
      scene_.warnings[i] = scene + ": " + scene_.warnings[i];
      if (on_warning) on_warning(scene_.warnings[i]);
    }
  }
  // The robot and its camera move at a fixed height above z = 0 or above the scene's ground.
  if (robot.floor_height_m != 0.0) raise_scene(scene_, -robot.floor_height_m);
  renderer_ = std::make_shared<const Renderer>(scene_, RendererOptions{}, executor);
}

SimulatedWorld SimulatedWorld::with(const RecordingOptions& recording, int seed) const {
  SimulatedWorld world = *this;
  world.options_.recording = recording;
  world.options_.simulation.scene.seed = seed;
  return world;
}

RecordingCamera SimulatedWorld::camera() const {
  const auto& simulation = options_.simulation;
  if (simulation.kind == 0) return options_.mirror.value_or(make_simulated_mirror_camera());
  if (simulation.kind == 2) {
    return make_simulated_dual_fisheye(static_cast<std::uint64_t>(simulation.lens_seed),
                                       simulation.lens_distance_m);
  }
  if (simulation.kind == equirectangular_kind) {
    constexpr double pole_rad = std::numbers::pi / 2.0;
    return PanoramaRendering{.rows = simulation.columns / 2,
                             .columns = simulation.columns,
                             .elevations = {-pole_rad, pole_rad},
                             .rays_per_axis = options_.frame.rays_per_axis};
  }
  return PanoramaRendering{
      .rows = simulation.rows,
      .columns = simulation.columns,
      .elevations = {radians(simulation.elevation_low_deg), radians(simulation.elevation_high_deg)},
      .rays_per_axis = options_.frame.rays_per_axis};
}

PictureSource SimulatedWorld::source() const {
  PictureSource source;
  const auto chosen_camera = camera();
  if (const auto* mirror = std::get_if<Camera>(&chosen_camera)) {
    source.kind = PictureKind::mirror;
    source.camera = *mirror;
  } else {
    if (options_.simulation.kind == equirectangular_kind)
      source.kind = PictureKind::equirectangular;
    source.layout.elevations = std::get<PanoramaRendering>(chosen_camera).elevations;
  }
  return source;
}

std::vector<RecordedPose> SimulatedWorld::plan(std::span<const Point2> way_points) const {
  return plan_recording(scene_, *free_space_, options_.recording, options_.odometry,
                        static_cast<std::uint64_t>(options_.simulation.scene.seed), way_points);
}

std::vector<RecordedPose> SimulatedWorld::plan_along(
    std::span<const StampedPose> trajectory) const {
  std::vector<Pose2> poses;
  for (const StampedPose& stamped : trajectory) poses.push_back(stamped.pose);
  const auto odometry = simulate_odometry(
      poses, options_.odometry, static_cast<std::uint64_t>(options_.simulation.scene.seed));
  std::vector<RecordedPose> recorded;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    recorded.push_back({trajectory[i].stamp_s, poses[i], odometry[i]});
  }
  return recorded;
}

std::string SimulatedWorld::describe_impossible_poses(std::span<const RecordedPose> poses) const {
  const Point2 low = free_space_->low();
  const Point2 high = free_space_->high();
  std::size_t outside = 0;
  std::size_t blocked = 0;
  for (const RecordedPose& recorded : poses) {
    const Point2 p = recorded.pose.position();
    if (p.x_m < low.x_m || p.y_m < low.y_m || p.x_m > high.x_m || p.y_m > high.y_m) {
      ++outside;
    } else if (!free_space_->is_free(p)) {
      ++blocked;
    }
  }
  if (outside + blocked == 0) return "";
  std::string text = "the robot cannot be at " + std::to_string(outside + blocked) + " of " +
                     format_count(poses.size(), "pose") + " (";
  if (outside > 0) {
    text += std::to_string(outside) + " outside of the floor, x " + to_text(low.x_m) + " to " +
            to_text(high.x_m) + " m, y " + to_text(low.y_m) + " to " + to_text(high.y_m) + " m";
  }
  if (blocked > 0) {
    text += std::string(outside > 0 ? "; " : "") + std::to_string(blocked) +
            " inside of an obstacle, within " + to_text(options_.free_space.robot_radius_m) +
            " m of one, or without a floor";
  }
  return text + "); their images show what no robot sees";
}

Image SimulatedWorld::capture_image(const Pose2& pose, std::uint64_t seed,
                                    Executor& executor) const {
  return simulation::capture_image(*renderer_, pose, camera(), options_.frame, options_.sensor,
                                   seed, executor);
}

Dataset record_dataset(const SimulatedWorld& world, const fs::path& folder,
                       std::span<const RecordedPose> poses, bool with_path, Executor& executor,
                       const std::function<void(const DatasetEntry&, const Image&)>& on_image) {
  UnfinishedFolder unfinished(folder);
  Dataset dataset{unfinished.path(), world.source(), {}};
  const auto& options = world.options();
  const bool is_sphere = options.simulation.kind == equirectangular_kind;
  record(
      world.renderer(), poses, world.camera(), options.frame, options.sensor,
      static_cast<std::uint64_t>(options.simulation.scene.seed), executor,
      [&](const RecordedFrame& frame) {
        const RecordedPose& recorded = frame.pose;
        DatasetEntry entry;
        entry.file = image_file_name(frame.number, is_sphere ? ".jpg" : ".png");
        entry.path = folder / entry.file;
        entry.pose = ReferencePose{recorded.pose.x_m, recorded.pose.y_m, recorded.pose.heading_rad};
        if (with_path) {
          entry.stamp_s = recorded.stamp_s;
          entry.odometry = recorded.odometry;
        }
        if (options.frame.tilt_rad > 0.0) entry.tilt = frame.tilt;
        unfinished.append(entry.file, is_sphere ? encode_photo_sphere(frame.picture.view(),
                                                                      recorded.pose, frame.tilt)
                                                : encode_png(frame.picture.view()));
        dataset.entries.push_back(std::move(entry));
        if (on_image) on_image(dataset.entries.back(), frame.picture);
      });
  write_dataset(dataset);
  unfinished.finish();
  dataset.folder = folder;
  return dataset;
}

}  // namespace panonav::simulation
