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

/// Makes a place to drive through, without reference views; `rendering` is that of its views.
[[nodiscard]] PlaceRecording make_empty_place(Scene scene, std::uint64_t seed,
                                              PanoramaRendering rendering, Executor& executor);

/// True poses, wheel odometry and views of a drive.
struct MappingRecording {
  std::vector<Pose2> truth;
  std::vector<Pose2> wheels;  ///< odometry_from_robot
  std::vector<FourierSignature> views;
};

/// Returns the noise of a cheap robot's odometry, a few times the defaults of `OdometryNoise`.
[[nodiscard]] OdometryNoise make_noisy_wheels();

/// Plans poses every `spacing_m` along the way points, connected by straight free lines or shortest
/// paths, headings along the path; at most `max_poses` poses. Throws ContractError as
/// `plan_recording`.
[[nodiscard]] std::vector<Pose2> drive(const PlaceRecording& place,
                                       std::span<const Point2> way_points, double spacing_m,
                                       std::size_t max_poses);

/// Records a view at each pose, preprocessed with the defaults of the command line program, and
/// odometry with the noise `wheels`. View i uses the noise seed `seed` + i.
[[nodiscard]] MappingRecording record_for_mapping(const PlaceRecording& place,
                                                  std::vector<Pose2> poses, int components,
                                                  const OdometryNoise& wheels, std::uint64_t seed,
                                                  Executor& executor);

/// Returns the signature reduced to its first components. Throws ContractError unless 1 <=
/// components <= those of `signature`.
[[nodiscard]] FourierSignature first_components(const FourierSignature& signature, int components);

/// Returns the recording with every n-th view only.
[[nodiscard]] MappingRecording thin_recording(const MappingRecording& recording, std::size_t n);

/// A recording mapped by the mapper.
struct MappedRecording {
  TopologicalMap map;
  std::vector<std::size_t> number;  ///< index in the recording, per node
  std::vector<Point2> estimate;     ///< of each node
  std::vector<Point2> truth;        ///< of each node
  std::size_t right_closures = 0;   ///< closures between views at most 1 m apart
  std::size_t wrong_closures = 0;
  double mean_step_s = 0.0;  ///< per view, including its share of the last optimisation
  double max_step_s = 0.0;
  double finish_s = 0.0;  ///< duration of the last optimisation
};

struct MappingRunOptions {
  MappingOptions mapping;
  VisualOdometryOptions odometry;
  LoopClosureOptions closure;
  int components = 15;
  bool wheels = false;        ///< use the motion by the wheels
  std::size_t max_nodes = 0;  ///< number of nodes at which the run ends; 0: all views
};
[[nodiscard]] MappedRecording map_recording(const MappingRecording& recording,
                                            const MappingRunOptions& options);

/// Returns the shape difference mu; 1 if all points of one set coincide.
[[nodiscard]] double shape_error(std::span<const Point2> estimate, std::span<const Point2> truth);

/// Returns the points of a map aligned to the true ones with one scale factor, for plots.
[[nodiscard]] std::vector<Point2> align_to(std::span<const Point2> estimate,
                                           std::span<const Point2> truth);

}  // namespace panonav::simulation
