#include "panonav_viewer/mission_picture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/navigation/area_planner.hpp"
#include "panonav/navigation/direction_field.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::viewer {

namespace {

bool is_known(const Pose2& pose) {
  return std::isfinite(pose.x_m) && std::isfinite(pose.y_m);
}

Point2 offset_point(Point2 from, double direction_rad, double distance_m) {
  return {from.x_m + distance_m * std::cos(direction_rad),
          from.y_m + distance_m * std::sin(direction_rad)};
}

/// Makes an arrow as a polyline with its tail at `from`.
std::vector<Point2> make_arrow(Point2 from, double direction_rad, double length_m) {
  constexpr double barb_rad = std::numbers::pi - 0.5;
  const Point2 tip = offset_point(from, direction_rad, length_m);
  return {from, tip, offset_point(tip, direction_rad + barb_rad, 0.4 * length_m), tip,
          offset_point(tip, direction_rad - barb_rad, 0.4 * length_m)};
}

/// Makes layers of the references and of their directions to the goal.
std::vector<MapLayer> make_field_layers(const simulation::RememberedPlace& remembered,
                                        const FieldOptions& options, ViewId goal) {
  constexpr double share_of_spacing = 0.55;
  MapLayer references{.label = "stored views", .colour = PlotColour::blue};
  MapLayer arrows{.label = "directions to the goal", .colour = PlotColour::sky};
  const auto field = direction_field(remembered.graph, goal, options);
  for (std::size_t i = 0; i < field.size(); ++i) {
    const Pose2& pose = remembered.truth[i];
    if (!is_known(pose)) continue;
    references.dots.push_back(pose.position());
    if (!field[i].direction_rad || !std::isfinite(pose.heading_rad)) continue;
    arrows.lines.push_back(make_arrow(pose.position(), pose.heading_rad + *field[i].direction_rad,
                                      share_of_spacing * remembered.spacing_m));
  }
  return {arrows, references};
}

/// Makes the layer of the path planned over the references, from the first known nearest reference
/// to the goal.
MapLayer make_planned_layer(const simulation::RememberedPlace& remembered,
                            const PlannerOptions& options, ViewId goal,
                            const simulation::MissionRun& run) {
  MapLayer layer{.label = "planned path", .colour = PlotColour::orange};
  const auto known = std::ranges::find_if(
      run.decisions, [](const auto& step) { return step.nearest.has_value(); });
  if (known == run.decisions.end()) return layer;
  AreaPlanner planner(remembered.graph, options);
  planner.set_goal(goal);
  std::vector<Point2> way;
  for (const std::size_t node : planner.plan_path(*remembered.graph.node_of(*known->nearest))) {
    if (is_known(remembered.truth[node])) way.push_back(remembered.truth[node].position());
  }
  if (way.size() > 1) layer.lines.push_back(std::move(way));
  return layer;
}

MapLayer make_driven_layer(const simulation::MissionRun& run) {
  MapLayer layer{.label = "driven path", .colour = PlotColour::vermilion, .lines = {{}}};
  for (std::size_t i = 0; i < run.path.size(); ++i) {
    layer.lines.back().push_back(run.path[i].position());
    if (run.kidnapped_at == i) layer.lines.emplace_back();
  }
  return layer;
}

}  // namespace

MapPlot make_mission_plot(const std::string& title, const simulation::MissionPlace& place,
                          const simulation::RememberedPlace& remembered,
                          const PlannerOptions& options, ViewId goal,
                          const simulation::MissionRun& run) {
  const std::vector<MapLayer> scene = scene_layers(place.scene);
  MapPlot plot{.title = title, .layers = {scene.front()}};
  for (MapLayer& layer : make_field_layers(remembered, options.field, goal)) {
    plot.layers.push_back(std::move(layer));
  }
  plot.layers.push_back(scene.back());  // a screen may hide references, so it is drawn above
  plot.layers.push_back(make_planned_layer(remembered, options, goal, run));
  plot.layers.push_back(make_driven_layer(run));
  plot.layers.push_back(
      {.label = "start", .colour = PlotColour::green, .squares = {run.path.front().position()}});
  if (run.kidnapped_at) {
    plot.layers.push_back({.label = "carried to this place",
                           .colour = PlotColour::purple,
                           .squares = {run.path.at(*run.kidnapped_at + 1).position()}});
  }
  const Pose2& at_goal = remembered.truth[*remembered.graph.node_of(goal)];
  if (is_known(at_goal)) {
    plot.layers.push_back(
        {.label = "goal", .colour = PlotColour::black, .crosses = {at_goal.position()}});
  }
  return plot;
}

void write_mission_picture(const std::filesystem::path& path, const std::string& title,
                           const simulation::MissionPlace& place,
                           const simulation::RememberedPlace& remembered,
                           const PlannerOptions& options, ViewId goal,
                           const simulation::MissionRun& run) {
  write_plot(path, make_mission_plot(title, place, remembered, options, goal, run));
}

}  // namespace panonav::viewer
