#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "lab/y03/route_contours.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/route/route_fit.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav_simulation/renderer.hpp"

namespace panonav::lab {

// Drives and localisation of [Y03 section 5] in one variant of the lab.

/// A drive past a memorised path: true poses, lines and odometry.
struct LineDrive {
  std::vector<Pose2> truth;
  std::vector<std::vector<float>> lines;
  std::vector<Pose2> steps;  ///< by odometry, from the previous pose; the first is unused
};

/// A variant of the lab: a straight path of 5 m with a line every 2 cm at exact positions, and a
/// drive of 2 m across it at 30 degrees, once in the memorised scene and once with moved objects,
/// which change about a tenth of the visible directions.
struct LabRoute {
  std::uint64_t seed = 0;
  std::shared_ptr<const simulation::Renderer> renderer;  ///< of the memorised scene
  double camera_height_m = 0.6;
  Pose2 world_from_path;  ///< pose of the path's start, heading along it
  RoutePanorama route;    ///< in the world's frame
  LineDrive across;
  LineDrive across_changed;
  double changed_fraction = 0.0;          ///< share of the directions in which objects changed
  std::vector<LineDrive> lateral_drives;  ///< parallel to the path, one per lateral offset
};

inline constexpr double lab_path_m = 5.0;
inline constexpr double lab_spacing_m = 0.02;

/// Records a variant with about 350 images. `lateral_m` contains the lateral offsets of drives
/// parallel to the path, of 10 images each.
[[nodiscard]] LabRoute record_lab_route(std::uint64_t seed, const std::vector<double>& lateral_m,
                                        Executor& executor);

/// Returns the route with every n-th line only, n = `every`.
[[nodiscard]] RoutePanorama thin_route(const RoutePanorama& route, std::size_t every);
/// Returns the route with its positions scaled about the first line's position.
[[nodiscard]] RoutePanorama scale_route(const RoutePanorama& route, double factor);

/// Estimated poses of a drive and their errors.
struct DriveErrors {
  std::vector<double> position_m;
  std::vector<double> heading_rad;  ///< absolute
  std::vector<Pose2> poses;         ///< estimated
  std::size_t missed = 0;           ///< images without an answer
  std::size_t changed = 0;          ///< images with a reported change; direct fit only
};

/// Localises all lines of a drive by direct fit, each predicted from the last estimate and
/// odometry. The first prediction is off by 5 cm and 2 degrees [Y03 section 4.1].
[[nodiscard]] DriveErrors follow_by_fit(const RouteLines& lines, const LineDrive& drive);
/// Localises all lines of a drive by dual contours; uses odometry alone where they do not converge.
[[nodiscard]] DriveErrors follow_by_contours(const RouteContours& contours, const LineDrive& drive);

/// A run to sub-goals off the path under proportional control [Y03 section 5.2].
struct GoalRun {
  std::vector<Pose2> truth;
  std::vector<Pose2> estimate;
  bool arrived = false;
  double error_m = 0.0;  ///< distance of the robot from the goal at the end
};

/// Drives from (1, 0) via (2, -0.5) to (3, 0) m, in the path's frame.
[[nodiscard]] GoalRun run_to_goals(const LabRoute& lab, const RouteLines& lines,
                                   std::uint64_t seed);
/// Returns start, sub-goal and goal of `run_to_goals`, in the path's frame.
[[nodiscard]] std::vector<Point2> goal_run_points();

}  // namespace panonav::lab
