#include "landmark_world.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string_view>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::testing {

LandmarkWorld::LandmarkWorld(std::uint64_t seed) {
  Random random(seed);
  for (int i = 0; i < 60; ++i) {
    posts_.push_back({{random.uniform(-4.0, 7.0), random.uniform(-4.0, 7.0)},
                      random.uniform(0.1, 0.6),
                      random.uniform(-0.4, 0.4),
                      random.uniform()});
  }
}

Image LandmarkWorld::picture(const Pose2& pose, int columns, int rows) const {
  std::vector<double> values(static_cast<std::size_t>(columns) * rows, 0.5);
  for (const auto& post : posts_) {
    const double distance_m = std::max(0.2, distance(pose.position(), post.position));
    const double azimuth_rad =
        std::atan2(post.position.y_m - pose.y_m, post.position.x_m - pose.x_m) - pose.heading_rad;
    const double width_rad = std::atan(post.radius_m / distance_m);
    for (int c = 0; c < columns; ++c) {
      const double column_rad = 2.0 * std::numbers::pi * (0.5 - (c + 0.5) / columns);
      const double off = angle_difference(column_rad, azimuth_rad) / width_rad;
      const double glow = post.brightness * std::exp(-0.5 * off * off);
      for (int y = 0; y < rows; ++y) {
        const double row_off = ((y + 0.5) / rows - post.middle_row) / 0.3;
        values[static_cast<std::size_t>(y) * columns + c] +=
            glow * std::exp(-0.5 * row_off * row_off);
      }
    }
  }
  Image image(columns, rows);
  std::transform(values.begin(), values.end(), image.pixels().begin(), [](double value) {
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
  });
  return image;
}

void LandmarkWorld::write_picture(const std::filesystem::path& path, const Pose2& pose, int columns,
                                  int rows) const {
  const Image image = picture(pose, columns, rows);
  write_png(path, image.view());
}

std::vector<Pose2> grid_poses(int side) {
  std::vector<Pose2> poses;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) poses.push_back({0.5 * i, 0.5 * j, 0.0});
  }
  return poses;
}

std::string view_name(std::size_t index) {
  const std::string digits = std::to_string(index);
  return "view_" + std::string(3 - std::min<std::size_t>(3, digits.size()), '0') + digits + ".png";
}

void write_dataset_toml(const std::filesystem::path& folder) {
  write_file(folder / "dataset.toml", std::string_view("[images]\n"
                                                       "kind = \"panorama\"\n"
                                                       "columns = \"clockwise\"\n"
                                                       "forward_column = 0.5\n"
                                                       "elevation_deg = [-20, 20]\n"
                                                       "[poses]\n"
                                                       "file = \"poses.csv\"\n"));
}

void write_dataset(const std::filesystem::path& folder, const LandmarkWorld& world,
                   const std::vector<Pose2>& poses) {
  std::filesystem::create_directories(folder);
  std::string csv = "file,x_m,y_m,heading_deg\n";
  for (std::size_t i = 0; i < poses.size(); ++i) {
    world.write_picture(folder / view_name(i), poses[i]);
    csv += view_name(i) + "," + to_text(poses[i].x_m) + "," + to_text(poses[i].y_m) + "," +
           to_text(degrees(poses[i].heading_rad)) + "\n";
  }
  write_file(folder / "poses.csv", std::string_view(csv));
  write_dataset_toml(folder);
}

}  // namespace panonav::testing
