// [M04] figures 9 and 10: hierarchical localisation, and how the shape of its areas follows the
// objects around.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "panonav/evaluation/m04_figures.hpp"
#include "panonav/evaluation/plot.hpp"
#include "panonav/evaluation/statistics.hpp"
#include "panonav/geometry/voronoi.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

namespace {

constexpr int kComponents = 15;
// Views within 25 % of the best known dissimilarity stay candidates: wide enough that the place
// itself is not dropped by noise at one component, narrow enough that areas shrink visibly. The
// rows report what it costs and misses.
constexpr double kTolerance = 0.25;

struct PlaceMemory {
  VisualMemory memory;
  std::vector<std::vector<Point2>> cells;  // by order of the references
};

float largest_magnitude(const std::vector<FourierSignature>& signatures) {
  float largest = 1e-6F;
  for (const auto& signature : signatures) {
    for (const float magnitude : signature.magnitudes()) largest = std::max(largest, magnitude);
  }
  return largest;
}

PlaceMemory remember(const PlaceRecording& recording) {
  std::vector<FourierSignature> signatures;
  std::vector<Point2> positions;
  for (const auto& view : recording.references) {
    signatures.push_back(compute_signature(view.panorama, kComponents));
    positions.push_back(view.pose.position());
  }
  VisualMemory memory(signatures.front().shape(), largest_magnitude(signatures),
                      signatures.front().elevations());
  for (std::size_t i = 0; i < signatures.size(); ++i) {
    memory.append(signatures[i], {.name = "view " + std::to_string(i),
                                  .pose = ReferencePose{positions[i].x_m, positions[i].y_m, 0.0},
                                  .stamp_s = std::nullopt});
  }
  const VoronoiCells cells(positions, recording.spacing_m);
  std::vector<std::vector<Point2>> by_reference;
  for (const std::size_t site : cells.site_of()) by_reference.push_back(cells.cell(site));
  return {std::move(memory), std::move(by_reference)};
}

std::vector<std::size_t> candidate_indices(const VisualMemory& memory,
                                           const HierarchyLevel& level) {
  std::vector<std::size_t> indices;
  const auto views = memory.views();
  for (const auto& match : level.candidates) {
    indices.push_back(static_cast<std::size_t>(
        std::lower_bound(views.begin(), views.end(), match.view) - views.begin()));
  }
  return indices;
}

// Axis of the largest spread of positions and how elongated they are (1: a line, 0: round).
struct Elongation {
  double axis_rad = 0.0;
  double amount = 0.0;
};

std::optional<Elongation> elongation(const std::vector<Point2>& points) {
  if (points.size() < 4) return std::nullopt;
  Point2 centre;
  for (const auto& p : points) {
    centre.x_m += p.x_m / static_cast<double>(points.size());
    centre.y_m += p.y_m / static_cast<double>(points.size());
  }
  double xx = 0.0;
  double yy = 0.0;
  double xy = 0.0;
  for (const auto& p : points) {
    xx += (p.x_m - centre.x_m) * (p.x_m - centre.x_m);
    yy += (p.y_m - centre.y_m) * (p.y_m - centre.y_m);
    xy += (p.x_m - centre.x_m) * (p.y_m - centre.y_m);
  }
  const double difference = std::hypot(xx - yy, 2.0 * xy);
  if (difference <= 1e-9) return std::nullopt;
  return Elongation{0.5 * std::atan2(2.0 * xy, xx - yy), difference / (xx + yy)};
}

// Direction to the nearest object: against the slope of the clearance.
std::optional<double> towards_nearest_object(const FreeSpace& space, Point2 at) {
  constexpr double kStep = 0.1;
  const double dx =
      space.clearance_m({at.x_m + kStep, at.y_m}) - space.clearance_m({at.x_m - kStep, at.y_m});
  const double dy =
      space.clearance_m({at.x_m, at.y_m + kStep}) - space.clearance_m({at.x_m, at.y_m - kStep});
  if (std::hypot(dx, dy) < kStep) return std::nullopt;  // several objects are equally near
  return std::atan2(-dy, -dx);
}

MapPlot area_map(const PlaceRecording& recording, const PlaceMemory& place, Point2 truth,
                 const HierarchyLevel& level) {
  MapPlot map{.title = std::to_string(level.components) +
                       (level.components == 1 ? " component" : " components"),
              .layers = {}};
  MapLayer area{.label = "where it may be", .colour = "#888888"};
  for (const std::size_t i : candidate_indices(place.memory, level)) {
    area.filled_polygons.push_back(place.cells[i]);
  }
  MapLayer references{.label = "reference views", .colour = "#0072b2"};
  for (const auto& view : recording.references) references.circles.push_back(view.pose.position());
  MapLayer robot{.label = "robot", .colour = "#d55e00", .crosses = {truth}};
  map.layers = {area, references, robot};
  return map;
}

}  // namespace

void reproduce_hierarchical_areas(const std::vector<PlaceRecording>& recordings,
                                  const std::filesystem::path& folder, Reproduction& result) {
  std::vector<std::vector<double>> areas_m2(kComponents);
  std::vector<std::size_t> holding(kComponents);
  std::size_t trials = 0;
  std::size_t nested = 0;
  std::vector<double> coarse_areas;
  std::vector<double> clearances;
  std::vector<double> angles_deg;
  std::vector<MapPlot> shrinking;
  std::vector<MapPlot> places;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const PlaceRecording& recording = recordings[r];
    const PlaceMemory place = remember(recording);
    for (std::size_t q = 0; q < recording.queries.size(); ++q) {
      const PlacedView& query = recording.queries[q];
      const Point2 truth = query.pose.position();
      const auto packed =
          pack(compute_signature(query.panorama, kComponents), place.memory.full_scale());
      const auto levels = place.memory.hierarchy(packed, kTolerance, kComponents);
      ++trials;
      bool is_nested = true;
      std::size_t before = recording.references.size();
      for (const auto& level : levels) {
        const auto m = static_cast<std::size_t>(level.components - 1);
        double area = 0.0;
        bool holds_truth = false;
        for (const std::size_t i : candidate_indices(place.memory, level)) {
          area += polygon_area_m2(place.cells[i]);
          holds_truth = holds_truth || i == recording.nearest_reference(truth);
        }
        areas_m2[m].push_back(area);
        holding[m] += holds_truth ? 1 : 0;
        is_nested = is_nested && level.candidates.size() <= before;
        before = level.candidates.size();
        // The shape is looked at where the area is still broad: after 3 components.
        if (level.components == 3) {
          std::vector<Point2> positions;
          for (const std::size_t i : candidate_indices(place.memory, level)) {
            positions.push_back(recording.references[i].pose.position());
          }
          coarse_areas.push_back(area);
          clearances.push_back(recording.free_space->clearance_m(truth));
          const auto shape = elongation(positions);
          const auto object = towards_nearest_object(*recording.free_space, truth);
          if (shape && shape->amount > 0.2 && object) {
            double angle = std::abs(angle_difference(shape->axis_rad, *object));
            if (angle > 0.5 * std::numbers::pi) angle = std::numbers::pi - angle;
            angles_deg.push_back(degrees(angle));
          }
        }
        const bool shown = level.components == 1 || level.components == 3 ||
                           level.components == 6 || level.components == 15;
        if (r == 0 && q == 0 && shown)
          shrinking.push_back(area_map(recording, place, truth, level));
        if (r == 0 && q < 6 && level.components == 3) {
          places.push_back(area_map(recording, place, truth, level));
          places.back().title = "place " + std::to_string(q + 1) + ", 3 components";
        }
      }
      nested += is_nested ? 1 : 0;
    }
  }
  write_plot(folder / "fig09_hierarchical_areas.png", shrinking, 2);
  result.pictures.push_back(
      {"fig09_hierarchical_areas.png",
       "With more components the area where the robot may be shrinks around it ([M04] figure 9)."});
  write_plot(folder / "fig10_areas_at_places.png", places, 2);
  result.pictures.push_back(
      {"fig10_areas_at_places.png",
       "Areas after 3 components at six places of the same office ([M04] figure 10)."});

  LinePlot curve{.title = "Area where the robot may be, by number of components (median)",
                 .x_label = "number of components compared",
                 .y_label = "area [m^2]",
                 .series = {Series{.label = "median area"}}};
  for (int m = 0; m < kComponents; ++m) {
    const auto& values = areas_m2[static_cast<std::size_t>(m)];
    if (values.empty()) continue;
    const auto interval = median_interval(values, 1);
    curve.series[0].x.push_back(m + 1);
    curve.series[0].y.push_back(median(values));
    curve.series[0].y_low.push_back(interval.first);
    curve.series[0].y_high.push_back(interval.second);
  }
  write_plot(folder / "fig09_area_curve.png", curve);
  result.pictures.push_back(
      {"fig09_area_curve.png", "The median area over all queries and scenes."});

  for (const int m : {1, 3, 15}) {
    const auto& values = areas_m2[static_cast<std::size_t>(m - 1)];
    const std::string text = std::to_string(m);
    result.rows.push_back(
        {.id = "m04.fig9.area_" + text,
         .what = "figure 9: area where the robot may be after " + text + " component(s) (median)",
         .published = std::nullopt,
         .ours = median(values),
         .interval = median_interval(values, 1),
         .unit = "m^2",
         .target = std::nullopt});
    const Proportion holds = success_rate(holding[static_cast<std::size_t>(m - 1)], trials);
    result.rows.push_back({.id = "m04.fig9.holds_truth_" + text,
                           .what = "figure 9: the area holds the cell of the nearest reference, " +
                                   text + " component(s)",
                           .published = std::nullopt,
                           .ours = holds.value,
                           .interval = std::pair{holds.low, holds.high},
                           .unit = "",
                           .target = std::nullopt});
  }
  const Proportion all_nested = success_rate(nested, trials);
  result.rows.push_back({.id = "m04.fig9.nested",
                         .what = "figure 9: queries whose areas only ever shrink",
                         .published = std::pair{1.0, 1.0},
                         .ours = all_nested.value,
                         .interval = std::pair{all_nested.low, all_nested.high},
                         .unit = "",
                         .target = Target{Comparison::at_least, 1.0}});
  if (coarse_areas.size() >= 3) {
    result.rows.push_back(
        {.id = "m04.fig10.area_against_clearance",
         .what = "figure 10: rank correlation of the area (3 components) with the distance to the "
                 "nearest object (the authors left it open)",
         .published = std::nullopt,
         .ours = rank_correlation(coarse_areas, clearances),
         .interval = std::nullopt,
         .unit = "",
         .target = std::nullopt});
  }
  if (!angles_deg.empty()) {
    result.rows.push_back(
        {.id = "m04.fig10.axis_against_object",
         .what =
             "figure 10: angle between the long axis of the area and the direction of the nearest "
             "object (median; 45 if independent, 90 if the area stretches along the object)",
         .published = std::nullopt,
         .ours = median(angles_deg),
         .interval = median_interval(angles_deg, 1),
         .unit = "deg",
         .target = std::nullopt});
  }
}

}  // namespace panonav
