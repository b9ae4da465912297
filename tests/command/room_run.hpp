#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"
#include "support/temporary_folder.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {

/// A data set of what a robot sees in a room from these poses; odometry as the robot's wheels tell
/// it, which start at 0 and run 2 % long.
inline void write_room_run(const std::filesystem::path& folder, const ToyWorld& room,
                           const std::vector<Pose2>& poses) {
  std::filesystem::create_directories(folder);
  Dataset dataset;
  dataset.folder = folder;
  const ElevationBand band{-0.02, 0.02};
  constexpr int columns = 360;
  dataset.source.layout.elevations = band;
  dataset.source.layout.forward_column = picture_forward_column(columns);
  Pose2 odometry;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto line = room.line(poses[i], columns);
    std::vector<float> values;
    for (int row = 0; row < 3; ++row) values.insert(values.end(), line.begin(), line.end());
    DatasetEntry entry;
    entry.file = "view_" + std::to_string(1000 + i) + ".png";
    entry.path = folder / entry.file;
    entry.stamp_s = 0.1 * static_cast<double>(i);
    entry.pose = ReferencePose{poses[i].x_m, poses[i].y_m, poses[i].heading_rad};
    if (i > 0) {
      Pose2 step = inverse(poses[i - 1]) * poses[i];
      step.x_m *= 1.02;
      odometry = odometry * step;
    }
    entry.odometry = odometry;
    const Image picture = to_picture(Panorama(3, columns, band, std::move(values)));
    write_png(entry.path, picture.view());
    dataset.entries.push_back(entry);
  }
  panonav::write_dataset(dataset);
}

inline std::vector<Pose2> straight(Point2 from, double heading_rad, double length_m,
                                   double step_m) {
  std::vector<Pose2> poses;
  const int steps = static_cast<int>(std::lround(length_m / step_m));
  for (int i = 0; i <= steps; ++i) {
    const double way = i * step_m;
    poses.push_back({from.x_m + way * std::cos(heading_rad), from.y_m + way * std::sin(heading_rad),
                     heading_rad});
  }
  return poses;
}

/// A straight route through a room and a drive that crosses it.
class RouteVerbs : public ::testing::Test {
 protected:
  RouteVerbs() {
    write_room_run(folder_ / "teach", room_, straight({-2.0, 0.0}, 0.0, 4.0, 0.05));
    write_room_run(folder_ / "repeat", room_, straight({-1.2, -0.2}, 0.15, 2.0, 0.1));
  }
  nlohmann::json record(const std::vector<std::string>& more = {}) {
    return answer_of(
        with({"route", "record", folder_ / "m.panonav", folder_ / "teach", "--json"}, more));
  }

  TemporaryFolder folder_;
  ToyWorld room_ = pillared_room(3);
};

}  // namespace panonav::testing
