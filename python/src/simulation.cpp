#include "panonav/core/error.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/simulated_base.hpp"
#include "panonav_simulation/simulated_world.hpp"
#include "recordings.hpp"

namespace panonav::python {

namespace {

using World = std::shared_ptr<const simulation::SimulatedWorld>;

/// Makes a world from the keyword arguments. The caller must read the options of a recording
/// before.
/// Warns in Python; throws if its filter makes errors of warnings. Needs no GIL.
void warn(const std::string& warning) {
  const py::gil_scoped_acquire held;
  if (PyErr_WarnEx(PyExc_UserWarning, warning.c_str(), 1) != 0) throw py::error_already_set();
}

World make_world(const std::string& scene, simulation::SimulatedWorldOptions options,
                 Keywords& parsed, int threads) {
  parsed.options(options.simulation)
      .options(options.frame)
      .options(options.sensor)
      .options(options.free_space)
      .options(options.odometry, "odometry")
      .finish();
  std::vector<std::string> explicit_options;
  for (const char* name : {"scene_seed", "moved_objects", "moved_seed", "camera_height_m",
                           "robot_radius_m", "robot_height_m", "step_height_m", "cell_m"}) {
    if (parsed.has(name)) explicit_options.emplace_back(name);
  }
  const py::gil_scoped_release free;
  InterruptibleExecutor executor(threads);
  return std::make_shared<const simulation::SimulatedWorld>(
      scene, std::move(options),
      [&](const std::string&, const std::string& name) {
        const auto found = std::ranges::find(explicit_options, name);
        return found == explicit_options.end() ? std::nullopt : std::optional(*found);
      },
      executor, warn);
}

simulation::SimulatedWorldOptions read_recording_options(Keywords& parsed) {
  simulation::SimulatedWorldOptions options;
  parsed.options(options.recording);
  if (!parsed.has("heading")) {
    options.recording.heading = simulation::default_heading(options.recording.path);
  }
  return options;
}

std::optional<Trajectory> to_optional_trajectory(const py::object& rows) {
  if (rows.is_none()) return std::nullopt;
  auto trajectory = to_trajectory(to_number_rows(rows, "trajectory", 4));
  require(!trajectory.empty(), "poses of trajectory", 0, ">= 1");
  return trajectory;
}

Dataset record(const simulation::SimulatedWorld& world, const std::filesystem::path& folder,
               const std::optional<Trajectory>& trajectory, int threads) {
  std::error_code ignored;
  if (std::filesystem::exists(folder, ignored) && !std::filesystem::is_empty(folder, ignored)) {
    throw FileError(folder.string(), "already exists and is not empty; allowed: a new folder");
  }
  InterruptibleExecutor executor(threads);
  const auto poses = trajectory ? world.plan_along(trajectory->poses()) : world.plan();
  const std::string impossible = trajectory ? world.describe_impossible_poses(poses) : "";
  if (!impossible.empty()) warn("trajectory: " + impossible);
  const bool with_path =
      trajectory || world.options().recording.path != simulation::RecordingPath::random;
  return simulation::record_dataset(world, folder, poses, with_path, executor);
}

py::array_t<double> to_point_rows(std::span<const Point2> points) {
  py::array_t<double> rows({static_cast<py::ssize_t>(points.size()), py::ssize_t{2}});
  auto row = rows.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    row(i, 0) = points[static_cast<std::size_t>(i)].x_m;
    row(i, 1) = points[static_cast<std::size_t>(i)].y_m;
  }
  return rows;
}

/// Renders the image at a pose of the world.
Image capture_image_at(const simulation::SimulatedWorld& world, const Pose2& pose,
                       std::uint64_t seed) {
  Executor executor(1);
  return world.capture_image(pose, seed, executor);
}

void bind_worlds(py::module_& m) {
  const auto world_option_list = {
      options_of<simulation::SimulationOptions>(), options_of<simulation::FrameOptions>(),
      options_of<simulation::SensorOptions>(), options_of<simulation::FreeSpaceOptions>(),
      options_of<OdometryNoise>("odometry")};
  std::vector<ListedOptions> recording_option_list{options_of<simulation::RecordingOptions>()};
  recording_option_list.insert(recording_option_list.end(), world_option_list);
  py::class_<simulation::SimulatedWorld, std::shared_ptr<simulation::SimulatedWorld>>(
      m, "SimulatedWorld",
      "A scene and a robot with ray-traced images. Several threads may use it at the same "
      "time.")
      .def(py::init([](const std::string& scene, const std::optional<Camera>& mirror, int threads,
                       const py::kwargs& keywords) {
             Keywords parsed(keywords);
             simulation::SimulatedWorldOptions options;
             options.mirror = mirror;
             return std::const_pointer_cast<simulation::SimulatedWorld>(
                 make_world(scene, std::move(options), parsed, threads));
           }),
           py::arg("scene"), py::kw_only(), py::arg("mirror") = py::none(), py::arg("threads") = 0,
           append_option_list(
               "`scene`: one of `scenes`, or the path of a Gazebo world or a mesh file. "
               "`mirror`: the camera if kind is 'mirror'. The robot and its camera's "
               "height have the defaults of the scene unless they are set.",
               world_option_list)
               .c_str())
      .def_property_readonly(
          "name", [](const simulation::SimulatedWorld& w) { return w.scene().name; },
          "Name of the built-in scene or of the file.")
      .def_property_readonly(
          "warnings", [](const simulation::SimulatedWorld& w) { return w.scene().warnings; },
          "Parts of a file that cannot be rendered.")
      .def_property_readonly("source", &simulation::SimulatedWorld::source, "Layout of its images.")
      .def_property_readonly(
          "camera_height_m",
          [](const simulation::SimulatedWorld& w) { return w.options().frame.camera_height_m; },
          "Height of the viewpoint above the floor.")
      .def_property_readonly(
          "robot_radius_m",
          [](const simulation::SimulatedWorld& w) { return w.options().free_space.robot_radius_m; },
          "Radius of the robot, which is a cylinder.")
      .def_property_readonly(
          "free_area_m2",
          [](const simulation::SimulatedWorld& w) { return w.free_space().area_m2(); },
          "Area in which the robot can stand.")
      .def_property_readonly(
          "low", [](const simulation::SimulatedWorld& w) { return w.free_space().low(); },
          "Lower corner of the floor: (x_m, y_m).")
      .def_property_readonly(
          "high", [](const simulation::SimulatedWorld& w) { return w.free_space().high(); },
          "Upper corner of the floor: (x_m, y_m).")
      .def_property_readonly(
          "tour", [](const simulation::SimulatedWorld& w) { return to_point_rows(w.scene().tour); },
          "A round trip, (n, 2) of x_m, y_m; may be empty.")
      .def(
          "floor_plan",
          [](const simulation::SimulatedWorld& w) { return to_array(w.free_space().picture()); },
          "uint8 of (rows, columns), y upwards from `low` to `high`: 255 free, 0 obstacle, grey "
          "too near to an obstacle.")
      .def(
          "is_free",
          [](const simulation::SimulatedWorld& w, const Point2& place) {
            return w.free_space().is_free(place);
          },
          py::arg("place"), "True if the robot can stand at (x_m, y_m).")
      .def(
          "clearance_m",
          [](const simulation::SimulatedWorld& w, const Point2& place) {
            return w.free_space().clearance_m(place);
          },
          py::arg("place"), "Distance from (x_m, y_m) to the nearest obstacle, or less.")
      .def(
          "random_pose",
          [](const simulation::SimulatedWorld& w, std::uint64_t seed) {
            Random random(seed, 0);
            return w.free_space().random_pose(random);
          },
          py::arg("seed"), "Returns a random free pose with random heading.")
      .def(
          "shortest_path",
          [](const simulation::SimulatedWorld& w, const Point2& from,
             const Point2& to) -> std::optional<py::array_t<double>> {
            const auto path = [&] {
              const py::gil_scoped_release free;
              return w.free_space().shortest_path(from, to);
            }();
            if (!path) return std::nullopt;
            return to_point_rows(*path);
          },
          py::arg("start"), py::arg("end"),
          "Waypoints of a short free path, (n, 2) of x_m, y_m; None if there is none.")
      .def(
          "capture_image",
          [](const simulation::SimulatedWorld& w, const Pose2& pose, std::uint64_t seed) {
            const Image picture = [&] {
              const py::gil_scoped_release free;
              return capture_image_at(w, pose, seed);
            }();
            return to_array(picture);
          },
          py::arg("pose"), py::arg("seed") = 0,
          "Renders the image at a pose, uint8. The same seed gives the same noise; use another "
          "seed for each image.")
      .def(
          "plan",
          [](const simulation::SimulatedWorld& w, const py::kwargs& keywords) {
            Keywords parsed(keywords);
            const auto options = read_recording_options(parsed);
            parsed.finish();
            std::vector<Pose2> poses;
            for (const auto& one :
                 w.with(options.recording, w.options().simulation.scene.seed).plan()) {
              poses.push_back(one.pose);
            }
            return to_pose_rows(poses);
          },
          append_option_list("Returns the poses of a recording with these options: (n, 3) of x_m, "
                             "y_m, heading_rad.",
                             {options_of<simulation::RecordingOptions>()})
              .c_str())
      .def(
          "record",
          [](const simulation::SimulatedWorld& w, const std::filesystem::path& folder,
             const py::object& trajectory, std::optional<int> seed, int threads,
             const py::kwargs& keywords) {
            Keywords parsed(keywords);
            const auto options = read_recording_options(parsed);
            parsed.finish();
            const auto along = to_optional_trajectory(trajectory);
            const py::gil_scoped_release free;
            return record(
                w.with(options.recording, seed.value_or(w.options().simulation.scene.seed)), folder,
                along, threads);
          },
          py::arg("folder"), py::kw_only(), py::arg("trajectory") = py::none(),
          py::arg("seed") = py::none(), py::arg("threads") = 0,
          append_option_list("Writes a data set, like `panonav simulate`, and returns it. "
                             "`trajectory`: poses to use instead, (n, 4) of stamp_s, x_m, y_m, "
                             "heading_rad. `seed`: seed of poses, noise and odometry, instead of "
                             "that of the world.",
                             {options_of<simulation::RecordingOptions>()})
              .c_str())
      .def("__repr__", [](const simulation::SimulatedWorld& w) {
        return "SimulatedWorld('" + w.scene().name + "', " + to_text(w.free_space().area_m2()) +
               " m2 free)";
      });
  m.def(
      "simulate",
      [](const std::string& scene, const std::filesystem::path& folder,
         const std::optional<Camera>& mirror, const py::object& trajectory, int threads,
         const py::kwargs& keywords) {
        Keywords parsed(keywords);
        auto options = read_recording_options(parsed);
        options.mirror = mirror;
        const auto along = to_optional_trajectory(trajectory);
        const World world = make_world(scene, std::move(options), parsed, threads);
        const py::gil_scoped_release free;
        return record(*world, folder, along, threads);
      },
      py::arg("scene"), py::arg("folder"), py::kw_only(), py::arg("mirror") = py::none(),
      py::arg("trajectory") = py::none(), py::arg("threads") = 0,
      append_option_list(
          "Renders a data set of a simulated robot, like `panonav simulate`: "
          "SimulatedWorld(scene).record(folder). Warns (UserWarning) of what a scene "
          "file lacks, and of poses at which the robot cannot be.",
          recording_option_list)
          .c_str());
  py::tuple names(simulation::scene_names().size());
  for (std::size_t i = 0; i < simulation::scene_names().size(); ++i)
    names[i] = std::string(simulation::scene_names()[i]);
  m.attr("scenes") = names;
}

/// A simulated base with its world, the number of images taken and the time.
struct Robot {
  World world;
  simulation::SimulatedBase base;
  std::uint64_t seed;
  std::uint64_t pictures = 0;
  double time_s = 0.0;
};
using SharedRobot = Shared<Robot>;

Pose2 choose_free_start(const simulation::SimulatedWorld& world, const std::optional<Pose2>& start,
                        std::uint64_t seed) {
  Random random(seed, 0);
  if (!start) return world.free_space().random_pose(random);
  if (world.free_space().is_free(start->position())) return *start;
  throw ContractError("start", to_text(start->x_m) + ", " + to_text(start->y_m), "a free place");
}

void bind_robots(py::module_& m) {
  py::class_<SharedRobot>(m, "SimulatedRobot",
                          "A robot in a simulated world. It drives until an obstacle "
                          "stops it, and takes images.")
      .def(py::init([](const std::shared_ptr<simulation::SimulatedWorld>& world,
                       const std::optional<Pose2>& start, std::uint64_t seed) {
             return std::make_unique<SharedRobot>(
                 Robot{world,
                       {choose_free_start(*world, start, seed),
                        [world](Point2 from, Point2 to) {
                          return world->free_space().is_free_between(from, to);
                        },
                        world->options().odometry, seed},
                       seed});
           }),
           py::arg("world"), py::arg("start") = py::none(), py::arg("seed") = 1,
           "`start`: a free pose; None: random. `seed`: seed of start, odometry and the noise of "
           "its images.")
      .def(
          "drive",
          [](SharedRobot& robot, double forward_m_s, double turn_rad_s, double seconds,
             double left_m_s) {
            return robot.change([&](Robot& r) {
              const auto step = r.base.drive({forward_m_s, left_m_s, turn_rad_s}, seconds);
              r.time_s += seconds;
              return !step.stopped;
            });
          },
          py::arg("forward_m_s"), py::arg("turn_rad_s") = 0.0, py::arg("seconds") = 0.1,
          py::kw_only(), py::arg("left_m_s") = 0.0,
          "Drives for `seconds`. Returns False if an obstacle stopped it; it only turned then.")
      .def(
          "observe",
          [](SharedRobot& robot) {
            return robot.change([](Robot& r) {
              Observation observation(
                  capture_image_at(*r.world, r.base.pose(), Random(r.seed, ++r.pictures).next()));
              const Pose2& pose = r.base.pose();
              observation.stamp_s = r.time_s;
              observation.odometry = r.base.odometry();
              observation.pose = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad};
              return observation;
            });
          },
          "Takes an image with stamp, odometry and the true pose, which no "
          "estimate uses.")
      .def(
          "teleport_to",
          [](SharedRobot& robot, const Pose2& pose) {
            robot.change([&](Robot& r) {
              r.base.teleport_to(choose_free_start(*r.world, pose, 0));
              return 0;
            });
          },
          py::arg("pose"), "Moves the robot to a pose by hand; the odometry does not change.")
      .def_property_readonly(
          "pose",
          [](const SharedRobot& robot) {
            return robot.read([](const Robot& r) { return r.base.pose(); });
          },
          "True pose.")
      .def_property_readonly(
          "odometry",
          [](const SharedRobot& robot) {
            return robot.read([](const Robot& r) { return r.base.odometry(); });
          },
          "Odometry pose, in the odometry frame.")
      .def_property_readonly(
          "time_s",
          [](const SharedRobot& robot) {
            return robot.read([](const Robot& r) { return r.time_s; });
          },
          "Simulated time in seconds.");
}

}  // namespace

void bind_simulation(py::module_& m) {
  bind_worlds(m);
  bind_robots(m);
}

}  // namespace panonav::python
