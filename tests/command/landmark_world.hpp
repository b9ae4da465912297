#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav::testing {

/// A flat world of glowing posts, the simplest one in which near places look alike and far ones do
/// not.
class LandmarkWorld {
 public:
  explicit LandmarkWorld(std::uint64_t seed);
  /// A grey panorama as a 360 degree camera writes it: clockwise, forward in the middle.
  [[nodiscard]] Image picture(const Pose2& pose, int columns = 96, int rows = 12) const;
  void write_picture(const std::filesystem::path& path, const Pose2& pose, int columns = 96,
                     int rows = 12) const;

 private:
  struct Post {
    Point2 position;
    double radius_m;
    double brightness;
    double middle_row;  ///< fraction of the height
  };
  std::vector<Post> posts_;
};

/// A 0.5 m grid of `side` x `side` poses, heading along x.
[[nodiscard]] std::vector<Pose2> grid_poses(int side);

/// Writes pictures "view_000.png" .., poses.csv and dataset.toml.
void write_dataset(const std::filesystem::path& folder, const LandmarkWorld& world,
                   const std::vector<Pose2>& poses);
void write_dataset_toml(const std::filesystem::path& folder);

[[nodiscard]] std::string view_name(std::size_t index);

}  // namespace panonav::testing
