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
  Point2 from;                             ///< one end
  Point2 to;                               ///< the other
  Link::Kind kind = Link::Kind::sequence;  ///< origin of the edge
};

/// Name and heading of a reference; its position is in `RunMoment::references`.
struct RunReference {
  std::string name;                   ///< name of the view
  std::optional<double> heading_rad;  ///< heading when it was taken, if known
};

/// A region of the floor that belongs to an area of the memory.
struct RunRegion {
  std::vector<Point2> outline;  ///< corners in order, closed from the last to the first
  std::size_t area = 0;         ///< number of the area, from 0
};

/// A reference that was compared with the current view.
struct RunComparison {
  std::size_t reference = 0;        ///< index into `RunMoment::references`
  std::uint32_t dissimilarity = 0;  ///< as `Match`: a smaller value is more similar
};

/// Direction of a home vector and its probability.
struct RunHoming {
  double direction_rad = 0.0;  ///< in the frame of the robot
  double probability = 0.0;    ///< 0 .. 1, that the direction is right, as `PairEvidence`
};

/// State of a run at one moment, for display. Empty members are not written. Positions and poses
/// are in the frame "map" unless stated otherwise. Records (`RunRecorder`) leave out members marked
/// "not in records".
struct RunMoment {
  double stamp_s = 0.0;                       ///< seconds, ascending
  std::optional<Image> picture;               ///< as the camera delivered it
  std::vector<std::uint8_t> encoded_picture;  ///< the same as PNG or JPEG; one is enough
  std::optional<Panorama> panorama;           ///< unwarped from the picture
  std::vector<std::uint8_t> best_match;       ///< thumbnail of the reference, PNG or JPEG
  std::optional<double> best_match_turn_rad;  ///< heading of the robot relative to that reference
  std::optional<Pose2> pose;                  ///< of the robot
  /// Covariance of x, y and heading, row-major, in m^2, m rad and rad^2.
  std::optional<std::array<double, 9>> covariance;
  std::vector<Pose2> particles;  ///< of a filter, or a sample of them (`resample_systematically`)
  std::vector<PoseMode> modes;   ///< heaviest first; not in records
  std::vector<RunComparison> comparisons;  ///< not in records
  std::optional<RunHoming> homing;         ///< not in records
  /// Duration of each stage of the robot's work since the previous moment, ms; not in records.
  std::vector<std::pair<std::string, double>> stages_ms;
  std::optional<Pose2> odometry;       ///< pose in the odometry frame
  std::optional<Tilt> tilt;            ///< roll and pitch, measured
  std::optional<ReferencePose> truth;  ///< true pose of the robot, for comparison
  // These members stay valid until a later moment replaces them.
  std::vector<Point2> references;             ///< positions of the reference views
  std::string length_unit;                    ///< of all positions if it is not "m"; not in records
  std::vector<RunReference> reference_views;  ///< one for each reference, or empty; not in records
  std::vector<RunRegion> regions;             ///< not in records
  std::vector<std::vector<Point2>> walls;  ///< polylines, closed if ends are equal; not in records
  std::vector<RunEdge> edges;              ///< edges of the map of the references
  std::vector<Pose2> plan;                 ///< planned path
  std::vector<Pose2> directions;           ///< positions and the directions to drive there
  std::optional<Pose2> goal;               ///< destination of the robot
  bool sure = false;                       ///< true: diagnostics level 0; false: a warning
  /// Probability, 0 .. 1, of the estimated pose, or that the place is known.
  std::optional<double> probability;
  std::string state;  ///< "localised", "unknown place", ...; empty: no diagnostics
  std::vector<std::pair<std::string, std::string>> values;  ///< further values of the diagnostics
};

/// Makes a moment of an observation. Its stamp is that of the observation, else `number` seconds.
[[nodiscard]] RunMoment make_moment(const Observation& observation, std::size_t number);
/// Returns the positions of all views that have a pose.
[[nodiscard]] std::vector<Point2> reference_positions(const VisualMemory& memory);

/// Sets pose, covariance, state and diagnostics of a moment from a tracked estimate.
void set_localisation(RunMoment& moment, const MonteCarloEstimate& estimate);
/// Sets state, probability and diagnostics of a moment from a recognised place, and the pose if
/// place, position and heading are known.
void set_localisation(RunMoment& moment, const Place& place);

/// Options of `RunRecorder` for a disk that is too slow.
struct RunRecorderOptions {
  /// True: `add` waits for the disk instead of dropping moments; for runs that are not live.
  bool wait = false;
  std::size_t max_waiting = 64;  ///< moments in the queue
};

/// Writes a run as MCAP with ROS 2 messages (CDR) for Rerun, Foxglove and Lichtblick. Pictures are
/// CompressedImage; references, edges, particles, plan and path are PointCloud2, and also PoseArray
/// or Path; visited floor is OccupancyGrid; the pose is TF and PoseWithCovarianceStamped; the state
/// is diagnostics (docs/formats.md). `read_recording` can read the file. Its own thread packs and
/// writes, so that a slow disk does not delay the robot; if `max_waiting` moments are queued,
/// further ones are dropped and counted.
class RunRecorder {
 public:
  /// Creates the file, or replaces it. Throws FileError.
  explicit RunRecorder(const std::filesystem::path& file, const RunRecorderOptions& options = {});
  ~RunRecorder();  ///< Closes the file, and ignores failures.
  RunRecorder(const RunRecorder&) = delete;
  RunRecorder& operator=(const RunRecorder&) = delete;

  /// Adds a moment. Throws FileError if an earlier one could not be written; nothing more is
  /// written after that.
  void add(RunMoment moment);
  /// Writes the queued moments and the end of the file. Throws FileError.
  void close();
  [[nodiscard]] std::size_t left_out() const;  ///< Returns the number of moments left out.

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::recordings
