#include "panonav/pipeline/route_recorder.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/pipeline/learnt_route.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/pipeline/visual_motion.hpp"
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
                     .from_odometry = options.odometry,
                     .assumed_unit_m = options.assumed_unit_m,
                     .is_in_map_unit = options.is_in_map_unit};
  if (source.is_in_map_unit && !source.assumed_unit_m) source.map_scale = read_map_scale(file);
  const auto known = file.route(options.name);
  if (!known) return source;
  const RouteSource before = read_route_source(file, options.name, known->columns());
  if (!options.line) source.line = before.line;
  if (!options.horizon_rows) source.horizon_rows = before.horizon_rows;
  if (source.line != before.line || source.horizon_rows != before.horizon_rows) {
    throw ContractError(
        describe_route(file, options.name) +
        " was recorded with another value of the option columns, the option half_band_rad or the "
        "option horizon_rows; leave them out or choose another name with the option name");
  }
  if (source.assumed_unit_m != before.assumed_unit_m) {
    throw ContractError(
        describe_route(file, options.name) + " is in " +
        (before.assumed_unit_m ? "view steps" : "metres") +
        ", these poses are in another unit; choose another name with the option name");
  }
  if (source.is_in_map_unit != before.is_in_map_unit && !source.assumed_unit_m) {
    throw ContractError(describe_route(file, options.name) + " is in " +
                        (before.is_in_map_unit ? "the unit of the map" : "metres of its drive") +
                        ", these poses are not; choose another name with the option name");
  }
  if (source.map_scale != before.map_scale) {
    throw ContractError(describe_route(file, options.name) +
                        " is in metres of an earlier scale of the map; choose another name with "
                        "the option name");
  }
  if (source.from_odometry != before.from_odometry) {
    throw ContractError(describe_route(file, options.name) + " is in the frame of " +
                        (before.from_odometry ? "its odometry" : "its data set") +
                        ", these poses are not; choose another name with the option name");
  }
  return source;
}

std::optional<Pose2> find_route_end(const MemoryFile& file, const std::string& name) {
  const auto known = file.route(name);
  if (!known || known->size() == 0) return std::nullopt;
  return known->poses().back();
}

bool has_position(const DatasetEntry& entry) {
  return entry.pose.has_value();
}
bool has_odometry_pose(const DatasetEntry& entry) {
  return entry.odometry.has_value();
}

Dataset keep_entries(Dataset drive, bool (*is_kept)(const DatasetEntry&)) {
  std::erase_if(drive.entries, [&](const DatasetEntry& entry) { return !is_kept(entry); });
  return drive;
}

/// Keeps the images of a drive that have a pose. Throws FileError if more than a tenth have none;
/// `cause` says why.
DrivePoses keep_posed_images(const Dataset& drive, const std::vector<std::optional<Pose2>>& poses,
                             const std::string& cause) {
  DrivePoses found;
  found.drive = drive;
  found.drive.entries.clear();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!poses[i]) continue;
    found.drive.entries.push_back(drive.entries[i]);
    found.poses.push_back(*poses[i]);
  }
  if (10 * found.poses.size() < 9 * poses.size()) {
    throw FileError(drive.folder.string(),
                    "has neither positions nor odometry, and only " +
                        std::to_string(found.poses.size()) + " of " +
                        format_count(poses.size(), "image") + " " + cause +
                        "; for a route, take an image every 20 to 50 cm, or a video");
  }
  return found;
}

/// Poses of the images that are views of the memory and in the largest component of its map; empty
/// if one is not a view of the memory or there is no map.
std::vector<std::optional<Pose2>> find_poses_in_map(const Dataset& drive,
                                                    const MemoryFile& memory) {
  const auto map = has_positions_from_map(memory) ? memory.map(map_name) : std::nullopt;
  if (!map) return {};
  const std::size_t component = find_largest_component(*map);
  std::vector<std::optional<Pose2>> poses;
  for (const DatasetEntry& entry : drive.entries) {
    const auto view = memory.find(entry.file);
    if (!view) return {};
    const auto node = std::ranges::lower_bound(map->nodes, *view, {}, &TopologicalMap::Node::view);
    const bool is_in = node != map->nodes.end() && node->view == *view;
    poses.push_back(is_in && node->component == component ? std::optional(node->pose)
                                                          : std::nullopt);
  }
  return poses;
}

/// Computes the motion between the images. An image that the others are not connected with has no
/// pose. Sets `median_step` to the median length of a step.
std::vector<std::optional<Pose2>> compute_poses_from_images(const Dataset& drive,
                                                            const ViewEncoder& encoder,
                                                            VisualOdometry odometry,
                                                            Executor& executor,
                                                            double& median_step) {
  std::vector<Pose2> poses;
  std::vector<std::size_t> component;
  std::vector<double> lengths;
  std::size_t component_count = 0;
  process_in_order(
      drive.entries.size(), executor,
      [&](std::size_t i) {
        return OdometryView(encoder.signature(read_observation(drive.entries[i])));
      },
      [&](std::size_t i, OdometryView&& view) {
        const auto step = odometry.add(std::move(view));
        component.push_back(step ? component[i - static_cast<std::size_t>(step->views)]
                                 : component_count++);
        poses.push_back(odometry.pose());
        if (!step) return;
        const double length = std::hypot(step->before_from_after.x_m, step->before_from_after.y_m);
        if (length > 0.0) lengths.push_back(length);
      });
  median_step = lengths.empty() ? 1.0 : upper_median_in_place(std::span(lengths));
  std::vector<std::size_t> sizes(component_count, 0);
  for (const std::size_t one : component) ++sizes[one];
  const auto largest = static_cast<std::size_t>(std::ranges::max_element(sizes) - sizes.begin());
  std::vector<std::optional<Pose2>> known(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (component[i] == largest) known[i] = poses[i];
  }
  return known;
}

/// True if the images of the drive, which are views of the memory, are in the order of a walk, or
/// are too few to tell.
bool are_images_in_order(const Dataset& drive, const MemoryFile& memory) {
  // The most similar tenth then has room for the views before and after.
  constexpr std::size_t min_images = 20;
  if (drive.entries.size() < min_images) return true;
  const VisualMemory views = memory.load();
  VisualMemory images(views.shape(), views.full_scale(), views.elevations());
  for (const DatasetEntry& entry : drive.entries) {
    const auto view = memory.find(entry.file);
    if (view) static_cast<void>(images.append(views.packed(*view), views.info(*view)));
  }
  return are_in_order(images);
}

DrivePoses find_poses_by_images(const Dataset& drive, const MemoryFile& memory,
                                Executor& executor) {
  const ViewEncoder encoder(memory.header(), drive.source);
  const auto info = memory.info();
  double median_step = 1.0;
  // Uses the unit of the memory's positions if there are some.
  const bool has_unit = info.views_with_position > 1;
  const auto poses = compute_poses_from_images(
      drive, encoder, has_unit ? visual_odometry(memory.load()) : VisualOdometry(), executor,
      median_step);
  DrivePoses found = keep_posed_images(drive, poses, "show the motion from one to the next");
  found.origin = RoutePoseOrigin::images;
  found.is_in_map_unit = !has_unit || has_positions_from_map(memory);
  found.is_scale_estimated = has_unit;
  if (!has_unit) {
    for (Pose2& pose : found.poses) {
      pose.x_m /= median_step;
      pose.y_m /= median_step;
    }
    found.assumed_unit_m = median_step;
  } else if (read_length_unit(memory) == LengthUnit::view_steps) {
    found.assumed_unit_m = read_assumed_unit_m(memory);
  }
  return found;
}

}  // namespace

DrivePoses find_drive_poses(const Dataset& drive, const MemoryFile& memory,
                            const std::string& route, bool only_odometry, Executor& executor) {
  const std::size_t images = drive.entries.size();
  Dataset moved = keep_entries(drive, has_odometry_pose);
  if (!only_odometry) {
    Dataset posed = keep_entries(drive, has_position);
    const std::size_t count = posed.entries.size();
    auto poses = dataset_poses(posed);
    if (!poses.empty() && 2 * count >= images && 10 * count >= 9 * moved.entries.size()) {
      return {std::move(posed), std::move(poses), RoutePoseOrigin::data_set, std::nullopt, false};
    }
  }
  const bool has_enough = only_odometry ? moved.entries.size() >= std::min<std::size_t>(2, images)
                                        : 2 * moved.entries.size() >= images;
  if (has_enough && !moved.entries.empty()) {
    std::vector<Pose2> poses;
    for (const DatasetEntry& entry : moved.entries) poses.push_back(*entry.odometry);
    return {std::move(moved), std::move(poses), RoutePoseOrigin::odometry, std::nullopt, false};
  }
  if (only_odometry) {
    const std::string some = "has odometry for " + std::to_string(moved.entries.size()) + " of " +
                             format_count(images, "image") + "; allowed with odometry: 2 or more";
    throw FileError(drive.folder.string(),
                    moved.entries.empty() ? "has no odometry for its images" : some);
  }
  const auto mapped = find_poses_in_map(drive, memory);
  if (!mapped.empty()) {
    DrivePoses found =
        keep_posed_images(drive, mapped, "are in the largest part of the memory's map");
    found.origin = RoutePoseOrigin::map;
    found.is_in_map_unit = true;
    found.is_in_order = are_images_in_order(found.drive, memory);
    if (read_length_unit(memory) == LengthUnit::view_steps) {
      found.assumed_unit_m = read_assumed_unit_m(memory);
    }
    return found;
  }
  if (memory.route(route)) {
    throw FileError(memory.path().string(),
                    "already contains the route '" + route +
                        "', and the motion of this drive can only be computed from its images, "
                        "in another frame; choose another name with the option name");
  }
  return find_poses_by_images(drive, memory, executor);
}

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
      views_(file_.header(), source.value_or(file_.header().source)),
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

std::optional<Pose2> RouteRecorder::pose_of(const Observation& observation) const {
  if (source_.from_odometry) return observation.odometry;
  const auto& known = observation.pose;
  if (!known || !known->heading_rad) return std::nullopt;
  return Pose2{known->x_m, known->y_m, *known->heading_rad};
}

double RouteRecorder::interval() const {
  return options_.every_m / source_.rough_unit_m();
}

RouteRecorder::EncodedLine RouteRecorder::encode(const Observation& observation) const {
  const auto pose = pose_of(observation);
  if (!pose) {
    throw ContractError(
        source_.from_odometry ? "odometry of the observation" : "pose of the observation",
        "unknown", "known, with a heading, for each line of a route");
  }
  views_.require_fit(observation);
  return {*pose, encoder_.line(observation)};
}

void RouteRecorder::add(EncodedLine line) {
  if (!last_ && route_end_) {
    const double gap_m = distance(route_end_->position(), line.pose.position());
    const double unit_m = source_.assumed_unit_m.value_or(1.0);
    if (unit_m * gap_m > max_gap_m) {
      const std::string unit = source_.assumed_unit_m ? " view steps" : " m";
      throw FileError(file_.path().string(), "the first line lies " + format_number(gap_m) + unit +
                                                 " from the end of the route '" + options_.name +
                                                 "'; allowed: at most " +
                                                 format_number(max_gap_m / unit_m) + unit +
                                                 ", or another value of the option name");
    }
  }
  last_ = line.pose;
  waiting_.push_back(std::move(line));
  if (waiting_.size() >= lines_at_once) flush();
}

bool RouteRecorder::add(const Observation& observation) {
  const auto pose = pose_of(observation);
  if (!pose || !is_due(last_, *pose, interval())) return false;
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
                interval())) {
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
        if (options_.odometry) {
          observation.odometry = pose;
        } else {
          observation.pose = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad};
        }
        return encode(observation);
      },
      [&](std::size_t, EncodedLine&& line) {
        add(std::move(line));
        if (recorded) recorded(chosen.size() - first);
      });
  Recorded result = finish();
  // Images before the first new line belong to lines that the route already had.
  result.known_before = first == 0 ? 0 : (first < chosen.size() ? chosen[first] : poses.size());
  result.too_near = poses.size() - result.known_before - result.appended;
  return result;
}

RouteRecorder::Recorded RouteRecorder::finish() {
  flush();
  learn_and_store_route(file_, options_.name);
  auto route = file_.route(options_.name);
  if (!route) throw ContractError("lines of the route", 0.0, "1 or more");
  return {
      .route = std::move(*route), .appended = appended_, .bytes = file_.route_bytes(options_.name)};
}

}  // namespace panonav
