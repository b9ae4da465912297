// [M04] figure 10: how the shape of localisation areas depends on the surrounding objects. Left
// open by the authors: "we are investigating the relation between the shape of the localisation
// areas and the disposition of the objects".

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>

#include "lab/m04/experiment.hpp"
#include "lab/m04/support.hpp"
#include "lab/m04/surroundings.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/localisation/hierarchical.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

// The grid is finer than the paper's, so that an area of 1 m^2 has a shape; views have fewer
// pixels, because 15 components need no more.
constexpr double area_spacing_m = 0.125;
constexpr int max_view_rows = 40;
constexpr int view_columns = 256;
// Numbers of components at which the shape is measured: with 3 the area is broad, with 6 it no
// longer reaches the border of the grid.
constexpr std::array component_counts{3, 6};
constexpr std::size_t level_count = component_counts.size();
constexpr double area_tolerance = 0.25;
// Grid of robot positions, the same in every scene.
constexpr std::size_t places_along_x = 6;
constexpr std::size_t places_along_y = 3;
constexpr std::size_t place_count = places_along_x * places_along_y;

// Mean extent over all directions, and the extent per direction divided by this mean.
struct Shape {
  double size = 0.0;
  Directional relative{};
};

Shape normalise_shape(const Directional& values) {
  Shape shape;
  shape.size = std::accumulate(values.begin(), values.end(), 0.0) / shape_directions;
  for (std::size_t i = 0; i < shape_directions; ++i) {
    shape.relative[i] = shape.size > 0.0 ? values[i] / shape.size : 1.0;
  }
  return shape;
}

// Shapes at one position in one scene.
struct Observation {
  std::array<Shape, level_count> area;       // equivalent radius of the area in each sector
  Shape free;                                // free distance
  Shape parallax;                            // distance at which the parallax is equal
  std::array<Shape, level_count> predicted;  // distance at which the components change equally
};
// Indexed by grid position; nullopt where furniture occupies it.
using SceneObservations = std::array<std::optional<Observation>, place_count>;

// Returns the extent of the area per sector of 45 degrees: the radius of a circle whose sector has
// the area of the candidates' cells in that sector.
Directional compute_sector_extents(const VisualMemory& memory, const ReferenceAreas& areas,
                                   Point2 robot, const std::vector<Match>& candidates) {
  Directional area_m2{};
  for (const Match& match : candidates) {
    const Point2 at = memory.info(match.view).pose->position();
    const auto cell = areas.cell(match.view);
    area_m2[find_sector(std::atan2(at.y_m - robot.y_m, at.x_m - robot.x_m))] +=
        polygon_area_m2(cell);
  }
  Directional extents{};
  for (std::size_t i = 0; i < shape_directions; ++i) {
    extents[i] = std::sqrt(area_m2[i] * shape_directions / std::numbers::pi);
  }
  return extents;
}

// Returns one property of an observation, to be correlated with another one.
using PropertyGetter = double (*)(const Observation&, std::size_t level, std::size_t direction);

struct Relation {
  std::string id;
  std::string label;
  std::string what;
  PropertyGetter area;
  PropertyGetter surroundings;
  std::size_t directions;  // 1 for properties without direction
};

const std::array<Relation, 5>& relations() {
  static const std::array<Relation, 5> all{
      Relation{
          "size_against_free_distance", "size",
          "size of the area with the mean free distance to objects",
          [](const Observation& o, std::size_t level, std::size_t) { return o.area[level].size; },
          [](const Observation& o, std::size_t, std::size_t) { return o.free.size; }, 1},
      Relation{"shape_against_free_distance", "free distance",
               "relative extent of the area per direction with the relative free distance there",
               [](const Observation& o, std::size_t level, std::size_t i) {
                 return o.area[level].relative[i];
               },
               [](const Observation& o, std::size_t, std::size_t i) { return o.free.relative[i]; },
               shape_directions},
      Relation{
          "shape_against_parallax", "parallax",
          "relative extent of the area per direction with the way that parallax allows there",
          [](const Observation& o, std::size_t level, std::size_t i) {
            return o.area[level].relative[i];
          },
          [](const Observation& o, std::size_t, std::size_t i) { return o.parallax.relative[i]; },
          shape_directions},
      Relation{
          "size_against_prediction", "size",
          "size of the area with the size predicted from parallax and contrast",
          [](const Observation& o, std::size_t level, std::size_t) { return o.area[level].size; },
          [](const Observation& o, std::size_t level, std::size_t) {
            return o.predicted[level].size;
          },
          1},
      Relation{"shape_against_prediction", "parallax and contrast",
               "relative extent of the area per direction with that predicted from parallax and "
               "contrast",
               [](const Observation& o, std::size_t level, std::size_t i) {
                 return o.area[level].relative[i];
               },
               [](const Observation& o, std::size_t level, std::size_t i) {
                 return o.predicted[level].relative[i];
               },
               shape_directions}};
  return all;
}

// Values of one relation minus their mean over all scenes at the same position and direction; the
// subtraction removes the influence of the room and of the grid.
struct Residuals {
  // Indexed by [scene][position * directions + direction]; NaN without an observation.
  std::vector<std::vector<double>> area;
  std::vector<std::vector<double>> surroundings;
};

std::vector<std::vector<double>> compute_residuals(const std::vector<SceneObservations>& scenes,
                                                   PropertyGetter property, std::size_t level,
                                                   std::size_t directions) {
  std::vector<std::vector<double>> result(
      scenes.size(), std::vector<double>(place_count * directions, std::nan("")));
  for (std::size_t p = 0; p < place_count; ++p) {
    for (std::size_t d = 0; d < directions; ++d) {
      double sum = 0.0;
      double count = 0.0;
      for (const auto& scene : scenes) {
        if (!scene[p]) continue;
        sum += property(*scene[p], level, d);
        count += 1.0;
      }
      for (std::size_t s = 0; s < scenes.size(); ++s) {
        if (scenes[s][p]) {
          result[s][p * directions + d] = property(*scenes[s][p], level, d) - sum / count;
        }
      }
    }
  }
  return result;
}

// Returns the rank correlation between the areas of scenes[i] and the surroundings of scene
// partners[i]. With partners equal to scenes it measures the relation, with shuffled partners what
// chance gives.
double rank_correlation_of_pairs(const Residuals& residuals, const std::vector<std::size_t>& scenes,
                                 const std::vector<std::size_t>& partners) {
  std::vector<double> area;
  std::vector<double> around;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    const auto& here = residuals.area[scenes[i]];
    const auto& there = residuals.surroundings[partners[i]];
    for (std::size_t j = 0; j < here.size(); ++j) {
      if (std::isnan(here[j]) || std::isnan(there[j])) continue;
      area.push_back(here[j]);
      around.push_back(there[j]);
    }
  }
  return area.size() >= 3 ? rank_correlation(area, around) : 0.0;
}

viewer::MapPlot draw_area_map(const simulation::PlaceRecording& place, const ReferenceAreas& areas,
                              Point2 robot, const std::vector<Match>& candidates,
                              std::size_t number) {
  viewer::MapPlot map{.title = "place " + std::to_string(number) + ", " +
                               std::to_string(component_counts.front()) + " components",
                      .layers = viewer::scene_layers(place.scene)};
  viewer::MapLayer area{.label = "where it may be", .colour = viewer::PlotColour::blue};
  for (const Match& match : candidates) area.filled_polygons.push_back(areas.cell(match.view));
  viewer::MapLayer truth{
      .label = "robot", .colour = viewer::PlotColour::vermilion, .crosses = {robot}};
  map.layers.push_back(area);
  map.layers.push_back(truth);
  return map;
}

class AreaShape final : public Experiment {
 public:
  void add(const simulation::PlaceRecording& place, Executor& executor) override {
    const simulation::PanoramaRendering rendering{
        .rows = std::min(max_view_rows, place.rendering.rows),
        .columns = view_columns,
        .elevations = place.rendering.elevations,
        .rays_per_axis = 1};
    std::vector<Pose2> grid;
    for (const auto& point : place.free_space->grid(area_spacing_m)) {
      grid.push_back({point.position.x_m, point.position.y_m, 0.0});
    }
    const std::uint64_t noise = place.seed * 100003U + 80000U;
    const auto views = simulation::capture_views(place, rendering, grid, noise, {}, executor);
    const VisualMemory memory =
        make_memory(views, compute_signatures(views, m04_components, executor));
    const ReferenceAreas areas(memory);
    Random random(place.seed, 80);
    SceneObservations here;
    const Point2 low = place.scene.floor_low;
    const Point2 high = place.scene.floor_high;
    for (std::size_t p = 0; p < place_count; ++p) {
      const double share_x = (static_cast<double>(p % places_along_x) + 0.5) / places_along_x;
      const double share_y = (static_cast<double>(p / places_along_x) + 0.5) / places_along_y;
      const Pose2 robot{low.x_m + share_x * (high.x_m - low.x_m),
                        low.y_m + share_y * (high.y_m - low.y_m),
                        random.uniform(-std::numbers::pi, std::numbers::pi)};
      if (!place.free_space->is_free(robot.position())) continue;
      const Panorama view =
          simulation::capture_view(place, rendering, robot, noise + grid.size() + p);
      const auto levels = localise_hierarchically(
          memory, areas, pack(compute_signature(view, m04_components), memory.full_scale()),
          {.tolerance = area_tolerance});
      const Surroundings around = measure_surroundings(place, robot.position());
      Observation seen{{}, normalise_shape(around.free_m), normalise_shape(around.parallax_m), {}};
      for (std::size_t level = 0; level < level_count; ++level) {
        const auto& candidates =
            levels.at(static_cast<std::size_t>(component_counts[level] - 1)).candidates;
        seen.predicted[level] =
            normalise_shape(predict_extents(place, robot, view, component_counts[level]));
        seen.area[level] =
            normalise_shape(compute_sector_extents(memory, areas, robot.position(), candidates));
        if (scenes_.empty() && level == 0 &&
            shown_places.end() != std::ranges::find(shown_places, p)) {
          shown_maps_.push_back(
              draw_area_map(place, areas, robot.position(), candidates, shown_maps_.size() + 1));
        }
      }
      here[p] = seen;
    }
    scenes_.push_back(here);
  }

  void report(Reproduction& result) const override {
    require(!scenes_.empty(), "places", 0.0, ">= 1");
    if (!shown_maps_.empty()) {
      add_plot(result, "fig10_areas_at_places.svg",
               "Areas after 3 components at places of one office, with its furniture seen from "
               "above ([M04] figure 10).",
               shown_maps_, 2);
    }
    std::vector<std::size_t> all(scenes_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    viewer::LinePlot plot{.title = "Does the area reach farther where the surroundings allow it?",
                          .x_label = "surroundings in that direction [tenths of all]",
                          .y_label = "extent of the area, against other offices [share]",
                          .series = {}};
    for (std::size_t level = 0; level < level_count; ++level) {
      for (const Relation& relation : relations()) {
        const Residuals residuals{
            compute_residuals(scenes_, relation.area, level, relation.directions),
            compute_residuals(scenes_, relation.surroundings, level, relation.directions)};
        add_rows(relation, level, residuals, all, result);
        if (relation.directions > 1 && relation.id != "shape_against_parallax") {
          plot.series.push_back(mean_by_decile(relation, level, residuals));
        }
      }
    }
    add_plot(result, "fig10_shape_against_surroundings.svg",
             "The open question of figure 10: how much farther or less far the area reaches in a "
             "direction than in other offices, by how the surroundings there differ from those in "
             "other offices.",
             plot);
  }

 private:
  static constexpr std::array<std::size_t, 4> shown_places{1, 4, 8, 15};
  static constexpr int bootstrap_draws = 500;

  static void add_rows(const Relation& relation, std::size_t level, const Residuals& residuals,
                       const std::vector<std::size_t>& all, Reproduction& result) {
    const std::string components = std::to_string(component_counts[level]);
    const std::string id = "m04.fig10." + relation.id + "_" + components;
    Random random(1, 81);
    std::vector<double> drawn;
    std::vector<double> shuffled;
    for (int draw = 0; draw < bootstrap_draws; ++draw) {
      std::vector<std::size_t> scenes(all.size());
      for (auto& scene : scenes) scene = random.index(all.size());
      drawn.push_back(rank_correlation_of_pairs(residuals, scenes, scenes));
      std::vector<std::size_t> partners = all;
      for (std::size_t i = partners.size(); i > 1; --i) {
        std::swap(partners[i - 1], partners[random.index(i)]);
      }
      shuffled.push_back(rank_correlation_of_pairs(residuals, all, partners));
    }
    add_row(result, id,
            "figure 10, left open by the authors: rank correlation over " +
                std::to_string(all.size()) + " offices, " + components + " components, of the " +
                relation.what,
            Figure(rank_correlation_of_pairs(residuals, all, all),
                   std::pair{quantile(drawn, 0.025), quantile(drawn, 0.975)}),
            "");
    add_row(
        result, id + ".by_chance",
        "figure 10: the same with the surroundings of another office at the same place (median of "
        "500 shuffles)",
        Figure(median(shuffled), std::pair{quantile(shuffled, 0.025), quantile(shuffled, 0.975)}),
        "");
  }

  // Returns the mean residual of the area per decile of the residuals of the surroundings.
  static viewer::Series mean_by_decile(const Relation& relation, std::size_t level,
                                       const Residuals& residuals) {
    std::vector<std::pair<double, double>> pairs;
    for (std::size_t s = 0; s < residuals.area.size(); ++s) {
      for (std::size_t j = 0; j < residuals.area[s].size(); ++j) {
        if (!std::isnan(residuals.area[s][j])) {
          pairs.emplace_back(residuals.surroundings[s][j], residuals.area[s][j]);
        }
      }
    }
    std::ranges::stable_sort(pairs, {}, &std::pair<double, double>::first);
    viewer::Series series{.label = relation.label + ", " + std::to_string(component_counts[level]) +
                                   " components"};
    constexpr std::size_t tenth_count = 10;
    for (std::size_t t = 0; t < tenth_count; ++t) {
      std::vector<double> values;
      for (std::size_t i = t * pairs.size() / tenth_count; i < (t + 1) * pairs.size() / tenth_count;
           ++i) {
        values.push_back(pairs[i].second);
      }
      if (values.empty()) continue;
      const auto interval = mean_interval(values, 1);
      series.add(static_cast<double>(t + 1), mean(values));
      series.y_low.push_back(interval.first);
      series.y_high.push_back(interval.second);
    }
    return series;
  }

  std::vector<SceneObservations> scenes_;
  std::vector<viewer::MapPlot> shown_maps_;
};

}  // namespace

std::unique_ptr<Experiment> make_area_shape_experiment() {
  return std::make_unique<AreaShape>();
}

}  // namespace panonav::lab
