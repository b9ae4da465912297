#include "panonav/localisation/internal/pose_witness.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

/// Smallest number of witnesses: two could both be wrong in the same way.
constexpr std::size_t min_witnesses = 3;
/// Smallest share of witnesses that agree; 99 % of sure localisations are right
/// (docs/decisions.md).
constexpr double min_agreeing_share = 0.8;
/// Smallest extent of the witnesses' images in spacings; nearer images would all be matched to the
/// same references.
constexpr double min_spread_spacings = 2.0;
/// Odometry error as a share of the distance travelled, due to slipping wheels.
constexpr double odometry_error_share = 0.05;

Pose2 predict_pose(const Pose2& odometry, const PoseWitness& witness) {
  return witness.pose * (inverse(witness.odometry) * odometry);
}

}  // namespace

std::optional<Pose2> find_witnessed_pose(const Pose2& odometry,
                                         std::span<const PoseWitness> witnesses,
                                         const std::optional<PoseWitness>& own, double spacing_m) {
  if (witnesses.size() < min_witnesses) return std::nullopt;
  std::vector<Pose2> poses;
  for (const PoseWitness& witness : witnesses) poses.push_back(predict_pose(odometry, witness));
  const auto agree = [&](std::size_t a, std::size_t b) {
    const double travelled_m = witnesses[a].travelled_m + witnesses[b].travelled_m;
    return distance(poses[a].position(), poses[b].position()) <=
               0.5 * spacing_m + odometry_error_share * travelled_m &&
           std::abs(angle_difference(poses[a].heading_rad, poses[b].heading_rad)) <=
               heading_agreement_tolerance_rad;
  };
  std::vector<std::size_t> best;
  for (std::size_t a = 0; a < poses.size(); ++a) {
    std::vector<std::size_t> agreeing;
    for (std::size_t b = 0; b < poses.size(); ++b) {
      if (agree(a, b)) agreeing.push_back(b);
    }
    if (agreeing.size() > best.size()) best = std::move(agreeing);
  }
  if (best.size() < min_witnesses ||
      static_cast<double>(best.size()) < min_agreeing_share * static_cast<double>(poses.size())) {
    return std::nullopt;
  }
  double spread_m = 0.0;
  for (const std::size_t a : best) {
    for (const std::size_t b : best) {
      spread_m = std::max(
          spread_m, distance(witnesses[a].odometry.position(), witnesses[b].odometry.position()));
    }
  }
  if (spread_m < min_spread_spacings * spacing_m) return std::nullopt;

  double weights = 0.0;
  Pose2 mean;
  double offset_rad = 0.0;
  const double middle_rad = poses[best.front()].heading_rad;
  const auto add = [&](const Pose2& pose, const PoseWitness& witness) {
    const double deviation_m =
        std::hypot(std::max(0.5 * witness.radius_m.value_or(spacing_m), 0.05 * spacing_m),
                   odometry_error_share * witness.travelled_m);
    const double weight = 1.0 / (deviation_m * deviation_m);
    weights += weight;
    mean.x_m += weight * pose.x_m;
    mean.y_m += weight * pose.y_m;
    offset_rad += weight * angle_difference(pose.heading_rad, middle_rad);
  };
  for (const std::size_t a : best) add(poses[a], witnesses[a]);
  if (own) {
    const Point2 middle{mean.x_m / weights, mean.y_m / weights};
    if (distance(own->pose.position(), middle) <= 0.5 * spacing_m &&
        std::abs(angle_difference(own->pose.heading_rad, middle_rad)) <=
            heading_agreement_tolerance_rad) {
      add(own->pose, *own);
    }
  }
  return Pose2{mean.x_m / weights, mean.y_m / weights,
               wrap_angle(middle_rad + offset_rad / weights)};
}

}  // namespace panonav
