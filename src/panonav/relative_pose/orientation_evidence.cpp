#include "panonav/relative_pose/orientation_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

namespace {

/// Turns whose sense the images show.
constexpr double min_turn_rad = radians(10.0);
constexpr double max_turn_rad = radians(150.0);
/// Largest error of a turn that is read from images a step apart. Less than twice the smallest
/// turn, so that no turn agrees with both senses.
constexpr double max_turn_error_rad = radians(9.0);
/// Largest share of the views' energy that a home vector leaves unexplained.
constexpr double max_residual = 0.5;
/// Largest error of the direction of motion between near views.
constexpr double max_direction_error_rad = radians(30.0);
/// Smallest number of motions, and share of them that agree on the forward direction. By chance a
/// sixth agrees, and half of twenty once in a thousand times.
constexpr std::size_t min_moves = 20;
constexpr double min_agreeing_share = 0.6;
/// Smallest error of the forward direction that is reported: more than that of sensors mounted by
/// hand, and than the 14 degrees of the common direction in test rooms and sparse recordings.
constexpr double min_forward_error_rad = radians(20.0);
/// Largest probability of what chance explains.
constexpr double max_chance = 0.001;

/// Probability that at least `successes` of `trials` tosses of a coin succeed.
double coin_tail(std::size_t successes, std::size_t trials) {
  double sum = 0.0;
  for (std::size_t k = successes; k <= trials; ++k) {
    const auto n = static_cast<double>(trials);
    const auto m = static_cast<double>(k);
    sum += std::exp(std::lgamma(n + 1.0) - std::lgamma(m + 1.0) - std::lgamma(n - m + 1.0) -
                    n * std::log(2.0));
  }
  return sum;
}

bool is_near(double direction_rad, double other_rad) {
  return std::abs(angle_difference(direction_rad, other_rad)) <= max_direction_error_rad;
}

}  // namespace

double OrientationEvidence::Move::turn_rad(bool is_mirrored) const {
  return angle_difference(true_rad, is_mirrored ? -stated_rad : stated_rad);
}

void OrientationEvidence::add(const HomingView& home, const HomingView& current,
                              const Pose2& home_from_current) {
  const HomeVector vector = home_vector(home, current);
  if (vector.residual > max_residual) return;
  const double turn_rad = home_from_current.heading_rad;
  if (std::abs(turn_rad) >= min_turn_rad && std::abs(turn_rad) <= max_turn_rad) {
    const double seen_rad = -vector.heading_rad;
    if (std::abs(angle_difference(seen_rad, turn_rad)) <= max_turn_error_rad) {
      ++turns_;
    } else if (std::abs(angle_difference(seen_rad, -turn_rad)) <= max_turn_error_rad) {
      ++turns_;
      ++opposite_turns_;
    }
  }
  const Pose2 current_from_home = inverse(home_from_current);
  if (!vector.has_direction() || std::hypot(current_from_home.x_m, current_from_home.y_m) == 0.0) {
    return;
  }
  moves_.push_back(
      {vector.direction_rad(), std::atan2(current_from_home.y_m, current_from_home.x_m)});
}

OrientationEvidence::CommonTurn OrientationEvidence::find_common_turn(bool is_mirrored) const {
  std::vector<double> turns_rad;
  for (const Move& move : moves_) turns_rad.push_back(move.turn_rad(is_mirrored));
  CommonTurn best;
  for (const double centre_rad : turns_rad) {
    double sum_rad = 0.0;
    double square_sum = 0.0;
    std::size_t agreeing = 0;
    for (const double turn_rad : turns_rad) {
      if (!is_near(turn_rad, centre_rad)) continue;
      const double off_rad = angle_difference(turn_rad, centre_rad);
      ++agreeing;
      sum_rad += off_rad;
      square_sum += off_rad * off_rad;
    }
    if (agreeing <= best.agreeing) continue;
    const auto n = static_cast<double>(agreeing);
    const double mean_rad = sum_rad / n;
    best = {wrap_angle(centre_rad + mean_rad), agreeing,
            std::sqrt(std::max(0.0, square_sum / n - mean_rad * mean_rad) / n)};
  }
  return best;
}

std::optional<bool> OrientationEvidence::runs_as_stated() const {
  if (coin_tail(opposite_turns_, turns_) <= max_chance) return false;
  if (coin_tail(turns_ - opposite_turns_, turns_) <= max_chance) return true;
  // On straight drives the same motions agree in both directions.
  const CommonTurn stated = find_common_turn(false);
  const CommonTurn mirrored = find_common_turn(true);
  std::size_t only_stated = 0;
  std::size_t only_mirrored = 0;
  for (const Move& move : moves_) {
    const bool fits_stated = is_near(move.turn_rad(false), stated.turn_rad);
    const bool fits_mirrored = is_near(move.turn_rad(true), mirrored.turn_rad);
    only_stated += fits_stated && !fits_mirrored ? 1 : 0;
    only_mirrored += fits_mirrored && !fits_stated ? 1 : 0;
  }
  const std::size_t only_one = only_stated + only_mirrored;
  if (is_common(mirrored) && coin_tail(only_mirrored, only_one) <= max_chance) return false;
  if (is_common(stated) && coin_tail(only_stated, only_one) <= max_chance) return true;
  return std::nullopt;
}

bool OrientationEvidence::is_common(const CommonTurn& turn) const {
  return moves_.size() >= min_moves && static_cast<double>(turn.agreeing) >=
                                           min_agreeing_share * static_cast<double>(moves_.size());
}

std::size_t OrientationEvidence::agreeing_moves() const {
  return find_common_turn(runs_as_stated() == false).agreeing;
}

std::optional<double> OrientationEvidence::find_turn_rad() const {
  const CommonTurn common = find_common_turn(runs_as_stated() == false);
  if (!is_common(common)) return std::nullopt;
  const double limit_rad = min_forward_error_rad + 3.0 * common.deviation_rad;
  return std::abs(common.turn_rad) > limit_rad ? common.turn_rad : 0.0;
}

std::optional<OrientationFault> OrientationEvidence::find_fault() const {
  const OrientationFault fault{runs_as_stated() == false, find_turn_rad().value_or(0.0)};
  if (fault == OrientationFault{}) return std::nullopt;
  return fault;
}

}  // namespace panonav
