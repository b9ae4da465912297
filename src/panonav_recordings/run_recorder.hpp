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
  Link::Kind kind = Link::Kind::sequence;  ///< why they are joined
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

/// A reference that was compared with the current view.
struct RunComparison {
  std::size_t reference = 0;        ///< index into `RunMoment::references`
  std::uint32_t dissimilarity = 0;  ///< as `Match`: less means more similar
};

/// Direction and confidence of a home vector.
struct RunHoming {
  double direction_rad = 0.0;  ///< in the frame of the robot
  double confidence = 0.0;     ///< 0 .. 1, as `HomeVector`
};

/// State of a run at one moment, for display. Empty members are not written. Positions and poses
/// are in the frame "map" unless stated otherwise. Records (`RunRecorder`) leave out members marked
/// "not in records".
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
  /// Times that the robot spent since the moment before, by stage, ms; not in records.
  std::vector<std::pair<std::string, double>> stages_ms;
  std::optional<Pose2> odometry;       ///< absolute, in a frame of its own
  std::optional<Tilt> tilt;            ///< roll and pitch, measured
  std::optional<ReferencePose> truth;  ///< true pose of the robot, for comparison
  // Members that stay valid until a later moment replaces them.
  std::vector<Point2> references;             ///< positions of the reference views
  std::vector<RunReference> reference_views;  ///< of each, or empty; not in records
  std::vector<RunRegion> regions;             ///< not in records
  std::vector<std::vector<Point2>> walls;  ///< lines; outlines end where they begin; not in records
  std::vector<RunEdge> edges;              ///< of the map that the references are in
  std::vector<Pose2> plan;                 ///< planned path
  std::vector<Pose2> directions;  ///< places with the direction in which they send the robot
  std::optional<Pose2> goal;      ///< destination of the robot
  bool sure = false;              ///< diagnostics: fine, otherwise a warning
  /// Probability of the estimated pose, or that the place is known: 0 .. 1.
  std::optional<double> probability;
  std::string state;  ///< "localised", "unknown place", ...; empty: no diagnostics
  std::vector<std::pair<std::string, std::string>> values;  ///< further values of the diagnostics
};

/// Makes a moment of an observation. Without a stamp it gets `number` seconds.
[[nodiscard]] RunMoment make_moment(const Observation& observation, std::size_t number);
/// Returns the positions of the views with a pose.
[[nodiscard]] std::vector<Point2> reference_positions(const VisualMemory& memory);

/// Sets the members of a moment that a tracked estimate has.
void describe(RunMoment& moment, const MonteCarloEstimate& estimate);
/// Sets the members of a moment that a recognised place has: its pose if place, position and
/// heading are known.
void describe(RunMoment& moment, const Place& place);

/// Options of a recorder for slow disks.
struct RunRecorderOptions {
  /// Wait for the disk instead of leaving moments out; for runs that are not live.
  bool wait = false;
  std::size_t max_waiting = 64;  ///< moments
};

/// Writes a run as MCAP with ROS 2 messages (CDR), which Rerun, Foxglove and Lichtblick open as it
/// is: pictures as CompressedImage, references, edges, particles, plan and path as PointCloud2 and
/// as PoseArray and Path, where the camera of the references has stood as OccupancyGrid, the pose
/// as TF and PoseWithCovarianceStamped, the state as diagnostics (docs/formats.md). The result can
/// be read as any recording (`read_recording`). A thread of its own packs and writes, so that a
/// slow disk does not delay the robot: moments that are too many for it are left out and counted.
class RunRecorder {
 public:
  /// Creates the file, or replaces it. Throws FileError.
  explicit RunRecorder(const std::filesystem::path& file, const RunRecorderOptions& options = {});
  ~RunRecorder();  ///< Closes the file, and ignores failures.
  RunRecorder(const RunRecorder&) = delete;
  RunRecorder& operator=(const RunRecorder&) = delete;

  /// Adds a moment. Throws FileError when an earlier one could not be written; nothing is written
  /// any more then.
  void add(RunMoment moment);
  /// Writes waiting moments and the end of the file. Throws FileError.
  void close();
  [[nodiscard]] std::size_t left_out() const;  ///< Returns the number of moments left out.

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::recordings
