// Maps of whole floors, arranged by the similarity of their views alone.

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "lab/elsewhere/experiments.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "panonav_simulation/mission.hpp"
#include "panonav_simulation/worlds.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

/// Results of the missions over an arranged floor.
struct FloorMissions {
  std::size_t arrived = 0;
  std::size_t falsely_arrived = 0;        // report an arrival, but are elsewhere
  std::size_t missions_in_component = 0;  // start and goal in the largest component
  std::size_t arrived_in_component = 0;   // arrived, with both in it
  std::map<NavigationDecision::State, std::size_t> ends;
};

// True if the view nearest to `position` is in the largest component of the map.
bool is_in_largest_component(const simulation::RememberedPlace& remembered,
                             const Point2& position) {
  const auto nearest = std::ranges::min_element(
      remembered.truth, {}, [&](const Pose2& view) { return distance(view.position(), position); });
  return remembered.arranged[static_cast<std::size_t>(nearest - remembered.truth.begin())]
      .has_value();
}

FloorMissions count_missions(const simulation::RememberedPlace& remembered,
                             const std::vector<simulation::Mission>& missions,
                             const std::vector<simulation::MissionRun>& runs, double spacing_m) {
  FloorMissions count;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const bool has_arrived = runs[i].has_arrived(0.5 * spacing_m);
    count.arrived += has_arrived ? 1 : 0;
    count.falsely_arrived +=
        !has_arrived && runs[i].end == NavigationDecision::State::arrived ? 1 : 0;
    ++count.ends[runs[i].end];
    const Pose2& goal = remembered.truth[remembered.graph.node_of(missions[i].goal).value()];
    if (!is_in_largest_component(remembered, goal.position()) ||
        !is_in_largest_component(remembered, missions[i].start.position())) {
      continue;
    }
    ++count.missions_in_component;
    count.arrived_in_component += has_arrived ? 1 : 0;
  }
  return count;
}

}  // namespace

void ElsewhereExperiments::reproduce_floor(const std::string& world, double spacing_m) {
  const simulation::MissionPlace place =
      simulation::make_mission_place(simulation::read_gazebo_world(options.data, world), executor);
  const simulation::RememberedPlace remembered =
      simulation::memorise_grid(place, spacing_m, Random(options.seed, 1).next(), executor);
  const std::size_t views = remembered.truth.size();
  const std::string id = "elsewhere.arrange." + world + "." + format_centimetres_id(spacing_m);
  const std::string what = world + ", " + std::to_string(views) + " views every " +
                           format_centimetres(spacing_m) + " arranged by their similarity alone";
  std::vector<Point2> estimate;
  std::vector<Point2> truth;
  for (std::size_t i = 0; i < views; ++i) {
    if (!remembered.arranged[i]) continue;
    estimate.push_back(*remembered.arranged[i]);
    truth.push_back(remembered.truth[i].position());
  }
  add_rate(result, id + ".placed", what + ": views in the largest connected component",
           estimate.size(), views);
  const double trustworthiness = neighbour_preservation(estimate, truth, 8).trustworthiness;
  add_row(result, id + ".shape", what + ": shape difference of the largest component",
          shape_difference(estimate, truth).value, "", at_most(0.05))
      .reason = "the trustworthiness of its neighbourhoods is " + format_fixed(trustworthiness, 3);
  add_row(result, id + ".trustworthiness", what + ": trustworthiness of its neighbourhoods",
          trustworthiness, "");
  const auto missions = simulation::sample_missions(place, remembered, {.count = options.runs},
                                                    Random(options.seed, 2).next());
  const auto runs = simulation::run_missions(place, remembered, missions, {},
                                             Random(options.seed, 3).next(), executor);
  const FloorMissions count = count_missions(remembered, missions, runs, spacing_m);
  add_rate(result, id + ".missions", what + ": missions that arrive within half the spacing",
           count.arrived, runs.size(), at_least(0.95));
  result.rows.back().reason = simulation::explain_other_ends(count.ends, count.falsely_arrived) +
                              "; of the " + std::to_string(count.missions_in_component) +
                              " missions from the largest component to a view in it, " +
                              std::to_string(count.arrived_in_component) + " arrive";
  std::vector<viewer::MapLayer> layers = viewer::scene_layers(place.scene);
  layers.push_back({.label = "where the views were taken", .dots = truth});
  layers.push_back({.label = "arranged, after the best rotation and scale",
                    .colour = viewer::PlotColour::orange,
                    .dots = simulation::align_to(estimate, truth)});
  add_plot(result, "elsewhere_arrange_" + world + "_" + format_centimetres_id(spacing_m) + ".svg",
           what, viewer::MapPlot{.title = world, .layers = std::move(layers)});
}

}  // namespace panonav::lab
