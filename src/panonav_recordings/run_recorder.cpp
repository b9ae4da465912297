#include "panonav_recordings/run_recorder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <numbers>
#include <span>
#include <thread>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/core/thread_priority.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_recordings/internal/topic_writer.hpp"
#include "panonav_recordings/run_messages.hpp"

namespace panonav::recordings {

namespace {

// Adds the floor to the diagnostics if it has a name.
void add_floor(RunMoment& moment, std::string_view floor) {
  if (!floor.empty()) moment.values.emplace_back("floor", floor);
}

/// Makes a grid whose cells within two cells of a reference are free and all others unknown.
/// `nullopt` if the references are too far apart for a grid.
std::optional<ros::OccupancyGrid> make_visited_grid(const std::vector<Point2>& positions,
                                                    std::int64_t stamp_ns) {
  constexpr double cell_m = 0.1;
  constexpr int margin_cells = 2;  // cells
  constexpr double max_cells = 4e6;
  const auto [low_x, high_x] = std::ranges::minmax(positions, {}, &Point2::x_m);
  const auto [low_y, high_y] = std::ranges::minmax(positions, {}, &Point2::y_m);
  const double columns = std::ceil((high_x.x_m - low_x.x_m) / cell_m) + 2 * margin_cells + 1;
  const double rows = std::ceil((high_y.y_m - low_y.y_m) / cell_m) + 2 * margin_cells + 1;
  if (!(columns * rows <= max_cells)) return std::nullopt;
  ros::OccupancyGrid grid;
  grid.header = {stamp_ns, "map"};
  grid.map_load_time_ns = stamp_ns;
  grid.resolution = static_cast<float>(cell_m);
  grid.width = static_cast<std::uint32_t>(columns);
  grid.height = static_cast<std::uint32_t>(rows);
  const Point2 corner{low_x.x_m - (margin_cells + 0.5) * cell_m,
                      low_y.y_m - (margin_cells + 0.5) * cell_m};
  // Slightly below the points; otherwise viewers hide half of each point.
  grid.origin.position = {corner.x_m, corner.y_m, -0.05};
  grid.cells.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), -1);
  for (const Point2& position : positions) {
    const int column = static_cast<int>((position.x_m - corner.x_m) / cell_m);
    const int row = static_cast<int>((position.y_m - corner.y_m) / cell_m);
    for (int r = row - margin_cells; r <= row + margin_cells; ++r) {
      for (int c = column - margin_cells; c <= column + margin_cells; ++c) {
        if (r < 0 || c < 0 || r >= static_cast<int>(rows) || c >= static_cast<int>(columns)) {
          continue;
        }
        grid.cells[static_cast<std::size_t>(r) * grid.width + static_cast<std::size_t>(c)] = 0;
      }
    }
  }
  return grid;
}

/// Samples points along the edges, dense enough to look like lines, but at most about 100,000 for
/// viewers.
PointValues sample_edges(const std::vector<RunEdge>& edges) {
  constexpr double max_points = 1e5;
  double length_m = 0.0;
  for (const RunEdge& edge : edges) length_m += distance(edge.from, edge.to);
  const double step_m = std::max(0.05, length_m / max_points);
  PointValues cloud;
  for (const RunEdge& edge : edges) {
    const auto steps = static_cast<int>(std::ceil(distance(edge.from, edge.to) / step_m));
    for (int i = 0; i <= steps; ++i) {
      const double share = static_cast<double>(i) / std::max(1, steps);
      cloud.add({std::lerp(edge.from.x_m, edge.to.x_m, share),
                 std::lerp(edge.from.y_m, edge.to.y_m, share)},
                static_cast<double>(edge.kind));
    }
  }
  return cloud;
}

}  // namespace

RunMoment make_moment(const Observation& observation, std::size_t number) {
  RunMoment moment{.stamp_s = observation.stamp_s.value_or(static_cast<double>(number)),
                   .odometry = observation.odometry,
                   .tilt = observation.tilt,
                   .truth = observation.pose};
  moment.encoded_picture = observation.encoded;
  const auto* const picture = std::get_if<Image>(&observation.picture);
  if (picture != nullptr && observation.encoded.empty()) moment.picture = *picture;
  return moment;
}

std::vector<Point2> reference_positions(const VisualMemory& memory) {
  std::vector<Point2> positions;
  for (const ViewId view : memory.views()) {
    if (const auto& pose = memory.info(view).pose) positions.push_back(pose->position());
  }
  return positions;
}

void set_localisation(RunMoment& moment, const MonteCarloEstimate& estimate) {
  moment.pose = estimate.pose;
  moment.modes = estimate.modes;
  if (estimate.pose && !estimate.modes.empty()) {
    moment.covariance = estimate.modes.front().covariance;
  }
  moment.sure = estimate.state == LocalisationState::localised;
  moment.state = estimate.state == LocalisationState::position_known
                     ? "position known, heading not"
                     : std::string(to_string(estimate.state));
  moment.probability = estimate.probability;
  moment.values = {{"probability", format_fixed(estimate.probability, 4)},
                   {"inside", format_fixed(estimate.p_inside, 4)},
                   {"modes", std::to_string(estimate.modes.size())},
                   {"particles", std::to_string(estimate.particles)}};
  add_floor(moment, estimate.floor());
}

void set_localisation(RunMoment& moment, const Place& place) {
  moment.sure = place.known;
  moment.state = place.known ? "known place" : "unknown place";
  moment.probability = place.probability;
  moment.values = {{"known_probability", format_fixed(place.known_probability, 4)}};
  add_floor(moment, place.floor());
  for (const AlternativePlace& other : place.alternatives) {
    moment.values.emplace_back(
        "alternative", other.match.name + ", probability " + format_fixed(other.probability, 4));
  }
  if (!place.matches.empty()) {
    moment.best_match_turn_rad = place.matches.front().heading_rad;
    moment.values.emplace_back("best_match", place.matches.front().name);
  }
  if (!place.known || !place.position || !place.heading_rad) return;
  moment.pose = Pose2{place.position->x_m, place.position->y_m, *place.heading_rad};
  // The accuracy of the heading is unknown: this is the variance of a uniform angle.
  constexpr double uniform_heading_variance = std::numbers::pi * std::numbers::pi / 3.0;
  const auto [xx, xy, yy] = place.position->covariance();
  moment.covariance = {xx, xy, 0, xy, yy, 0, 0, 0, uniform_heading_variance};
}

struct RunRecorder::Implementation {
  Implementation(const std::filesystem::path& file, const RunRecorderOptions& recorder_options)
      : options(recorder_options),
        writer(file, {.compression = McapCompression::lz4}),
        pictures(writer, "/camera/image/compressed"),
        panoramas(writer, "/panorama/compressed"),
        best_matches(writer, "/best_match/compressed"),
        transforms(writer, "/tf"),
        references(writer, "/references"),
        edges(writer, "/edges"),
        particles(writer, "/particles"),
        path_points(writer, "/path/points"),
        plan_points(writer, "/plan/points"),
        particle_poses(writer, "/particles/poses"),
        directions(writer, "/directions"),
        path(writer, "/path"),
        plan(writer, "/plan"),
        grid(writer, "/visited"),
        poses(writer, "/pose"),
        goals(writer, "/goal"),
        diagnostics(writer, "/diagnostics"),
        robot(writer, "map"),
        thread([this] { work(); }) {}

  void write_picture(TopicWriter<ros::CompressedImage>& topic, std::int64_t ns,
                     std::span<const std::uint8_t> bytes) {
    const bool is_png = image_format(bytes, "an image of the run") == ImageFormat::png;
    topic.write(log_ns, ns, {{ns, "camera"}, is_png ? "png" : "jpeg", bytes});
  }

  void write(const RunMoment& moment) {
    const std::int64_t ns = to_nanoseconds(moment.stamp_s);
    log_ns = std::max(log_ns, ns);  // the clock may have been set back
    robot.write(log_ns, ns, moment.odometry, moment.tilt, moment.truth);
    if (!moment.encoded_picture.empty()) {
      write_picture(pictures, ns, moment.encoded_picture);
    } else if (moment.picture) {
      write_picture(pictures, ns, encode_png(moment.picture->view()));
    }
    if (moment.panorama) {
      const Image picture = to_picture(*moment.panorama);
      write_picture(panoramas, ns, encode_png(picture.view()));
    }
    if (!moment.best_match.empty()) write_picture(best_matches, ns, moment.best_match);
    write_transforms(moment, ns);
    write_references(moment.references, ns);
    if (!moment.edges.empty()) {
      edges.write(log_ns, ns, sample_edges(moment.edges).message(ns, "map", "kind"));
    }
    write_plan(moment.plan, ns);
    if (!moment.directions.empty())
      directions.write(log_ns, ns, poses_message(moment.directions, ns, "map"));
    if (moment.goal) goals.write(log_ns, ns, {{ns, "map"}, ros::to_pose(*moment.goal)});
    if (moment.pose) {
      poses.write(log_ns, ns, pose_message(moment, ns, "map"));
      write_path(ns, *moment.pose);
    }
    if (!moment.particles.empty()) {
      particles.write(log_ns, ns, make_cloud(moment.particles).message(ns, "map", "heading"));
      particle_poses.write(log_ns, ns, poses_message(moment.particles, ns, "map"));
    }
    if (moment.state.empty()) return;
    diagnostics.write(log_ns, ns, diagnostics_message(moment, ns));
  }

  /// Writes the frames of REP 105: map, odom if there is odometry, and base_link.
  void write_transforms(const RunMoment& moment, std::int64_t ns) {
    ros::TFMessage tf;
    const auto add = [&](const char* parent, const char* child, const Pose2& parent_from_child) {
      tf.transforms.push_back({{ns, parent}, child, ros::to_pose(parent_from_child)});
    };
    add("tf#/", "map", {});  // Rerun shows "map" only below this root
    if (moment.odometry) add("odom", "base_link", *moment.odometry);
    if (moment.odometry && moment.pose)
      add("map", "odom", *moment.pose * inverse(*moment.odometry));
    if (moment.pose && !moment.odometry) add("map", "base_link", *moment.pose);
    add("base_link", "camera", {});
    transforms.write(log_ns, ns, tf);
  }

  static PointValues make_cloud(const std::vector<Pose2>& poses) {
    PointValues cloud;
    for (const Pose2& pose : poses) cloud.add(pose.position(), pose.heading_rad);
    return cloud;
  }
  /// Writes the plan as PointCloud2 and as Path; its poses have the stamp of the message.
  void write_plan(const std::vector<Pose2>& path, std::int64_t ns) {
    if (path.empty()) return;
    ros::Path message{{ns, "map"}, {}};
    for (const Pose2& pose : path) message.poses.push_back({{ns, "map"}, ros::to_pose(pose)});
    plan_points.write(log_ns, ns, make_cloud(path).message(ns, "map", "heading"));
    plan.write(log_ns, ns, message);
  }

  /// Writes the path driven so far. Each message has the whole path, so every second pose is
  /// dropped once there are 1024.
  void write_path(std::int64_t ns, const Pose2& pose) {
    constexpr std::size_t max_poses = 1024;
    if (moments_on_path++ % path_every == 0) {
      path_poses.push_back({ns, pose});
      if (path_poses.size() == max_poses) {
        for (std::size_t i = 0; 2 * i < path_poses.size(); ++i) path_poses[i] = path_poses[2 * i];
        path_poses.resize(max_poses / 2);
        path_every *= 2;
      }
    }
    PointValues cloud;
    ros::Path message{{ns, "map"}, {}};
    for (const auto& [stamp_ns, at] : path_poses) {
      cloud.add(at.position(), at.heading_rad);
      message.poses.push_back({{stamp_ns, "map"}, ros::to_pose(at)});
    }
    path_points.write(log_ns, ns, cloud.message(ns, "map", "heading"));
    path.write(log_ns, ns, message);
  }

  void write_references(const std::vector<Point2>& positions, std::int64_t ns) {
    if (positions.empty()) return;
    PointValues cloud;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      cloud.add(positions[i], static_cast<double>(i));
    }
    references.write(log_ns, ns, cloud.message(ns, "map", "number"));
    if (const auto visited = make_visited_grid(positions, ns)) grid.write(log_ns, ns, *visited);
  }

  void add(RunMoment&& moment) {
    std::unique_lock lock(mutex);
    if (failure) std::rethrow_exception(failure);
    if (closed) throw ContractError("recording", "closed", "open, to be written to");
    if (options.wait) {
      has_room.wait(lock, [this] { return waiting.size() < options.max_waiting; });
    } else if (waiting.size() >= options.max_waiting) {
      ++left_out;
      return;
    }
    waiting.push_back(std::move(moment));
    has_work.notify_one();
  }

  void work() {
    if (!options.wait) lower_thread_priority();
    std::unique_lock lock(mutex);
    while (true) {
      has_work.wait(lock, [this] { return closed || !waiting.empty(); });
      if (waiting.empty()) return;
      const RunMoment moment = std::move(waiting.front());
      waiting.pop_front();
      lock.unlock();
      std::exception_ptr thrown;
      try {
        if (!failed) write(moment);
      } catch (const Error&) {
        thrown = std::current_exception();
        failed = true;
      }
      lock.lock();
      if (thrown && !failure) failure = thrown;
      has_room.notify_one();
    }
  }

  void close() {
    {
      const std::lock_guard lock(mutex);
      if (closed) return;
      closed = true;
      has_work.notify_one();
    }
    thread.join();
    if (failure) std::rethrow_exception(failure);
    writer.close();
  }

  RunRecorderOptions options;
  McapWriter writer;  // used only by the thread, up to `failed`
  TopicWriter<ros::CompressedImage> pictures, panoramas, best_matches;
  TopicWriter<ros::TFMessage> transforms;
  TopicWriter<ros::PointCloud2> references, edges, particles, path_points, plan_points;
  TopicWriter<ros::PoseArray> particle_poses, directions;
  TopicWriter<ros::Path> path, plan;
  TopicWriter<ros::OccupancyGrid> grid;
  TopicWriter<ros::PoseWithCovarianceStamped> poses;
  TopicWriter<ros::PoseStamped> goals;
  TopicWriter<ros::DiagnosticArray> diagnostics;
  RobotTopics robot;
  std::vector<std::pair<std::int64_t, Pose2>> path_poses;
  std::size_t moments_on_path = 0;
  std::size_t path_every = 1;
  std::int64_t log_ns = 0;
  bool failed = false;  // last one used only by the thread
  std::mutex mutex;
  std::condition_variable has_work;
  std::condition_variable has_room;
  std::deque<RunMoment> waiting;
  std::exception_ptr failure;
  std::size_t left_out = 0;
  bool closed = false;
  std::thread thread;
};

RunRecorder::RunRecorder(const std::filesystem::path& file, const RunRecorderOptions& options)
    : implementation_(std::make_unique<Implementation>(file, options)) {}

RunRecorder::~RunRecorder() {
  try {
    implementation_->close();
  } catch (const Error&) {  // NOLINT(bugprone-empty-catch): only `close` reports it
  }
}

void RunRecorder::add(RunMoment moment) {
  implementation_->add(std::move(moment));
}

void RunRecorder::close() {
  implementation_->close();
}

std::size_t RunRecorder::left_out() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->left_out;
}

}  // namespace panonav::recordings
