#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/topological_mapper.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/signature/fourier_signature.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::simulation {

/// Makes a place to drive through, without any reference views.
[[nodiscard]] PlaceRecording make_empty_place(Scene scene, std::uint64_t seed, int columns,
                                              Executor& executor);

/// True poses, odometry and views of a drive.
struct MappingRecording {
  std::vector<Pose2> truth;
  std::vector<Pose2> wheels;  ///< odometry_from_robot
  std::vector<FourierSignature> views;
};

/// Returns the noise of a cheap robot: a few times the errors of `OdometryNoise`'s defaults.
[[nodiscard]] OdometryNoise make_noisy_wheels();

/// Plans poses every `spacing_m` along the way points, on straight free lines or shortest paths,
/// heading along the path; at most `max_poses` poses. Throws ContractError as `plan_recording`.
[[nodiscard]] std::vector<Pose2> drive(const PlaceRecording& place,
                                       std::span<const Point2> way_points, double spacing_m,
                                       std::size_t max_poses);

/// Records views at all poses, preprocessed by the command's defaults, view i with the noise seed
/// `seed` + i; odometry of `wheels`.
[[nodiscard]] MappingRecording record_for_mapping(const PlaceRecording& place,
                                                  std::vector<Pose2> poses, int components,
                                                  const OdometryNoise& wheels, std::uint64_t seed,
                                                  Executor& executor);

/// Returns the first components of a signature. Throws ContractError unless 1 <= components <= its
/// own.
[[nodiscard]] FourierSignature first_components(const FourierSignature& signature, int components);

/// Returns every n-th view.
[[nodiscard]] MappingRecording thin_recording(const MappingRecording& recording, std::size_t n);

/// A run through the mapper.
struct MappedRecording {
  TopologicalMap map;
  std::vector<std::size_t> number;  ///< in the recording, of each node
  std::vector<Point2> estimate;     ///< of each node
  std::vector<Point2> truth;        ///< of each node
  std::size_t right_closures = 0;   ///< views at most 1 m apart
  std::size_t wrong_closures = 0;
  double mean_step_s = 0.0;  ///< of a view, the last optimisation shared among them
  double max_step_s = 0.0;
  double finish_s = 0.0;  ///< the last optimisation
};

struct MappingRunOptions {
  MappingOptions mapping;
  VisualOdometryOptions odometry;
  LoopClosureOptions closure;
  int components = 15;
  bool wheels = false;        ///< steps of the wheels are known
  std::size_t max_nodes = 0;  ///< the run ends at this number of nodes; 0: all views
};
[[nodiscard]] MappedRecording map_recording(const MappingRecording& recording,
                                            const MappingRunOptions& options);

/// Returns mu, or 1 where one of the sets is a single point.
[[nodiscard]] double shape_error(std::span<const Point2> estimate, std::span<const Point2> truth);

/// Returns the points of a map aligned to the truth with one scale, for images.
[[nodiscard]] std::vector<Point2> align_to(std::span<const Point2> estimate,
                                           std::span<const Point2> truth);

}  // namespace panonav::simulation
