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
  std::string name = "route";  ///< of the route; an existing one grows
  double every_m = 0.1;        ///< distance between lines, >= 0
  /// Empty: those of the existing route, else the defaults.
  std::optional<HorizonScanlineOptions> line;
  /// First and last row that show the horizon, counted from 0 at the top, of panoramas whose
  /// elevations are not known. Empty: those of the existing route, else all.
  std::optional<std::pair<int, int>> horizon_rows;
  bool odometry = false;  ///< remember the odometry's poses, even where observations have poses
};

/// Records a route as one line of pixels a step [Y03] in a memory file, 64 lines in one
/// transaction. Poses are those of the observations, which need headings, or those of their
/// odometry, as the options say. One thread at a time, except `encode`.
class RouteRecorder {
 public:
  /// The recorded route, and the lines that this recorder added to it.
  struct Recorded {
    RoutePanorama route;       ///< all of its lines, those of earlier drives included
    std::size_t appended = 0;  ///< lines
    std::uint64_t bytes = 0;   ///< of the route's lines and poses as stored
    /// Bytes for each kilometre of the route; 0 for a route without length.
    [[nodiscard]] double bytes_per_km() const;
  };

  /// A line that is not in the route yet.
  struct EncodedLine {
    Pose2 pose;               ///< in the route's frame
    std::vector<float> line;  ///< as `horizon_scanline` gives it
  };

  /// Pictures come from the memory's own camera. Throws as the other.
  explicit RouteRecorder(const std::filesystem::path& memory,
                         const RouteRecorderOptions& options = {});
  /// Takes a file open for writing. `source`: layout of the pictures; empty: the memory's own.
  /// Throws ContractError when the route is there and was recorded otherwise, FileError.
  RouteRecorder(MemoryFile memory, const std::optional<PictureSource>& source,
                const RouteRecorderOptions& options = {});

  /// True if the place is `every_m` or more from the last line.
  [[nodiscard]] static bool is_due(const std::optional<Pose2>& last, const Pose2& next,
                                   double every_m);
  /// Encodes an observation for `add`; several threads may encode the next observations
  /// concurrently. Throws as `LineEncoder::line`, ContractError on an observation with neither pose
  /// nor odometry.
  [[nodiscard]] EncodedLine encode(const Observation& observation) const;
  /// Returns the number of lines at the beginning of a drive that the route already holds, if it
  /// holds nothing else: an interrupted recording continues after them. 0 for any other route.
  [[nodiscard]] std::size_t skip_recorded(std::span<const Pose2> drive);
  /// Adds a line, whatever its distance from the line before. Throws FileError; at the first line
  /// also when the route is there and ends farther than a metre from it.
  void add(EncodedLine line);
  /// Adds a line of the next observation if one is due. Returns true if it was. Throws as `encode`
  /// and the other.
  bool add(const Observation& observation);
  /// Records a whole drive, with a pose for each entry: adds lines of those entries at which one is
  /// due and skips those that the route already holds. Calls `recorded` with their number after
  /// each line. Throws as `add` and `finish`; those before a picture that cannot be read are kept.
  Recorded record(const Dataset& drive, std::span<const Pose2> poses, Executor& executor,
                  const std::function<void(std::size_t lines)>& recorded = {});
  /// Writes the added lines to the disk. Throws FileError; ContractError if nothing was ever added.
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
  bool source_kept_ = false;
  LineEncoder encoder_;
  std::optional<Pose2> end_;   // of the route that was there
  std::optional<Pose2> last_;  // of the lines added
  std::vector<EncodedLine> waiting_;
  std::size_t appended_ = 0;
};

}  // namespace panonav
