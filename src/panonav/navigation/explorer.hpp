#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// Options of an exploration.
struct ExplorationOptions {
  /// Largest radius of a view's catchment area: the area from which the robot homes to the view.
  double radius_m = 0.5;
  /// Longest motion between two observations.
  double step_m = 0.25;
  /// Smallest uncovered area for which a view is memorised.
  double min_area_m2 = 0.05;
  /// Distance that the robot drives without recognising a view before it drives back to the last
  /// one that it recognised.
  double max_unrecognised_m = 2.0;
  /// Distance after which the exploration ends and the robot drives back to its start.
  double max_metres = 500.0;
};
void visit_options(ExplorationOptions& options, OptionVisitor& visitor);

/// Lists motion, contact and ranges since the last observation.
struct ExplorationReport {
  /// A measured range.
  struct Range {
    double direction_rad = 0.0;  ///< in the current robot frame
    double length_m = 0.0;       ///< free length from the robot's centre
    bool is_obstacle = false;    ///< an obstacle is at its end
    double deviation_m = 0.0;    ///< standard deviation of the length
  };
  /// Motion by odometry, robot_old_from_robot_new.
  Pose2 moved;
  /// Direction in which it touched an obstacle, in the current robot frame.
  std::optional<double> contact_rad;
  /// Direction of the motion that the contact ended, in the current robot frame.
  double course_rad = 0.0;
  /// Ranges; empty if the robot has no ranges.
  std::span<const Range> ranges;
};

/// One decision of an explorer.
struct ExplorationDecision {
  /// Progress of an exploration.
  enum class State {
    exploring,   ///< drives to where the next view is needed
    recovering,  ///< drives back to the last view that it recognised
    returning,   ///< the floor is covered; drives back to the start
    done,        ///< is back at the start
    lost,        ///< recognises no view, and does not find back
  };
  State state = State::exploring;  ///< after this observation
  double direction_rad = 0.0;      ///< direction of motion in the current robot frame
  double advance_m = 0.0;          ///< length of the motion; 0 at the end
  bool memorise = false;           ///< this observation is a new view, the next node of the map
};
/// Returns "exploring", "recovering", "returning", "done" or "lost".
[[nodiscard]] std::string_view to_string(ExplorationDecision::State state);

/// Progress of an exploration, by the knowledge of the explorer.
struct ExplorationProgress {
  double floor_m2 = 0.0;              ///< floor that was found, on which the robot has room
  double covered_m2 = 0.0;            ///< part of it in the catchment area of a view
  double position_deviation_m = 0.0;  ///< of the pose, relative to the views around
  bool is_complete = false;           ///< nothing is left to explore
};

/// Leads a robot through an unknown place so that the views that it memorises cover the floor with
/// their catchment areas [M04 section 1]. Knows images, odometry, contact and ranges, but no true
/// pose and no map. Each observation is compared with the views around: their home vectors correct
/// the pose by odometry, and show where a catchment area does not reach as far as assumed. A
/// `CoverageMap` of all sensed obstacles and views then gives the position of the next view. If no
/// view was recognised for too long, the robot drives back to the last one.
///
/// Same calls, same bits. Cost of an observation: a few home vectors and a `CoverageMap`.
class Explorer {
 public:
  /// `robot_radius_m`: radius of the robot. `has_ranges`: the reports contain ranges; without them,
  /// floor around the robot is assumed to be free until it touches an obstacle. `odometry`: errors
  /// of the odometry. Throws OptionError, ContractError.
  Explorer(const ExplorationOptions& options, double robot_radius_m, bool has_ranges,
           const OdometryNoise& odometry = {});
  ~Explorer();
  /// A moved-from explorer may only be destroyed or assigned to.
  Explorer(Explorer&& other) noexcept;
  Explorer& operator=(Explorer&& other) noexcept;

  /// Decides on the next motion after an observation; the first observation becomes the first view.
  /// After the end, every decision is to stand still. Throws ContractError on a signature of
  /// another shape than the first and on numbers that are not finite.
  [[nodiscard]] ExplorationDecision observe(const FourierSignature& view,
                                            const ExplorationReport& report = {});

  /// Returns the estimated pose of the robot, in the frame of the first view.
  [[nodiscard]] const Pose2& pose() const noexcept;
  /// Returns the estimated poses of the memorised views, in the frame of the first one.
  [[nodiscard]] std::span<const Pose2> view_poses() const noexcept;
  /// Returns the map of the memorised views, whose ids in their memory are `ids`; edges are driven
  /// or measured motions. Throws ContractError unless there is an ascending id for each view.
  [[nodiscard]] TopologicalMap map(std::span<const ViewId> ids) const;
  /// Returns the length of the path by odometry.
  [[nodiscard]] double travelled_m() const noexcept;
  /// Returns the progress at the last observation; zeros before the first. Cost: O(cells of the
  /// map).
  [[nodiscard]] ExplorationProgress progress() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
