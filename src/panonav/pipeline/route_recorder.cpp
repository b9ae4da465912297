#include "panonav/pipeline/route_recorder.hpp"

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/route/route_panorama.hpp"

namespace panonav {

namespace {

constexpr std::size_t lines_at_once = 64;
/// Largest gap between the end of a route and the line that continues it (chosen).
constexpr double max_gap_m = 1.0;

std::string describe_route(const MemoryFile& file, const std::string& name) {
  return "the route '" + name + "' in " + file.path().string();
}

/// Returns how to make the lines. An existing route must be continued with the same line options
/// and in the same frame.
RouteSource choose_source(const MemoryFile& file, const RouteRecorderOptions& options) {
  require(options.every_m >= 0.0, "every_m", options.every_m, ">= 0");
  RouteSource source{.line = options.line.value_or(HorizonScanlineOptions{}),
                     .horizon_rows = options.horizon_rows,
                     .from_odometry = options.odometry};
  const auto known = file.route(options.name);
  if (!known) return source;
  const RouteSource before = read_route_source(file, options.name, known->columns());
  if (!options.line) source.line = before.line;
  if (!options.horizon_rows) source.horizon_rows = before.horizon_rows;
  if (source.line != before.line || source.horizon_rows != before.horizon_rows) {
    throw ContractError(
        describe_route(file, options.name) +
        " was recorded with another value of the option columns, the option half_band_rad or the "
        "option horizon_rows; leave them out or choose another name");
  }
  if (source.from_odometry != before.from_odometry) {
    throw ContractError(describe_route(file, options.name) + " is in the frame of " +
                        (before.from_odometry ? "its odometry" : "its data set") +
                        ", these poses are not; choose another name");
  }
  return source;
}

std::optional<Pose2> find_route_end(const MemoryFile& file, const std::string& name) {
  const auto known = file.route(name);
  if (!known || known->size() == 0) return std::nullopt;
  return known->poses().back();
}

}  // namespace

double RouteRecorder::Recorded::bytes_per_km() const {
  const double length_m = route.length_m();
  return length_m > 0.0 ? 1000.0 * static_cast<double>(bytes) / length_m : 0.0;
}

RouteRecorder::RouteRecorder(const std::filesystem::path& memory,
                             const RouteRecorderOptions& options)
    : RouteRecorder(MemoryFile::open(memory, Access::read_write), std::nullopt, options) {}

RouteRecorder::RouteRecorder(MemoryFile memory, const std::optional<PictureSource>& source,
                             const RouteRecorderOptions& options)
    : options_(options),
      file_(std::move(memory)),
      source_(choose_source(file_, options)),
      encoder_(source.value_or(file_.header().source), source_),
      route_end_(find_route_end(file_, options.name)) {}

std::size_t RouteRecorder::skip_recorded(std::span<const Pose2> drive) {
  const auto route = file_.route(options_.name);
  if (!route || last_) return 0;
  const std::span<const Pose2> known = route->poses();
  // Uses the distance within which `RoutePanorama::append` leaves out lines.
  const auto same_place = [](const Pose2& a, const Pose2& b) {
    return distance(a.position(), b.position()) < RoutePanorama::min_step_m;
  };
  std::size_t found = 0;
  std::size_t skipped = 0;
  for (; skipped < drive.size(); ++skipped) {
    if (found < known.size() && same_place(known[found], drive[skipped])) {
      ++found;
    } else if (found == 0 || !same_place(known[found - 1], drive[skipped])) {
      break;
    }
  }
  if (found < known.size()) return 0;
  last_ = route_end_;
  return skipped;
}

bool RouteRecorder::is_due(const std::optional<Pose2>& last, const Pose2& next, double every_m) {
  // Tolerates robots that drive slightly less than `every_m` between images.
  return !last || distance(last->position(), next.position()) >= 0.999 * every_m;
}

Pose2 RouteRecorder::pose_of(const Observation& observation) const {
  if (source_.from_odometry && observation.odometry) return *observation.odometry;
  const auto& known = observation.pose;
  if (!source_.from_odometry && known && known->heading_rad) {
    return {known->x_m, known->y_m, *known->heading_rad};
  }
  throw ContractError(
      source_.from_odometry ? "odometry of the observation" : "pose of the observation", "unknown",
      "known, with a heading, for each line of a route");
}

RouteRecorder::EncodedLine RouteRecorder::encode(const Observation& observation) const {
  return {pose_of(observation), encoder_.line(observation)};
}

void RouteRecorder::add(EncodedLine line) {
  if (!last_ && route_end_) {
    const double gap_m = distance(route_end_->position(), line.pose.position());
    if (gap_m > max_gap_m) {
      throw FileError(file_.path().string(), "the first line lies " + format_number(gap_m) +
                                                 " m from the end of the route '" + options_.name +
                                                 "'; allowed: at most " + format_number(max_gap_m) +
                                                 " m, or another name");
    }
  }
  last_ = line.pose;
  waiting_.push_back(std::move(line));
  if (waiting_.size() >= lines_at_once) flush();
}

bool RouteRecorder::add(const Observation& observation) {
  if (!is_due(last_, pose_of(observation), options_.every_m)) return false;
  add(encode(observation));
  return true;
}

void RouteRecorder::flush() {
  if (waiting_.empty()) return;
  RoutePanorama more(source_.line.columns);
  for (const EncodedLine& line : waiting_) {
    static_cast<void>(more.append(line.pose, std::span<const float>(line.line)));
  }
  waiting_.clear();
  file_.change([&] {
    if (!is_source_stored_) store_route_source(file_, options_.name, source_);
    appended_ += file_.append_route(options_.name, more);
  });
  is_source_stored_ = true;
}

RouteRecorder::Recorded RouteRecorder::record(
    const Dataset& drive, std::span<const Pose2> poses, Executor& executor,
    const std::function<void(std::size_t lines)>& recorded) {
  std::vector<std::size_t> chosen;
  std::vector<Pose2> due_poses;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!is_due(due_poses.empty() ? std::nullopt : std::optional(due_poses.back()), poses[i],
                options_.every_m)) {
      continue;
    }
    chosen.push_back(i);
    due_poses.push_back(poses[i]);
  }
  const std::size_t first = skip_recorded(due_poses);
  process_in_order(
      chosen.size() - first, executor,
      [&](std::size_t i) {
        Observation observation = read_observation(drive.entries[chosen[first + i]]);
        const Pose2& pose = due_poses[first + i];
        if (!options_.odometry)
          observation.pose = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad};
        return encode(observation);
      },
      [&](std::size_t, EncodedLine&& line) {
        add(std::move(line));
        if (recorded) recorded(chosen.size() - first);
      });
  return finish();
}

RouteRecorder::Recorded RouteRecorder::finish() {
  flush();
  auto route = file_.route(options_.name);
  if (!route) throw ContractError("lines of the route", 0.0, "1 or more");
  return {std::move(*route), appended_, file_.route_bytes(options_.name)};
}

}  // namespace panonav
