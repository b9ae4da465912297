#include "panonav/mapping/session_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/internal/loop_closure_finder.hpp"
#include "panonav/mapping/internal/visual_scale.hpp"

namespace panonav {

namespace {

/// Standard deviation of a match in metres and radians: the default of `PoseEdge`.
constexpr double match_position_deviation_m = 0.1;
constexpr double match_heading_deviation_rad = 0.05;
/// Standard deviations of the motion between two nodes of an optimised map: position and heading
/// per metre (m/m, rad/m), and both at length 0 (m, rad). The first two are a quarter and a
/// half of those of a single step (`MappingOptions`), as steps and closures around have corrected
/// it.
constexpr double edge_position_deviation_per_m = 0.02;
constexpr double edge_heading_deviation_rad_per_m = 0.01;
constexpr double min_edge_position_deviation_m = 0.005;
constexpr double min_edge_heading_deviation_rad = 0.003;

double translation_m(const Pose2& motion) {
  return std::hypot(motion.x_m, motion.y_m);
}

std::vector<PathNode> make_path_nodes(const TopologicalMap& map, std::size_t component) {
  std::vector<PathNode> nodes;
  double path_m = 0.0;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    if (i > 0) path_m += distance(map.nodes[i - 1].pose.position(), map.nodes[i].pose.position());
    nodes.push_back({map.nodes[i].view, path_m, component});
  }
  return nodes;
}

std::vector<LoopClosure> find_matches(const VisualMemory& memory, const TopologicalMap& first,
                                      const TopologicalMap& second,
                                      const LoopClosureOptions& closure, double scale_m) {
  // The finder gets the views of the second session one by one, as from a driving robot.
  VisualMemory views(memory.shape(), memory.full_scale(), memory.elevations());
  std::vector<PathNode> nodes = make_path_nodes(first, 0);
  const std::vector<PathNode> others = make_path_nodes(second, 1);
  std::vector<Pose2> poses;
  const auto append = [&](ViewId view) {
    return views.append(memory.packed(view), memory.info(view));
  };
  for (std::size_t i = 0; i < first.nodes.size(); ++i) {
    nodes[i].view = append(first.nodes[i].view);
    poses.push_back(first.nodes[i].pose);
  }
  LoopClosureFinder finder(views, closure, {}, ClosureScope::other_components);
  std::vector<LoopClosure> matches;
  std::vector<std::size_t> number;  // index in `second` of each appended node
  for (std::size_t i = 0; i < second.nodes.size(); ++i) {
    const ViewId view = second.nodes[i].view;
    const auto same = std::ranges::lower_bound(first.nodes, view, {}, &TopologicalMap::Node::view);
    if (same != first.nodes.end() && same->view == view) {
      matches.push_back({static_cast<std::size_t>(same - first.nodes.begin()), i, {}, 0.0});
      continue;
    }
    nodes.push_back(others[i]);
    nodes.back().view = append(view);
    poses.push_back(second.nodes[i].pose);
    number.push_back(i);
    for (LoopClosure found : finder.find(nodes, poses, OdometryView(memory.signature(view)),
                                         scale_m, [](const LoopClosure&) { return true; })) {
      if (found.earlier >= first.nodes.size()) continue;
      found.later = number[found.later - first.nodes.size()];
      matches.push_back(found);
    }
  }
  return matches;
}

/// The matches of two sessions, each with the relative pose of the maps that it proposes.
class Matches {
 public:
  Matches(const TopologicalMap& first, const TopologicalMap& second,
          const SessionAlignmentOptions& options, const LoopClosureOptions& closure, double scale_m,
          std::vector<LoopClosure> matches)
      : first_(&first),
        second_(&second),
        options_(options),
        spacing_m_(closure.spacing_m),
        tolerance_m_(closure.max_length * scale_m),
        tolerance_rad_(2.0 * closure.heading_tolerance_rad),
        path_(make_path_nodes(second, 0)),
        matches_(std::move(matches)) {
    for (const LoopClosure& match : matches_) {
      frames_.push_back(first.nodes[match.earlier].pose * match.earlier_from_later *
                        inverse(second.nodes[match.later].pose));
    }
  }

  using Set = std::vector<std::size_t>;  // numbers of matches, ascending
  struct Hypothesis {
    int places = 0;
    Set matches;
  };

  [[nodiscard]] Set all() const {
    Set numbers(matches_.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
    return numbers;
  }
  [[nodiscard]] const LoopClosure& operator[](std::size_t i) const { return matches_[i]; }

  /// Returns the largest set of matches that agree on one relative pose, and its number of places.
  [[nodiscard]] Hypothesis find_largest_consensus(const Set& among) const {
    Hypothesis best;
    for (const std::size_t i : among) {
      Set agreeing;
      for (const std::size_t j : among) {
        if (agree(i, j) && agree(j, i)) agreeing.push_back(j);
      }
      const int places = count_places(agreeing);
      if (places > best.places) best = {places, std::move(agreeing)};
    }
    return best;
  }

  /// Counts the places in the overlap of the maps, and those of them near a match. As maps drift,
  /// each place is transformed by the relative pose of its nearest match along the path.
  void count_confirmed_places(const Set& set, SessionAlignment& alignment) const {
    std::optional<double> last_m;
    for (std::size_t i = 0; i < path_.size(); ++i) {
      const double here_m = path_[i].path_m;
      if (last_m && here_m - *last_m < spacing_m_) continue;
      const auto off_m = [&](std::size_t match) {
        return std::abs(path_[matches_[match].later].path_m - here_m);
      };
      const std::size_t nearest = *std::ranges::min_element(set, {}, off_m);
      const Point2 place = (frames_[nearest] * second_->nodes[i].pose).position();
      const bool is_overlapping =
          std::ranges::any_of(first_->nodes, [&](const TopologicalMap::Node& node) {
            return distance(node.pose.position(), place) < 0.5 * tolerance_m_;
          });
      if (!is_overlapping) continue;
      last_m = here_m;
      ++alignment.expected_places;
      if (off_m(nearest) <= 2.0 * spacing_m_) ++alignment.confirmed_places;
    }
  }

  /// Returns the relative pose of the match with the least sum of distances to all others (medoid).
  [[nodiscard]] Pose2 medoid_frame(const Set& set) const {
    const auto total_gap_m = [&](std::size_t i) {
      double sum = 0.0;
      for (const std::size_t j : set) sum += gap_m(i, j);
      return sum;
    };
    return frames_[*std::ranges::min_element(set, {}, total_gap_m)];
  }

 private:
  /// Returns the distance between the positions of match j by the relative poses of i and of j.
  [[nodiscard]] double gap_m(std::size_t i, std::size_t j) const {
    const Pose2& there = second_->nodes[matches_[j].later].pose;
    return distance((frames_[i] * there).position(), (frames_[j] * there).position());
  }
  [[nodiscard]] bool agree(std::size_t i, std::size_t j) const {
    const double apart_m = distance(first_->nodes[matches_[i].earlier].pose.position(),
                                    first_->nodes[matches_[j].earlier].pose.position());
    return gap_m(i, j) < tolerance_m_ + options_.max_drift * apart_m &&
           std::abs(angle_difference(frames_[i].heading_rad, frames_[j].heading_rad)) <
               tolerance_rad_;
  }
  /// Counts matched places; matches within `spacing_m` along the path are one place.
  [[nodiscard]] int count_places(const Set& set) const {
    int count = 0;
    double last_m = 0.0;
    for (const std::size_t i : set) {
      const double here_m = path_[matches_[i].later].path_m;
      if (count > 0 && here_m - last_m < spacing_m_) continue;
      ++count;
      last_m = here_m;
    }
    return count;
  }

  const TopologicalMap* first_;
  const TopologicalMap* second_;
  SessionAlignmentOptions options_;
  double spacing_m_, tolerance_m_, tolerance_rad_;
  std::vector<PathNode> path_;
  std::vector<LoopClosure> matches_;
  std::vector<Pose2> frames_;
};

}  // namespace

void visit_options(SessionAlignmentOptions& options, OptionVisitor& visitor) {
  using T = SessionAlignmentOptions;
  constexpr OptionTable table{
      option<&T::min_places>("number of common places that must agree before two maps are joined",
                             1, 1000000),
      option<&T::min_confirmed>(
          "smallest share of places that must match where the two maps overlap", 0, 1),
      option<&T::distinctness>("smallest ratio of the number of agreeing places of the best "
                               "alignment to that of the second best alignment",
                               1, 1e6),
      option<&T::max_drift>("assumed drift of each map per metre between two places", 0, 100),
  };
  table.visit(options, visitor);
}

std::optional<SessionAlignment> align_sessions(const VisualMemory& memory,
                                               const TopologicalMap& first,
                                               const TopologicalMap& second,
                                               const SessionAlignmentOptions& options) {
  validate(options);
  validate(first);
  validate(second);
  // Single matches need not be as certain as closures of one drive, since many must agree.
  const LoopClosureOptions closure{.max_residual = 0.2};
  const double scale_m =
      std::max(estimate_visual_scale_m(memory, first).value_or(VisualOdometryOptions{}.scale_m),
               estimate_visual_scale_m(memory, second).value_or(0.0));
  const Matches matches(first, second, options, closure, scale_m,
                        find_matches(memory, first, second, closure, scale_m));
  const Matches::Hypothesis best = matches.find_largest_consensus(matches.all());
  if (best.places < options.min_places) return std::nullopt;
  Matches::Set others;
  std::ranges::set_difference(matches.all(), best.matches, std::back_inserter(others));
  SessionAlignment alignment;
  alignment.places = best.places;
  alignment.other_places = matches.find_largest_consensus(others).places;
  alignment.refuted = others.size();
  if (alignment.other_places * options.distinctness > best.places) return std::nullopt;
  matches.count_confirmed_places(best.matches, alignment);
  if (alignment.confirmed_places < options.min_confirmed * alignment.expected_places) {
    return std::nullopt;
  }
  for (const std::size_t i : best.matches) alignment.matches.push_back(matches[i]);
  alignment.first_from_second = matches.medoid_frame(best.matches);
  return alignment;
}

TopologicalMap join_sessions(const TopologicalMap& first, const TopologicalMap& second,
                             const SessionAlignment& alignment, const PoseGraphOptions& graph) {
  std::map<ViewId, Pose2> poses;
  for (const TopologicalMap::Node& node : first.nodes) poses.emplace(node.view, node.pose);
  for (const TopologicalMap::Node& node : second.nodes) {
    poses.emplace(node.view, alignment.first_from_second * node.pose);
  }
  TopologicalMap joined;
  for (const auto& [view, pose] : poses) joined.nodes.push_back({view, pose, 0});
  const auto number = [&](ViewId view) {
    return static_cast<std::size_t>(
        std::ranges::lower_bound(joined.nodes, view, {}, &TopologicalMap::Node::view) -
        joined.nodes.begin());
  };
  std::vector<PoseEdge> edges;
  const auto add_edges = [&](const TopologicalMap& map) {
    const auto pose_of = [&](ViewId view) {
      return std::ranges::lower_bound(map.nodes, view, {}, &TopologicalMap::Node::view)->pose;
    };
    for (const TopologicalMap::Edge& edge : map.edges) {
      const Pose2 motion = inverse(pose_of(edge.a)) * pose_of(edge.b);
      edges.push_back(
          {number(edge.a), number(edge.b), motion,
           edge_position_deviation_per_m * translation_m(motion) + min_edge_position_deviation_m,
           edge_heading_deviation_rad_per_m * translation_m(motion) +
               min_edge_heading_deviation_rad});
      joined.edges.push_back(edge);
    }
  };
  add_edges(first);
  add_edges(second);
  for (const LoopClosure& match : alignment.matches) {
    const ViewId a = first.nodes[match.earlier].view;
    const ViewId b = second.nodes[match.later].view;
    if (a == b) continue;
    edges.push_back({number(a), number(b), match.earlier_from_later, match_position_deviation_m,
                     match_heading_deviation_rad, true});
    joined.edges.push_back({a, b, match.earlier_from_later, Link::Kind::closure, 1.0});
  }
  std::vector<Pose2> found;
  for (const TopologicalMap::Node& node : joined.nodes) found.push_back(node.pose);
  const PoseGraphReport report = optimise_pose_graph(found, edges, graph);
  for (std::size_t i = 0; i < found.size(); ++i) joined.nodes[i].pose = found[i];
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (edges[i].doubtful) joined.edges[i].weight = report.edge_weights[i];
  }
  const std::vector<std::size_t> components = connected_components(found.size(), edges);
  for (std::size_t i = 0; i < found.size(); ++i) joined.nodes[i].component = components[i];
  return joined;
}

}  // namespace panonav
