#include "panonav/mapping/component_joining.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/internal/loop_closure_finder.hpp"
#include "panonav/mapping/internal/visual_scale.hpp"
#include "panonav/memory/floors.hpp"

namespace panonav {

namespace {

/// Number of views of other components with which a view is compared (chosen).
constexpr int max_compared_views = 10;
/// Smallest ratio of agreeing closures between the best relative pose and any other: that of
/// `SessionAlignmentOptions`.
constexpr std::size_t min_distinctness = 2;
/// Conditions of a closure, for views in no order, which are farther apart than those of a drive:
/// twice the length, and the residual below which at most 2 % of the pairs of views from two
/// buildings are (`VisualOdometry`). Chosen on walks in built-in scenes and 20 random views of
/// each: with 0.15, 5 to 17 views joined the walk in their scene and none joined another; with 0.2,
/// up to 3 did.
constexpr LoopClosureOptions closure_options{
    .max_residual = 0.15, .max_length = 0.6, .return_tolerance = 0.2};

/// Joins components by the closures between their views.
class Joiner {
 public:
  Joiner(TopologicalMap& map, const VisualMemory& memory, std::size_t max_views,
         const VisualOdometryOptions& odometry)
      : map_(map),
        memory_(memory),
        max_views_(max_views),
        finder_(memory, closure_options, odometry) {
    for (const TopologicalMap::Node& node : map.nodes) poses_.push_back(node.pose);
  }

  void find_closures() {
    const std::vector<std::size_t> counts = count_nodes(map_);
    for (std::size_t i = 0; i < map_.nodes.size(); ++i) {
      if (counts[map_.nodes[i].component] <= max_views_) compare_with_other_components(i);
    }
  }

  /// Joins the two components with the most agreeing closures; false if none can be joined.
  bool join_best() {
    std::map<std::pair<std::size_t, std::size_t>, std::vector<LoopClosure>> between;
    for (const LoopClosure& closure : closures_) {
      const std::size_t a = map_.nodes[closure.earlier].component;
      const std::size_t b = map_.nodes[closure.later].component;
      if (a != b) between[std::minmax(a, b)].push_back(closure);
    }
    const std::vector<std::size_t> counts = count_nodes(map_);
    std::vector<LoopClosure> best;
    for (const auto& [components, closures] : between) {
      if (std::min(counts[components.first], counts[components.second]) > max_views_) continue;
      auto agreeing = find_agreeing(closures);
      if (agreeing.size() > best.size()) best = std::move(agreeing);
    }
    if (best.empty()) return false;
    join(best);
    return true;
  }

  void store() {
    for (std::size_t i = 0; i < map_.nodes.size(); ++i) map_.nodes[i].pose = poses_[i];
    renumber_components(map_);
  }

 private:
  void compare_with_other_components(std::size_t node) {
    std::vector<ViewId> excluded;
    for (const TopologicalMap::Node& other : map_.nodes) {
      if (other.component == map_.nodes[node].component) excluded.push_back(other.view);
    }
    const auto found = memory_.search(memory_.packed(map_.nodes[node].view),
                                      {.top = max_compared_views}, {.excluded_views = excluded});
    const OdometryView here(memory_.signature(map_.nodes[node].view));
    for (const Match& match : found.matches) {
      const auto other =
          std::ranges::lower_bound(map_.nodes, match.view, {}, &TopologicalMap::Node::view);
      if (other == map_.nodes.end() || other->view != match.view ||
          !are_on_one_floor(memory_, match.view, map_.nodes[node].view)) {
        continue;
      }
      const auto closure =
          finder_.verify_closure(static_cast<std::size_t>(other - map_.nodes.begin()), node,
                                 OdometryView(memory_.signature(match.view)), here);
      if (closure) closures_.push_back(*closure);
    }
  }

  /// Returns the largest set of closures that agree with one of them; empty if there are too few,
  /// or too many that agree on another relative pose.
  [[nodiscard]] std::vector<LoopClosure> find_agreeing(
      std::span<const LoopClosure> closures) const {
    const auto find_largest = [&](std::span<const LoopClosure> among) {
      std::vector<LoopClosure> largest;
      for (const LoopClosure& one : among) {
        std::vector<LoopClosure> agreeing;
        for (const LoopClosure& other : among) {
          if (finder_.agree(one, other, poses_)) agreeing.push_back(other);
        }
        if (agreeing.size() > largest.size()) largest = std::move(agreeing);
      }
      return largest;
    };
    std::vector<LoopClosure> best = find_largest(closures);
    if (best.size() < static_cast<std::size_t>(closure_options.sequence)) return {};
    std::vector<LoopClosure> others;
    for (const LoopClosure& closure : closures) {
      if (std::ranges::find(best, closure) == best.end()) others.push_back(closure);
    }
    if (min_distinctness * find_largest(others).size() > best.size()) return {};
    return best;
  }

  /// Moves the smaller component by the mean of the relative poses of agreeing closures, weighted
  /// by what they explain of the views, and adds the closures as edges.
  void join(std::span<const LoopClosure> closures) {
    const std::vector<std::size_t> counts = count_nodes(map_);
    std::size_t kept = map_.nodes[closures.front().earlier].component;
    std::size_t moved = map_.nodes[closures.front().later].component;
    if (std::pair(counts[kept], moved) < std::pair(counts[moved], kept)) std::swap(kept, moved);
    Point2 centre;
    std::vector<LoopClosure> oriented;  // `earlier` in the kept component
    for (LoopClosure closure : closures) {
      if (map_.nodes[closure.earlier].component != kept) {
        std::swap(closure.earlier, closure.later);
        closure.earlier_from_later = inverse(closure.earlier_from_later);
      }
      const Point2 here = poses_[closure.later].position();
      centre.x_m += here.x_m / static_cast<double>(closures.size());
      centre.y_m += here.y_m / static_cast<double>(closures.size());
      oriented.push_back(closure);
    }
    const Pose2 pivot{centre.x_m, centre.y_m, 0.0};
    Pose2 mean;
    double sine = 0.0;
    double cosine = 0.0;
    double weights = 0.0;
    for (const LoopClosure& closure : oriented) {
      const Pose2 frame = poses_[closure.earlier] * closure.earlier_from_later *
                          inverse(poses_[closure.later]) * pivot;
      const double weight = 1.0 - closure.residual;
      mean.x_m += weight * frame.x_m;
      mean.y_m += weight * frame.y_m;
      sine += weight * std::sin(frame.heading_rad);
      cosine += weight * std::cos(frame.heading_rad);
      weights += weight;
      map_.edges.push_back({map_.nodes[closure.earlier].view, map_.nodes[closure.later].view,
                            closure.earlier_from_later, Link::Kind::closure, 1.0});
    }
    mean = {mean.x_m / weights, mean.y_m / weights, std::atan2(sine, cosine)};
    const Pose2 kept_from_moved = mean * inverse(pivot);
    for (std::size_t i = 0; i < map_.nodes.size(); ++i) {
      if (map_.nodes[i].component != moved) continue;
      map_.nodes[i].component = kept;
      poses_[i] = kept_from_moved * poses_[i];
    }
  }

  TopologicalMap& map_;
  const VisualMemory& memory_;
  std::size_t max_views_;
  LoopClosureFinder finder_;
  std::vector<Pose2> poses_;
  std::vector<LoopClosure> closures_;
};

}  // namespace

std::size_t join_small_components(TopologicalMap& map, const VisualMemory& memory,
                                  std::size_t max_views) {
  validate(map);
  const std::size_t before = count_components(map);
  const std::vector<std::size_t> counts = count_nodes(map);
  if (before < 2 || std::ranges::min(counts) > max_views) return 0;
  VisualOdometryOptions odometry;
  odometry.scale_m = estimate_visual_scale_m(memory, map).value_or(odometry.scale_m);
  Joiner joiner(map, memory, max_views, odometry);
  joiner.find_closures();
  while (joiner.join_best()) continue;
  joiner.store();
  return before - count_components(map);
}

}  // namespace panonav
