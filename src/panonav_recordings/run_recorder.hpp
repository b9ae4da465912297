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
#include "panonav/localisation/place.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/panorama/tilt.hpp"
#include "panonav/pipeline/observation.hpp"

namespace panonav::recordings {

/// An edge of a map between two places.
struct RunEdge {
  Point2 from;                         ///< one end
  Point2 to;                           ///< the other
  LinkKind kind = LinkKind::sequence;  ///< why they are joined
};

/// Data of a reference besides its position.
struct RunReference {
  std::string name;                   ///< of the view
  std::optional<double> heading_rad;  ///< at which it was taken; empty: unknown
};

/// A region of the floor that belongs to an area of the memory.
struct RunRegion {
  std::vector<Point2> outline;  ///< corners in order, closed from the last to the first
  std::size_t area = 0;         ///< number of the area, from 0
};

/// A reference that was compared with what is seen.
struct RunComparison {
  std::size_t reference = 0;        ///< its place in `RunMoment::references`
  std::uint32_t dissimilarity = 0;  ///< as `Match`: the less, the more alike
};

/// Where the home vector points, and how far it is to be believed.
struct RunHoming {
  double direction_rad = 0.0;  ///< in the frame of the robot
  double confidence = 0.0;     ///< 0 .. 1, as `HomeVector`
};

/// State of a run at one moment, for people to look at. Empty members are not written. Positions
/// and poses are in the frame "map" unless said otherwise. Records (`RunRecorder`) leave out what
/// is marked so.
struct RunMoment {
  double stamp_s = 0.0;                       ///< seconds, ascending
  std::optional<Image> picture;               ///< as the camera delivered it
  std::vector<std::uint8_t> encoded_picture;  ///< the same as PNG or JPEG; one of the two is enough
  std::optional<Panorama> panorama;           ///< unwarped from the picture
  std::vector<std::uint8_t> best_match;       ///< its thumbnail, PNG
  std::optional<double> best_match_turn_rad;  ///< heading of the robot relative to it
  std::optional<Pose2> pose;                  ///< of the robot
  /// Of x, y and heading, row-major, m^2, m rad and rad^2.
  std::optional<std::array<double, 9>> covariance;
  std::vector<Pose2> particles;  ///< of a filter, or a sample of them (`resample_systematically`)
  std::vector<PoseMode> modes;   ///< heaviest first; not in records
  std::vector<RunComparison> comparisons;  ///< not in records
  std::optional<RunHoming> homing;         ///< not in records
  /// What the robot spent its time with since the moment before, ms; not in records.
  std::vector<std::pair<std::string, double>> stages_ms;
  std::optional<Pose2> odometry;       ///< absolute, in a frame of its own
  std::optional<Tilt> tilt;            ///< roll and pitch, measured
  std::optional<ReferencePose> truth;  ///< where the robot truly is, for comparison
  // Members that stay valid until a later moment replaces them.
  std::vector<Point2> references;             ///< positions of the reference views
  std::vector<RunReference> reference_views;  ///< of each, or empty; not in records
  std::vector<RunRegion> regions;             ///< not in records
  std::vector<std::vector<Point2>> walls;  ///< lines; outlines end where they begin; not in records
  std::vector<RunEdge> edges;              ///< of the map that the references are in
  std::vector<Pose2> plan;                 ///< the way to go along
  std::vector<Pose2> directions;           ///< places, and which way they send the robot
  std::optional<Pose2> goal;               ///< where the robot is sent
  bool sure = false;                       ///< diagnostics: fine, otherwise a warning
  /// That the robot is where it is said to be, or the place a known one: 0 .. 1.
  std::optional<double> probability;
  std::string state;  ///< "localised", "unknown place", ...; empty: no diagnostics
  std::vector<std::pair<std::string, std::string>> values;  ///< what else diagnostics tell
};

/// The picture of an observation and what is known of it. Where it has no stamp, `number` seconds.
[[nodiscard]] RunMoment make_moment(const Observation& seen, std::size_t number);
/// Returns the positions of the views with a pose.
[[nodiscard]] std::vector<Point2> reference_positions(const VisualMemory& memory);

/// The part that a tracked estimate tells, and that a recognised place does.
void describe(RunMoment& moment, const MonteCarloEstimate& estimate);
/// A place has a pose where it is known, with its position and heading.
void describe(RunMoment& moment, const Place& place);

/// Options of a recorder for slow disks.
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
  ~RunRecorder();  ///< Closes, and says nothing when that fails.
  RunRecorder(const RunRecorder&) = delete;
  RunRecorder& operator=(const RunRecorder&) = delete;

  /// Throws FileError when what came before could not be written; nothing is written any more then.
  void add(RunMoment moment);
  /// All that waits, and the end of the file. Throws FileError.
  void close();
  [[nodiscard]] std::size_t left_out() const;  ///< Moments that the disk was too slow for.

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::recordings
