#include "panonav/pipeline/map_scale.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/mapping/ground_lengths.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/pipeline/arrangement.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/learnt_route.hpp"
#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/route/route_panorama.hpp"

namespace panonav {

namespace {

/// Number of pairs of views whose ground is compared; more hardly change the median (chosen).
constexpr std::size_t max_compared_pairs = 300;
/// Smallest number of pairs that show the ground (chosen).
constexpr std::size_t min_measured_pairs = 8;
/// Largest relative standard deviation of the scale (chosen).
constexpr double max_scale_deviation = 0.1;

/// Two neighbouring views of a map and their distance in its unit.
struct MapPair {
  ViewId a;
  ViewId b;
  double distance = 0.0;
};

const TopologicalMap::Node* find_node(const TopologicalMap& map, ViewId view) {
  const auto found = std::ranges::lower_bound(map.nodes, view, {}, &TopologicalMap::Node::view);
  return found == map.nodes.end() || found->view != view ? nullptr : &*found;
}

/// Returns the distance of two views in a map; nullopt if they have no common frame or place.
std::optional<double> find_distance(const TopologicalMap& map, ViewId a, ViewId b) {
  const auto* const from = find_node(map, a);
  const auto* const to = find_node(map, b);
  if (from == nullptr || to == nullptr || from->component != to->component) return std::nullopt;
  const double apart = distance(from->pose.position(), to->pose.position());
  return apart > 0.0 ? std::optional(apart) : std::nullopt;
}

/// Returns the pairs of views joined by edges that the rest of the map does not contradict; of many
/// only every n-th.
std::vector<MapPair> select_pairs(const TopologicalMap& map) {
  std::vector<MapPair> pairs;
  for (const TopologicalMap::Edge& edge : map.edges) {
    const auto apart = find_distance(map, edge.a, edge.b);
    if (apart && edge.weight >= min_spring_weight) pairs.push_back({edge.a, edge.b, *apart});
  }
  const std::size_t every = (pairs.size() + max_compared_pairs - 1) / max_compared_pairs;
  std::vector<MapPair> selected;
  for (std::size_t i = 0; i < pairs.size(); i += every) selected.push_back(pairs[i]);
  return selected;
}

/// Returns the relative standard deviation of the median of ratios, from their median deviation.
double compute_median_deviation(const std::vector<double>& ratios, double middle) {
  // Factors of the normal distribution: of the standard deviation by the median deviation, and of
  // the deviation of a median by that of its values.
  constexpr double deviation_per_median_deviation = 1.4826;
  constexpr double median_per_value = 1.2533;
  std::vector<double> off;
  for (const double ratio : ratios) off.push_back(std::abs(ratio / middle - 1.0));
  return median_per_value * deviation_per_median_deviation * median(off) /
         std::sqrt(static_cast<double>(ratios.size()));
}

/// Returns the factor of a route's lengths in a scaling of the map by `factor` to `new_scale`
/// metres for each assumed metre; nullopt if the route stays as it is.
std::optional<double> choose_route_factor(const RouteSource& source, bool is_map_metric,
                                          double factor, std::optional<double> new_scale) {
  if (source.assumed_unit_m) {
    if (is_map_metric) return std::nullopt;
    return new_scale.value() * *source.assumed_unit_m;
  }
  if (!source.is_in_map_unit) return std::nullopt;
  if (source.map_scale && new_scale) return *new_scale / *source.map_scale;
  return is_map_metric ? std::optional(factor) : std::nullopt;
}

void require_positions_from_map(const MemoryFile& memory) {
  if (has_positions_from_map(memory)) return;
  throw ContractError(memory.path().string() +
                      ": the positions come from a data set and are in metres; only a map of "
                      "images is scaled");
}

}  // namespace

std::optional<double> compare_lengths(const TopologicalMap& known, const TopologicalMap& map) {
  constexpr std::size_t min_pairs = 3;
  std::vector<double> ratios;
  for (const TopologicalMap::Edge& edge : known.edges) {
    const auto before = find_distance(known, edge.a, edge.b);
    const auto after = find_distance(map, edge.a, edge.b);
    if (before && after) ratios.push_back(*after / *before);
  }
  if (ratios.size() < min_pairs) return std::nullopt;
  return median(ratios);
}

GroundScale measure_ground_scale(const MemoryFile& memory, double camera_height_m,
                                 const std::function<void(std::size_t)>& compared) {
  require_known_elevations(memory.header().source, memory.path().string());
  if (!memory.header().elevations) {
    throw FileError(memory.path().string(),
                    "has images whose rows have unknown elevations, so the ground cannot be found; "
                    "scale the map by a known distance (panonav scale, the option 'distance')");
  }
  require_positions_from_map(memory);
  GroundLengths ground(camera_height_m);
  const VisualMemory views = memory.load();
  const auto pairs = select_pairs(memory.map(map_name).value_or(TopologicalMap{}));
  GroundScale scale{.tried = pairs.size()};
  std::vector<double> ratios;
  for (const MapPair& pair : pairs) {
    if (compared) compared(pairs.size());
    const OdometryView before(views.signature(pair.a));
    const OdometryView after(views.signature(pair.b));
    auto step = visual_step(before, after);
    if (!step) continue;
    const std::size_t measured_before = ground.measured_steps();
    static_cast<void>(ground.correct_step(before.coefficients, after.coefficients, *step));
    if (ground.measured_steps() == measured_before) continue;
    ratios.push_back(std::hypot(step->before_from_after.x_m, step->before_from_after.y_m) /
                     pair.distance);
  }
  scale.measured = ratios.size();
  if (ratios.empty()) return scale;
  const double unit_m = median(ratios);
  scale.deviation = compute_median_deviation(ratios, unit_m);
  if (ratios.size() >= min_measured_pairs && scale.deviation <= max_scale_deviation) {
    scale.unit_m = unit_m;
  }
  return scale;
}

std::optional<double> scale_routes(MemoryFile& memory, double factor) {
  // Scales are metres for each assumed metre.
  const bool is_map_metric = read_length_unit(memory) == LengthUnit::metres;
  const auto former_scale =
      is_map_metric ? read_map_scale(memory) : std::optional(1.0 / read_assumed_unit_m(memory));
  const auto new_scale = former_scale ? std::optional(factor * *former_scale) : std::nullopt;
  for (const std::string& name : memory.route_names()) {
    // Chains are in metres of odometry.
    if (memory.route_method(name) == RouteMethod::chain) continue;
    const RoutePanorama route = memory.route(name).value();
    RouteSource source = read_route_source(memory, name, route.columns());
    const auto own_factor = choose_route_factor(source, is_map_metric, factor, new_scale);
    if (!own_factor) continue;
    source.assumed_unit_m.reset();
    source.is_in_map_unit = true;
    source.map_scale = new_scale;
    RoutePanorama scaled(route.columns());
    for (std::size_t i = 0; i < route.size(); ++i) {
      Pose2 pose = route.poses()[i];
      pose.x_m *= *own_factor;
      pose.y_m *= *own_factor;
      static_cast<void>(scaled.append(pose, route.line(i)));
    }
    memory.remove_route(name);
    static_cast<void>(memory.append_route(name, scaled));
    store_route_source(memory, name, source);
    learn_and_store_route(memory, name);
  }
  return new_scale;
}

void scale_to_metres(MemoryFile& memory, double unit_m, const std::string& undo) {
  require(std::isfinite(unit_m) && unit_m > 0.0, "unit_m", unit_m, "> 0");
  require_positions_from_map(memory);
  const VisualMemory views = memory.load();
  TopologicalMap map = memory.map(map_name).value_or(TopologicalMap{});
  scale_lengths(map, unit_m);
  memory.change(
      [&] {
        memory.save_map(map_name, map);
        for (const ViewId view : views.views()) {
          auto pose = views.info(view).pose;
          if (!pose) continue;
          pose->x_m *= unit_m;
          pose->y_m *= unit_m;
          memory.set_pose(view, pose);
        }
        const auto map_scale = scale_routes(memory, unit_m);
        store_length_unit(memory, LengthUnit::metres, 1.0, map_scale);
        learn_and_store_models(memory);
      },
      undo);
}

double scale_to_metres(MemoryFile& memory, ViewId a, ViewId b, double distance_m,
                       const std::string& undo) {
  require(std::isfinite(distance_m) && distance_m > 0.0, "distance_m", distance_m, "> 0");
  require_positions_from_map(memory);
  const VisualMemory views = memory.load();
  const TopologicalMap map = memory.map(map_name).value_or(TopologicalMap{});
  for (const ViewId view : {a, b}) {
    if (find_node(map, view) == nullptr) {
      throw ContractError("view", static_cast<double>(view.value), "a view of the map");
    }
  }
  if (find_node(map, a)->component != find_node(map, b)->component) {
    throw ContractError(views.info(a).name + " and " + views.info(b).name +
                        " are in parts of the map that are not connected, so their distance is "
                        "not known; choose two views of one part");
  }
  // A shorter distance is mostly the error of a single step. (chosen)
  constexpr double min_distance_steps = 3.0;
  const double known = find_distance(map, a, b).value_or(0.0);
  const double step = compute_view_step(map).value_or(0.0);
  if (!(known > 0.0) || known < min_distance_steps * step) {
    const std::string unit = std::string(" ") + to_string(read_length_unit(memory));
    throw ContractError(views.info(a).name + " and " + views.info(b).name + " are " +
                        format_number(known, {}, 2) + unit +
                        " apart in the map; choose two views that are far apart, at least " +
                        format_number(min_distance_steps * step, {}, 2) + unit + ", 3 times the " +
                        describe_view_step(map));
  }
  const double unit_m = distance_m / known;
  scale_to_metres(memory, unit_m, undo);
  return unit_m;
}

}  // namespace panonav
