#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <string>

#include "memories.hpp"
#include "panonav/core/error.hpp"
#include "panonav/pipeline/chain_route.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/route_follower.hpp"
#include "panonav/pipeline/route_recorder.hpp"
#include "panonav/storage/memory_address.hpp"
#include "recordings.hpp"

namespace panonav::python {

namespace {

constexpr std::array<const char*, 3> origin_names{"prediction", "recovery", "search"};

struct NamedStep : RouteFollower::Step {
  std::string name;
};

template <class Value>
auto fix_field(Value RouteFix::*member) {
  return [member](const NamedStep& step) -> std::optional<Value> {
    if (!step.fix) return std::nullopt;
    return (*step.fix).*member;
  };
}

RouteFollowerOptions make_follower_options(const std::optional<std::string>& name,
                                           bool use_odometry, const py::kwargs& keywords) {
  RouteFollowerOptions options{.name = name, .use_odometry = use_odometry};
  Keywords(keywords).options(options.tracker).options(options.fit).finish();
  return options;
}

void bind_following(py::module_& m) {
  Record<RouteChanges::AzimuthRange>(m, "AzimuthRange", "Azimuths in the robot's frame.")
      .field("from_rad", &RouteChanges::AzimuthRange::from_rad, "In [-pi, pi).")
      .field("to_rad", &RouteChanges::AzimuthRange::to_rad, "Counter-clockwise from from_rad.");
  Record<NamedStep>(m, "RouteStep", "Pose of a robot relative to a route.")
      .field("name", &NamedStep::name, "Name of the image, if it has one.")
      .field(
          "on_route", [](const NamedStep& s) { return s.fix.has_value(); },
          "If False, the values of the fix are None.")
      .field("pose", fix_field(&RouteFix::pose), "In the route's frame.")
      .field(
          "origin",
          [](const NamedStep& s) -> std::optional<std::string> {
            if (!s.fix) return std::nullopt;
            return origin_names[static_cast<std::size_t>(s.fix->origin)];
          },
          "'prediction', 'recovery' or 'search'.")
      .field("along_m", fix_field(&RouteFix::along_m), "Path length along the route.")
      .field("lateral_m", fix_field(&RouteFix::lateral_m),
             "Distance of the robot from the route; positive to the left.")
      .field("correlation", fix_field(&RouteFix::correlation),
             "Correlation of observed and predicted line, -1 to 1.")
      .field("residual", fix_field(&RouteFix::residual),
             "Robust root mean square of the residuals of the fit, relative to the standard "
             "deviation of the predicted line.")
      .field("columns", fix_field(&RouteFix::columns),
             "Number of directions whose line of sight crosses the path.")
      .field(
          "covariance",
          [](const NamedStep& s) -> std::optional<py::array_t<double>> {
            if (!s.fix) return std::nullopt;
            return py::array_t<double>({3, 3}, s.fix->covariance.data());
          },
          "(3, 3) of x, y in m and heading in rad.")
      .field("changed", &NamedStep::changed, "Azimuths at which the scene has changed.")
      .field(
          "line",
          [](const NamedStep& s) {
            return py::array_t<float>(static_cast<py::ssize_t>(s.line.size()), s.line.data());
          },
          "The scanline of the observation, float32.");
  const std::string option_text =
      append_option_list("", {options_of<RouteTrackerOptions>(), options_of<RouteFitOptions>()});
  using SharedFollower = Shared<RouteFollower>;
  py::class_<SharedFollower>(m, "RouteFollower",
                             "Localises a robot relative to a recorded route, one image after "
                             "another.")
      .def(py::init([](const std::filesystem::path& memory, const std::optional<std::string>& name,
                       const std::optional<PictureSource>& source, bool use_odometry,
                       const py::kwargs& keywords) {
             const auto options = make_follower_options(name, use_odometry, keywords);
             const py::gil_scoped_release free;
             return std::make_unique<SharedFollower>(MemoryFile::open(memory, Access::read_only),
                                                     source, options);
           }),
           py::arg("memory"), py::arg("name") = py::none(), py::arg("source") = py::none(),
           py::arg("use_odometry") = true,
           ("`name`: name of the route; None: the only one in the file." + option_text).c_str())
      .def(
          "step",
          [](SharedFollower& follower, const py::object& observation) {
            const Observation seen = to_observation(observation);
            return follower.change([&](RouteFollower& one) {
              return NamedStep{one.step(seen), seen.name};
            });
          },
          py::arg("observation"), "Processes the next observation.");
  m.def(
      "follow_route",
      [](const std::filesystem::path& memory, const py::object& recording,
         const std::optional<std::string>& name, const std::optional<PictureSource>& source,
         bool use_odometry, int threads, const py::kwargs& keywords) {
        auto options = make_follower_options(name, use_odometry, keywords);
        const Dataset dataset = to_dataset_for_memory(memory, recording, source);
        const py::gil_scoped_release free;
        InterruptibleExecutor executor(threads);
        options.use_odometry = use_odometry && has_odometry(dataset);
        RouteFollower follower(MemoryFile::open(memory, Access::read_only), dataset.source,
                               options);
        std::vector<NamedStep> steps;
        process_in_order(
            dataset.entries.size(), executor,
            [&](std::size_t i) { return follower.encode(read_observation(dataset.entries[i])); },
            [&](std::size_t i, std::vector<float>&& line) {
              const DatasetEntry& entry = dataset.entries[i];
              steps.push_back({follower.step(std::move(line), entry.odometry), entry.file});
            });
        return steps;
      },
      py::arg("memory"), py::arg("recording"), py::arg("name") = py::none(),
      py::arg("source") = py::none(), py::kw_only(), py::arg("use_odometry") = true,
      py::arg("threads") = 0,
      ("Localises the robot of a recording relative to a route, like `panonav route follow`." +
       option_text)
          .c_str());
}

/// A recorded route, and what became of the images that are no line of it.
struct RecordedRoute : RouteRecorder::Recorded {
  bool length_estimated = false;
  std::size_t without_pose = 0;
  std::size_t unusable = 0;
  /// Returns the numbers of images by reason, as `panonav route record --json` names them.
  [[nodiscard]] std::map<std::string, std::size_t> left_out() const {
    return {{"too_near", too_near},
            {"known_before", known_before},
            {"without_pose", without_pose},
            {"unusable", unusable}};
  }
};

RecordedRoute record_route(const Dataset& dataset, const std::filesystem::path& memory,
                           RouteRecorderOptions options, int threads) {
  InterruptibleExecutor executor(threads);
  const bool memory_existed = memory_exists(memory);
  MemoryFile file =
      memory_existed
          ? MemoryFile::open(memory, Access::read_write)
          : MemoryFile::create(memory, make_header_from_recording(dataset, {}, {}, executor));
  const DrivePoses drive =
      find_drive_poses(dataset, file, options.name, options.odometry, executor);
  options.odometry =
      drive.origin == RoutePoseOrigin::odometry || drive.origin == RoutePoseOrigin::images;
  options.assumed_unit_m = drive.assumed_unit_m;
  options.is_in_map_unit = drive.is_in_map_unit;
  RouteRecorder recorder(std::move(file), dataset.source, options);
  return {recorder.record(drive.drive, drive.poses, executor), drive.is_scale_estimated,
          dataset.entries.size() - drive.drive.entries.size(), dataset.unusable.size()};
}

void bind_recording(py::module_& m) {
  py::class_<RoutePanorama>(m, "RoutePanorama",
                            "Horizon scanlines along a route, one for each place.")
      .def("__len__", &RoutePanorama::size)
      .def_property_readonly("columns", &RoutePanorama::columns,
                             "Number of bytes per line, over a full turn.")
      .def_property_readonly("length_m", &RoutePanorama::length_m, "Path length over all places.")
      .def(
          "lines",
          [](const RoutePanorama& route) {
            py::array_t<std::uint8_t> rows({static_cast<py::ssize_t>(route.size()),
                                            static_cast<py::ssize_t>(route.columns())});
            for (std::size_t i = 0; i < route.size(); ++i) {
              std::ranges::copy(route.line(i), rows.mutable_data(static_cast<py::ssize_t>(i), 0));
            }
            return rows;
          },
          "uint8 of (places, columns), from straight ahead counter-clockwise.")
      .def(
          "poses", [](const RoutePanorama& route) { return to_pose_rows(route.poses()); },
          "(places, 3) of x_m, y_m, heading_rad.")
      .def("__repr__", [](const RoutePanorama& route) {
        return "RoutePanorama(" + std::to_string(route.size()) + " lines, " +
               std::to_string(route.columns()) + " columns)";
      });
  Record<RecordedRoute>(m, "RecordedRoute", "A route as stored in a memory file.")
      .field("route", &RecordedRoute::route, "All lines, including those of earlier drives.")
      .field("appended", &RecordedRoute::appended, "Number of new lines.")
      .field("bytes", &RecordedRoute::bytes, "Stored size of lines and poses.")
      .field("bytes_per_km", &RecordedRoute::bytes_per_km,
             "Bytes per kilometre; 0 for a route of length 0.")
      .field("length_estimated", &RecordedRoute::length_estimated,
             "True if the unit was estimated from the memory's views; lengths may be wrong by a "
             "factor.")
      .field("left_out", &RecordedRoute::left_out,
             "Numbers of images that became no line, by reason: too_near, known_before, "
             "without_pose, unusable.");
  m.def(
      "record_route",
      [](const std::filesystem::path& memory, const py::object& recording, const std::string& name,
         const std::optional<PictureSource>& source, double every_m,
         const std::optional<std::pair<int, int>>& horizon_rows, bool odometry, int threads,
         const py::kwargs& keywords) {
        RouteRecorderOptions options{
            .name = name, .every_m = every_m, .horizon_rows = horizon_rows, .odometry = odometry};
        HorizonScanlineOptions line;
        Keywords(keywords).options(line).finish();
        if (py::len(keywords) > 0) options.line = line;
        const Dataset dataset = to_dataset_for_memory(memory, recording, source);
        const py::gil_scoped_release free;
        return record_route(dataset, memory, options, threads);
      },
      py::arg("memory"), py::arg("recording"), py::arg("name") = "route",
      py::arg("source") = py::none(), py::kw_only(), py::arg("every_m") = 0.1,
      py::arg("horizon_rows") = py::none(), py::arg("odometry") = false, py::arg("threads") = 0,
      append_option_list(
          "Records a route as one line of pixels per step, like `panonav route record`. "
          "`horizon_rows`: (first, last) row at the horizon, for panoramas whose elevations are "
          "not known. `odometry`: use the poses of the odometry, even if positions are known.",
          {options_of<HorizonScanlineOptions>()})
          .c_str());
  m.def(
      "read_route",
      [](SharedFile& memory, const std::string& name) {
        return memory.change([&](MemoryFile& file) { return file.route(name); });
      },
      py::arg("memory"), py::arg("name") = "route", "A route of a MemoryFile, or None.");
}

/// A motion along a chain, and where the robot is.
struct ChainStep : ChainDecision {
  std::string name;
  std::size_t snapshot = 0;
  Pose2 pose;
};

ChainStep make_chain_step(ChainGuide& guide, const Observation& observation) {
  const ChainDecision decision = guide.step(observation);
  return {decision, observation.name, guide.snapshot_number(decision.target),
          guide.chain_from_robot()};
}

ChainDirection choose_direction(bool back) {
  return back ? ChainDirection::back : ChainDirection::forward;
}

ChainSummary record_chain_of(const Dataset& dataset, const std::filesystem::path& memory,
                             const std::string& name, bool odometry, const ChainSpacing& spacing,
                             const ChainOdometry& chain_odometry, int threads) {
  InterruptibleExecutor executor(threads);
  MemoryFile file =
      memory_exists(memory)
          ? MemoryFile::open(memory, Access::read_write)
          : MemoryFile::create(memory, make_header_from_recording(dataset, {}, {}, executor));
  const DrivePoses drive = find_drive_poses(dataset, file, name, odometry, executor);
  return summarise_chain(record_chain(file, name, drive, spacing, chain_odometry, executor));
}

void bind_chain_records(py::module_& m) {
  Record<ChainSummary>(m, "ChainSummary", "Size and spacing of a chain of snapshots.")
      .field("snapshots", &ChainSummary::snapshots, "Number of snapshots.")
      .field("way_points", &ChainSummary::way_points, "Number of nodes without a snapshot.")
      .field("length_m", &ChainSummary::length_m, "Sum of all legs.")
      .field("bytes", &ChainSummary::bytes, "Size of the packed form.")
      .field("bytes_per_m", &ChainSummary::bytes_per_m, "0 for a chain without length.")
      .field("spacing_m", &ChainSummary::spacing_m, "Mean distance between snapshots.")
      .field("expected_offset_m", &ChainSummary::expected_offset_m,
             "Offset to be expected by odometry after travelling spacing_m.");
  Record<ChainStep>(m, "ChainStep", "The next motion of a robot along a chain of snapshots.")
      .field("name", &ChainStep::name, "Name of the image, if it has one.")
      .field(
          "state", [](const ChainStep& s) { return std::string(to_string(s.state)); },
          "'travelling', 'homing', 'searching', 'arrived' or 'lost'.")
      .field("snapshot", &ChainStep::snapshot, "Number of the next snapshot, from 1.")
      .field("turn_rad", &ChainStep::turn_rad, "Direction of the motion in the robot frame.")
      .field("advance_m", &ChainStep::advance_m, "Length of the motion.")
      .field("pose", &ChainStep::pose, "Estimated pose in the frame of the chain.");
}

void bind_chain_guide(py::module_& m) {
  using SharedGuide = Shared<ChainGuide>;
  py::class_<SharedGuide>(m, "ChainGuide",
                          "Leads a robot along a chain of snapshots: takes an image with its "
                          "odometry, returns the next motion.")
      .def(py::init([](const std::filesystem::path& memory, const std::optional<std::string>& name,
                       const std::optional<PictureSource>& source, bool back,
                       const py::kwargs& keywords) {
             ChainFollowerOptions options;
             Keywords(keywords).options(options).finish();
             const py::gil_scoped_release free;
             return std::make_unique<SharedGuide>(MemoryFile::open(memory, Access::read_only),
                                                  source, name, choose_direction(back), options);
           }),
           py::arg("memory"), py::arg("name") = py::none(), py::arg("source") = py::none(),
           py::kw_only(), py::arg("back") = false,
           append_option_list("`name`: of the route; None: the only one. `back`: from its end to "
                              "its beginning.",
                              {options_of<ChainFollowerOptions>()})
               .c_str())
      .def(
          "step",
          [](SharedGuide& guide, const py::object& observation) {
            const Observation current = to_observation(observation);
            return guide.change([&](ChainGuide& g) { return make_chain_step(g, current); });
          },
          py::arg("observation"),
          "Decides the next motion, to be carried out before the next observation. The "
          "observation needs odometry. After 'arrived' or 'lost' all decisions are the same.");
}

void bind_chains(py::module_& m) {
  bind_chain_records(m);
  bind_chain_guide(m);
  m.def(
      "record_chain",
      [](const std::filesystem::path& memory, const py::object& recording, const std::string& name,
         const std::optional<PictureSource>& source, bool odometry, int threads,
         const py::kwargs& keywords) {
        ChainSpacing spacing;
        ChainOdometry chain_odometry;
        Keywords(keywords).options(spacing).options(chain_odometry).finish();
        const Dataset dataset = to_dataset_for_memory(memory, recording, source);
        const py::gil_scoped_release free;
        return record_chain_of(dataset, memory, name, odometry, spacing, chain_odometry, threads);
      },
      py::arg("memory"), py::arg("recording"), py::arg("name") = "route",
      py::arg("source") = py::none(), py::kw_only(), py::arg("odometry") = false,
      py::arg("threads") = 0,
      append_option_list("Records a route as a chain of snapshots, like `panonav route record "
                         "--method chain`.",
                         {options_of<ChainSpacing>(), options_of<ChainOdometry>()})
          .c_str());
  m.def(
      "follow_chain",
      [](const std::filesystem::path& memory, const py::object& recording,
         const std::optional<std::string>& name, const std::optional<PictureSource>& source,
         bool back) {
        const Dataset dataset = to_dataset_for_memory(memory, recording, source);
        const py::gil_scoped_release free;
        ChainGuide guide(MemoryFile::open(memory, Access::read_only), dataset.source, name,
                         choose_direction(back));
        std::vector<ChainStep> steps;
        for (const DatasetEntry& entry : dataset.entries) {
          if (!entry.odometry) continue;
          steps.push_back(make_chain_step(guide, read_observation(entry)));
          const ChainState state = steps.back().state;
          if (state == ChainState::arrived || state == ChainState::lost) break;
        }
        return steps;
      },
      py::arg("memory"), py::arg("recording"), py::arg("name") = py::none(),
      py::arg("source") = py::none(), py::kw_only(), py::arg("back") = false,
      "Decides the motions along a chain of snapshots for each image with odometry, like `panonav "
      "route follow`, until the robot has arrived or is lost.");
}

HomeArea learn_home_of(const Dataset& dataset, const std::filesystem::path& memory,
                       const std::string& name, bool odometry, const HomeAreaOptions& options,
                       int threads) {
  InterruptibleExecutor executor(threads);
  MemoryFile file =
      memory_exists(memory)
          ? MemoryFile::open(memory, Access::read_write)
          : MemoryFile::create(memory, make_header_from_recording(dataset, {}, {}, executor));
  const DrivePoses walk = find_drive_poses(dataset, file, name, odometry, executor);
  return learn_home_area(file, name, walk, options, executor);
}

void bind_homes(py::module_& m) {
  Record<HomeArea>(m, "HomeArea", "The surroundings of a home, learnt from a walk around it.")
      .field(
          "snapshots", [](const HomeArea& a) { return a.chain.snapshots(); },
          "Number of snapshots.")
      .field(
          "bytes", [](const HomeArea& a) { return a.chain.pack().size(); },
          "Size of the packed form.")
      .field("returns", &HomeArea::returns, "Times that the walk was seen to pass home.")
      .field(
          "homeward_component", [](const HomeArea& a) { return a.homeward_component(); },
          "Mean over the views that are not stored; 1: straight home.")
      .field(
          "field",
          [](const HomeArea& a) {
            py::array_t<double> rows({static_cast<py::ssize_t>(a.held_out.size()), py::ssize_t{4}});
            for (std::size_t i = 0; i < a.held_out.size(); ++i) {
              const HeldOutView& view = a.held_out[i];
              constexpr double none = std::numeric_limits<double>::quiet_NaN();
              const Point2 home = view.home_vector.value_or(Point2{none, none});
              const std::array<double, 4> row{view.pose.x_m, view.pose.y_m, home.x_m, home.y_m};
              std::ranges::copy(row, rows.mutable_data(static_cast<py::ssize_t>(i), 0));
            }
            return rows;
          },
          "(views, 4) of x_m, y_m and the home vector in m; NaN where there is none.");
  Record<HomeStep>(m, "HomeStep", "Where a robot is relative to its home.")
      .field(
          "state",
          [](const HomeStep& s) {
            return std::string(s.decision ? to_string(s.decision->state) : "away");
          },
          "'travelling', 'homing', 'searching', 'arrived' or 'lost'; 'away' on the way out.")
      .field(
          "turn_rad",
          [](const HomeStep& s) {
            return s.decision ? std::optional(s.decision->turn_rad) : std::nullopt;
          },
          "Direction of the next motion in the robot frame.")
      .field(
          "advance_m",
          [](const HomeStep& s) {
            return s.decision ? std::optional(s.decision->advance_m) : std::nullopt;
          },
          "Length of the next motion.")
      .field("pose", &HomeStep::pose, "In the frame of the home.")
      .field("distance_m", &HomeStep::distance_m, "From home.")
      .field("direction_rad", &HomeStep::direction_rad, "To home, in the robot frame.")
      .field("deviation_m", &HomeStep::deviation_m,
             "Standard deviation of the position in its worst direction.");
  using SharedGuide = Shared<HomeAreaGuide>;
  py::class_<SharedGuide>(m, "HomeAreaGuide",
                          "Leads a robot home by odometry and by the surroundings of its home.")
      .def(
          py::init([](const std::filesystem::path& memory, const std::optional<std::string>& name,
                      const std::optional<PictureSource>& source, const py::kwargs& keywords) {
            HomeFinderOptions options;
            OdometryNoise noise;
            Keywords(keywords).options(options).options(noise).finish();
            const py::gil_scoped_release free;
            return std::make_unique<SharedGuide>(MemoryFile::open(memory, Access::read_only),
                                                 source, name, noise, options);
          }),
          py::arg("memory"), py::arg("name") = "home", py::arg("source") = py::none(),
          append_option_list("The robot is at home, at the heading of the first image of the walk.",
                             {options_of<HomeFinderOptions>(), options_of<OdometryNoise>()})
              .c_str())
      .def(
          "step",
          [](SharedGuide& guide, const py::object& observation, bool back) {
            const Observation current = to_observation(observation);
            return guide.change([&](HomeAreaGuide& g) { return g.step(current, back); });
          },
          py::arg("observation"), py::kw_only(), py::arg("back") = true,
          "Takes the next observation, which needs odometry. `back`: the robot is on its way back; "
          "decides the motion to be carried out before the next observation.");
  m.def(
      "learn_home",
      [](const std::filesystem::path& memory, const py::object& recording, const std::string& name,
         const std::optional<PictureSource>& source, bool odometry, int threads,
         const py::kwargs& keywords) {
        HomeAreaOptions options;
        Keywords(keywords).options(options).finish();
        const Dataset dataset = to_dataset_for_memory(memory, recording, source);
        const py::gil_scoped_release free;
        return learn_home_of(dataset, memory, name, odometry, options, threads);
      },
      py::arg("memory"), py::arg("recording"), py::arg("name") = "home",
      py::arg("source") = py::none(), py::kw_only(), py::arg("odometry") = false,
      py::arg("threads") = 0,
      append_option_list("Learns the surroundings of a home, like `panonav home learn`.",
                         {options_of<HomeAreaOptions>()})
          .c_str());
}

}  // namespace

void bind_routes(py::module_& m) {
  bind_recording(m);
  bind_following(m);
  bind_chains(m);
  bind_homes(m);
}

}  // namespace panonav::python
