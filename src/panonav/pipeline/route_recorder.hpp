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
#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Options for recording a route.
struct RouteRecorderOptions {
  std::string name = "route";  ///< of the route; lines are appended to an existing one
  double every_m = 0.1;        ///< distance between lines, >= 0
  /// Options of the lines; nullopt: those of the existing route, else the defaults.
  std::optional<HorizonScanlineOptions> line;
  /// First and last row that show the horizon, counted from 0 at the top; only for panoramas of
  /// unknown elevations. nullopt: those of the existing route, else all.
  std::optional<std::pair<int, int>> horizon_rows;
  bool odometry = false;  ///< store the odometry's poses, even if observations have poses
};

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
  /// concurrently. Throws as `LineEncoder::line`, ContractError on an observation with neither pose
  /// nor odometry.
  [[nodiscard]] EncodedLine encode(const Observation& observation) const;
  /// Returns the number of poses at the start of `drive` whose lines the route already has, so that
  /// an interrupted recording can continue after them. Returns 0 if the route also has other lines.
  [[nodiscard]] std::size_t skip_recorded(std::span<const Pose2> drive);
  /// Adds a line at any distance from the last one. Throws FileError; for the first line also if
  /// the existing route ends more than a metre away.
  void add(EncodedLine line);
  /// Encodes and adds the next observation if a line is due. Returns true if a line was added.
  /// Throws like `encode` and the overload above.
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
  [[nodiscard]] Pose2 pose_of(const Observation& observation) const;
  void flush();

  RouteRecorderOptions options_;
  MemoryFile file_;
  RouteSource source_;
  bool is_source_stored_ = false;
  LineEncoder encoder_;
  std::optional<Pose2> route_end_;  // last pose of the route before this recording
  std::optional<Pose2> last_;       // pose of the last added line
  std::vector<EncodedLine> waiting_;
  std::size_t appended_ = 0;
};

}  // namespace panonav
