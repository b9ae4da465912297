#include "reports/navigate_report.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "panonav/core/text.hpp"
#include "panonav_viewer/report_page.hpp"

namespace panonav::command {

void write_navigate_report(const std::filesystem::path& folder, const MissionReport& mission,
                           const viewer::RunPage& played) {
  const simulation::MissionRun& run = mission.run;
  viewer::ReportPage page("The path to " + mission.goal,
                          "A simulated robot was sent to a remembered view. It uses only images: "
                          "it knows neither its position nor those of its references.");
  std::vector<std::pair<std::string, std::string>> figures{
      {std::string(name_of(run.end)), mission.reason},
      {std::to_string(run.decisions.size()), "steps, an image and a decision each"}};
  if (std::isfinite(run.end_distance_m)) {
    figures.emplace_back(format_fixed(100.0 * run.end_distance_m, 0) + " cm",
                         "from where the goal's view was taken");
  }
  figures.emplace_back(format_fixed(run.travelled_m, 1) + " m",
                       std::isfinite(run.shortest_m) ? "driven; the shortest path is " +
                                                           format_fixed(run.shortest_m, 1) + " m"
                                                     : "driven");
  page.add_figures(figures);
  page.begin_section("The mission, decision by decision");
  page.add_text(
      "Grey dots are the remembered views, with the direction in which each sends the robot; the "
      "thick line is the planned path, the ring its goal. The robot is drawn at its true position. "
      "The list shows its decisions; click one to go there.");
  page.add_run(played);
  page.begin_section("The whole mission");
  page.add_plots({{mission.plot, "Planned and driven path, with the surroundings"}});
  page.write(folder, "index.html", "panonav navigate");
}

}  // namespace panonav::command
