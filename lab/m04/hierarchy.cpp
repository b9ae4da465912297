// [M04] figure 9: areas that shrink with the number of components compared.

#include <algorithm>
#include <optional>
#include <string>

#include "lab/m04/experiment.hpp"
#include "lab/m04/support.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/error.hpp"
#include "panonav/localisation/hierarchical.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

constexpr std::size_t level_count = m04_components;
// Views within 25 % of the best known dissimilarity stay candidates: wide enough that the place
// itself is not dropped by noise at one component, and narrow enough that areas shrink visibly. The
// result rows report the bytes read and how often the true place is lost.
constexpr double tolerance = 0.25;
constexpr double target_radius_m = 0.5;

viewer::MapPlot draw_area_map(const simulation::Scene& scene, const VisualMemory& memory,
                              const ReferenceAreas& areas, Point2 robot,
                              const LocalisationLevel& level) {
  viewer::MapPlot map{.title = std::to_string(level.components) +
                               (level.components == 1 ? " component" : " components"),
                      .layers = viewer::scene_layers(scene)};
  viewer::MapLayer area{.label = "where it may be", .colour = viewer::PlotColour::orange};
  for (const Match& match : level.candidates)
    area.filled_polygons.push_back(areas.cell(match.view));
  viewer::MapLayer references{.label = "reference views", .colour = viewer::PlotColour::blue};
  for (const ViewId view : memory.views()) {
    references.circles.push_back(memory.info(view).pose->position());
  }
  viewer::MapLayer truth{
      .label = "robot", .colour = viewer::PlotColour::vermilion, .crosses = {robot}};
  for (const viewer::MapLayer& layer : {area, references, truth}) map.layers.push_back(layer);
  return map;
}

bool contains(const std::vector<Match>& matches, ViewId view) {
  return std::ranges::any_of(matches, [&](const Match& match) { return match.view == view; });
}

class HierarchicalAreas final : public Experiment {
 public:
  void add(const simulation::PlaceRecording& place, Executor& executor) override {
    const auto signatures = compute_signatures(place.references, m04_components, executor);
    const VisualMemory memory = make_memory(place.references, signatures);
    const ReferenceAreas areas(memory);
    for (const simulation::PlacedView& query : place.queries) {
      const Point2 robot = query.pose.position();
      const auto packed =
          pack(compute_signature(query.panorama, m04_components), memory.full_scale());
      const auto levels = localise_hierarchically(memory, areas, packed, {.tolerance = tolerance});
      const ViewId nearest = memory.views()[place.nearest_reference(robot)];
      ++trials_;
      for (std::size_t m = 0; m < levels.size(); ++m) {
        areas_m2_[m].push_back(*levels[m].area_m2);
        areas_with_truth_[m] += contains(levels[m].candidates, nearest) ? 1 : 0;
      }
      const auto coarse = localise_hierarchically(
          memory, areas, packed, {.radius_m = target_radius_m, .tolerance = tolerance});
      components_needed_.push_back(coarse.back().components);
      const std::size_t scan = memory.size() * memory.shape().size();
      read_byte_fractions_.push_back(static_cast<double>(coarse.back().bytes_read) /
                                     static_cast<double>(scan));
      if (shown_maps_.empty()) {
        for (const std::size_t m : {0U, 2U, 5U, 14U}) {
          shown_maps_.push_back(draw_area_map(place.scene, memory, areas, robot, levels.at(m)));
        }
      }
    }
  }

  void report(Reproduction& result) const override {
    require(trials_ >= 1, "queries", 0.0, ">= 1");
    add_plot(
        result, "fig09_hierarchical_areas.svg",
        "With more components the area where the robot may be shrinks around it ([M04] figure 9).",
        shown_maps_, 2);
    viewer::LinePlot curve{.title = "Area where the robot may be, by number of components",
                           .x_label = "number of components compared",
                           .y_label = "area [m^2]",
                           .series = {viewer::Series{.label = "median of all queries"}}};
    for (std::size_t m = 0; m < level_count; ++m) {
      add_point(curve.series[0], static_cast<double>(m + 1), median_figure(areas_m2_[m]));
    }
    add_plot(result, "fig09_area_curve.svg", "The median area over all queries and scenes.", curve);
    for (const std::size_t m : {std::size_t{1}, std::size_t{3}, level_count}) {
      const std::string text = std::to_string(m);
      add_row(result, "m04.fig9.area_" + text,
              "figure 9: area where the robot may be after " + text +
                  (m == 1 ? " component (median)" : " components (median)"),
              median_figure(areas_m2_[m - 1]), "m^2");
      const Proportion holds = success_rate(areas_with_truth_[m - 1], trials_);
      add_row(result, "m04.fig9.holds_truth_" + text,
              "figure 9: the area holds the cell of the nearest reference, " + text +
                  (m == 1 ? " component" : " components"),
              holds, "", m == level_count ? std::optional(at_least(0.95)) : std::nullopt);
    }
    add_row(result, "m04.fig9.components_for_50_cm",
            "figure 9: components compared until the place is known to 0.5 m (median)",
            median_figure(components_needed_), "");
    add_row(result, "m04.fig9.bytes_for_50_cm",
            "figure 9: bytes read until then, as a share of all magnitudes of the memory (median)",
            median_figure(read_byte_fractions_), "");
  }

 private:
  std::size_t trials_ = 0;
  std::array<std::vector<double>, level_count> areas_m2_;
  std::array<std::size_t, level_count> areas_with_truth_{};
  std::vector<double> components_needed_;
  std::vector<double> read_byte_fractions_;
  std::vector<viewer::MapPlot> shown_maps_;
};

}  // namespace

std::unique_ptr<Experiment> make_hierarchical_areas_experiment() {
  return std::make_unique<HierarchicalAreas>();
}

}  // namespace panonav::lab
