#include "reports/home_report.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "cli/session.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/voronoi.hpp"
#include "panonav_viewer/plot.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

namespace {

/// Returns up to four indices: first, last, and others at equal intervals.
std::set<std::size_t> choose_shown_answers(std::size_t count) {
  constexpr std::size_t max_shown = 4;
  std::set<std::size_t> shown;
  for (std::size_t i = 0; i < std::min(max_shown, count); ++i) {
    shown.insert(i * (count - 1) / std::max<std::size_t>(1, std::min(max_shown, count) - 1));
  }
  return shown;
}

std::string make_caption(const HomeAnswer& answer) {
  const HomingResult& result = answer.result;
  if (!result.direction_rad)
    return answer.file + ": no direction home, " + explain_no_direction(result);
  return answer.file + ": home is " + describe_direction(*result.direction_rad) + ", about " +
         format_fixed(result.distance_r(), 2) + " times as far as the objects around; " +
         describe_rotation(-result.turn_rad());
}

/// Returns a length for arrows of 0.8 times the spacing of the views, in metres; 1 if it is
/// unknown.
double arrow_length_m(const std::vector<HomeAnswer>& answers) {
  std::vector<Point2> places;
  for (const auto& answer : answers) {
    if (answer.pose) places.push_back(answer.pose->position());
  }
  return places.size() < 2 ? 1.0 : 0.8 * VoronoiCells(places).spacing_m();
}

/// Draws the directions home from above; nullopt if no view has both a pose and a direction.
std::optional<viewer::MapPlot> draw_field(const Goal& goal,
                                          const std::vector<HomeAnswer>& answers) {
  viewer::MapLayer arrows{.label = "path home", .colour = viewer::PlotColour::blue};
  viewer::MapLayer without_direction{.label = "no direction",
                                     .colour = viewer::PlotColour::vermilion};
  const double length_m = arrow_length_m(answers);
  for (const auto& answer : answers) {
    if (!answer.pose || !answer.pose->heading_rad) continue;
    const Point2 at = answer.pose->position();
    if (!answer.result.direction_rad) {
      without_direction.crosses.push_back(at);
      continue;
    }
    const double towards = *answer.pose->heading_rad + *answer.result.direction_rad;
    arrows.lines.push_back(make_arrow_line({at.x_m, at.y_m, towards}, length_m));
  }
  if (arrows.lines.empty()) return std::nullopt;
  viewer::MapLayer home{.label = "home", .colour = viewer::PlotColour::black};
  if (goal.pose) home.squares.push_back(goal.pose->position());
  return viewer::MapPlot{.title = "Home vectors from above",
                         .layers = {arrows, without_direction, home}};
}

/// Returns the view at home, rotated to the current heading, and the current view below it.
std::vector<viewer::ReportView> make_report_views(const std::optional<Panorama>& home,
                                                  const Panorama& current,
                                                  const HomeAnswer& answer) {
  std::vector<viewer::ViewMark> marks{{.azimuth_rad = 0.0, .colour = viewer::PlotColour::grey}};
  if (answer.result.direction_rad) {
    const double towards = *answer.result.direction_rad;
    marks.push_back(
        {.azimuth_rad = towards, .colour = viewer::PlotColour::vermilion, .is_dashed_line = true});
    marks.push_back({.azimuth_rad = wrap_angle(towards + std::numbers::pi),
                     .colour = viewer::PlotColour::blue,
                     .is_dashed_line = true});
  }
  std::vector<viewer::ReportView> views;
  if (home) {  // rotates the view to the current heading
    const double columns = answer.result.turn_rad() / (2.0 * std::numbers::pi) * home->columns();
    views.push_back({rotate_columns(*home, static_cast<int>(std::lround(columns))), marks,
                     "View at home, rotated to the current heading"});
  }
  views.push_back({current, marks, make_caption(answer)});
  return views;
}

}  // namespace

void write_home_report(const std::filesystem::path& folder, const Goal& goal,
                       const std::vector<HomeAnswer>& answers,
                       const std::function<Panorama(std::size_t)>& current) {
  viewer::ReportPage page("Direction home",
                          "panonav compared the view at home, " + goal.name +
                              ", with the current image. It computed the direction home without a "
                              "map and without knowing the robot's heading.");
  const HomingResult& first = answers.front().result;
  if (answers.size() == 1 && !first.known()) {
    page.add_figures({{"no answer", explain_no_direction(first)}});
  } else if (answers.size() == 1) {
    page.add_figures({{first.direction_rad ? describe_direction(*first.direction_rad) : "none",
                       "direction home"},
                      {format_fixed(first.distance_r(), 2) + " R",
                       "distance; R is the typical distance of the objects around"},
                      {format_fixed(degrees(first.turn_rad()), 0) + " degrees",
                       "rotation of the robot since then, left positive"},
                      {format_fixed(first.probability(), 2),
                       "probability that the direction is right within 45 degrees"}});
  }
  page.begin_section(goal.panorama ? "Both views" : "Current image");
  page.add_text(std::string(goal.panorama ? "Above: the view at home, rotated to the current "
                                            "heading. Below: the current image. "
                                          : "") +
                "The forward direction is in the middle (grey mark). Orange: the direction home; "
                "objects in this direction become larger during the drive. Blue: the opposite "
                "direction, where objects become smaller.");
  for (const std::size_t i : choose_shown_answers(answers.size())) {
    page.add_views(make_report_views(goal.panorama, current(i), answers[i]));
  }
  if (const auto vectors = draw_field(goal, answers)) {
    page.begin_section("Map");
    page.add_plots({{*vectors, "Direction home at each place with known position and heading"}});
  }
  page.begin_section("Numbers");
  std::vector<std::vector<std::string>> rows;
  for (const HomeAnswer& answer : answers) {
    const HomingResult& result = answer.result;
    const auto if_known = [&](double value, int digits) {
      return result.known() ? format_fixed(value, digits) : std::string("no answer");
    };
    rows.push_back({answer.file,
                    result.direction_rad ? describe_direction(*result.direction_rad) : "none",
                    if_known(result.distance_r(), 3), if_known(degrees(result.turn_rad()), 1),
                    if_known(result.known() ? result.evidence->vector.correlation : 0.0, 3),
                    if_known(result.known() ? result.evidence->vector.residual : 0.0, 3),
                    if_known(result.probability(), 3)});
  }
  page.add_table({"view", "direction home", "distance [R]", "rotation [degrees]", "correlation",
                  "residual", "probability"},
                 rows);
  page.write(folder, "index.html", "panonav home");
}

}  // namespace panonav::command
