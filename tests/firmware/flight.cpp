// Records a chain in a simulated garden and flies back along it with the firmware's own program:
// flight FOLDER [SCENE SEED]. Writes flight.bin, what the board captures, and flight.txt, all
// velocities bit by bit. Fails unless the flight ends, and if it ends elsewhere than at the start.
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board.hpp"
#include "drone.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/route/chain_recorder.hpp"
#include "panonav/route/sampler_pixels.hpp"
#include "panonav_simulation/free_space.hpp"
#include "panonav_simulation/mirror.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/scenes.hpp"

namespace {

using namespace panonav;

constexpr double period_s = 0.1;
constexpr double pose_spacing_m = 0.1;
constexpr double min_route_m = 12.0;
constexpr double arrival_radius_m = 0.5;
constexpr int max_pictures = 1500;

// Returns the simulated mirror camera with pictures of the board's size.
Camera make_board_camera() {
  Camera camera = simulation::make_simulated_mirror_camera();
  const double scale = static_cast<double>(board::width) / camera.image_size.width;
  std::get<HyperboloidalModel>(camera.model).focal_length_px *= scale;
  camera.image_size = {board::width, board::height};
  camera.centre = {camera.centre.u_px * scale, camera.centre.v_px * scale};
  camera.rim_radius_px *= scale;
  camera.inner_radius_px *= scale;
  return camera;
}

// The world around the board.
struct Flight {
  Flight(const std::string& scene_name, std::uint64_t seed)
      : scene(simulation::make_scene(scene_name, {.seed = seed})), renderer(scene, {}, executor) {}

  Image capture(const Pose2& pose) {
    return simulation::capture_image(renderer, pose, camera, {}, {}, 1000 + pictures, executor);
  }
  void plan(std::uint64_t seed);
  void record();

  Executor executor{1};
  simulation::Scene scene;
  simulation::Renderer renderer;
  Camera camera = make_board_camera();
  ElevationBand band = visible_elevations(camera);
  std::vector<std::uint16_t> pixels = make_sampler_pixels(camera, band);
  std::vector<Pose2> route;
  std::vector<std::uint8_t> chain;
  Pose2 pose;      // true
  Pose2 odometry;  // by the robot, with a scale error, a drift of the heading and wind
  std::uint64_t pictures = 0;
  std::ofstream bin;
  std::ofstream text;
};

std::unique_ptr<Flight> flight;

void Flight::plan(std::uint64_t seed) {
  const simulation::FreeSpace space(scene);
  Random random(seed);
  std::vector<Pose2> corners{space.random_pose(random)};
  double path_m = 0.0;
  while (path_m < min_route_m) {
    const auto leg =
        space.shortest_path(corners.back().position(), space.random_pose(random).position());
    for (std::size_t i = 1; leg && i < leg->size(); ++i) {
      path_m += distance(corners.back().position(), (*leg)[i]);
      corners.push_back({(*leg)[i].x_m, (*leg)[i].y_m, 0.0});
    }
  }
  route = simulation::resample(corners, pose_spacing_m);
  simulation::face_path(route);
}

void Flight::record() {
  const SnapshotSampler sampler({}, pixels);
  ChainRecorder recorder;
  for (std::size_t i = 0; i < route.size(); ++i) {
    ++pictures;
    const Image picture = capture(route[i]);
    std::vector<float> cosines(48);
    std::vector<float> sines(48);
    sampler.sample(picture.pixels(), cosines, sines);
    recorder.add({8, 6, cosines, sines, band}, i == 0 ? Pose2{} : inverse(route[i - 1]) * route[i]);
  }
  chain = recorder.finish().pack();
}

template <class Number>
void write(std::ofstream& file, const Number* numbers, std::size_t count) {
  file.write(reinterpret_cast<const char*>(numbers),
             static_cast<std::streamsize>(count * sizeof(Number)));
}

}  // namespace

namespace board {

std::span<const std::uint8_t> chain() {
  return flight->chain;
}
std::span<const std::uint16_t> sampler() {
  return flight->pixels;
}

bool capture(std::span<std::uint8_t> grey) {
  if (++flight->pictures > max_pictures) return false;
  const Image picture = flight->capture(flight->pose);
  std::copy(picture.pixels().begin(), picture.pixels().end(), grey.begin());
  const std::array<double, 3> numbers{flight->odometry.x_m, flight->odometry.y_m,
                                      flight->odometry.heading_rad};
  write(flight->bin, numbers.data(), numbers.size());
  write(flight->bin, grey.data(), grey.size());
  return true;
}

Pose2 odometry() {
  return flight->odometry;
}

void set_velocity(const Velocity& drive) {
  for (const double value : {drive.forward_m_s, drive.left_m_s, drive.turn_rad_s}) {
    std::array<char, 18> text{};
    std::snprintf(text.data(), text.size(), "%016llx ",
                  static_cast<unsigned long long>(std::bit_cast<std::uint64_t>(value)));
    flight->text << text.data();
  }
  flight->text << '\n';
  const Pose2 moved = integrate_velocity(drive, period_s);
  // The robot turns and drifts, which its odometry does not see.
  constexpr double wind_m_per_m = 0.05;
  constexpr double turn_rad_per_m = 0.02;
  constexpr double scale = 1.03;
  const double length_m = std::hypot(moved.x_m, moved.y_m);
  flight->pose = flight->pose * Pose2{scale * moved.x_m, scale * moved.y_m,
                                      moved.heading_rad + turn_rad_per_m * length_m};
  flight->pose.x_m += wind_m_per_m * length_m;
  flight->odometry = flight->odometry * moved;
}

}  // namespace board

int main(int argc, char** argv) try {
  if (argc != 2 && argc != 4) throw Error("usage: flight FOLDER [SCENE SEED]");
  const std::string folder = argv[1];
  const std::uint64_t seed = argc == 4 ? std::stoull(argv[3]) : 1;
  flight = std::make_unique<Flight>(argc == 4 ? argv[2] : "garden", seed);
  flight->plan(seed);
  flight->record();
  flight->pose = flight->route.back();
  flight->bin.open(folder + "/flight.bin", std::ios::binary);
  flight->text.open(folder + "/flight.txt");
  const std::array<std::uint32_t, 2> sizes{static_cast<std::uint32_t>(flight->chain.size()),
                                           static_cast<std::uint32_t>(flight->pixels.size())};
  write(flight->bin, sizes.data(), sizes.size());
  write(flight->bin, flight->chain.data(), flight->chain.size());
  write(flight->bin, flight->pixels.data(), flight->pixels.size());
  flight->pictures = 0;
  const ChainState state = fly_back();
  const double off_m = distance(flight->pose.position(), flight->route.front().position());
  std::cout << "chain " << flight->chain.size() << " bytes, route "
            << pose_spacing_m * static_cast<double>(flight->route.size()) << " m, "
            << flight->pictures << " pictures, state " << static_cast<int>(state) << ", " << off_m
            << " m from the start\n";
  flight->bin.flush();
  flight->text << "state " << static_cast<int>(state) << '\n' << std::flush;
  if (!flight->bin || !flight->text) throw Error(folder + ": cannot be written");
  const bool is_home = state == ChainState::arrived && off_m <= arrival_radius_m;
  return is_home || state == ChainState::lost ? 0 : 1;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 2;
}
