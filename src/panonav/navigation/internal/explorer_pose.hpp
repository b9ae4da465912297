#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/pose_graph.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/relative_pose/home_vector.hpp"

namespace panonav {

/// Pose of an exploring robot among the views that it memorised, in the frame of the first one:
/// odometry, corrected by visual steps from the views around. A new view is joined to these by
/// edges of a pose graph, which moves all views; and to views elsewhere that show its place, so
/// that a robot that drifted does not explore the same floor once more.
class ExplorerPose {
 public:
  /// A view that an observation shows.
  struct Recognition {
    std::size_t view = 0;
    Pose2 robot_from_view;  ///< direction and turn from the images, length as expected
  };

  /// `radius_m`: catchment radius of a view. `odometry` must be valid.
  ExplorerPose(double radius_m, const OdometryNoise& odometry)
      : radius_m_(radius_m), odometry_(odometry) {}

  void move(const Pose2& moved);
  /// Corrects the pose by visual steps from the views around. Returns those that it recognises:
  /// turn and direction are where the pose expects them.
  std::vector<Recognition> correct(const OdometryView& current);
  /// Memorises a view. Cost: four `compute_pair_evidence`, and an optimisation of the pose graph.
  void add_view(OdometryView current, const std::vector<Recognition>& recognised);
  /// Searches all views; true if one is recognised, whose pose the robot then takes over. Cost: a
  /// `compute_pair_evidence` for each view.
  bool relocalise(const OdometryView& current);

  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  [[nodiscard]] const std::vector<OdometryView>& views() const noexcept { return views_; }
  [[nodiscard]] std::span<const Pose2> poses() const noexcept { return poses_; }
  /// Returns the index of the view that was recognised last.
  [[nodiscard]] std::size_t anchor() const noexcept { return anchor_; }
  /// Returns the path length since a view was recognised.
  [[nodiscard]] double unrecognised_m() const noexcept { return unrecognised_m_; }
  [[nodiscard]] double travelled_m() const noexcept { return travelled_m_; }
  /// Returns the standard deviation of the position relative to the views around.
  [[nodiscard]] double compute_position_deviation_m() const noexcept {
    return std::sqrt(position_variance_m2_);
  }
  /// True if the robot is in the catchment radius of a view.
  [[nodiscard]] bool is_near_a_view() const;
  /// Returns the map of the views; see `Explorer::map`.
  [[nodiscard]] TopologicalMap map(std::span<const ViewId> ids) const;

 private:
  [[nodiscard]] std::vector<std::size_t> find_near_views() const;
  [[nodiscard]] std::vector<Recognition> find_closures(const OdometryView& current) const;
  [[nodiscard]] Pose2 estimate_robot_from_view(const HomeVector& vector) const;
  void correct_heading(double turn_error_rad);
  void correct_position(Point2 view, double world_direction_rad);
  void add_driven_edge(std::size_t number);
  void add_seen_edge(std::size_t number, const Recognition& seen, double position_deviation);

  double radius_m_;
  OdometryNoise odometry_;
  std::vector<OdometryView> views_;
  std::vector<Pose2> poses_;
  std::vector<PoseEdge> edges_;
  std::vector<double> edge_weights_;
  std::size_t anchor_ = 0;
  Pose2 pose_;
  double position_variance_m2_ = 0.0;
  double heading_variance_rad2_ = 0.0;
  double unrecognised_m_ = 0.0;
  double travelled_m_ = 0.0;
  Pose2 since_view_;  // motion by odometry since the last memorised view
  double since_view_m_ = 0.0;
  double since_view_rad_ = 0.0;
};

}  // namespace panonav
