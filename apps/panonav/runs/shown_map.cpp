#include "runs/shown_map.hpp"

#include <algorithm>

#include "panonav/pipeline/mapper.hpp"

namespace panonav::command {

void add_component(recordings::RunMoment& moment, const TopologicalMap& map, std::size_t component,
                   const std::vector<std::string>& names) {
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    const TopologicalMap::Node& node = map.nodes[i];
    if (node.component != component) continue;
    moment.references.push_back(node.pose.position());
    moment.reference_views.push_back({names[i], node.pose.heading_rad});
  }
  const auto node_of = [&](ViewId view) -> const TopologicalMap::Node& {
    return *std::ranges::lower_bound(map.nodes, view, {}, &TopologicalMap::Node::view);
  };
  for (const TopologicalMap::Edge& edge : map.edges) {
    const TopologicalMap::Node& a = node_of(edge.a);
    if (a.component != component) continue;
    moment.edges.push_back({a.pose.position(), node_of(edge.b).pose.position(), edge.kind});
  }
}

TopologicalMap to_shown_lengths(TopologicalMap map, LengthUnit unit) {
  const auto step = median_step_length(map);
  if (unit == LengthUnit::view_steps && step) scale_lengths(map, 1.0 / *step);
  return map;
}

void set_unit(recordings::RunMoment& moment, LengthUnit unit) {
  moment.length_unit = to_string(unit);
}

void GrowingMap::add_to(recordings::RunMoment& moment, const TopologicalMap& grown, LengthUnit unit,
                        bool is_node, const std::string& name) {
  const TopologicalMap map = to_shown_lengths(grown, unit);
  set_unit(moment, unit);
  truth_ = moment.truth;
  last_is_node_ = is_node;
  if (is_node) {
    names_.push_back(name);
    truths_.push_back(moment.truth);
  }
  moment.sure = is_node;
  moment.state = is_node ? "place of the map" : "between places";
  const auto closures = static_cast<std::size_t>(
      std::ranges::count(map.edges, Link::Kind::closure, &TopologicalMap::Edge::kind));
  moment.values = {{"places", std::to_string(map.nodes.size())},
                   {"closures", std::to_string(closures)}};
  if (map.nodes.empty()) return;
  if (closures > shown_closure_count_) moment.values.emplace_back("event", "a loop is closed");
  const std::size_t component = map.nodes.back().component;
  transform_to_component(moment, map, unit, component);
  if (closures == shown_closure_count_ &&
      map.nodes.size() <= shown_node_count_ + shown_node_count_ / 20)
    return;
  shown_closure_count_ = closures;
  shown_node_count_ = map.nodes.size();
  add_component(moment, map, component, names_);
}

void GrowingMap::finish(recordings::RunMoment& moment, const TopologicalMap& finished,
                        LengthUnit unit) const {
  if (finished.nodes.empty()) return;
  const TopologicalMap map = to_shown_lengths(finished, unit);
  set_unit(moment, unit);
  const std::size_t component = find_largest_component(map);
  moment.truth = truth_;
  transform_to_component(moment, map, unit, component);
  moment.values.emplace_back("event", "the map is finished");
  add_component(moment, map, component, names_);
}

void GrowingMap::transform_to_component(recordings::RunMoment& moment, const TopologicalMap& map,
                                        LengthUnit unit, std::size_t component) const {
  moment.pose.reset();
  if (last_is_node_ && map.nodes.back().component == component) {
    moment.pose = map.nodes.back().pose;
  }
  const auto first = std::ranges::find(map.nodes, component, &TopologicalMap::Node::component);
  const auto& anchor = truths_[static_cast<std::size_t>(first - map.nodes.begin())];
  // A true pose is in metres, which a map in view steps does not have.
  if (unit != LengthUnit::metres || !moment.truth || !moment.truth->heading_rad || !anchor ||
      !anchor->heading_rad) {
    moment.truth.reset();
    return;
  }
  const auto full = [](const ReferencePose& pose) {
    return Pose2{pose.x_m, pose.y_m, *pose.heading_rad};
  };
  const Pose2 moved = first->pose * inverse(full(*anchor)) * full(*moment.truth);
  moment.truth = ReferencePose{moved.x_m, moved.y_m, moved.heading_rad};
}

}  // namespace panonav::command
