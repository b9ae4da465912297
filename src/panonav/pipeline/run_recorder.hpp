#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/panorama/tilt.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/pipeline/place_recogniser.hpp"

namespace panonav {

/// An edge of a map between two places.
struct RunEdge {
  Point2 from;
  Point2 to;
  LinkKind kind = LinkKind::sequence;
};

/// What is known at one moment of a run, for people to look at. What is empty is not written.
/// Positions and poses are in the frame "map" unless said otherwise.
struct RunMoment {
  double stamp_s = 0.0;
  std::optional<Image> picture;               ///< as the camera delivered it
  std::vector<std::uint8_t> encoded_picture;  ///< the same as PNG or JPEG; one of the two is enough
  std::optional<Panorama> panorama;
  std::vector<std::uint8_t> best_match;  ///< its thumbnail, PNG
  std::optional<Pose2> pose;             ///< of the robot
  /// Of x, y and heading, row-major, m^2, m rad and rad^2.
  std::optional<std::array<double, 9>> covariance;
  std::vector<Pose2> particles;
  std::optional<Pose2> odometry;  ///< absolute, in a frame of its own
  std::optional<Tilt> tilt;
  std::optional<ReferencePose> truth;
  // What stays until it is given anew.
  std::vector<Point2> references;
  std::vector<RunEdge> edges;
  std::vector<Pose2> plan;        ///< the way to go along
  std::vector<Pose2> directions;  ///< places, and which way they send the robot
  std::optional<Pose2> goal;
  bool sure = false;  ///< diagnostics: fine, otherwise a warning
  std::string state;  ///< "localised", "unknown place", ...; empty: no diagnostics
  std::vector<std::pair<std::string, std::string>> values;  ///< what else diagnostics tell
};

/// The picture of an observation and what is known of it. Where it has no stamp, `number` seconds.
[[nodiscard]] RunMoment moment_of(const Observation& seen, std::size_t number);
/// Of the views with a pose.
[[nodiscard]] std::vector<Point2> reference_positions(const VisualMemory& memory);

/// The part that a tracked estimate tells, and that a recognised place does.
void describe(RunMoment& moment, const MonteCarloEstimate& estimate);
void describe(RunMoment& moment, const Place& place);

struct RunRecorderOptions {
  /// Wait for the disk instead of leaving moments out: of runs that are not live.
  bool wait = false;
  std::size_t max_waiting = 64;  ///< moments
};

/// Writes a run as MCAP with ROS 2 messages (CDR), which Rerun, Foxglove and Lichtblick open as it
/// is: pictures as CompressedImage, references, edges, particles, plan and path as PointCloud2 and
/// as PoseArray and Path, where the camera of the references has stood as OccupancyGrid, the pose
/// as TF and PoseWithCovarianceStamped, the state as diagnostics (docs/formats.md). What it records
/// is a recording that can be read as any other (`read_recording`). A thread of its own packs and
/// writes, so that a slow disk does not hold up the robot: moments that it cannot keep up with are
/// left out and counted.
class RunRecorder {
 public:
  /// Replaces a file that is there. Throws FileError.
  explicit RunRecorder(const std::filesystem::path& file, const RunRecorderOptions& options = {});
  /// Closes, and says nothing when that fails.
  ~RunRecorder();
  RunRecorder(const RunRecorder&) = delete;
  RunRecorder& operator=(const RunRecorder&) = delete;

  /// Throws FileError when what came before could not be written; nothing is written any more then.
  void add(RunMoment moment);
  /// All that waits, and the end of the file. Throws FileError.
  void close();
  [[nodiscard]] std::size_t left_out() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
