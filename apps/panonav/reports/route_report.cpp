#include "reports/route_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "cli/session.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav_viewer/picture_plot.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/report_page.hpp"

namespace panonav::command {

namespace {

/// Copies a line with columns that run clockwise and the forward direction in the middle. `to` has
/// space for `line.size()` values.
void copy_line_clockwise(std::span<const float> line, float* to) {
  const std::size_t columns = line.size();
  for (std::size_t i = 0; i < columns; ++i) {
    to[i] = line[(2 * columns + columns / 2 - i) % columns];
  }
}

viewer::MapLayer draw_path_layer(std::span<const Pose2> path) {
  viewer::MapLayer layer{.label = "stored route", .colour = viewer::PlotColour::grey};
  layer.lines.push_back(positions_of(path));
  return layer;
}

/// Draws the lines of the route at equal steps along the path, from the bottom to the top.
viewer::PicturePlot draw_panorama(const RoutePanorama& route, LengthUnit unit) {
  constexpr int max_rows = 400;
  const double length_m = route.length_m();
  const int rows = std::clamp(static_cast<int>(route.size()), 1, max_rows);
  const auto columns = static_cast<std::size_t>(route.columns());
  viewer::PicturePlot plot{
      .title = "The route panorama: each row is the horizon at one place",
      .x_label = "azimuth from straight ahead [degrees], left positive",
      .y_label = "distance along the route [" + std::string(to_string(unit)) + "]",
      .x_range = {180.0, -180.0},
      .y_range = {0.0, std::max(length_m, 1e-3)},
      .columns = route.columns(),
      .rows = rows,
      .x_tick = 45.0};
  plot.values.resize(columns * static_cast<std::size_t>(rows));
  double travelled_m = 0.0;
  std::size_t line = 0;
  std::vector<float> grey(columns);
  for (int row = 0; row < rows; ++row) {
    const double middle_m = length_m * (row + 0.5) / rows;
    // The line nearest to the middle of the row.
    while (line + 1 < route.size()) {
      const double step_m =
          distance(route.poses()[line].position(), route.poses()[line + 1].position());
      if (travelled_m + 0.5 * step_m > middle_m) break;
      travelled_m += step_m;
      ++line;
    }
    const auto bytes = route.line(line);
    for (std::size_t c = 0; c < columns; ++c) grey[c] = static_cast<float>(bytes[c]) / 255.0F;
    copy_line_clockwise(grey, plot.values.data() + static_cast<std::size_t>(row) * columns);
  }
  return plot;
}

/// Returns the indices of up to `max_count` images on the route, at equal intervals.
std::vector<std::size_t> choose_images_on_route(const std::vector<FollowedImage>& images,
                                                std::size_t max_count) {
  std::vector<std::size_t> on_route;
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (images[i].fix) on_route.push_back(i);
  }
  if (on_route.size() <= max_count) return on_route;
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < max_count; ++k) {
    chosen.push_back(on_route[k * (on_route.size() - 1) / (max_count - 1)]);
  }
  return chosen;
}

/// Draws two bands for each chosen image: the observed line above the line that the route predicts.
viewer::PicturePlot draw_lines(const RouteLines& route, const std::vector<FollowedImage>& images,
                               const std::vector<std::size_t>& chosen) {
  constexpr int band = 3;
  constexpr int gap = 1;
  constexpr int rows_per_pair = 2 * band + gap;
  const auto columns = static_cast<std::size_t>(route.columns());
  const int rows = rows_per_pair * static_cast<int>(chosen.size());
  viewer::PicturePlot plot{
      .title = "Seen by the robot (upper band) and predicted from the route (lower band)",
      .x_label = "azimuth from straight ahead [degrees], left positive",
      .y_label = "image, last image at the top",
      .x_range = {180.0, -180.0},
      .y_range = {0.0, static_cast<double>(chosen.size())},
      .columns = route.columns(),
      .rows = rows,
      .x_tick = 45.0,
      .y_tick = 1.0};
  plot.values.assign(columns * static_cast<std::size_t>(rows),
                     std::numeric_limits<float>::quiet_NaN());
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const FollowedImage& image = images[chosen[k]];
    const auto predicted = route.synthesise(image.fix->pose);
    for (int row = 0; row < 2 * band; ++row) {
      const auto& line = row < band ? predicted : image.line;
      copy_line_clockwise(
          line, plot.values.data() + (k * rows_per_pair + static_cast<std::size_t>(row)) * columns);
    }
  }
  return plot;
}

viewer::MapPlot draw_path(const RouteLines& route, const std::vector<FollowedImage>& images,
                          LengthUnit unit) {
  viewer::MapLayer truth{.label = "ground truth", .colour = viewer::PlotColour::black};
  viewer::MapLayer fixes{.label = "computed positions", .colour = viewer::PlotColour::blue};
  viewer::MapLayer changed{.label = "changed scene", .colour = viewer::PlotColour::orange};
  viewer::MapLayer off_route{.label = "true position while off the route",
                             .colour = viewer::PlotColour::vermilion};
  std::vector<Point2> true_path;
  for (const FollowedImage& image : images) {
    if (image.truth) true_path.push_back(image.truth->position());
    if (image.fix) fixes.dots.push_back(image.fix->pose.position());
    if (image.fix && !image.changed.empty()) {
      changed.circles.push_back(image.fix->pose.position());
    }
    if (!image.fix && image.truth) off_route.crosses.push_back(image.truth->position());
  }
  if (true_path.size() > 1) truth.lines.push_back(std::move(true_path));
  return {.title = "Map",
          .layers = {draw_path_layer(route.poses()), truth, changed, fixes, off_route},
          .unit = to_string(unit)};
}

viewer::LinePlot draw_errors(const std::vector<FollowedImage>& images) {
  viewer::Series position{.label = "position [cm]", .style = viewer::SeriesStyle::points};
  viewer::Series along{.label = "along the route [cm]", .style = viewer::SeriesStyle::points};
  viewer::Series lost{.label = "not on this route", .style = viewer::SeriesStyle::points};
  for (std::size_t i = 0; i < images.size(); ++i) {
    const FollowedImage& image = images[i];
    const auto number = static_cast<double>(i + 1);
    if (!image.fix) {
      lost.add(number, 0.0);
    } else if (image.truth) {
      position.add(number, 100.0 * distance(image.fix->pose.position(), image.truth->position()));
      along.add(number, 100.0 * std::abs(image.fix->along_m - image.true_place->along_m));
    }
  }
  return {.title = "Errors",
          .x_label = "image",
          .y_label = "error [cm]",
          .series = {position, along, lost}};
}

viewer::LinePlot draw_correlations(const std::vector<FollowedImage>& images) {
  viewer::Series correlation{.label = "of seen and predicted line",
                             .style = viewer::SeriesStyle::lines_and_points};
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (!images[i].fix) continue;
    correlation.add(static_cast<double>(i + 1), images[i].fix->correlation);
  }
  return {.title = "Correlation of seen and predicted lines",
          .x_label = "image",
          .y_label = "correlation",
          .series = {correlation}};
}

std::vector<viewer::RouteMark> make_marks(const std::vector<FollowedImage>& images) {
  std::vector<viewer::RouteMark> marks;
  for (const FollowedImage& image : images) {
    viewer::RouteMark& mark = marks.emplace_back();
    if (image.fix) mark.along_m = image.fix->along_m;
    if (image.true_place) mark.true_along_m = image.true_place->along_m;
    for (const RouteChanges::AzimuthRange& range : image.changed) {
      mark.changed_deg.emplace_back(degrees(range.from_rad), degrees(range.to_rad));
    }
  }
  return marks;
}

viewer::MapPlot draw_chain(const SnapshotChain& chain, const std::vector<ChainStep>& steps) {
  viewer::MapLayer legs{.label = "stored route", .colour = viewer::PlotColour::grey};
  viewer::MapLayer snapshots{.label = "snapshots", .colour = viewer::PlotColour::black};
  legs.lines.emplace_back();
  for (const ChainNode& node : chain.nodes()) {
    legs.lines.back().push_back(node.position);
    if (node.has_snapshot()) snapshots.squares.push_back(node.position);
  }
  constexpr std::array colours{viewer::PlotColour::blue, viewer::PlotColour::green,
                               viewer::PlotColour::orange, viewer::PlotColour::purple,
                               viewer::PlotColour::vermilion};
  constexpr std::array states{ChainState::travelling, ChainState::homing, ChainState::searching,
                              ChainState::arrived, ChainState::lost};
  viewer::MapPlot plot{.title = "Map", .layers = {legs, snapshots}};
  for (std::size_t i = 0; i < states.size(); ++i) {
    viewer::MapLayer layer{.label = to_string(states[i]), .colour = colours[i]};
    const bool is_end = states[i] == ChainState::arrived || states[i] == ChainState::lost;
    for (const ChainStep& step : steps) {
      if (step.decision.state != states[i]) continue;
      (is_end ? layer.crosses : layer.dots).push_back(step.pose.position());
    }
    plot.layers.push_back(std::move(layer));
  }
  return plot;
}

viewer::LinePlot draw_snapshot_numbers(const std::vector<ChainStep>& steps) {
  viewer::Series series{.label = "", .style = viewer::SeriesStyle::lines_and_points};
  for (std::size_t i = 0; i < steps.size(); ++i) {
    series.add(static_cast<double>(i + 1), static_cast<double>(steps[i].snapshot));
  }
  return {.title = "Snapshot to which the robot moves",
          .x_label = "image",
          .y_label = "snapshot",
          .series = {series}};
}

void add_median_figure(std::vector<std::pair<std::string, std::string>>& figures,
                       const std::vector<double>& errors, double scale, int digits,
                       const std::string& unit, const std::string& meaning) {
  if (errors.empty()) return;
  figures.emplace_back(format_fixed(scale * median(errors), digits) + unit, meaning);
}

}  // namespace

void write_record_report(const std::filesystem::path& folder, const std::string& name,
                         const RouteRecorder::Recorded& recorded, LengthUnit unit) {
  const RoutePanorama& route = recorded.route;
  viewer::MapLayer path = draw_path_layer(route.poses());
  viewer::MapLayer start{.label = "start", .colour = viewer::PlotColour::green};
  start.squares.push_back(route.poses().front().position());
  viewer::ReportPage page("Route '" + name + "'",
                          "For each place of a drive, panonav stored one line of pixels: what the "
                          "camera saw all around, at the height of the horizon. From these lines "
                          "and their positions, route follow computes where a robot is.");
  page.add_figures(
      {{format_fixed(route.length_m(), 1) + " " + to_string(unit), "long"},
       {std::to_string(route.size()), "lines of " + std::to_string(route.columns()) + " pixels"},
       unit == LengthUnit::metres
           ? std::pair{format_fixed(1e-6 * recorded.bytes_per_km(), 2) + std::string(" MB"),
                       std::string("per kilometre in the memory")}
           : std::pair{
                 format_fixed(1e-3 * static_cast<double>(recorded.bytes), 0) + std::string(" kB"),
                 std::string("in the memory")}});
  page.begin_section("The route panorama");
  page.add_text(
      "All lines above each other: each row of this picture is the line of one place. The start is "
      "at the bottom, the end at the top. What was ahead of the robot is in the middle, what was "
      "behind it at both sides. An object that the robot passes moves from the middle to one side, "
      "a near object faster than a distant one.");
  page.add_plots({{draw_panorama(route, unit), "The stored lines, from the start upwards"}});
  page.begin_section("Route");
  page.add_plots(
      {{viewer::MapPlot{.title = "Map", .layers = {path, start}, .unit = to_string(unit)},
        "Where the lines were recorded"}});
  page.write(folder, "index.html", "panonav route record");
}

void write_follow_report(const std::filesystem::path& folder, const FollowedRoute& route,
                         const std::vector<FollowedImage>& images, const FollowSummary& summary,
                         viewer::RunPage replay_page) {
  const auto chosen = choose_images_on_route(images, 8);
  std::vector<std::pair<std::string, std::string>> figures{
      {std::to_string(summary.on_route) + " of " + std::to_string(summary.images),
       "images on the route"}};
  for (const auto& [count, origin] : {std::pair{summary.predicted, RouteFix::Origin::prediction},
                                      {summary.recovered, RouteFix::Origin::recovery},
                                      {summary.searched, RouteFix::Origin::search}}) {
    if (count > 0) {
      figures.emplace_back(std::to_string(count), "of these " + std::string(format_origin(origin)));
    }
  }
  add_median_figure(figures, summary.position_m, 100.0, 1, " cm", "median error of position");
  add_median_figure(figures, summary.along_m, 100.0, 1, " cm", "median error along the route");
  add_median_figure(figures, summary.heading_rad, degrees(1.0), 2, " degrees",
                    "median error of heading");
  viewer::ReportPage page(
      "Following route '" + route.name + "'",
      "A robot drove along the recorded route again, or beside it. For each of its images, panonav "
      "computed where the robot was: at the position and heading from which the stored lines look "
      "most like the image.");
  page.add_figures(figures);
  page.add_text("How each position was found: " + std::string(origin_explanation) + ".");
  replay_page.set_route(draw_panorama(route.panorama, route.unit), make_marks(images));
  page.begin_section("The run, image by image");
  page.add_text(
      "The map shows the recorded route and the robot's position. The wide grey picture below it "
      "contains the recorded lines above each other, the start of the route at the bottom, the "
      "forward direction in the middle; its horizontal line shows how far along the route the "
      "robot is. Orange marks are directions in which the scene has changed since the recording.");
  page.add_run(replay_page);
  page.begin_section("Route");
  page.add_plots({{draw_path(route.lines, images, route.unit),
                   "Stored route, computed positions, and the true path if it is known"}});
  if (!chosen.empty()) {
    page.begin_section("Seen and predicted lines");
    page.add_text(
        "A check of the answers. Of each pair, the upper band is what the robot saw at the height "
        "of the horizon, the lower band what it should see at the computed position according to "
        "the recorded lines. The better both agree, the safer is the answer. Light blue: the "
        "recorded lines do "
        "not show this direction. The correlation measures the agreement: 1 for the same pattern, "
        "0 for nothing in common.");
    page.add_plots(
        {{draw_lines(route.lines, images, chosen), "Seen lines and predicted lines of some images"},
         {draw_correlations(images), "Correlation of seen and predicted lines, image by image"}});
  }
  if (!summary.position_m.empty()) {
    page.begin_section("Errors");
    page.add_plots(
        {{draw_errors(images),
          "Distance of each computed position from the true one, which the data set contains"}});
  }
  const auto stretches = find_changed_sections(images);
  if (!stretches.empty()) {
    page.begin_section("Changed scene");
    page.add_text(
        "On these sections of the route the stored lines do not match the images in some "
        "directions. The scene has changed there.");
    std::vector<std::vector<std::string>> rows;
    for (const auto& [from_m, to_m] : stretches) {
      rows.push_back({format_fixed(from_m, 2) + " " + to_string(route.unit),
                      format_fixed(to_m, 2) + " " + to_string(route.unit)});
    }
    page.add_table({"from", "to"}, rows);
  }
  page.write(folder, "index.html", "panonav route follow");
}

void write_chain_report(const std::filesystem::path& folder, const std::string& name,
                        const SnapshotChain& chain, const std::vector<ChainStep>& steps,
                        const viewer::RunPage& replay_page) {
  const ChainStep& last = steps.back();
  const ChainSummary summary = summarise_chain(chain);
  viewer::ReportPage page(
      "Following route '" + name + "'",
      "A robot drove along a chain of snapshots: a few small views, with straight legs by odometry "
      "between them. It travels by odometry to the next snapshot, and then compares its view with "
      "the stored one to move to the place where that was taken. A snapshot that is not where "
      "odometry expects it is searched for along a spiral.");
  page.add_figures({{to_string(last.decision.state), "after the last image"},
                    {std::to_string(last.snapshot) + " of " + std::to_string(summary.snapshots),
                     "snapshot to which it moved"},
                    {format_fixed(summary.length_m, 1) + " m", "long"},
                    {std::to_string(summary.bytes) + " bytes", "for the whole route"}});
  page.begin_section("The run, image by image");
  page.add_text(
      "The map shows the chain, its snapshots and the estimated path of the robot; the facts name "
      "the snapshot to which it moves, and its next motion.");
  page.add_run(replay_page);
  page.begin_section("Route");
  page.add_plots({{draw_chain(chain, steps),
                   "The chain, and the positions of the robot by odometry and snapshots"},
                  {draw_snapshot_numbers(steps), "Progress along the chain"}});
  page.write(folder, "index.html", "panonav route follow");
}

}  // namespace panonav::command
