// [S06] figures 9, 14, 15 and 16: maps around one goal.

#include <algorithm>
#include <array>
#include <cmath>

#include "lab/s06/support.hpp"
#include "panonav/core/error.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

namespace {

const std::vector<double> difference_limits{0.05, 0.1, 0.2, 0.4, 0.8};
const std::vector<double> distance_limits{0.0126, 0.0501, 0.1001, 0.2001, 0.4001};
constexpr double catchment_radius_m = 0.1 + 1e-6;

// One goal and the data for its figures.
class GoalFigures {
 public:
  GoalFigures(ArenaSurveys& surveys, std::size_t goal)
      : surveys_(surveys), arena_(surveys.arena()), goal_(goal) {}

  [[nodiscard]] const HomingView& home() const {
    return arena_.homes.views[goal_ * surveys_.goal_stride()].view;
  }
  [[nodiscard]] Point2 position() const {
    return arena_.homes.views[goal_ * surveys_.goal_stride()].pose.position();
  }
  [[nodiscard]] std::vector<double> differences(int highest) const {
    std::vector<double> values;
    for (const auto& placed : arena_.currents.views) {
      values.push_back(image_difference(home(), placed.view, highest));
    }
    return values;
  }
  [[nodiscard]] std::vector<double> compute_final_distances(const HomingStrategy& strategy) {
    const auto stages = surveys_.survey_stages(strategy);
    std::vector<double> values;
    for (const std::uint32_t end : final_places(stages, goal_, survey_options(arena_))) {
      values.push_back(distance(position(), arena_.currents.views[end].pose.position()));
    }
    return values;
  }
  [[nodiscard]] std::vector<viewer::MapLayer> shade_cells(const std::vector<double>& values,
                                                          const std::vector<double>& limits) const;
  [[nodiscard]] viewer::MapLayer draw_home_vectors(const FourierHomingOptions& homing) const;
  [[nodiscard]] viewer::MapLayer outline_catchment(const std::vector<double>& ends_m) const;
  [[nodiscard]] viewer::MapLayer mark_goal() const;
  [[nodiscard]] viewer::MapLayer mark_most_similar(const std::vector<double>& differences) const;

 private:
  ArenaSurveys& surveys_;
  const Arena& arena_;
  std::size_t goal_;
};

// Returns map layers of cells, one per range between limits; the highest values are darkest.
std::vector<viewer::MapLayer> GoalFigures::shade_cells(const std::vector<double>& values,
                                                       const std::vector<double>& limits) const {
  constexpr std::array greys{viewer::PlotColour::yellow,     viewer::PlotColour::pale_grey,
                             viewer::PlotColour::light_grey, viewer::PlotColour::grey,
                             viewer::PlotColour::dark_grey,  viewer::PlotColour::black};
  const double half_m = 0.5 * arena_.options.spacing_m;
  std::vector<viewer::MapLayer> layers;
  for (std::size_t level = 0; level <= limits.size(); ++level) {
    layers.push_back({.colour = greys.at(std::min(level, greys.size() - 1))});
  }
  for (std::size_t p = 0; p < values.size(); ++p) {
    const auto level = static_cast<std::size_t>(
        std::ranges::count_if(limits, [&](double limit) { return values[p] > limit; }));
    const Point2 at = arena_.currents.views[p].pose.position();
    layers[level].filled_polygons.push_back({{at.x_m - half_m, at.y_m - half_m},
                                             {at.x_m + half_m, at.y_m - half_m},
                                             {at.x_m + half_m, at.y_m + half_m},
                                             {at.x_m - half_m, at.y_m + half_m}});
  }
  return layers;
}

// Draws a dot at each place and a stroke in the direction of its home vector.
viewer::MapLayer GoalFigures::draw_home_vectors(const FourierHomingOptions& homing) const {
  viewer::MapLayer layer{.colour = viewer::PlotColour::blue};
  for (const auto& placed : arena_.currents.views) {
    const HomeVector vector = home_vector(home(), placed.view, homing);
    if (vector.length() == 0.0) continue;
    const double direction = placed.pose.heading_rad + vector.direction_rad();
    const double length_m = 0.7 * arena_.options.spacing_m;
    const Point2 at = placed.pose.position();
    layer.dots.push_back(at);
    layer.lines.push_back(
        {at, {at.x_m + length_m * std::cos(direction), at.y_m + length_m * std::sin(direction)}});
  }
  return layer;
}

// Draws the outline of the cells from which runs end within 10 cm of the goal.
viewer::MapLayer GoalFigures::outline_catchment(const std::vector<double>& ends_m) const {
  viewer::MapLayer layer{.colour = viewer::PlotColour::vermilion};
  const double spacing_m = arena_.options.spacing_m;
  const auto is_inside = [&](double x_m, double y_m) {
    for (std::size_t p = 0; p < ends_m.size(); ++p) {
      const Point2 at = arena_.currents.views[p].pose.position();
      if (std::abs(at.x_m - x_m) < 0.5 * spacing_m && std::abs(at.y_m - y_m) < 0.5 * spacing_m) {
        return ends_m[p] <= catchment_radius_m;
      }
    }
    return false;
  };
  for (std::size_t p = 0; p < ends_m.size(); ++p) {
    if (!(ends_m[p] <= catchment_radius_m)) continue;
    const Point2 at = arena_.currents.views[p].pose.position();
    constexpr std::array<std::array<int, 2>, 4> sides{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
    for (const auto& [dx, dy] : sides) {
      if (is_inside(at.x_m + dx * spacing_m, at.y_m + dy * spacing_m)) continue;
      const double h = 0.5 * spacing_m;
      const double x = at.x_m + dx * h;
      const double y = at.y_m + dy * h;
      layer.lines.push_back({{x - dy * h, y - dx * h}, {x + dy * h, y + dx * h}});
    }
  }
  return layer;
}

viewer::MapLayer GoalFigures::mark_goal() const {
  return {.label = "goal", .colour = viewer::PlotColour::purple, .squares = {position()}};
}

viewer::MapLayer GoalFigures::mark_most_similar(const std::vector<double>& differences) const {
  const auto best = std::ranges::min_element(differences) - differences.begin();
  return {.label = "most similar",
          .colour = viewer::PlotColour::green,
          .circles = {arena_.currents.views[static_cast<std::size_t>(best)].pose.position()}};
}

template <typename... Layers>
viewer::MapPlot make_map(const std::string& title, std::vector<viewer::MapLayer> layers,
                         Layers... more) {
  (layers.push_back(std::move(more)), ...);
  return {title, std::move(layers)};
}

// Returns the differences along the line through the goal parallel to x or y.
viewer::Series make_transect(const Arena& arena, Point2 goal,
                             const std::vector<double>& differences, bool along_x,
                             const std::string& label) {
  std::vector<std::pair<double, double>> points;
  for (std::size_t p = 0; p < differences.size(); ++p) {
    const Point2 at = arena.currents.views[p].pose.position();
    const double lateral_m = along_x ? at.y_m - goal.y_m : at.x_m - goal.x_m;
    if (std::abs(lateral_m) > 0.1 * arena.options.spacing_m) continue;
    points.emplace_back(along_x ? at.x_m - goal.x_m : at.y_m - goal.y_m, differences[p]);
  }
  std::ranges::sort(points);
  viewer::Series series{.label = label};
  for (const auto& [x, y] : points) {
    series.add(x, y);
  }
  return series;
}

// Returns the index of the goal nearest to the street crossing left of the middle.
std::size_t choose_goal(const HomingSurvey& survey) {
  const Point2 crossing{0.5, 0.6};
  return static_cast<std::size_t>(
      std::ranges::min_element(
          survey.goals, {},
          [&](const Pose2& goal) { return distance(goal.position(), crossing); }) -
      survey.goals.begin());
}

// Draws figure 9.
void draw_vectors(GoalFigures& figures, Reproduction& result) {
  const auto differences = figures.differences(5);
  const auto ends = figures.compute_final_distances(make_published_strategy({5}));
  add_plot(result, "figure_09_vectors.svg",
           "[S06] figure 9: home vectors to one goal (strokes from the dots), the darker the less "
           "similar "
           "the views. Other valleys lead astray.",
           make_map("Home vectors, K = 5; orange: catchment area at 10 cm",
                    figures.shade_cells(differences, difference_limits),
                    figures.draw_home_vectors(published_homing_options(5, s06_iterations)),
                    figures.outline_catchment(ends), figures.mark_goal(),
                    figures.mark_most_similar(differences)));
}

// Draws figure 14.
void draw_stages(GoalFigures& figures, Reproduction& result) {
  std::vector<viewer::MapPlot> panels;
  for (const int highest : {2, 4, 10}) {
    const std::string k = "K = " + std::to_string(highest);
    const auto differences = figures.differences(highest);
    const auto ends = figures.compute_final_distances(make_published_strategy({highest}));
    panels.push_back(make_map(
        k + ": image difference, home vectors", figures.shade_cells(differences, difference_limits),
        figures.draw_home_vectors(published_homing_options(highest, s06_iterations)),
        figures.mark_goal(), figures.mark_most_similar(differences)));
    panels.push_back(make_map(k + ": where runs end; yellow: at the goal, dark: beyond 40 cm",
                              figures.shade_cells(ends, distance_limits),
                              figures.outline_catchment(ends), figures.mark_goal()));
  }
  add_plot(result, "figure_14_stages.svg",
           "[S06] figure 14: the same goal with K = 2, 4 and 10. Left: image difference and home "
           "vectors; right: how far from the goal runs end that start there.",
           panels, 2);
}

// Draws figure 15.
void draw_catchments_by_rule(GoalFigures& figures, Reproduction& result) {
  std::vector<viewer::MapPlot> panels;
  for (const HomingStrategy& strategy :
       {make_published_strategy({2, 4, 10}), make_own_strategy(), make_expected_image_strategy()}) {
    const auto ends = figures.compute_final_distances(strategy);
    panels.push_back(make_map(strategy.label, figures.shade_cells(ends, distance_limits),
                              figures.outline_catchment(ends), figures.mark_goal()));
  }
  add_plot(result, "figure_15_areas.svg",
           "[S06] figure 15: where runs to this goal end, coarse to fine, by a chain of 20 stages "
           "and by expected "
           "images. Yellow: at the goal; dark: beyond 40 cm; orange: the area within 10 cm.",
           panels, 3);
}

// Draws figure 16, left.
void draw_transects(const Arena& arena, const GoalFigures& figures, Reproduction& result) {
  const auto plot = [&](const std::string& axis, bool along_x) {
    viewer::LinePlot lines{.title = "Image difference along " + axis + " through the goal",
                           .x_label = "distance from the goal [m]",
                           .y_label = "share of the energy of both views"};
    for (const int highest : {2, 4, 10}) {
      lines.series.push_back(make_transect(arena, figures.position(), figures.differences(highest),
                                           along_x, "K = " + std::to_string(highest)));
    }
    return lines;
  };
  add_plot(result, "figure_16_transect_x.svg",
           "[S06] figure 16, left: the image difference along a line through the goal. More "
           "frequencies, a narrower valley.",
           plot("x", true));
  add_plot(result, "figure_16_transect_y.svg", "The same across.", plot("y", false));
}

// Draws figure 16, right.
void draw_surface(const Arena& arena, const GoalFigures& figures, Reproduction& result) {
  const auto surface = figures.differences(10);
  viewer::HeatMap map{.title = "Image difference to the goal (cross), K = 10",
                      .value_label = "share of the energy of both views",
                      .first_cell = {0.0, 0.0},
                      .spacing_m = arena.options.spacing_m,
                      .crosses = {figures.position()}};
  map.columns = static_cast<int>(std::lround(arena.scene.floor_high.x_m / map.spacing_m)) + 1;
  map.rows = static_cast<int>(std::lround(arena.scene.floor_high.y_m / map.spacing_m)) + 1;
  map.values.assign(static_cast<std::size_t>(map.columns) * static_cast<std::size_t>(map.rows),
                    std::nan(""));
  for (std::size_t p = 0; p < surface.size(); ++p) {
    const Point2 at = arena.currents.views[p].pose.position();
    const auto column = static_cast<std::size_t>(std::lround(at.x_m / map.spacing_m));
    const auto row = static_cast<std::size_t>(std::lround(at.y_m / map.spacing_m));
    map.values.at(row * static_cast<std::size_t>(map.columns) + column) = surface[p];
  }
  add_plot(result, "figure_16_surface.svg",
           "[S06] figure 16, right: the image difference over the arena.", map);
}

}  // namespace

void reproduce_goal_figures(ArenaSurveys& surveys, Reproduction& result) {
  GoalFigures figures(surveys, choose_goal(surveys.survey_published(2)));
  draw_vectors(figures, result);
  draw_stages(figures, result);
  draw_catchments_by_rule(figures, result);
  draw_transects(surveys.arena(), figures, result);
  draw_surface(surveys.arena(), figures, result);
}

}  // namespace panonav::lab
