#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/panorama/picture_source.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {

/// A 0.5 m grid of `side` x `side` poses, heading along x.
inline std::vector<Pose2> grid_poses(int side) {
  std::vector<Pose2> poses;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) poses.push_back({0.5 * i, 0.5 * j, 0.0});
  }
  return poses;
}

/// Returns the layout of `landmark_picture`s.
inline PictureSource landmark_panoramas() {
  PictureSource source;
  source.layout.elevations = ElevationBand{radians(-20.0), radians(20.0)};
  return source;
}

inline Image landmark_picture(const ToyWorld& world, const Pose2& pose, int columns = 96,
                              int rows = 12) {
  return world.picture(pose, columns, rows);
}

inline std::string view_name(std::size_t index) {
  const std::string digits = std::to_string(index);
  return "view_" + std::string(3 - std::min<std::size_t>(3, digits.size()), '0') + digits + ".png";
}

inline void write_picture(const std::filesystem::path& path, const ToyWorld& world,
                          const Pose2& pose, int columns = 96, int rows = 12) {
  const Image image = landmark_picture(world, pose, columns, rows);
  write_png(path, image.view());
}

inline void write_dataset_toml(const std::filesystem::path& folder) {
  write_file(folder / "dataset.toml", std::string_view("[images]\n"
                                                       "kind = \"panorama\"\n"
                                                       "columns = \"clockwise\"\n"
                                                       "forward_column = 0.5\n"
                                                       "elevation_deg = [-20, 20]\n"
                                                       "[poses]\n"
                                                       "file = \"poses.csv\"\n"));
}

/// Writes pictures "view_000.png" .., poses.csv and dataset.toml.
inline void write_dataset(const std::filesystem::path& folder, const ToyWorld& world,
                          const std::vector<Pose2>& poses) {
  std::filesystem::create_directories(folder);
  std::string csv = "file,x_m,y_m,heading_deg\n";
  for (std::size_t i = 0; i < poses.size(); ++i) {
    write_picture(folder / view_name(i), world, poses[i]);
    csv += view_name(i) + "," + to_text(poses[i].x_m) + "," + to_text(poses[i].y_m) + "," +
           to_text(degrees(poses[i].heading_rad)) + "\n";
  }
  write_file(folder / "poses.csv", std::string_view(csv));
  write_dataset_toml(folder);
}

}  // namespace panonav::testing
