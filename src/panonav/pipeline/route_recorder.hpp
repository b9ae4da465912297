#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Options for recording a route.
struct RouteRecorderOptions {
  std::string name = "route";  ///< of the route; lines are appended to an existing one
  /// Distance between lines in metres, >= 0; for poses in view steps, metres by the assumed scale.
  double every_m = 0.1;
  /// Options of the lines; nullopt: those of the existing route, else the defaults.
  std::optional<HorizonScanlineOptions> line;
  /// First and last row that show the horizon, counted from 0 at the top; only for panoramas of
  /// unknown elevations. nullopt: those of the existing route, else all.
  std::optional<std::pair<int, int>> horizon_rows;
  bool odometry = false;  ///< store the odometry's poses, even if observations have poses
  /// Of the poses, if they are in view steps (`RouteSource`); nullopt: poses are in metres.
  std::optional<double> assumed_unit_m;
  bool is_in_map_unit = false;  ///< as in `RouteSource`
};

/// Source of the poses of a route.
enum class RoutePoseOrigin {
  data_set,  ///< positions of the recording; headings may be computed from the path
  odometry,  ///< of the recording
  map,       ///< positions of the memory's views, which show the images of the drive
  images,    ///< motion computed from the images, in a frame of its own
};

/// The images of a drive that get lines, and their poses.
struct DrivePoses {
  Dataset drive;                                       ///< images with a pose
  std::vector<Pose2> poses;                            ///< one for each image of `drive`
  RoutePoseOrigin origin = RoutePoseOrigin::data_set;  ///< where the poses come from
  std::optional<double> assumed_unit_m;                ///< as in `RouteRecorderOptions`
  bool is_in_map_unit = false;                         ///< as in `RouteSource`
  /// False if the images have the poses of the map and are in no order (`are_in_order`).
  bool is_in_order = true;
  /// True if the unit of the poses was estimated from views of the memory with positions, for
  /// `RoutePoseOrigin::images`; lengths may then be wrong by a factor.
  bool is_scale_estimated = false;
};

/// Finds the poses of a drive, in this order: of the data set (not with `only_odometry`), of its
/// odometry, of the memory's map, computed from the images. Positions or odometry are used if half
/// of the images have them, positions only if odometry has not much more (10 : 9); with
/// `only_odometry` if two images have it. Images without are left out, as are images that the map
/// or the motion does not connect with the others. Throws FileError if `only_odometry` is true and
/// there is none, if the map or the motion leaves out more than a tenth of the images, and if poses
/// are computed from images for a route `route` that exists.
[[nodiscard]] DrivePoses find_drive_poses(const Dataset& drive, const MemoryFile& memory,
                                          const std::string& route, bool only_odometry,
                                          Executor& executor);

/// Records a route in a memory file as one line of pixels per step [Y03], 64 lines per transaction.
/// The poses of the lines are those of the observations, which need headings, or come from odometry
/// (`RouteRecorderOptions::odometry`). One thread at a time, except `encode`.
class RouteRecorder {
 public:
  /// The recorded route, and the lines that this recorder added to it.
  struct Recorded {
    RoutePanorama route;       ///< all of its lines, including those of earlier drives
    std::size_t appended = 0;  ///< number of lines added
    std::uint64_t bytes = 0;   ///< stored size of the route's lines and poses
    /// Number of images of `record` that are nearer than `every_m` to the line before.
    std::size_t too_near = 0;
    /// Number of images of `record` whose lines the route already had.
    std::size_t known_before = 0;
    /// Bytes for each kilometre of the route; 0 for a route without length.
    [[nodiscard]] double bytes_per_km() const;
  };

  /// A line that is not in the route yet.
  struct EncodedLine {
    Pose2 pose;               ///< in the route's frame
    std::vector<float> line;  ///< as returned by `horizon_scanline`
  };

  /// Uses images of the memory's own camera. Throws like the constructor below.
  explicit RouteRecorder(const std::filesystem::path& memory,
                         const RouteRecorderOptions& options = {});
  /// Uses a file that is open for writing. `source`: layout of the images; nullopt: that of the
  /// memory. Throws ContractError if the route exists and was recorded with other options;
  /// FileError.
  RouteRecorder(MemoryFile memory, const std::optional<PictureSource>& source,
                const RouteRecorderOptions& options = {});

  /// True if `next` is at least `every_m` from the last line, or there is no line yet.
  [[nodiscard]] static bool is_due(const std::optional<Pose2>& last, const Pose2& next,
                                   double every_m);
  /// Encodes an observation for `add`; several threads may encode the next observations
  /// concurrently. Throws as `LineEncoder::line` and `ViewEncoder::require_fit`, ContractError on
  /// an observation with neither pose nor odometry.
  [[nodiscard]] EncodedLine encode(const Observation& observation) const;
  /// Returns the number of poses at the start of `drive` whose lines the route already has, so that
  /// an interrupted recording can continue after them. Returns 0 if the route also has other lines.
  [[nodiscard]] std::size_t skip_recorded(std::span<const Pose2> drive);
  /// Adds a line at any distance from the last one. Throws FileError; for the first line also if
  /// the existing route ends more than a metre away.
  void add(EncodedLine line);
  /// Encodes and adds the next observation if a line is due and it has a pose. Returns true if a
  /// line was added. Throws like `encode` and the overload above.
  bool add(const Observation& observation);
  /// Records a whole drive, with a pose for each entry: adds a line at each entry where one is due,
  /// except those that the route already has. After each line calls `recorded` with the total
  /// number of lines to add. Throws like `add` and `finish`; lines before an unreadable image are
  /// kept.
  Recorded record(const Dataset& drive, std::span<const Pose2> poses, Executor& executor,
                  const std::function<void(std::size_t lines)>& recorded = {});
  /// Writes the added lines to the disk. Throws FileError; ContractError if the route has no lines.
  Recorded finish();

  /// Returns the file of the route.
  [[nodiscard]] const MemoryFile& memory() const noexcept { return file_; }
  /// Returns how the route's lines are made, and where its poses come from.
  [[nodiscard]] const RouteSource& source() const noexcept { return source_; }

 private:
  /// Returns the pose of a line; nullopt if the observation has none.
  [[nodiscard]] std::optional<Pose2> pose_of(const Observation& observation) const;
  /// Distance between lines in the unit of the poses.
  [[nodiscard]] double interval() const;
  void flush();

  RouteRecorderOptions options_;
  MemoryFile file_;
  RouteSource source_;
  bool is_source_stored_ = false;
  ViewEncoder views_;
  LineEncoder encoder_;
  std::optional<Pose2> route_end_;  // last pose of the route before this recording
  std::optional<Pose2> last_;       // pose of the last added line
  std::vector<EncodedLine> waiting_;
  std::size_t appended_ = 0;
};

}  // namespace panonav
