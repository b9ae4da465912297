// Whole floors, arranged by the similarity of their views alone.

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
#include "panonav_simulation/mission.hpp"
#include "panonav_simulation/worlds.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

void reproduce_floor(const ElsewhereReproductionOptions& options, const std::string& world,
                     double spacing_m, Executor& executor, Reproduction& result) {
  const simulation::MissionPlace place =
      simulation::make_mission_place(simulation::read_world(options.data, world), executor);
  const simulation::RememberedPlace remembered =
      simulation::remember_grid(place, spacing_m, Random(options.seed, 1).next(), executor);
  std::vector<Point2> truth;
  for (const Pose2& pose : remembered.truth) truth.push_back(pose.position());
  const std::string id = "elsewhere.arrange." + world + "." + centimetres_id(spacing_m);
  const std::string what = world + ", " + std::to_string(truth.size()) + " views every " +
                           centimetres(spacing_m) + " arranged by their similarity alone";
  std::vector<Point2> estimate;
  std::vector<Point2> placed_truth;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!remembered.arranged[i]) continue;
    estimate.push_back(*remembered.arranged[i]);
    placed_truth.push_back(truth[i]);
  }
  add_rate(result, id + ".placed", what + ": views in the largest connected component",
           estimate.size(), truth.size());
  const auto difference = shape_difference(estimate, placed_truth);
  const double trustworthiness = neighbour_preservation(estimate, placed_truth, 8).trustworthiness;
  add_row(result, id + ".shape", what + ": shape difference of the largest component",
          difference.value, "", at_most(0.05))
      .reason = "the trustworthiness of its neighbourhoods is " + fixed(trustworthiness, 3);
  add_row(result, id + ".trustworthiness", what + ": trustworthiness of its neighbourhoods",
          trustworthiness, "");
  const auto missions = simulation::random_missions(place, remembered, {.count = options.runs},
                                                    Random(options.seed, 2).next());
  const auto runs = simulation::run_missions(place, remembered, missions, {},
                                             Random(options.seed, 3).next(), executor);
  // Whether a way can lead from the start, as the nearest view has it, to the goal.
  const auto in_largest = [&](const Point2& position) {
    const auto nearest = std::ranges::min_element(
        truth, {}, [&](const Point2& view) { return distance(view, position); });
    return remembered.arranged[static_cast<std::size_t>(nearest - truth.begin())].has_value();
  };
  std::size_t arrived = 0;
  std::size_t wrongly = 0;
  std::size_t within = 0;
  std::size_t arrived_within = 0;
  std::map<NavigationState, std::size_t> ends;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const bool arrives = runs[i].arrives(0.5 * spacing_m);
    arrived += arrives ? 1 : 0;
    wrongly += !arrives && runs[i].end == NavigationState::arrived ? 1 : 0;
    ++ends[runs[i].end];
    const Pose2& goal = remembered.truth[remembered.graph.node_of(missions[i].goal).value()];
    if (!in_largest(goal.position()) || !in_largest(missions[i].start.position())) continue;
    ++within;
    arrived_within += arrives ? 1 : 0;
  }
  add_rate(result, id + ".missions", what + ": missions that arrive within half the spacing",
           arrived, runs.size(), at_least(0.95));
  result.rows.back().reason = simulation::other_ends(ends, wrongly) + "; of the " +
                              std::to_string(within) +
                              " missions from the largest component to a view in it, " +
                              std::to_string(arrived_within) + " arrive";
  const Alignment onto =
      align(estimate, placed_truth, {.allow_scale = true, .allow_reflection = false});
  viewer::MapLayer arranged{.label = "arranged, after the best rotation and scale",
                            .colour = viewer::PlotColour::orange};
  for (const Point2& point : estimate) arranged.dots.push_back(onto.apply(point));
  viewer::MapLayer taken{.label = "where the views were taken"};
  taken.dots = placed_truth;
  std::vector<viewer::MapLayer> layers = viewer::scene_layers(place.scene);
  layers.push_back(std::move(taken));
  layers.push_back(std::move(arranged));
  add_plot(result, options.out,
           "elsewhere_arrange_" + world + "_" + centimetres_id(spacing_m) + ".svg", what,
           viewer::MapPlot{.title = world, .layers = std::move(layers)});
}

}  // namespace panonav::lab
