#include "demo/maps.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "experiments/runs/surroundings.hpp"
#include "panonav/geometry/alignment.hpp"
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
  MapPlot plot{.title = "A drive through rooms", .layers = scene_layers(place.scene)};
  plot.layers.push_back(
      {.label = "true way", .colour = PlotColour::black, .lines = {mapped.truth}});
  plot.layers.push_back({.label = "wheels alone",
                         .colour = PlotColour::vermilion,
                         .lines = {laid_over(positions_of(recording.wheels), mapped.truth)}});
  plot.layers.push_back({.label = "map from the views",
                         .colour = PlotColour::blue,
                         .lines = {laid_over(mapped.estimate, mapped.truth)}});
  write_plot(path, plot);
}

/// The longer side of the floor on which the views were taken.
double room_m(const VisualMemory& office) {
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

}  // namespace

DemoMaps show_maps(const VisualMemory& office, std::uint64_t seed, bool quick,
                   const std::filesystem::path& out, Session& session, ReportPage& page) {
  DemoMaps maps;
  maps.arranged = arrange(office, {}, {}, session.executor());
  maps.lattice = compare_with_ground_truth(maps.arranged, office);
  write_lattice_picture(out / "arranged.svg", maps.arranged, office);

  const PlaceRecording place =
      empty_place(make_scene("loop", {.seed = seed}), seed, 256, session.executor());
  const MappingRecording recording =
      record_for_mapping(place, drive(place, {}, spacing_m, quick ? 60 : 200), components,
                         cheap_wheels(), seed, session.executor());
  const MappedRecording mapped =
      map_recording(recording, {.odometry = {.camera_height_m = place.scene.camera_height_m}});
  maps.map_error = shape_error(mapped.estimate, mapped.truth);
  maps.wheels_error = shape_error(positions_of(recording.wheels), mapped.truth);
  maps.map_rms_m = align(mapped.estimate, mapped.truth, {.allow_scale = true}).rms_m;
  maps.wheels_rms_m =
      align(positions_of(recording.wheels), mapped.truth, {.allow_scale = true}).rms_m;
  draw_drive(place, recording, mapped, out / "drive.svg");

  const auto centimetres = [](double metres) { return fixed(100.0 * metres, 0) + " cm"; };
  const std::string arranged = maps.lattice ? centimetres(maps.lattice->rms_m) : "none";
  page.part("How places lie",
            {arranged, "is how far off a map is that views made by how alike they look alone"});
  page.text(
      "Can pictures alone make a map? The remembered views of the office were shuffled and their "
      "positions taken away. Views that look alike pull each other close, like balls on springs, "
      "and so they find their places by themselves.");
  page.pictures({{"arranged.svg",
                  "Left, where the views were taken; right, where they put themselves: turned and "
                  "scaled as a whole to fit, because pictures know neither north nor metres. Lines "
                  "are the springs. Were the arrangement perfect, the right picture would be the "
                  "left one."}});
  page.text(
      "In the second picture a robot drives through rooms that it has never seen and makes a map "
      "of its way, from one picture after the other and without wheels; where it comes by again it "
      "recognises the place and closes the loop.");
  page.pictures(
      {{"drive.svg", "The drive: " + std::to_string(recording.truth.size()) + " views, one every " +
                         centimetres(spacing_m) +
                         ". The blue map should lie on the black way; both it and the "
                         "orange line are laid over that in equal size. The orange one is "
                         "what the wheels of a cheap robot make of the same drive."}});
  std::vector<std::pair<std::string, std::string>> figures;
  if (maps.lattice) {
    figures.push_back({arranged,
                       "from their true places lie the arranged views (root mean "
                       "square), in a room " +
                           fixed(room_m(office), 1) + " m long: " +
                           fixed(100.0 * maps.lattice->rms_m / room_m(office), 1) + " % of it"});
  }
  figures.push_back({centimetres(maps.map_rms_m),
                     "from the true way lies the map of a drive of " +
                         fixed(spacing_m * static_cast<double>(recording.truth.size()), 0) + " m"});
  figures.push_back({centimetres(maps.wheels_rms_m), "from it lies what the wheels tell"});
  page.figures(figures);
  return maps;
}

}  // namespace panonav::command
