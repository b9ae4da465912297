#include "reports/navigate_report.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "panonav/core/text.hpp"
#include "panonav_viewer/report_page.hpp"

namespace panonav::command {

void write_navigate_report(const std::filesystem::path& folder, const MissionReport& mission,
                           const viewer::RunPage& replay_page) {
  const simulation::MissionRun& run = mission.run;
  viewer::ReportPage page("Mission to " + mission.goal,
                          "A simulated robot was sent to a stored view. It uses only images. It "
                          "knows neither its own position nor the positions of the stored views.");
  std::vector<std::pair<std::string, std::string>> figures{
      {std::string(to_string(run.end)), mission.reason},
      {std::to_string(run.decisions.size()), "steps with one image and one decision each"}};
  if (std::isfinite(run.end_distance_m)) {
    figures.emplace_back(format_fixed(100.0 * run.end_distance_m, 0) + " cm",
                         "distance from the goal at the end");
  }
  figures.emplace_back(format_fixed(run.travelled_m, 1) + " m",
                       std::isfinite(run.shortest_m) ? "driven; the shortest path is " +
                                                           format_fixed(run.shortest_m, 1) + " m"
                                                     : "driven");
  page.add_figures(figures);
  page.begin_section("The mission, decision by decision");
  page.add_text(
      "Grey dots are the stored views. Their lines show the direction in which each view sends the "
      "robot. The thick line is the planned path, and the ring is the goal. The robot is drawn at "
      "its true position. The list shows the robot's decisions; click a decision to see it on the "
      "map.");
  page.add_run(replay_page);
  page.begin_section("The whole mission");
  page.add_plots({{mission.plot, "Planned path, driven path and objects"}});
  page.write(folder, "index.html", "panonav navigate");
}

}  // namespace panonav::command
