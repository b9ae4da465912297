// [M04] section 3.2: views arranged by magnitudes alone, in furnished rooms.

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "lab/m04/experiment.hpp"
#include "lab/m04/lattice_support.hpp"
#include "lab/m04/magnitude_layout.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::lab {

namespace {

// Added to the seed: the method was developed on seeds 1 to 10, the number of springs on 201 to
// 205.
constexpr std::uint64_t judged_seed_offset = 400;
// [M04] figures 14 and 15: 270 x 210 cm.
constexpr int grid_columns = 10;
constexpr int grid_rows = 8;
constexpr double grid_spacing_m = 0.3;
// Number of springs per view of the lattice of few springs (`lattice.cpp`).
constexpr int few_springs = 4;

std::vector<FourierSignature> signatures_of(const VisualMemory& memory) {
  std::vector<FourierSignature> signatures;
  for (const ViewId view : memory.views()) signatures.push_back(memory.signature(view));
  return signatures;
}

double compare_layout(const ViewGrid& grid, std::span<const Point2> positions) {
  Lattice lattice;
  for (const Point2 p : positions) lattice.nodes.push_back({.pose = {p.x_m, p.y_m, 0.0}});
  return compare_with_grid(grid, lattice).with_reflection;
}

/// Arranges as published: the curve from dissimilarity to distance and its error come from the true
/// positions, as in the paper's figures 7 and 12.
double measure_all_pairs(const ViewGrid& grid, std::span<const FourierSignature> signatures) {
  // Correlation ends where the dissimilarity of the farther quarter of all pairs begins.
  constexpr double far_share = 0.75;
  const std::size_t n = signatures.size();
  std::vector<double> dissimilarities(n * n);
  std::vector<DissimilarityCurve::Sample> pairs;
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const double value = dissimilarity_l1(signatures[a], signatures[b]);
      dissimilarities[a * n + b] = dissimilarities[b * n + a] = value;
      pairs.push_back({value, distance(grid.poses[a].position(), grid.poses[b].position())});
    }
  }
  std::ranges::sort(pairs, {}, &DissimilarityCurve::Sample::distance);
  double level = 0.0;
  const auto first = static_cast<std::size_t>(far_share * static_cast<double>(pairs.size()));
  for (std::size_t i = first; i < pairs.size(); ++i)
    level += pairs[i].dissimilarity / static_cast<double>(pairs.size() - first);
  return compare_layout(grid,
                        arrange_by_all_pairs(n, dissimilarities, DissimilarityCurve(pairs, level)));
}

/// Shape differences of the four methods, one value per variant of a scene.
struct RoomFigures {
  std::vector<double> all_pairs, springs, magnitudes, phases;
  std::vector<double> common_rows;  // magnitudes of the elevations that panoramas have, too
};

void measure_room(const std::string& scene, std::uint64_t seed, const Experiments& context,
                  RoomFigures& figures) {
  const auto record = [&](const simulation::PanoramaRendering& rendering) {
    const auto place = simulation::make_empty_place(simulation::make_scene(scene, {.seed = seed}),
                                                    seed, rendering, context.executor);
    return record_grid(place, grid_columns, grid_rows, grid_spacing_m, GridHeadings::random,
                       context.executor);
  };
  if (const auto common = context.make_common_rendering(context.options.rows, 256)) {
    const ViewGrid grid = record(*common);
    figures.common_rows.push_back(
        compare_layout(grid, arrange_by_magnitudes(signatures_of(grid.memory), context.executor)));
  }
  const ViewGrid grid = record(context.make_rendering(context.options.rows, 256));
  const auto signatures = signatures_of(grid.memory);
  figures.all_pairs.push_back(measure_all_pairs(grid, signatures));
  const LatticeOptions few{.neighbours = few_springs, .phases = false};
  figures.springs.push_back(
      compare_with_grid(grid, arrange(grid.memory, few, {}, context.executor)).with_reflection);
  figures.magnitudes.push_back(
      compare_layout(grid, arrange_by_magnitudes(signatures, context.executor)));
  figures.phases.push_back(
      compare_with_grid(grid, arrange(grid.memory, {}, {}, context.executor)).shape_difference);
}

}  // namespace

void reproduce_magnitudes_alone(const Experiments& context) {
  for (const std::string scene : {"lab", "hall", "office"}) {
    RoomFigures figures;
    for (int variant = 0; variant < context.options.scenes; ++variant) {
      measure_room(scene,
                   context.options.seed + judged_seed_offset + static_cast<std::uint64_t>(variant),
                   context, figures);
    }
    const std::string id = "m04.magnitudes." + scene;
    const std::string what = "section 3.2: shape difference of 10 x 8 views in " + scene + ", ";
    add_median(context.result, id + ".all_pairs",
               what + "springs between all pairs, curve from true positions, as published", "",
               figures.all_pairs);
    add_median(context.result, id + ".few_springs", what + "springs to 4 neighbours", "",
               figures.springs);
    if (!figures.common_rows.empty()) {
      add_median(context.result, id + ".common_rows",
                 what + "magnitudes alone, of the elevations that panoramas have, too", "",
                 figures.common_rows);
    }
    add_median(context.result, id + ".ours", what + "magnitudes alone", "", figures.magnitudes,
               at_most(0.02));
    if (!figures.common_rows.empty()) {
      context.result.rows.back().reason =
          "with the rows alone whose elevations panoramas have, too, it is " +
          to_text(median(figures.common_rows));
    }
    add_median(context.result, id + ".phases", what + "phases", "", figures.phases);
  }
}

}  // namespace panonav::lab
