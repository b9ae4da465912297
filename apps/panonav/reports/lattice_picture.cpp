#include "reports/lattice_picture.hpp"

#include <algorithm>
#include <vector>

#include "panonav/geometry/alignment.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav/pipeline/arrangement.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::command {

namespace {

/// Draws the springs that were not rejected as lines between `positions`.
viewer::MapLayer draw_springs(const Lattice& lattice,
                              const std::vector<std::optional<Point2>>& positions) {
  viewer::MapLayer layer{.label = "pairs of similar views",
                         .colour = viewer::PlotColour::light_grey};
  for (const Lattice::Spring& spring : lattice.springs) {
    const auto& a = positions[spring.a];
    const auto& b = positions[spring.b];
    if (spring.weight >= min_spring_weight && a && b) layer.lines.push_back({*a, *b});
  }
  return layer;
}

viewer::MapPlot draw_plot(std::string title, const Lattice& lattice,
                          const std::vector<std::optional<Point2>>& positions) {
  viewer::MapLayer views{.label = "views"};
  for (const auto& position : positions) {
    if (position) views.circles.push_back(*position);
  }
  return {.title = std::move(title), .layers = {draw_springs(lattice, positions), views}};
}

}  // namespace

bool has_true_positions(const Lattice& lattice, const VisualMemory& memory) {
  const auto [arranged, truth] = collect_known_positions(lattice, memory);
  return is_comparable(arranged, truth);
}

std::vector<std::optional<Point2>> align_to_truth(const Lattice& lattice,
                                                  const VisualMemory& memory) {
  const auto [arranged, truth] = collect_known_positions(lattice, memory);
  Alignment truth_from_lattice;
  if (is_comparable(arranged, truth)) {
    truth_from_lattice = align(arranged, truth, {.allow_scale = true, .allow_reflection = true});
  }
  std::vector<std::optional<Point2>> places;
  for (const Lattice::Node& node : lattice.nodes) {
    places.emplace_back();
    if (node.component == 0) places.back() = truth_from_lattice.apply(node.pose.position());
  }
  return places;
}

std::vector<viewer::MapPlot> draw_lattice(const Lattice& lattice, const VisualMemory& memory) {
  viewer::MapPlot map = draw_plot("Computed positions", lattice, align_to_truth(lattice, memory));
  if (!has_true_positions(lattice, memory)) {
    if (!lattice.metric) map.unit = "median distance to the nearest view";
    return {map};
  }
  std::vector<std::optional<Point2>> truth;
  for (const Lattice::Node& node : lattice.nodes) {
    truth.emplace_back();
    const auto& pose = memory.info(node.view).pose;
    if (node.component == 0 && pose) truth.back() = pose->position();
  }
  return {draw_plot("True positions", lattice, truth), map};
}

void write_lattice_picture(const std::filesystem::path& path, const Lattice& lattice,
                           const VisualMemory& memory) {
  const auto plots = draw_lattice(lattice, memory);
  viewer::write_plot(path, plots, static_cast<int>(plots.size()));
}

}  // namespace panonav::command
