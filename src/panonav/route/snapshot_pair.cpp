#include "panonav/route/snapshot_pair.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/route/internal/snapshot_sight.hpp"

namespace panonav {

namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A normal distribution of logarithms.
struct LogNormal {
  double mean = 0.0;
  double deviation = 1.0;

  static LogNormal fit(const std::vector<double>& values) {
    constexpr double min_value = 1e-4;
    constexpr double min_deviation = 0.1;
    LogNormal fitted;
    for (const double v : values) fitted.mean += std::log(std::max(v, min_value));
    fitted.mean /= static_cast<double>(values.size());
    double squares = 0.0;
    for (const double v : values) {
      const double off = std::log(std::max(v, min_value)) - fitted.mean;
      squares += off * off;
    }
    fitted.deviation =
        std::max(min_deviation, std::sqrt(squares / static_cast<double>(values.size())));
    return fitted;
  }
  [[nodiscard]] double log_density(double log_value) const {
    const double z = (log_value - mean) / deviation;
    return -0.5 * z * z - std::log(deviation);
  }
};

// The value at which both are equally probable, between their means.
double find_equal_density(const LogNormal& low, const LogNormal& high) {
  double below = low.mean;
  double above = std::max(high.mean, low.mean);
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (below + above);
    (low.log_density(middle) > high.log_density(middle) ? below : above) = middle;
  }
  return std::exp(below);
}

}  // namespace

bool is_right_direction(double direction_rad, Point2 from, Point2 snapshot) {
  constexpr double max_error_rad = 0.6;
  const double true_rad = std::atan2(snapshot.y_m - from.y_m, snapshot.x_m - from.x_m);
  return std::abs(wrap_angle(direction_rad - true_rad)) <= max_error_rad;
}

SnapshotPair compare_with_snapshot(const HomingView& snapshot, Point2 snapshot_place,
                                   const HomingView& view, Point2 from) {
  const SnapshotSight sight =
      look_at_snapshot(view_coefficients(snapshot), view_coefficients(view), compared_headings);
  const HomeVector& vector = sight.vector;
  return {
      distance(from, snapshot_place), vector.length(), sight.difference, sight.confidence,
      vector.length() > 0.0 && is_right_direction(vector.direction_rad(), from, snapshot_place)};
}

ChainModel learn_chain_model(std::span<const SnapshotPair> pairs,
                             std::span<const double> reaches_m) {
  ChainModel model;
  std::vector<double> scales_m;
  for (const SnapshotPair& pair : pairs) {
    if (pair.is_right && pair.distance_m >= min_compared_m && pair.distance_m <= max_compared_m) {
      scales_m.push_back(pair.distance_m / pair.length);
    }
  }
  if (scales_m.empty()) return model;
  model.typical_distance_m = static_cast<float>(std::clamp(median(scales_m), 1e-3, 1e4));
  model.reach_m = static_cast<float>(std::max(
      min_compared_m,
      reaches_m.empty() ? 0.0 : median(std::vector<double>(reaches_m.begin(), reaches_m.end()))));
  std::vector<double> beside;
  std::vector<double> elsewhere;
  std::vector<std::pair<double, bool>> by_confidence;
  constexpr double max_length_beside = 0.1;  // in units of R
  for (const SnapshotPair& pair : pairs) {
    const auto r_m = static_cast<double>(model.typical_distance_m);
    if (pair.distance_m <= std::max(max_length_beside * r_m, min_compared_m)) {
      beside.push_back(pair.difference);
    } else if (!pair.is_right) {
      elsewhere.push_back(pair.difference);
    }
    if (pair.distance_m >= min_compared_m)
      by_confidence.emplace_back(-pair.confidence, pair.is_right);
  }
  constexpr std::size_t min_values = 5;
  if (beside.size() >= min_values && elsewhere.size() >= min_values) {
    const LogNormal near = LogNormal::fit(beside);
    const double equal = find_equal_density(near, LogNormal::fit(elsewhere));
    constexpr double quantile_95 = 1.645;
    model.arrived_difference = static_cast<float>(
        std::min({2.0, equal, std::exp(near.mean + quantile_95 * near.deviation)}));
  }
  std::sort(by_confidence.begin(), by_confidence.end());
  constexpr double right_share = 0.9;
  double right = 0.0;
  double all = 0.0;
  for (const auto& [negative_confidence, is_right] : by_confidence) {
    all += 1.0;
    right += is_right ? 1.0 : 0.0;
    if (right >= right_share * all)
      model.homing_confidence = static_cast<float>(-negative_confidence);
  }
  return model;
}

}  // namespace panonav
