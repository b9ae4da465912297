#include "panonav/pipeline/memory_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/nearest_points.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/mapping/component_joining.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/mapping/topological_mapper.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/map_scale.hpp"

namespace panonav {

namespace {

/// Parameter that is set if the positions of the views come from a map; its value is their unit.
constexpr const char* unit_parameter = "map_unit";
constexpr const char* scale_parameter = "map_scale";  // `read_map_scale`; empty: unknown
constexpr const char* own_unit_parameter = "own_map_unit";
constexpr const char* metres_text = "metres";
constexpr const char* view_steps_text = "view_steps";  // followed by the assumed metres of a step
/// Distance between components that have no common frame, in median steps. It exceeds the distance
/// over which positions are interpolated (chosen).
constexpr double component_gap_steps = 6.0;
/// Smallest number of views of a part whose views get positions: fewer are too few for the model of
/// observations, and steps between images that are far apart are too often wrong.
constexpr std::size_t min_positioned_views = ObservationModel::min_views;
/// Assumed distance between neighbouring views of an arrangement: that which is recommended for a
/// recording.
constexpr double assumed_spacing_m = 0.3;

/// Relative change of the lengths of a map in metres from which its routes are scaled, too. Smaller
/// changes are the noise of its steps (chosen).
constexpr double min_change_of_scale = 0.01;

struct StoredUnit {
  LengthUnit unit = LengthUnit::metres;
  double assumed_m = 1.0;
};

StoredUnit read_stored_unit(const MemoryFile& memory) {
  const auto text = memory.parameter(unit_parameter);
  if (!text || text->empty() || *text == metres_text) return {};
  const std::vector<std::string> words = split_words(*text);
  StoredUnit stored{.unit = LengthUnit::view_steps};
  if (words.size() == 2 && words[0] == view_steps_text && read_number(words[1], stored.assumed_m) &&
      std::isfinite(stored.assumed_m) && stored.assumed_m > 0.0) {
    return stored;
  }
  throw FileError(memory.path().string(), std::string("parameter ") + unit_parameter + " is '" +
                                              to_readable_line(*text) +
                                              "'; allowed: " + metres_text + ", or " +
                                              view_steps_text + " and a number above 0");
}

double length(const Pose2& step) {
  return std::hypot(step.x_m, step.y_m);
}

/// Bounds of the positions of a component.
struct Box {
  double min_x_m = std::numeric_limits<double>::infinity();
  double max_x_m = -std::numeric_limits<double>::infinity();
  double min_y_m = std::numeric_limits<double>::infinity();
  double max_y_m = -std::numeric_limits<double>::infinity();

  void add(const Pose2& pose) {
    min_x_m = std::min(min_x_m, pose.x_m);
    max_x_m = std::max(max_x_m, pose.x_m);
    min_y_m = std::min(min_y_m, pose.y_m);
    max_y_m = std::max(max_y_m, pose.y_m);
  }
  [[nodiscard]] double width() const { return max_x_m - min_x_m; }
  [[nodiscard]] double height() const { return max_y_m - min_y_m; }
};

/// Returns the offset of each component (`place_components_side_by_side`), given their boxes.
std::vector<Point2> compute_offsets(const std::vector<Box>& boxes,
                                    const std::vector<std::size_t>& order, double gap) {
  std::vector<Point2> offsets(boxes.size());
  const Box& first = boxes[order.front()];
  double area = 0.0;
  for (const Box& box : boxes) area += (box.width() + gap) * (box.height() + gap);
  constexpr double width_to_height = 1.5;
  const double row_width = std::max(first.width(), std::sqrt(width_to_height * area));
  double x = first.max_x_m + gap;
  double top = first.max_y_m;
  double row_height = first.height();
  for (const std::size_t component : std::span(order).subspan(1)) {
    const Box& box = boxes[component];
    if (x + box.width() > first.min_x_m + row_width) {
      x = first.min_x_m;
      top -= row_height + gap;
      row_height = 0.0;
    }
    offsets[component] = {x - box.min_x_m, top - box.max_y_m};
    x += box.width() + gap;
    row_height = std::max(row_height, box.height());
  }
  return offsets;
}

/// Returns the motions between views that follow each other in an earlier map in metres.
std::map<std::pair<ViewId, ViewId>, Pose2> read_metric_steps(const MemoryFile& memory) {
  std::map<std::pair<ViewId, ViewId>, Pose2> steps;
  const auto map = memory.map(map_name);
  if (!map || !has_positions_from_map(memory) || read_length_unit(memory) != LengthUnit::metres) {
    return steps;
  }
  for (const TopologicalMap::Edge& edge : map->edges) {
    if (edge.kind == Link::Kind::sequence) steps.emplace(std::pair(edge.a, edge.b), edge.a_from_b);
  }
  return steps;
}

/// A map of views in their order.
struct OrderedMap {
  TopologicalMap map;
  bool is_metric = false;
  double assumed_unit_m = 1.0;  ///< of lengths that are not metric
};

/// Returns the views of paths beside others that are in no order, so that no step leads from one to
/// the next. Odometry says what the order is.
std::vector<ViewId> find_unordered_views(const MemoryFile& file, const VisualMemory& views,
                                         const std::map<std::string, Pose2>& odometry) {
  std::vector<ViewId> unordered;
  const std::vector<ViewId> starts = read_path_starts(file);
  const auto ids = views.views();
  for (auto begin = ids.begin(); !starts.empty() && begin != ids.end();) {
    const auto next_start = std::ranges::upper_bound(starts, *begin);
    const auto end =
        next_start == starts.end() ? ids.end() : std::lower_bound(begin, ids.end(), *next_start);
    if (begin == ids.begin() && end == ids.end()) break;  // there is no other path
    VisualMemory path(views.shape(), views.full_scale(), views.elevations());
    bool has_odometry = false;
    for (auto view = begin; view != end; ++view) {
      path.append_with_id(*view, views.packed(*view), views.info(*view));
      has_odometry = has_odometry || odometry.contains(views.info(*view).name);
    }
    if (path.size() >= min_positioned_views && !has_odometry && !are_in_order(path)) {
      unordered.insert(unordered.end(), begin, end);
    }
    begin = end;
  }
  return unordered;
}

/// Makes a map of the views in the order of their ids. `unordered`: views to which no step leads.
OrderedMap map_in_order(const MemoryFile& file, const VisualMemory& views,
                        const std::map<std::string, Pose2>& odometry,
                        std::span<const ViewId> unordered, const std::function<void()>& mapped) {
  const auto metric_steps = read_metric_steps(file);
  VisualMemory nodes(views.shape(), views.full_scale(), views.elevations());
  TopologicalMapper mapper(nodes);
  const std::vector<ViewId> path_starts = read_path_starts(file);
  auto next_start = path_starts.begin();
  std::optional<ViewId> before;
  std::optional<Pose2> last_odometry;  // of the last view that has one
  std::size_t views_since_odometry = 0;
  for (const ViewId view : views.views()) {
    const ReferenceInfo& info = views.info(view);
    const auto later_start = std::upper_bound(next_start, path_starts.end(), view);
    const bool begins_path = std::exchange(next_start, later_start) != later_start ||
                             std::ranges::binary_search(unordered, view);
    if (begins_path && before) {
      // Another path begins anywhere, and so does its odometry.
      mapper.begin_path();
      before.reset();
      last_odometry.reset();
      views_since_odometry = 0;
    }
    std::optional<Pose2> moved;
    std::size_t moved_views = 1;
    ++views_since_odometry;
    const auto here = odometry.find(info.name);
    if (last_odometry && here != odometry.end()) {
      moved = inverse(*last_odometry) * here->second;
      moved_views = views_since_odometry;
    } else if (before) {
      const auto known = metric_steps.find({*before, view});
      if (known != metric_steps.end()) moved = known->second;
    }
    if (here != odometry.end()) {
      last_odometry = here->second;
      views_since_odometry = 0;
    }
    nodes.append_with_id(view, views.packed(view), info);
    static_cast<void>(mapper.add(view, OdometryView(views.signature(view)), moved, moved_views));
    before = view;
    if (mapped) mapped();
  }
  mapper.finish();
  return {mapper.map(), mapper.is_metric(), 1.0};
}

void unlink_edges(MemoryFile& memory, const TopologicalMap& old_map,
                  const TopologicalMap& new_map) {
  std::set<std::pair<ViewId, ViewId>> kept;
  for (const TopologicalMap::Edge& edge : new_map.edges) kept.insert(std::minmax(edge.a, edge.b));
  for (const TopologicalMap::Edge& edge : old_map.edges) {
    if (!kept.contains(std::minmax(edge.a, edge.b))) memory.unlink(edge.a, edge.b);
  }
}

void store_poses(MemoryFile& memory, const TopologicalMap& map) {
  const auto poses = place_components_side_by_side(map);
  const std::vector<std::size_t> counts = count_nodes(map);
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    std::optional<ReferencePose> pose;
    if (counts[map.nodes[i].component] >= min_positioned_views) {
      pose = ReferencePose{poses[i].x_m, poses[i].y_m, poses[i].heading_rad};
    }
    memory.set_pose(map.nodes[i].view, pose);
  }
  for (const ViewId view : memory.views()) {
    if (!std::ranges::binary_search(map.nodes, view, {}, &TopologicalMap::Node::view)) {
      memory.set_pose(view, std::nullopt);
    }
  }
}

}  // namespace

const char* to_string(LengthUnit unit) noexcept {
  return unit == LengthUnit::metres ? "m" : "view steps";
}

LengthUnit read_length_unit(const MemoryFile& memory) {
  return read_stored_unit(memory).unit;
}

double read_assumed_unit_m(const MemoryFile& memory) {
  return read_stored_unit(memory).assumed_m;
}

std::optional<double> read_map_scale(const MemoryFile& memory) {
  const auto text = memory.parameter(scale_parameter);
  if (!text || text->empty()) return std::nullopt;
  double scale = 0.0;
  if (read_number(*text, scale) && std::isfinite(scale) && scale > 0.0) return scale;
  throw FileError(memory.path().string(), std::string("parameter ") + scale_parameter + " is '" +
                                              to_readable_line(*text) +
                                              "'; allowed: a number above 0");
}

void store_length_unit(MemoryFile& memory, LengthUnit unit, double assumed_unit_m,
                       std::optional<double> map_scale) {
  memory.set_parameter(unit_parameter, unit == LengthUnit::metres
                                           ? metres_text
                                           : view_steps_text + (" " + to_text(assumed_unit_m)));
  if (map_scale || memory.parameter(scale_parameter)) {
    memory.set_parameter(scale_parameter, map_scale ? to_text(*map_scale) : "");
  }
}

bool has_positions_from_map(const MemoryFile& memory) {
  const auto text = memory.parameter(unit_parameter);
  return text && !text->empty();
}

std::vector<Pose2> place_components_side_by_side(const TopologicalMap& map,
                                                 std::optional<double> gap) {
  std::vector<Pose2> poses;
  if (map.nodes.empty()) return poses;
  const std::vector<std::size_t> counts = count_nodes(map);
  std::vector<Box> boxes(counts.size());
  for (const TopologicalMap::Node& node : map.nodes) boxes[node.component].add(node.pose);
  std::vector<std::size_t> order(counts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t i) { return counts[i]; });
  const double default_gap = component_gap_steps * median_step_length(map).value_or(1.0);
  const auto offsets = compute_offsets(boxes, order, gap.value_or(default_gap));
  for (const TopologicalMap::Node& node : map.nodes) {
    const Point2 offset = offsets[node.component];
    poses.push_back(
        {node.pose.x_m + offset.x_m, node.pose.y_m + offset.y_m, node.pose.heading_rad});
  }
  return poses;
}

void scale_lengths(TopologicalMap& map, double factor) {
  const auto scale = [factor](Pose2& pose) {
    pose.x_m *= factor;
    pose.y_m *= factor;
  };
  for (TopologicalMap::Node& node : map.nodes) scale(node.pose);
  for (TopologicalMap::Edge& edge : map.edges) scale(edge.a_from_b);
}

std::optional<double> median_step_length(const TopologicalMap& map) {
  std::vector<double> lengths;
  for (const TopologicalMap::Edge& edge : map.edges) {
    const double edge_length = length(edge.a_from_b);
    if (edge.kind == Link::Kind::sequence && edge_length > 0.0) lengths.push_back(edge_length);
  }
  if (lengths.empty()) return std::nullopt;
  return upper_median_in_place(std::span(lengths));
}

std::optional<double> compute_view_step(const TopologicalMap& map) {
  if (const auto step = median_step_length(map)) return step;
  std::vector<Point2> points;
  std::vector<std::size_t> components;
  for (const TopologicalMap::Node& node : map.nodes) {
    points.push_back(node.pose.position());
    components.push_back(node.component);
  }
  std::vector<double> distances = distances_between_nearest_positions(points, components);
  if (distances.empty()) return std::nullopt;
  return upper_median_in_place(std::span(distances));
}

const char* describe_view_step(const TopologicalMap& map) noexcept {
  return std::ranges::any_of(
             map.edges,
             [](const TopologicalMap::Edge& edge) { return edge.kind == Link::Kind::sequence; })
             ? "median distance between consecutive views"
             : "median distance between a view and the nearest one";
}

std::optional<MemoryMap> describe_map(const MemoryFile& memory) {
  if (!has_positions_from_map(memory)) return std::nullopt;
  const auto map = memory.map(map_name);
  if (!map) return std::nullopt;
  MemoryMap description{map->nodes.size(), count_nodes(*map), read_length_unit(memory),
                        describe_view_step(*map)};
  std::erase(description.part_sizes, 0U);  // of forgotten views
  std::ranges::sort(description.part_sizes, std::greater{});
  return description;
}

void store_map(MemoryFile& memory, TopologicalMap map, LengthUnit unit, double assumed_unit_m) {
  const auto before = memory.map(map_name);
  const LengthUnit unit_before = read_length_unit(memory);
  auto unit_ratio =
      before && has_positions_from_map(memory) ? compare_lengths(*before, map) : std::nullopt;
  if (unit == LengthUnit::view_steps && unit_before == LengthUnit::metres && unit_ratio) {
    scale_lengths(map, 1.0 / *unit_ratio);
    unit = LengthUnit::metres;
    unit_ratio = 1.0;
  } else if (unit == LengthUnit::view_steps) {
    if (const auto step = median_step_length(map)) {
      scale_lengths(map, 1.0 / *step);
      assumed_unit_m *= *step;
    }
  }
  std::vector<Link> links;
  for (const TopologicalMap::Edge& edge : map.edges) links.push_back({edge.a, edge.b, edge.kind});
  memory.change([&] {
    if (before) unlink_edges(memory, *before, map);
    memory.link(links);
    memory.save_map(map_name, map);
    store_poses(memory, map);
    std::optional<double> map_scale;
    if (unit == LengthUnit::metres && unit_ratio) {
      const bool is_scaled = unit_before == LengthUnit::view_steps ||
                             std::abs(*unit_ratio - 1.0) > min_change_of_scale;
      map_scale = is_scaled ? scale_routes(memory, *unit_ratio) : read_map_scale(memory);
    }
    store_length_unit(memory, unit, assumed_unit_m, map_scale);
    learn_and_store_models(memory);
  });
}

void store_own_map_unit(MemoryFile& memory, LengthUnit unit) {
  memory.set_parameter(own_unit_parameter,
                       unit == LengthUnit::metres ? metres_text : view_steps_text);
}

LengthUnit read_map_unit(const MemoryFile& memory) {
  if (has_positions_from_map(memory)) return read_length_unit(memory);
  return memory.parameter(own_unit_parameter) == view_steps_text ? LengthUnit::view_steps
                                                                 : LengthUnit::metres;
}

void require_known_elevations(const PictureSource& source, const std::string& input) {
  if (!source.camera || !source.camera->has_assumed_elevations) return;
  throw FileError(input,
                  "has images of a mirror whose shape was assumed (elevations = \"assumed\" in the "
                  "camera file), so lengths from the ground would be wrong by an unknown factor; "
                  "state the shape of the mirror in panonav calibrate, or scale the map by a known "
                  "distance (panonav scale, the option 'distance')");
}

std::optional<MemoryMap> map_views(MemoryFile& memory, const std::map<std::string, Pose2>& odometry,
                                   Executor& executor, const std::function<void()>& mapped) {
  const MemoryFile::Counts counts = memory.counts();
  if (counts.views < 2 || memory.header().shape.components < 3 ||
      (!has_positions_from_map(memory) && counts.views_with_position > 0)) {
    return std::nullopt;
  }
  const VisualMemory views = memory.load();
  auto unordered = find_unordered_views(memory, views, odometry);
  const bool has_walk = unordered.size() < views.size();
  if (!has_walk) unordered.clear();
  // Steps between images in no order would be wrong: beside a walk, each joins it by itself.
  OrderedMap ordered = map_in_order(memory, views, odometry, unordered, mapped);
  if (!unordered.empty() || ordered.is_metric || are_in_order(views)) {
    join_small_components(ordered.map, views, min_positioned_views - 1);
  } else {
    const auto count_largest = [](const TopologicalMap& map) {
      return std::ranges::max(count_nodes(map));
    };
    TopologicalMap arranged = to_topological_map(arrange(views, {}, {}, executor));
    if (count_largest(arranged) > count_largest(ordered.map)) {
      ordered.map = std::move(arranged);
      ordered.assumed_unit_m = assumed_spacing_m;
    }
  }
  if (std::ranges::max(count_nodes(ordered.map)) < min_positioned_views) {
    remove_positions_from_map(memory);
    MemoryMap parts{views.size(), count_nodes(ordered.map), LengthUnit::view_steps,
                    describe_view_step(ordered.map)};
    std::ranges::sort(parts.part_sizes, std::greater{});
    return parts;
  }
  store_map(memory, std::move(ordered.map),
            ordered.is_metric ? LengthUnit::metres : LengthUnit::view_steps,
            ordered.assumed_unit_m);
  return describe_map(memory);
}

void remove_positions_from_map(MemoryFile& memory) {
  if (!has_positions_from_map(memory)) return;
  memory.change([&] {
    const auto map = memory.map(map_name);
    if (map) {
      unlink_edges(memory, *map, {});
      memory.remove_map(map_name);
    }
    for (const ViewId view : memory.views()) memory.set_pose(view, std::nullopt);
    memory.set_parameter(unit_parameter, "");
    if (memory.parameter(scale_parameter)) memory.set_parameter(scale_parameter, "");
  });
}

}  // namespace panonav
