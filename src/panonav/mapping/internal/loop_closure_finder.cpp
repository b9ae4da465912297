#include "panonav/mapping/internal/loop_closure_finder.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/signature/compass.hpp"

namespace panonav {

namespace {

/// Number of matches searched per candidate place, as the search finds several views of one place.
constexpr int views_per_candidate = 4;
/// Candidates that are closer along the path than this share of the shortest loop are one place.
constexpr double place_share_of_loop = 0.25;
/// Error of odometry over a metre or two, as a share of the path.
constexpr double local_drift = 0.1;

bool is_before(const LoopClosure& a, const LoopClosure& b) {
  return a.later < b.later;
}

double position_distance(const Pose2& a, const Pose2& b) {
  return distance(a.position(), b.position());
}

}  // namespace

void visit_options(LoopClosureOptions& options, OptionVisitor& visitor) {
  using T = LoopClosureOptions;
  constexpr OptionTable table{
      option<&T::candidates>("number of places that are tested for each view", 1, 1000),
      option<&T::min_loop_m>("shortest length of a loop, measured along the path", above(0), 1e6),
      option<&T::max_residual>(
          "largest share of the views' energy that a loop closure does not explain", 0, 1),
      option<&T::max_length>("largest distance between the views of a loop closure, in units of R "
                             "(the typical distance of objects)",
                             0, 2),
      option<&T::heading_tolerance_rad>("largest difference between the headings from the visual "
                                        "compass and from the home vectors in both directions",
                                        0, 3.2),
      option<&T::return_tolerance>("largest length of the sum of the two home vectors between two "
                                   "views, in units of R (the typical distance of objects)",
                                   0, 2),
      option<&T::distinctness>(
          "factor by which all other places must match the view worse than the candidate does", 1,
          1000),
      option<&T::reciprocal_rank>(
          "A search for the candidate must find the view among this number of best matches", 1,
          1000),
      option<&T::sequence>("number of successive views whose loop closures must agree", 1, 1000),
      option<&T::spacing_m>("shortest path between two reported loop closures", 0, 1e6),
  };
  table.visit(options, visitor);
}

LoopClosureFinder::LoopClosureFinder(const VisualMemory& memory, const LoopClosureOptions& options,
                                     const VisualOdometryOptions& odometry, ClosureScope scope)
    : memory_(&memory), options_(options), odometry_(odometry), scope_(scope) {
  validate(options);
  validate(odometry);
  odometry_.rule = VisualOdometryOptions::Rule::home_vector;  // the other gives no direction
  odometry_.max_residual = options.max_residual;
  odometry_.min_probability = 0.0;  // closures are checked by the way back and by sequences
}

std::vector<ViewId> LoopClosureFinder::find_excluded_views(std::span<const PathNode> nodes,
                                                           std::size_t node) const {
  std::vector<ViewId> views;
  if (scope_ == ClosureScope::other_components) {
    for (const PathNode& other : nodes) {
      if (other.component == nodes[node].component) views.push_back(other.view);
    }
    return views;
  }
  const double here_m = nodes[node].path_m;
  for (std::size_t i = node;; --i) {
    if (here_m - nodes[i].path_m > options_.min_loop_m) break;
    views.push_back(nodes[i].view);
    if (i == 0) break;
  }
  for (std::size_t i = node + 1; i < nodes.size(); ++i) {
    if (nodes[i].path_m - here_m > options_.min_loop_m) break;
    views.push_back(nodes[i].view);
  }
  return views;
}

std::optional<std::size_t> LoopClosureFinder::find_node(std::span<const PathNode> nodes,
                                                        ViewId view) const {
  const auto found = std::ranges::lower_bound(nodes, view, {}, &PathNode::view);
  if (found == nodes.end() || found->view != view) return std::nullopt;
  return static_cast<std::size_t>(found - nodes.begin());
}

std::optional<LoopClosure> LoopClosureFinder::verify_closure(std::size_t earlier, std::size_t later,
                                                             const OdometryView& earlier_view,
                                                             const OdometryView& later_view) const {
  const auto there = visual_step(earlier_view, later_view, odometry_);
  if (!there || there->length_in_views > options_.max_length) return std::nullopt;
  const auto back = visual_step(later_view, earlier_view, odometry_);
  if (!back) return std::nullopt;
  const Pose2 round_trip = there->before_from_after * back->before_from_after;
  if (std::hypot(round_trip.x_m, round_trip.y_m) > options_.return_tolerance * odometry_.scale_m ||
      std::abs(round_trip.heading_rad) > options_.heading_tolerance_rad) {
    return std::nullopt;
  }
  const auto reading = compass(later_view.signature, earlier_view.signature);
  if (!reading ||
      std::abs(angle_difference(reading->heading_rad, there->before_from_after.heading_rad)) >
          options_.heading_tolerance_rad) {
    return std::nullopt;
  }
  return LoopClosure{earlier, later, there->before_from_after, there->residual};
}

std::optional<LoopClosure> LoopClosureFinder::find_best_closure(
    std::span<const PathNode> nodes, std::span<const Pose2> poses, const OdometryView& view,
    const IsPossible& is_possible) const {
  const std::size_t here = nodes.size() - 1;
  const auto excluded = find_excluded_views(nodes, here);
  const auto found = memory_->search(memory_->packed(nodes[here].view),
                                     {.top = options_.candidates * views_per_candidate},
                                     {.excluded_views = excluded});
  std::vector<std::size_t> compared;
  std::vector<LoopClosure> closures;
  for (const Match& match : found.matches) {
    const auto candidate = find_node(nodes, match.view);
    if (!candidate || !are_on_one_floor(*memory_, match.view, nodes[here].view)) continue;
    // Only the first, most similar one of neighbours along the path is compared.
    const bool known = std::ranges::any_of(compared, [&](std::size_t i) {
      return std::abs(nodes[i].path_m - nodes[*candidate].path_m) <
             place_share_of_loop * options_.min_loop_m;
    });
    if (known) continue;
    if (static_cast<int>(compared.size()) == options_.candidates) break;
    compared.push_back(*candidate);
    const auto closure =
        verify_closure(*candidate, here, OdometryView(memory_->signature(match.view)), view);
    if (closure && is_possible(*closure)) closures.push_back(*closure);
  }
  if (closures.empty()) return std::nullopt;
  const LoopClosure& best = *std::ranges::min_element(closures, {}, &LoopClosure::residual);
  const Pose2 place = poses[best.earlier] * best.earlier_from_later;
  const bool ambiguous = std::ranges::any_of(closures, [&](const LoopClosure& other) {
    // Another passage through the same place does not make the closure ambiguous.
    return other.residual < options_.distinctness * best.residual &&
           position_distance(place, poses[other.earlier] * other.earlier_from_later) >
               options_.max_length * odometry_.scale_m;
  });
  if (ambiguous) return std::nullopt;
  return best;
}

bool LoopClosureFinder::is_reciprocal(std::span<const PathNode> nodes, std::span<const Pose2> poses,
                                      const LoopClosure& closure) const {
  const auto excluded = find_excluded_views(nodes, closure.earlier);
  const auto found =
      memory_->search(memory_->packed(nodes[closure.earlier].view),
                      {.top = options_.reciprocal_rank}, {.excluded_views = excluded});
  return std::ranges::any_of(found.matches, [&](const Match& match) {
    const auto node = find_node(nodes, match.view);
    if (!node) return false;
    return nodes[closure.later].path_m - nodes[*node].path_m < options_.min_loop_m ||
           (nodes[*node].component == nodes[closure.earlier].component &&
            position_distance(poses[*node], poses[closure.earlier]) <
                options_.max_length * odometry_.scale_m);
  });
}

bool LoopClosureFinder::agree(const LoopClosure& a, const LoopClosure& b,
                              std::span<const Pose2> poses) const {
  // The motion from a's later node to b's: along the path, and through the earlier passage.
  const Pose2 along = inverse(poses[a.later]) * poses[b.later];
  const Pose2 across = inverse(a.earlier_from_later) *
                       (inverse(poses[a.earlier]) * poses[b.earlier]) * b.earlier_from_later;
  const Pose2 difference = inverse(along) * across;
  // Residuals shorten the displacement between views.
  const double allowed_m =
      (options_.return_tolerance + a.residual + b.residual) * odometry_.scale_m +
      local_drift * std::hypot(along.x_m, along.y_m);
  return std::hypot(difference.x_m, difference.y_m) < allowed_m &&
         std::abs(difference.heading_rad) < options_.heading_tolerance_rad;
}

std::vector<LoopClosure> LoopClosureFinder::find(std::span<const PathNode> nodes,
                                                 std::span<const Pose2> poses,
                                                 const OdometryView& view, double scale_m,
                                                 const IsPossible& is_possible) {
  require(nodes.size() == poses.size() && !nodes.empty(), "poses",
          static_cast<double>(poses.size()), "as many as nodes, and at least one");
  odometry_.scale_m = scale_m;
  const std::size_t here = nodes.size() - 1;
  const auto reach = static_cast<std::size_t>(options_.sequence - 1);
  while (!pending_.empty() && here - pending_.front().later > 2 * reach) pending_.pop_front();
  const auto found = find_best_closure(nodes, poses, view, is_possible);
  if (found && is_reciprocal(nodes, poses, *found)) pending_.push_back(*found);
  if (here < reach) return {};
  const auto closure = decide(nodes, poses, here - reach);
  if (!closure) return {};
  return {*closure};
}

std::vector<LoopClosure> LoopClosureFinder::finish(std::span<const PathNode> nodes,
                                                   std::span<const Pose2> poses) {
  std::vector<LoopClosure> closures;
  const auto undecided = static_cast<std::size_t>(options_.sequence - 1);
  for (std::size_t i = nodes.size() - std::min(undecided, nodes.size()); i < nodes.size(); ++i) {
    if (const auto closure = decide(nodes, poses, i)) closures.push_back(*closure);
  }
  return closures;
}

std::optional<LoopClosure> LoopClosureFinder::decide(std::span<const PathNode> nodes,
                                                     std::span<const Pose2> poses,
                                                     std::size_t node) {
  const auto closure = std::ranges::find(pending_, node, &LoopClosure::later);
  if (closure == pending_.end()) return std::nullopt;
  // The displacement between views is the more certain the smaller it is, so a passage through a
  // known place is closed where the views explain each other best. Matches of other components are
  // checked by their number.
  int agreeing = 0;
  for (const LoopClosure& other : pending_) {
    if (!agree(std::min(other, *closure, is_before), std::max(other, *closure, is_before), poses))
      continue;
    if (scope_ == ClosureScope::everywhere && other.residual < closure->residual)
      return std::nullopt;
    ++agreeing;
  }
  const double closed_m = nodes[node].path_m;
  if (agreeing < options_.sequence || closed_m - last_closure_path_m_ < options_.spacing_m) {
    return std::nullopt;
  }
  last_closure_path_m_ = closed_m;
  return *closure;
}

}  // namespace panonav
