#include "lab/y03/figures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/route/route_crossing.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_viewer/picture_plot.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

viewer::MapLayer make_line_layer(const std::string& label, viewer::PlotColour colour,
                                 const std::vector<Pose2>& poses) {
  return {.label = label, .colour = colour, .lines = {positions_of(poses)}};
}

std::vector<Pose2> to_path_frame(const LabRoute& lab, const std::vector<Pose2>& poses) {
  std::vector<Pose2> result;
  for (const Pose2& pose : poses) result.push_back(inverse(lab.world_from_path) * pose);
  return result;
}

viewer::MapLayer make_path_layer(const LabRoute& lab) {
  return make_line_layer("memorised path", viewer::PlotColour::grey,
                         to_path_frame(lab, {lab.route.poses().begin(), lab.route.poses().end()}));
}

// Returns the layers above the map of the memorised lab, in the frame of the path.
std::vector<viewer::MapLayer> prepend_room(const LabRoute& lab,
                                           std::vector<viewer::MapLayer> layers) {
  std::vector<viewer::MapLayer> all =
      viewer::scene_layers(simulation::make_scene("lab", {.seed = lab.seed}));
  const Pose2 path_from_world = inverse(lab.world_from_path);
  for (viewer::MapLayer& layer : all) {
    for (auto* shapes : {&layer.lines, &layer.filled_polygons}) {
      for (auto& shape : *shapes) {
        for (Point2& point : shape) point = path_from_world * point;
      }
    }
  }
  all.insert(all.end(), layers.begin(), layers.end());
  return all;
}

// Returns the column of a line that is shown at position i from the left: azimuth decreases to the
// right, and straight ahead is in the middle.
std::size_t shown_column(std::size_t i, std::size_t columns) {
  return (2 * columns + columns / 2 - i) % columns;
}

viewer::PicturePlot make_panorama_plot(const LabRoute& lab, const std::string& title) {
  const auto columns = static_cast<std::size_t>(lab.route.columns());
  viewer::PicturePlot plot{.title = title,
                           .x_label = "azimuth from straight ahead [degrees], left positive",
                           .y_label = "distance along the path [m]",
                           .x_range = {180.0, -180.0},
                           .y_range = {0.0, lab.route.length_m()},
                           .columns = lab.route.columns(),
                           .rows = static_cast<int>(lab.route.size()),
                           .x_tick = 45.0};
  for (std::size_t row = 0; row < lab.route.size(); ++row) {
    const auto line = lab.route.line(row);
    for (std::size_t i = 0; i < columns; ++i) {
      plot.values.push_back(static_cast<float>(line[shown_column(i, columns)]));
    }
  }
  // Scale brightness to black .. white, for readers.
  const float max_value = std::max(1.0F, std::ranges::max(plot.values));
  for (float& value : plot.values) value /= max_value;
  return plot;
}

}  // namespace

void draw_route_panorama(const LabRoute& lab, Reproduction& result) {
  const std::string file = "figure_03_route_panorama.svg";
  add_plot(result, file,
           "The route panorama of the straight path [Y03 figure 3], the start at the bottom. "
           "Things ahead and behind keep their place, things beside the path wander by.",
           make_panorama_plot(lab, "Route panorama: each row is the horizon at one place"));
}

void draw_virtual_view(const LabRoute& lab, const LineDrive& lateral_drive, Reproduction& result) {
  const std::size_t middle = lateral_drive.truth.size() / 2;
  const Pose2& pose = lateral_drive.truth[middle];
  const Pose2 in_path = inverse(lab.world_from_path) * pose;
  const auto columns = static_cast<std::size_t>(lab.route.columns());
  std::vector<RouteCrossing> crossings(columns);
  find_crossings(lab.route.poses(), 0, pose.position(), equal_directions(columns), crossings);
  viewer::PicturePlot plot =
      make_panorama_plot(lab, "Light blue: where a viewpoint beside the path finds what it sees");
  // The directions of crossings are in the world frame. The path is straight, so one shift by its
  // heading applies to all lines.
  const double turn =
      lab.world_from_path.heading_rad * static_cast<double>(columns) / radians(360.0);
  const auto rows = static_cast<int>(lab.route.size());
  for (std::size_t i = 0; i < columns; ++i) {
    const auto column = static_cast<std::size_t>(std::lround(
        static_cast<double>(shown_column(i, columns)) + turn + 2.0 * static_cast<double>(columns)));
    const RouteCrossing& crossing = crossings[column % columns];
    if (crossing.along < 0.0F) continue;
    const auto row = static_cast<int>(std::lround(crossing.along));
    for (int r = std::max(0, row - 1); r <= std::min(rows - 1, row + 1); ++r) {
      plot.values[static_cast<std::size_t>(r) * columns + i] =
          std::numeric_limits<float>::quiet_NaN();
    }
  }
  const std::string where = std::to_string(std::lround(100.0 * in_path.y_m)) +
                            " cm to the left of the path, " +
                            std::to_string(std::lround(100.0 * in_path.x_m)) + " cm along it";
  add_plot(result, "figure_05_curve.svg",
           "Eq. 5 for a viewpoint " + where +
               " [Y03 figure 5]: along this curve the route panorama holds what is seen there.",
           plot);
  const auto shown = RouteLines(lab.route).synthesise(pose);
  viewer::Series truth{.label = "seen there", .style = viewer::SeriesStyle::lines};
  viewer::Series synthesised{.label = "synthesised from the route panorama",
                             .style = viewer::SeriesStyle::points};
  for (std::size_t i = 0; i < columns; ++i) {
    const std::size_t c = shown_column(i, columns);
    const double azimuth = 180.0 - 360.0 * static_cast<double>(i) / static_cast<double>(columns);
    truth.add(azimuth, static_cast<double>(lateral_drive.lines[middle][c]));
    if (!std::isfinite(shown[c])) continue;
    synthesised.add(azimuth, static_cast<double>(shown[c]));
  }
  add_plot(result, "figure_05_lines.svg",
           "The line synthesised at that viewpoint, where no picture was taken, and the one that a "
           "camera sees there. Ahead and behind, the lines of sight do not cross the path.",
           viewer::LinePlot{.title = "The horizon " + where,
                            .x_label = "azimuth from straight ahead [degrees], left positive",
                            .y_label = "brightness",
                            .series = {truth, synthesised},
                            .x_range = std::pair(-180.0, 180.0)});
}

void draw_drives(const LabRoute& lab, const LocalisedDrives& drives, Reproduction& result) {
  const auto panel = [&](const std::string& title, const LineDrive& drive, const DriveErrors& fit,
                         const DriveErrors& contours) {
    return viewer::MapPlot{
        title,
        prepend_room(lab, {make_path_layer(lab),
                           make_line_layer("true", viewer::PlotColour::black,
                                           to_path_frame(lab, drive.truth)),
                           make_line_layer("contours, as published", viewer::PlotColour::vermilion,
                                           to_path_frame(lab, contours.poses)),
                           make_line_layer("direct fit", viewer::PlotColour::blue,
                                           to_path_frame(lab, fit.poses))})};
  };
  const std::string file = "figure_09_drives.svg";
  add_plot(result, file,
           "A robot crosses the memorised path at 30 degrees [Y03 figure 9]. The direct fit "
           "lies on the true drive.",
           std::vector<viewer::MapPlot>{
               panel("scene as memorised", lab.across, drives.fit, drives.contours),
               panel("things moved, a tenth of what is seen", lab.across_changed,
                     drives.changed_fit, drives.changed_contours)},
           2);
  const auto series = [](const std::string& label, const DriveErrors& errors) {
    viewer::Series line{.label = label, .style = viewer::SeriesStyle::lines};
    for (std::size_t i = 0; i < errors.position_m.size(); ++i) {
      line.add(static_cast<double>(i), 100.0 * errors.position_m[i]);
    }
    return line;
  };
  const std::string errors_file = "figure_09_errors.svg";
  add_plot(result, errors_file, "The errors of these drives, image by image.",
           viewer::LinePlot{.title = "How far off along these drives",
                            .x_label = "image, 5 cm apart",
                            .y_label = "error of the position [cm]",
                            .series = {series("contours", drives.contours),
                                       series("contours, things moved", drives.changed_contours),
                                       series("direct fit", drives.fit),
                                       series("direct fit, things moved", drives.changed_fit)}});
}

void draw_goal_run(const LabRoute& lab, const GoalRun& run, Reproduction& result) {
  viewer::MapLayer goals{.label = "start, sub-goal and goal", .colour = viewer::PlotColour::green};
  for (const Point2 point : goal_run_points()) goals.squares.push_back(point);
  const std::string file = "figure_10_goal.svg";
  add_plot(result, file,
           "Closed loop under proportional control [Y03 figure 10]; the estimate lies on the true "
           "drive.",
           viewer::MapPlot{"To a goal over a sub-goal off the path",
                           prepend_room(lab, {make_path_layer(lab),
                                              make_line_layer("true", viewer::PlotColour::black,
                                                              to_path_frame(lab, run.truth)),
                                              make_line_layer("estimate", viewer::PlotColour::blue,
                                                              to_path_frame(lab, run.estimate)),
                                              goals})});
}

}  // namespace panonav::lab
