#include "panonav/motion/trajectory_error.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/statistics.hpp"

namespace panonav {
namespace {

struct Pair {
  Pose2 estimate;  ///< in the frame of the truth
  Pose2 truth;
};

TrajectoryError::Summary summarise(const std::vector<double>& errors) {
  double squares = 0;
  for (const double error : errors) squares += error * error;
  return {std::sqrt(squares / static_cast<double>(errors.size())), mean(errors), median(errors),
          quantile(errors, 0.95), *std::max_element(errors.begin(), errors.end())};
}

Pose2 apply_alignment(const Alignment& ground_truth_from_estimate, const Pose2& pose) {
  const Point2 position = ground_truth_from_estimate.apply(pose.position());
  const double heading_rad =
      ground_truth_from_estimate.reflected ? -pose.heading_rad : pose.heading_rad;
  return {position.x_m, position.y_m,
          wrap_angle(heading_rad + ground_truth_from_estimate.rotation_rad)};
}

/// Compares each pose with the first one that is `distance_m` farther along the true path.
void compute_relative_errors(const std::vector<Pair>& pairs, double distance_m,
                             TrajectoryError& error) {
  std::vector<double> travelled_m{0.0};
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    travelled_m.push_back(travelled_m.back() +
                          distance(pairs[i - 1].truth.position(), pairs[i].truth.position()));
  }
  std::vector<double> position_m;
  std::vector<double> heading_rad;
  std::size_t end = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    while (end < pairs.size() && travelled_m[end] - travelled_m[i] < distance_m) ++end;
    if (end == pairs.size()) break;
    const Pose2 estimated = inverse(pairs[i].estimate) * pairs[end].estimate;
    const Pose2 true_motion = inverse(pairs[i].truth) * pairs[end].truth;
    position_m.push_back(distance(estimated.position(), true_motion.position()));
    heading_rad.push_back(
        std::abs(angle_difference(estimated.heading_rad, true_motion.heading_rad)));
  }
  error.relative_pairs = position_m.size();
  if (position_m.empty()) return;
  error.relative_position_m = summarise(position_m);
  error.relative_heading_rad = summarise(heading_rad);
}

}  // namespace

void visit_options(TrajectoryError::Options& options, OptionVisitor& visitor) {
  using T = TrajectoryError::Options;
  constexpr OptionTable table{
      option<&T::max_gap_s>("longest gap in the true trajectory that is interpolated", 0.001, 1e9),
      option<&T::relative_distance_m>("distance along the true path for the relative error", 0.001,
                                      1e7),
      option<&T::align>("align the estimate with the true trajectory first"),
      option<&T::align_scale>("allow the alignment to change the scale"),
      option<&T::align_reflection>("allow the alignment to mirror the estimate"),
  };
  table.visit(options, visitor);
}

std::optional<TrajectoryError> trajectory_error(const Trajectory& estimate, const Trajectory& truth,
                                                const TrajectoryError::Options& options) {
  validate(options);
  std::vector<Pair> pairs;
  for (const StampedPose& stamped : estimate.poses()) {
    const auto true_pose = truth.at(stamped.stamp_s, options.max_gap_s);
    if (true_pose) pairs.push_back({stamped.pose, *true_pose});
  }
  if (pairs.size() < 2) return std::nullopt;

  TrajectoryError error;
  error.pairs = pairs.size();
  error.left_out = estimate.size() - pairs.size();
  if (options.align) {
    std::vector<Point2> from;
    std::vector<Point2> to;
    for (const Pair& pair : pairs) {
      from.push_back(pair.estimate.position());
      to.push_back(pair.truth.position());
    }
    error.ground_truth_from_estimate =
        align(from, to,
              {.allow_scale = options.align_scale, .allow_reflection = options.align_reflection});
  }
  std::vector<double> heading_rad;
  for (Pair& pair : pairs) {
    pair.estimate = apply_alignment(error.ground_truth_from_estimate, pair.estimate);
    error.position_errors_m.push_back(distance(pair.estimate.position(), pair.truth.position()));
    heading_rad.push_back(
        std::abs(angle_difference(pair.estimate.heading_rad, pair.truth.heading_rad)));
  }
  error.position_m = summarise(error.position_errors_m);
  error.heading_rad = summarise(heading_rad);
  error.ground_truth_from_estimate.rms_m = error.position_m.rms;
  compute_relative_errors(pairs, options.relative_distance_m, error);
  return error;
}

}  // namespace panonav
