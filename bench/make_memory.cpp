// Makes a large memory file for measurements, and images to localise in it:
//   make_memory VIEWS MEMORY [FOLDER IMAGES]
// Views stand on a grid of 0.25 m in rooms of 10 m x 10 m, whose walls, floor and ceiling bear
// random rectangles. Each is a panorama of 80 x 512 that the `Memoriser` encodes, so that
// signatures, thumbnails, local features and models are those of real memories. FOLDER gets IMAGES
// images between views (known_*.png) and as many of rooms that are not in the memory
// (unknown_*.png). The same arguments give the same views.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/memoriser.hpp"

namespace {

using namespace panonav;

constexpr int rows = 80;
constexpr int columns = 512;
constexpr ElevationBand elevations{radians(-40.0), radians(40.0)};
constexpr double side_m = 10.0;  // of a room, along x and y
constexpr double height_m = 3.0;
constexpr double camera_height_m = 1.0;
constexpr double spacing_m = 0.25;
constexpr double margin_m = 0.5;  // between walls and views
constexpr int views_a_side = 37;
constexpr std::size_t views_a_room = std::size_t{views_a_side} * views_a_side;
constexpr int rooms_a_row = 10;
constexpr double room_pitch_m = 12.0;

/// A surface of a room: grey levels of random rectangles at 20 pixels a metre.
class Surface {
 public:
  static constexpr double pixels_a_metre = 20.0;

  Surface(double width_m, double height_m, double mean, Random& random)
      : width_(static_cast<int>(width_m * pixels_a_metre)),
        height_(static_cast<int>(height_m * pixels_a_metre)),
        values_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_),
                static_cast<float>(mean)) {
    const int rectangles = static_cast<int>(width_m * height_m / 2.0);  // one for two square metres
    for (int i = 0; i < rectangles; ++i) {
      const int left = static_cast<int>(random.index(static_cast<std::uint64_t>(width_)));
      const int top = static_cast<int>(random.index(static_cast<std::uint64_t>(height_)));
      const int right = std::min(width_, left + 4 + static_cast<int>(random.index(36)));
      const int bottom = std::min(height_, top + 4 + static_cast<int>(random.index(26)));
      const auto value = static_cast<float>(random.uniform(0.5, 1.5) * mean);
      for (int v = top; v < bottom; ++v) {
        for (int u = left; u < right; ++u) values_[at(u, v)] = value;
      }
    }
  }

  /// Interpolates between pixels; coordinates beyond the edges are those of the edge.
  [[nodiscard]] float sample(double u_m, double v_m) const {
    const double u = std::clamp(u_m * pixels_a_metre, 0.0, width_ - 1.001);
    const double v = std::clamp(v_m * pixels_a_metre, 0.0, height_ - 1.001);
    const int left = static_cast<int>(u);
    const int top = static_cast<int>(v);
    const auto right_share = static_cast<float>(u - left);
    const auto lower_share = static_cast<float>(v - top);
    const auto row = [&](int y) {
      return std::lerp(values_[at(left, y)], values_[at(left + 1, y)], right_share);
    };
    return std::lerp(row(top), row(top + 1), lower_share);
  }

 private:
  [[nodiscard]] std::size_t at(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(u);
  }
  int width_, height_;
  std::vector<float> values_;
};

class Room {
 public:
  explicit Room(std::uint64_t number)
      : random_(11, number),
        walls_(4.0 * side_m, height_m, 0.5, random_),
        floor_(side_m, side_m, 0.3, random_),
        ceiling_(side_m, side_m, 0.7, random_) {}

  /// Renders the view of a camera at a pose in the room; `noise` draws the noise of the camera.
  [[nodiscard]] Panorama render(const Pose2& pose, Random& noise) const {
    Panorama view(rows, columns, elevations);
    std::vector<double> slopes;  // of the rows
    for (int y = 0; y < rows; ++y) slopes.push_back(std::tan(view.elevation_rad(y)));
    for (int c = 0; c < columns; ++c) {
      const double azimuth_rad = pose.heading_rad + view.azimuth_rad(c);
      const double along_x = std::cos(azimuth_rad);
      const double along_y = std::sin(azimuth_rad);
      const double to_x_wall_m = ((along_x > 0.0 ? side_m : 0.0) - pose.x_m) / along_x;
      const double to_y_wall_m = ((along_y > 0.0 ? side_m : 0.0) - pose.y_m) / along_y;
      const bool is_x_wall = std::abs(to_x_wall_m) < std::abs(to_y_wall_m);
      const double wall_m = std::abs(is_x_wall ? to_x_wall_m : to_y_wall_m);
      const double along_wall_m =
          is_x_wall ? (along_x > 0.0 ? 0.0 : side_m) + pose.y_m + wall_m * along_y
                    : (along_y > 0.0 ? 2.0 : 3.0) * side_m + pose.x_m + wall_m * along_x;
      for (int y = 0; y < rows; ++y) {
        const double slope = slopes[static_cast<std::size_t>(y)];
        const double at_wall_m = camera_height_m + wall_m * slope;
        const double surface_m =
            at_wall_m < 0.0 ? -camera_height_m / slope : (height_m - camera_height_m) / slope;
        const double x_m = pose.x_m + surface_m * along_x;
        const double y_m = pose.y_m + surface_m * along_y;
        view.at(y, c) = at_wall_m < 0.0        ? floor_.sample(x_m, y_m)
                        : at_wall_m > height_m ? ceiling_.sample(x_m, y_m)
                                               : walls_.sample(along_wall_m, at_wall_m);
      }
    }
    for (std::size_t i = 0; i + 1 < view.values().size(); i += 2) {
      const auto [a, b] = noise.normal_pair();
      view.values()[i] = std::clamp(view.values()[i] + static_cast<float>(0.01 * a), 0.0F, 1.0F);
      view.values()[i + 1] =
          std::clamp(view.values()[i + 1] + static_cast<float>(0.01 * b), 0.0F, 1.0F);
    }
    return view;
  }

 private:
  Random random_;
  Surface walls_, floor_, ceiling_;
};

/// Returns the pose of a view in its room: rows of the grid in turn from the left and the right.
Pose2 grid_pose(std::size_t number, Random& random) {
  const auto row = static_cast<int>(number % views_a_room) / views_a_side;
  const auto step = static_cast<int>(number % views_a_room) % views_a_side;
  const int column = row % 2 == 0 ? step : views_a_side - 1 - step;
  return {margin_m + spacing_m * column, margin_m + spacing_m * row,
          random.uniform(-std::numbers::pi, std::numbers::pi)};
}

Observation observe(const Room& room, std::size_t number) {
  Random random(12, number);
  const Pose2 pose = grid_pose(number, random);
  Observation observation(room.render(pose, random));
  char name[32];
  std::snprintf(name, sizeof name, "view_%07zu.png", number);
  observation.name = name;
  const std::size_t at = number / views_a_room;
  observation.pose = ReferencePose{pose.x_m + room_pitch_m * static_cast<double>(at % rooms_a_row),
                                   pose.y_m + room_pitch_m * static_cast<double>(at / rooms_a_row),
                                   pose.heading_rad};
  return observation;
}

void write_memory(std::size_t views, const std::filesystem::path& path) {
  constexpr std::size_t batch = 256;
  Executor executor(0);
  MemoriserOptions options{.source = PictureSource{}, .map = false};
  options.source->layout.elevations = elevations;
  Memoriser memoriser(path, options);
  for (std::size_t first = 0; first < views; first += batch) {
    const std::size_t count = std::min(batch, views - first);
    std::vector<Room> rooms;  // those of the batch
    for (std::size_t at = first / views_a_room; at <= (first + count - 1) / views_a_room; ++at)
      rooms.emplace_back(at);
    std::vector<Observation> observations(count, Observation(Image(1, 1)));
    parallel_for(executor, count, [&](std::size_t i) {
      const std::size_t number = first + i;
      observations[i] = observe(rooms[number / views_a_room - first / views_a_room], number);
    });
    memoriser.add(std::move(observations), executor);
    std::fprintf(stderr, "\rmemorised %zu of %zu views ", first + count, views);
  }
  memoriser.finish(executor);
  std::fprintf(stderr, "\n");
}

void write_images(std::size_t views, const std::filesystem::path& folder, std::size_t count) {
  constexpr std::uint64_t unknown_rooms = 1'000'000;  // more rooms than a memory has
  std::filesystem::create_directories(folder);
  for (std::size_t i = 0; i < count; ++i) {
    Random random(13, i);
    for (const bool is_known : {true, false}) {
      const std::size_t beside = random.index(views);
      const Room room(is_known ? beside / views_a_room : unknown_rooms + i);
      Pose2 pose = grid_pose(beside, random);
      pose.x_m += random.uniform(-spacing_m / 2.0, spacing_m / 2.0);
      pose.y_m += random.uniform(-spacing_m / 2.0, spacing_m / 2.0);
      char name[32];
      std::snprintf(name, sizeof name, "%s_%05zu.png", is_known ? "known" : "unknown", i);
      const Image image = to_picture(room.render(pose, random));
      write_png(folder / name, image.view());
    }
  }
}

}  // namespace

int main(int count, char** arguments) {
  const auto number = [&](int i) {
    return static_cast<std::size_t>(std::strtoull(arguments[i], nullptr, 10));
  };
  if ((count != 3 && count != 5) || number(1) == 0) {
    std::fprintf(stderr, "usage: make_memory VIEWS MEMORY [FOLDER IMAGES]; VIEWS at least 1\n");
    return 2;
  }
  try {
    write_memory(number(1), arguments[2]);
    if (count == 5) write_images(number(1), arguments[3], number(4));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_memory: %s\n", error.what());
    return 2;
  }
  return 0;
}
