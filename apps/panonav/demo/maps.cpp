#include "demo/maps.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/pipeline/arrangement.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::command {

namespace {

constexpr double spacing_m = 0.1;
constexpr int components = 15;

viewer::MapPlot draw_drive(const simulation::PlaceRecording& place,
                           const simulation::MappingRecording& recording,
                           const simulation::MappedRecording& mapped) {
  viewer::MapPlot plot{.title = "A drive through rooms",
                       .layers = viewer::scene_layers(place.scene)};
  plot.layers.push_back(
      {.label = "true path", .colour = viewer::PlotColour::black, .lines = {mapped.truth}});
  plot.layers.push_back(
      {.label = "odometry alone",
       .colour = viewer::PlotColour::vermilion,
       .lines = {simulation::align_to(positions_of(recording.wheels), mapped.truth)}});
  plot.layers.push_back({.label = "map from the views",
                         .colour = viewer::PlotColour::blue,
                         .lines = {simulation::align_to(mapped.estimate, mapped.truth)}});
  return plot;
}

/// Poses and groups of the views at one step of the arrangement.
struct GrowthStep {
  std::vector<Pose2> poses;
  std::vector<std::size_t> groups;
};

/// Draws the views as squares, coloured by their true positions from west to east, so that a
/// correct map shows a colour gradient.
std::vector<viewer::MapLayer> colour_by_position(const std::vector<Point2>& positions,
                                                 const std::vector<Point2>& truth) {
  constexpr std::array colours{viewer::PlotColour::blue,   viewer::PlotColour::sky,
                               viewer::PlotColour::green,  viewer::PlotColour::yellow,
                               viewer::PlotColour::orange, viewer::PlotColour::vermilion};
  std::vector<viewer::MapLayer> layers;
  for (const viewer::PlotColour colour : colours) layers.push_back({.colour = colour});
  layers.front().label = "views taken in the west";
  layers.back().label = "views taken in the east";
  const auto [west, east] = std::ranges::minmax(truth, {}, &Point2::x_m);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double share = (truth[i].x_m - west.x_m) / std::max(1e-9, east.x_m - west.x_m);
    const auto strip = static_cast<std::size_t>(share * static_cast<double>(colours.size()));
    layers[std::min(strip, colours.size() - 1)].squares.push_back(positions[i]);
  }
  return layers;
}

/// Animates how the views form groups. Groups are drawn at their final positions, other views at
/// random positions.
viewer::MapAnimation draw_growth(const Lattice& arranged, const VisualMemory& office,
                                 const std::vector<GrowthStep>& growth, std::uint64_t seed) {
  std::vector<Point2> truth;
  std::vector<Point2> ends;
  for (const Lattice::Node& node : arranged.nodes) {
    truth.push_back(office.info(node.view).pose->position());
    ends.push_back(node.pose.position());
  }
  ends = simulation::align_to(ends, truth);
  std::vector<Point2> random_positions = ends;
  Random random(seed, 1);
  for (std::size_t i = random_positions.size(); i > 1; --i) {
    std::swap(random_positions[i - 1], random_positions[static_cast<std::size_t>(random.index(i))]);
  }
  viewer::MapAnimation map{.title = "Arrangement of the views"};
  map.frames.push_back(
      {.title = "random positions", .layers = colour_by_position(random_positions, truth)});
  for (const GrowthStep& growth_step : growth) {
    std::map<std::size_t, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < growth_step.groups.size(); ++i)
      groups[growth_step.groups[i]].push_back(i);
    std::vector<Point2> positions = random_positions;
    std::size_t found = 0;
    for (const auto& [unused, views] : groups) {
      if (views.size() < 3) continue;
      std::vector<Point2> now;
      std::vector<Point2> end;
      for (const std::size_t view : views) {
        now.push_back(growth_step.poses[view].position());
        end.push_back(ends[view]);
      }
      now = simulation::align_to(now, end);
      for (std::size_t i = 0; i < views.size(); ++i) positions[views[i]] = now[i];
      found += views.size();
    }
    map.frames.push_back({.title = std::to_string(found) + " of " + std::to_string(truth.size()) +
                                   " views in groups",
                          .layers = colour_by_position(positions, truth)});
  }
  viewer::MapLayer springs{.label = "springs", .colour = viewer::PlotColour::light_grey};
  for (const Lattice::Spring& spring : arranged.springs) {
    if (spring.weight >= min_spring_weight)
      springs.lines.push_back({ends[spring.a], ends[spring.b]});
  }
  map.frames.push_back({.title = "done", .layers = {springs}});
  std::ranges::move(colour_by_position(ends, truth), std::back_inserter(map.frames.back().layers));
  return map;
}

viewer::MapPlot draw_truth(const VisualMemory& office) {
  std::vector<Point2> truth;
  for (const ViewId view : office.views()) {
    truth.push_back(office.info(view).pose->position());
  }
  return {.title = "True positions", .layers = colour_by_position(truth, truth)};
}

/// Returns the longer side of the bounding box of the views.
double room_length_m(const VisualMemory& office) {
  std::vector<double> x_m;
  std::vector<double> y_m;
  for (const ViewId view : office.views()) {
    x_m.push_back(office.info(view).pose->x_m);
    y_m.push_back(office.info(view).pose->y_m);
  }
  const auto [west, east] = std::ranges::minmax(x_m);
  const auto [south, north] = std::ranges::minmax(y_m);
  return std::max(east - west, north - south);
}

std::string format_centimetres(double metres) {
  return format_fixed(100.0 * metres, 0) + " cm";
}

std::vector<std::pair<std::string, std::string>> make_figures(const DemoMaps& maps,
                                                              const VisualMemory& office,
                                                              std::size_t drive_views) {
  std::vector<std::pair<std::string, std::string>> figures;
  if (maps.lattice) {
    figures.push_back(
        {format_centimetres(maps.lattice->truth_from_map.rms_m),
         "root mean square error of the computed positions of the views, in a room " +
             format_fixed(room_length_m(office), 1) + " m long; this error is " +
             format_fixed(100.0 * maps.lattice->truth_from_map.rms_m / room_length_m(office), 1) +
             " % of the length of the room"});
  }
  figures.push_back({format_centimetres(maps.map_rms_m),
                     "error of the map from the images of a drive that is " +
                         format_fixed(spacing_m * static_cast<double>(drive_views), 0) +
                         " m long"});
  figures.push_back(
      {format_centimetres(maps.wheels_rms_m), "error of the path from odometry alone"});
  return figures;
}

}  // namespace

DemoMaps demonstrate_maps(const VisualMemory& office, std::uint64_t seed, bool quick,
                          Session& session, viewer::ReportPage& page) {
  constexpr std::size_t frames = 40;
  DemoMaps maps;
  std::vector<GrowthStep> growth;
  std::size_t step_count = 0;
  maps.arranged =
      arrange(office, {}, {}, session.executor(),
              [&](std::span<const Pose2> poses, std::span<const std::size_t> groups) {
                if (step_count++ % (office.size() / frames + 1) != 0) return;
                growth.push_back({{poses.begin(), poses.end()}, {groups.begin(), groups.end()}});
              });
  maps.lattice = compare_with_ground_truth(maps.arranged, office);

  const simulation::PlaceRecording place =
      simulation::make_empty_place(simulation::make_scene("loop", {.seed = seed}), seed,
                                   {.columns = 256, .rays_per_axis = 1}, session.executor());
  const simulation::MappingRecording recording = simulation::record_for_mapping(
      place, drive(place, {}, spacing_m, quick ? 60 : 200), components,
      simulation::make_noisy_wheels(), seed, session.executor());
  const simulation::MappedRecording mapped =
      map_recording(recording, {.odometry = {.camera_height_m = place.scene.camera_height_m}});
  maps.map_error = simulation::shape_error(mapped.estimate, mapped.truth);
  maps.wheels_error = simulation::shape_error(positions_of(recording.wheels), mapped.truth);
  maps.map_rms_m = align(mapped.estimate, mapped.truth, {.allow_scale = true}).rms_m;
  maps.wheels_rms_m =
      align(positions_of(recording.wheels), mapped.truth, {.allow_scale = true}).rms_m;

  const std::string arranged =
      maps.lattice ? format_centimetres(maps.lattice->truth_from_map.rms_m) : "none";
  page.begin_part("Maps", {arranged, "error of a map that was made from images alone"});
  page.add_text(
      "In this part, an algorithm makes a map from images alone. It knows neither the order of the "
      "images nor their positions. It connects similar views by virtual springs, which pull the "
      "views to their positions.");
  page.add_plots(
      {{draw_growth(maps.arranged, office, growth, seed),
        "At first the positions are random. Similar views form groups, and the groups grow until "
        "all views are connected. The animation draws each group at its final position from the "
        "beginning. The map is rotated and scaled to fit the true positions, because the images "
        "show neither the north direction nor lengths in metres."},
       {draw_truth(office),
        "The true positions, which the algorithm did not use. In both maps, the colour of a view "
        "shows its true position from west to east. If the result were perfect, the last step of "
        "the other map would look like this map."}});
  page.add_text(
      "In a second test, a robot drives through unknown rooms and makes a map of its path from "
      "images, without odometry. When the robot passes a place again, it recognises this place and "
      "corrects the map.");
  page.add_plots({{draw_drive(place, recording, mapped),
                   "A drive with " + std::to_string(recording.truth.size()) + " views, one every " +
                       format_centimetres(spacing_m) +
                       ". Black: true path. Blue: map from images. Orange: for comparison, the "
                       "path from the odometry of a low-cost robot. The blue and the orange path "
                       "are scaled to the size of the true path."}});
  page.add_figures(make_figures(maps, office, recording.truth.size()));
  return maps;
}

}  // namespace panonav::command
