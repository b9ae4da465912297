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

// The experiments of [Y03 section 5] in one variant of the lab.

/// A drive past a memorised path: what is seen, and what odometry says.
struct LineDrive {
  std::vector<Pose2> truth;
  std::vector<std::vector<float>> lines;
  std::vector<Pose2> steps;  ///< odometry's, from the pose before; the first is of no use
};

/// A variant of the lab: a straight path of 5 m with a line every 2 cm, positions exact, and a
/// drive of 2 m at 30 degrees across it, in the scene as memorised and with things moved so that
/// about a tenth of what is seen is another.
struct LabRoute {
  std::uint64_t seed = 0;
  std::shared_ptr<const simulation::Renderer> renderer;  ///< of the scene as memorised
  double camera_height_m = 0.6;
  Pose2 world_from_path;  ///< the path's start, along it
  RoutePanorama route;    ///< in the world's frame
  LineDrive across;
  LineDrive across_changed;
  double changed_share = 0.0;     ///< of the directions that show something else there
  std::vector<LineDrive> beside;  ///< parallel to the path, one a lateral offset; empty without
};

inline constexpr double lab_path_m = 5.0;
inline constexpr double lab_spacing_m = 0.02;

/// Records a variant: some 350 images. `lateral_m`: offsets of drives beside the path, 10 images
/// each.
[[nodiscard]] LabRoute record_lab_route(std::uint64_t seed, const std::vector<double>& lateral_m,
                                        Executor& executor);

/// Returns every n-th line.
[[nodiscard]] RoutePanorama thin_route(const RoutePanorama& route, std::size_t every);
/// Returns the route with positions scaled around the first line.
[[nodiscard]] RoutePanorama scale_route(const RoutePanorama& route, double factor);

/// Errors of estimated poses.
struct DriveErrors {
  std::vector<double> position_m;
  std::vector<double> heading_rad;  ///< absolute
  std::vector<Pose2> poses;         ///< estimated
  std::size_t missed = 0;           ///< images without an answer
  std::size_t changed = 0;          ///< images in which something is named as changed; direct fit
};

/// Localises by the direct fit along a drive, each from the last and odometry; the first from a
/// prediction that is off by 5 cm and 2 degrees [Y03 section 4.1].
[[nodiscard]] DriveErrors follow_by_fit(const RouteLines& lines, const LineDrive& drive);
/// Localises by the dual contours; where they do not converge, odometry continues.
[[nodiscard]] DriveErrors follow_by_contours(const RouteContours& contours, const LineDrive& drive);

/// A run to sub-goals off the path under proportional control [Y03 section 5.2].
struct GoalRun {
  std::vector<Pose2> truth;
  std::vector<Pose2> estimate;
  bool arrived = false;
  double error_m = 0.0;  ///< between goal and robot at the end
};

/// Runs from (1, 0) over (2, -0.5) to (3, 0) m of the path's frame.
[[nodiscard]] GoalRun run_to_goals(const LabRoute& lab, const RouteLines& lines,
                                   std::uint64_t seed);
/// Returns these points, in the path's frame.
[[nodiscard]] std::vector<Point2> goal_run_points();

}  // namespace panonav::lab
