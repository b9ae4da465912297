#include "panonav/motion/trajectory_error.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/statistics.hpp"

namespace panonav {
namespace {

struct Pair {
  Pose3 estimate;  ///< in the frame of the truth
  Pose3 truth;
};

TrajectoryError::Summary summarise(const std::vector<double>& errors) {
  double squares = 0;
  for (const double error : errors) squares += error * error;
  return {std::sqrt(squares / static_cast<double>(errors.size())), mean(errors), median(errors),
          quantile(errors, 0.95), *std::max_element(errors.begin(), errors.end())};
}

double rotation_between(const Rotation3& a, const Rotation3& b) {
  return (inverse(a) * b).angle_rad();
}

/// Compares the motions over consecutive parts of the estimated path; the first part begins where
/// the path reaches its length, as in evo_rpe.
void compute_relative_errors(const std::vector<Pair>& pairs, double distance_m,
                             TrajectoryError& error) {
  std::vector<double> position_m;
  std::vector<double> rotation_rad;
  double travelled_m = 0.0;
  std::optional<std::size_t> begin;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    travelled_m += distance(pairs[i - 1].estimate.position, pairs[i].estimate.position);
    if (travelled_m < distance_m) continue;
    travelled_m = 0.0;
    if (begin) {
      const Pose3 estimated = inverse(pairs[*begin].estimate) * pairs[i].estimate;
      const Pose3 true_motion = inverse(pairs[*begin].truth) * pairs[i].truth;
      position_m.push_back(distance(estimated.position, true_motion.position));
      rotation_rad.push_back(rotation_between(estimated.rotation, true_motion.rotation));
    }
    begin = i;
  }
  error.relative_pairs = position_m.size();
  if (position_m.empty()) return;
  error.relative_position_m = summarise(position_m);
  error.relative_rotation_rad = summarise(rotation_rad);
}

std::vector<StampedPose3> to_space(const Trajectory& trajectory) {
  std::vector<StampedPose3> poses;
  for (const StampedPose& stamped : trajectory.poses()) {
    poses.push_back({stamped.stamp_s, to_pose3(stamped.pose)});
  }
  return poses;
}

/// Returns the index of the nearest stamp, the first of two equally near ones.
std::size_t find_nearest(std::span<const StampedPose3> poses, double stamp_s) {
  const auto after = std::ranges::lower_bound(poses, stamp_s, {}, &StampedPose3::stamp_s);
  const auto at = static_cast<std::size_t>(after - poses.begin());
  if (at == 0) return 0;
  if (at == poses.size()) return at - 1;
  return stamp_s - poses[at - 1].stamp_s <= poses[at].stamp_s - stamp_s ? at - 1 : at;
}

}  // namespace

void visit_options(TrajectoryError::Options& options, OptionVisitor& visitor) {
  using T = TrajectoryError::Options;
  constexpr OptionTable table{
      choice<&T::align>("what the alignment of the estimate with the true trajectory may change: "
                        "rotation and translation, also the scale, or nothing",
                        "rigid", "similarity", "none"),
      option<&T::align_reflection>("allow the alignment to mirror the estimate"),
      option<&T::max_stamp_difference_s>(
          "largest difference between the stamps of an estimated pose and its true pose", 0, 1e9),
      option<&T::relative_distance_m>(
          "length of the parts of the path over which relative errors are computed", 0.001, 1e7),
  };
  table.visit(options, visitor);
}

bool is_planar(std::span<const StampedPose3> poses) {
  constexpr double max_height_m = 1e-9;
  constexpr double max_tilt_component = 1e-9;  // of the quaternion: sine of half the tilt
  const double height_m = poses.empty() ? 0.0 : poses.front().pose.position.z_m;
  return std::ranges::all_of(poses, [height_m](const StampedPose3& stamped) {
    const auto& [position, rotation] = stamped.pose;
    return std::abs(position.z_m - height_m) <= max_height_m &&
           std::hypot(rotation.x, rotation.y) <= max_tilt_component;
  });
}

std::vector<PosePair> pair_by_stamp(std::span<const StampedPose3> estimate,
                                    std::span<const StampedPose3> truth,
                                    double max_stamp_difference_s) {
  std::vector<PosePair> pairs;
  const bool estimate_is_longer = estimate.size() > truth.size();
  const auto shorter = estimate_is_longer ? truth : estimate;
  const auto longer = estimate_is_longer ? estimate : truth;
  if (longer.empty()) return pairs;
  for (std::size_t i = 0; i < shorter.size(); ++i) {
    const std::size_t nearest = find_nearest(longer, shorter[i].stamp_s);
    if (std::abs(longer[nearest].stamp_s - shorter[i].stamp_s) > max_stamp_difference_s) continue;
    pairs.push_back(estimate_is_longer ? PosePair{nearest, i} : PosePair{i, nearest});
  }
  return pairs;
}

std::optional<TrajectoryError> trajectory_error(std::span<const StampedPose3> estimate,
                                                std::span<const StampedPose3> truth,
                                                const TrajectoryError::Options& options) {
  validate(options);
  const auto matched = pair_by_stamp(estimate, truth, options.max_stamp_difference_s);
  if (matched.size() < 2) return std::nullopt;
  TrajectoryError error;
  error.pairs = matched.size();
  error.left_out = estimate.size() - std::min(estimate.size(), matched.size());
  std::vector<Pair> pairs;
  std::vector<Point3> from;
  std::vector<Point3> to;
  for (const PosePair& pair : matched) {
    pairs.push_back({estimate[pair.estimate].pose, truth[pair.truth].pose});
    from.push_back(pairs.back().estimate.position);
    to.push_back(pairs.back().truth.position);
  }
  if (options.align != TrajectoryError::Align::none) {
    error.planar = is_planar(estimate) && is_planar(truth);
    const Alignment::Options freedoms{
        .allow_scale = options.align == TrajectoryError::Align::similarity,
        .allow_reflection = options.align_reflection};
    error.truth_from_estimate =
        error.planar ? align_in_plane(from, to, freedoms) : align_in_space(from, to, freedoms);
  }
  std::vector<double> rotation_rad;
  for (Pair& pair : pairs) {
    pair.estimate = error.truth_from_estimate.apply(pair.estimate);
    error.position_errors_m.push_back(distance(pair.estimate.position, pair.truth.position));
    rotation_rad.push_back(rotation_between(pair.estimate.rotation, pair.truth.rotation));
  }
  error.position_m = summarise(error.position_errors_m);
  error.rotation_rad = summarise(rotation_rad);
  compute_relative_errors(pairs, options.relative_distance_m, error);
  return error;
}

std::optional<TrajectoryError> trajectory_error(const Trajectory& estimate, const Trajectory& truth,
                                                const TrajectoryError::Options& options) {
  return trajectory_error(to_space(estimate), to_space(truth), options);
}

}  // namespace panonav
