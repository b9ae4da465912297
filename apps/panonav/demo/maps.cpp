#include "demo/maps.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "experiments/runs/surroundings.hpp"
#include "panonav/geometry/positions.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/simulation/scenes.hpp"
#include "reporting/plot.hpp"

namespace panonav::command {

namespace {

constexpr double spacing_m = 0.1;
constexpr int components = 15;

void draw_drive(const PlaceRecording& place, const MappingRecording& recording,
                const MappedRecording& mapped, const std::filesystem::path& path) {
  MapPlot plot{.title = "A drive through rooms, from above: x and y in metres",
               .layers = furniture_layers(place.scene)};
  plot.layers.push_back({.label = "true way", .colour = "#777777", .lines = {mapped.truth}});
  plot.layers.push_back({.label = "wheels alone",
                         .colour = "#d55e00",
                         .lines = {laid_over(positions_of(recording.wheels), mapped.truth)}});
  plot.layers.push_back({.label = "map from the views",
                         .colour = "#0072b2",
                         .lines = {laid_over(mapped.estimate, mapped.truth)}});
  write_plot(path, plot);
}

}  // namespace

DemoMaps show_maps(const VisualMemory& office, std::uint64_t seed, bool quick,
                   const std::filesystem::path& out, Session& session, ReportPage& page) {
  DemoMaps maps;
  maps.arranged = arrange(office, {}, {}, session.executor());
  maps.lattice = compare_with_ground_truth(maps.arranged, office);
  write_lattice_picture(out / "arranged.png", maps.arranged, office);

  const PlaceRecording place =
      empty_place(make_scene("loop", {.seed = seed}), seed, 256, session.executor());
  const MappingRecording recording =
      record_for_mapping(place, drive(place, {}, spacing_m, quick ? 60 : 200), components,
                         cheap_wheels(), seed, session.executor());
  const MappedRecording mapped =
      map_recording(recording, {.odometry = {.camera_height_m = place.scene.camera_height_m}});
  maps.map_error = shape_error(mapped.estimate, mapped.truth);
  maps.wheels_error = shape_error(positions_of(recording.wheels), mapped.truth);
  maps.closures = mapped.right_closures + mapped.wrong_closures;
  draw_drive(place, recording, mapped, out / "drive.png");

  page.part("How places lie",
            {maps.lattice ? fixed(maps.lattice->shape_difference, 3) : std::string("none"),
             "from the true shape: 0 is the same, 1 any other; no position was given"});
  page.text(
      "The remembered views of the office, in no order and without any position, arrange "
      "themselves by their similarity alone, like balls held by springs. And from one picture "
      "after "
      "the other, a robot that drives through rooms it has never seen makes a map of its way; the "
      "height of the camera tells metres, its wheels tell nothing.");
  std::vector<std::pair<std::string, std::string>> figures;
  if (maps.lattice) {
    figures.push_back(
        {fixed(maps.lattice->shape_difference, 3),
         "shape difference of the arranged office: 0 is the true shape, 1 any other"});
    if (maps.lattice->trustworthiness) {
      figures.push_back({fixed(100.0 * *maps.lattice->trustworthiness, 1) + " %",
                         "trustworthiness: how far views side by side there are so in truth"});
    }
  }
  figures.push_back({fixed(maps.map_error, 3), "shape difference of the map from the drive"});
  figures.push_back({fixed(maps.wheels_error, 3), "the same of the wheels of a cheap robot"});
  page.figures(figures);
  page.pictures({{"arranged.png",
                  "The office as its views arranged themselves, beside where they were taken."},
                 {"drive.png", "The drive: " + std::to_string(recording.truth.size()) +
                                   " views, one every " + fixed(100.0 * spacing_m, 0) + " cm."}});
  return maps;
}

}  // namespace panonav::command
