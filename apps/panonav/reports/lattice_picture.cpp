#include "reports/lattice_picture.hpp"

#include <algorithm>
#include <vector>

#include "panonav/geometry/alignment.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::command {

namespace {

constexpr int neighbours = 8;

/// The views of the largest component that have a true position.
struct Known {
  std::vector<Point2> arranged;
  std::vector<Point2> truth;
};

Known collect_known(const Lattice& lattice, const VisualMemory& memory) {
  Known known;
  for (const Lattice::Node& node : lattice.nodes) {
    const auto& pose = memory.info(node.view).pose;
    if (node.component != 0 || !pose) continue;
    known.arranged.push_back(node.pose.position());
    known.truth.push_back(pose->position());
  }
  return known;
}

/// Springs that were not rejected, as lines between `positions`.
viewer::MapLayer draw_springs(const Lattice& lattice,
                              const std::vector<std::optional<Point2>>& positions) {
  viewer::MapLayer layer{.label = "springs", .colour = viewer::PlotColour::light_grey};
  for (const Lattice::Spring& spring : lattice.springs) {
    const auto& a = positions[spring.a];
    const auto& b = positions[spring.b];
    if (spring.weight >= 0.25 && a && b) layer.lines.push_back({*a, *b});
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

std::optional<LatticeComparison> compare_with_ground_truth(const Lattice& lattice,
                                                           const VisualMemory& memory) {
  const Known known = collect_known(lattice, memory);
  if (!is_comparable(known.arranged, known.truth)) return std::nullopt;
  const auto difference = shape_difference(known.arranged, known.truth);
  const auto alignment = align(known.arranged, known.truth, {.allow_scale = true});
  LatticeComparison comparison{.compared = known.truth.size(),
                               .shape_difference = difference.value,
                               .with_reflection = difference.with_reflection,
                               .rms_m = alignment.rms_m,
                               .scale = alignment.scale};
  if (3 * neighbours + 1 < 2 * static_cast<int>(known.truth.size())) {
    const auto kept = neighbour_preservation(known.arranged, known.truth, neighbours);
    comparison.trustworthiness = kept.trustworthiness;
    comparison.continuity = kept.continuity;
  }
  return comparison;
}

bool is_known(const Lattice& lattice, const VisualMemory& memory) {
  const Known known = collect_known(lattice, memory);
  return is_comparable(known.arranged, known.truth);
}

std::vector<std::optional<Point2>> aligned_positions(const Lattice& lattice,
                                                     const VisualMemory& memory) {
  const Known known = collect_known(lattice, memory);
  Alignment truth_from_lattice;
  if (is_comparable(known.arranged, known.truth)) {
    truth_from_lattice =
        align(known.arranged, known.truth, {.allow_scale = true, .allow_reflection = true});
  }
  std::vector<std::optional<Point2>> places;
  for (const Lattice::Node& node : lattice.nodes) {
    places.emplace_back();
    if (node.component == 0) places.back() = truth_from_lattice.apply(node.pose.position());
  }
  return places;
}

std::vector<viewer::MapPlot> draw_lattice(const Lattice& lattice, const VisualMemory& memory) {
  viewer::MapPlot map =
      draw_plot("as the views arrange themselves", lattice, aligned_positions(lattice, memory));
  if (!is_known(lattice, memory)) {
    if (!lattice.metric) map.unit = "median distance to the nearest view";
    return {map};
  }
  std::vector<std::optional<Point2>> truth;
  for (const Lattice::Node& node : lattice.nodes) {
    truth.emplace_back();
    const auto& pose = memory.info(node.view).pose;
    if (node.component == 0 && pose) truth.back() = pose->position();
  }
  return {draw_plot("as they were taken", lattice, truth), map};
}

void write_lattice_picture(const std::filesystem::path& path, const Lattice& lattice,
                           const VisualMemory& memory) {
  const auto plots = draw_lattice(lattice, memory);
  viewer::write_plot(path, plots, static_cast<int>(plots.size()));
}

}  // namespace panonav::command
