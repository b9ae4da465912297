#include "panonav/signature/sector_matching.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/feature_match.hpp"

namespace panonav {

namespace {

/// Difference of distances that is evidence of 1, in levels of a histogram (developed on
/// `ciirc_b670`, docs/decisions.md).
constexpr float weight_unit = 2.5F;
/// Largest weight of a pair: a window that shows the same town from all rooms is no more evidence
/// than the furniture in front of it.
constexpr float max_weight = 1.0F;
constexpr int sector_rotation_steps = 128;
constexpr int sector_motion_axes = 16;
constexpr double sector_tolerance_rad = radians(3.0);
constexpr double fine_tolerance_rad = radians(1.0);
/// Largest accepted ratio of the distance between the views to the distance of a feature.
constexpr float max_distance_ratio = 2.0F;

std::span<const std::uint8_t> to_bytes(std::span<const GradientFeatures::Histogram> histograms) {
  return {histograms.empty() ? nullptr : histograms.front().data(),
          histograms.size() * GradientFeatures::dimensions};
}

/// Bearings of pairs, as a structure of arrays.
struct PairBearings {
  PairBearings(const GradientFeatures& query, const GradientFeatures& reference,
               std::span<const SectorPair> pairs) {
    for (const SectorPair& pair : pairs) {
      const auto& a = query.corners[pair.query];
      const auto& b = reference.corners[pair.reference];
      query_sine.push_back(std::sin(a.azimuth_rad));
      query_cosine.push_back(std::cos(a.azimuth_rad));
      query_tangent.push_back(std::tan(a.elevation_rad));
      reference_sine.push_back(std::sin(b.azimuth_rad));
      reference_cosine.push_back(std::cos(b.azimuth_rad));
      reference_tangent.push_back(std::tan(b.elevation_rad));
      sine.push_back(query_sine.back() * reference_cosine.back() -
                     query_cosine.back() * reference_sine.back());
      cosine.push_back(query_cosine.back() * reference_cosine.back() +
                       query_sine.back() * reference_sine.back());
      weight.push_back(pair.weight);
    }
  }
  [[nodiscard]] std::size_t size() const { return weight.size(); }
  std::vector<float> query_sine, query_cosine, query_tangent;
  std::vector<float> reference_sine, reference_cosine, reference_tangent;
  std::vector<float> sine, cosine;  // of the azimuth in the query minus that in the reference
  std::vector<float> weight;
};

/// A set of directions of motion, each with its opposite.
struct MotionAxes {
  MotionAxes(double first_rad, double step_rad) {
    for (std::size_t d = 0; d < sector_motion_axes; ++d) {
      cosine[d] = static_cast<float>(std::cos(first_rad + step_rad * static_cast<double>(d)));
      sine[d] = static_cast<float>(std::sin(first_rad + step_rad * static_cast<double>(d)));
    }
  }
  std::array<float, sector_motion_axes> cosine, sine;
};

/// Sums the weights that each direction of motion explains after a rotation, and counts them.
struct DirectionSums {
  std::array<float, 2 * sector_motion_axes> weights{};
  std::array<int, 2 * sector_motion_axes> counts{};
};

/// Returns the pair's weight after a rotation whose sine and cosine are given; 0 if the rotation
/// brings its features no nearer than a right angle.
float weigh_by_parallax(const PairBearings& pairs, std::size_t i, float sine, float cosine) {
  const float within = pairs.cosine[i] * cosine - pairs.sine[i] * sine;
  return within > 0.0F ? pairs.weight[i] * within * within * within : 0.0F;
}

DirectionSums sum_explained(const PairBearings& pairs, double turn_rad, const MotionAxes& axes,
                            double tolerance_rad) {
  const auto sine = static_cast<float>(std::sin(turn_rad));
  const auto cosine = static_cast<float>(std::cos(turn_rad));
  const auto half_sine = static_cast<float>(std::sin(0.5 * turn_rad));
  const auto half_cosine = static_cast<float>(std::cos(0.5 * turn_rad));
  const auto tolerance_sine = static_cast<float>(std::sin(tolerance_rad));
  const auto tolerance_cosine = static_cast<float>(std::cos(tolerance_rad));
  DirectionSums sums;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const float weight = weigh_by_parallax(pairs, i, sine, cosine);
    if (!(weight > 0.0F)) continue;
    const float parallax = pairs.sine[i] * cosine + pairs.cosine[i] * sine;
    const float size = std::abs(parallax);
    const float sign = parallax < 0.0F ? -1.0F : 1.0F;
    const float query_sine =
        sign * (pairs.query_sine[i] * half_cosine + pairs.query_cosine[i] * half_sine);
    const float query_cosine =
        sign * (pairs.query_cosine[i] * half_cosine - pairs.query_sine[i] * half_sine);
    const float reference_sine =
        sign * (pairs.reference_sine[i] * half_cosine - pairs.reference_cosine[i] * half_sine);
    const float reference_cosine =
        sign * (pairs.reference_cosine[i] * half_cosine + pairs.reference_sine[i] * half_sine);
    const float min_sine = size <= tolerance_sine
                               ? -2.0F
                               : (size * tolerance_cosine - tolerance_sine) / max_distance_ratio;
    const float qt = pairs.query_tangent[i];
    const float rt = pairs.reference_tangent[i];
    for (std::size_t d = 0; d < sector_motion_axes; ++d) {
      const float of_query = query_sine * axes.cosine[d] - query_cosine * axes.sine[d];
      const float of_reference = reference_sine * axes.cosine[d] - reference_cosine * axes.sine[d];
      const float off = qt * of_reference - rt * of_query;
      const float scale = std::max((rt * rt + of_reference * of_reference) * (1.0F + qt * qt),
                                   (qt * qt + of_query * of_query) * (1.0F + rt * rt));
      if (off * off > tolerance_sine * tolerance_sine * scale) continue;
      if (std::min(of_query, of_reference) >= min_sine) {
        sums.weights[d] += weight;
        ++sums.counts[d];
      }
      if (-std::max(of_query, of_reference) >= min_sine) {
        sums.weights[d + sector_motion_axes] += weight;
        ++sums.counts[d + sector_motion_axes];
      }
    }
  }
  return sums;
}

/// Returns the sum of the weights that a rotation brings within a right angle, less parallax.
double bound_at(const PairBearings& pairs, double turn_rad) {
  const auto sine = static_cast<float>(std::sin(turn_rad));
  const auto cosine = static_cast<float>(std::cos(turn_rad));
  double bound = 0.0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    bound += static_cast<double>(weigh_by_parallax(pairs, i, sine, cosine));
  }
  return bound;
}

/// Rounding of sums of floats in another order.
constexpr double bound_slack = 1.0 + 1e-5;

/// Refines the heading around the best coarse step: the mean of the rotations at which a finer
/// tolerance explains most, weighted by the excess over nine tenths of the largest sum.
double refine_heading(const PairBearings& pairs, double turn_rad) {
  constexpr int steps = 10;  // to each side
  constexpr double step_rad = radians(0.35);
  const MotionAxes axes(0.0, std::numbers::pi / sector_motion_axes);
  std::array<double, 2 * steps + 1> sums{};
  for (int k = -steps; k <= steps; ++k) {
    const auto explained = sum_explained(pairs, turn_rad + k * step_rad, axes, fine_tolerance_rad);
    sums[static_cast<std::size_t>(k + steps)] =
        static_cast<double>(*std::ranges::max_element(explained.weights));
  }
  const double largest = *std::ranges::max_element(sums);
  double total = 0.0;
  double moment = 0.0;
  for (int k = -steps; k <= steps; ++k) {
    const double excess = std::max(0.0, sums[static_cast<std::size_t>(k + steps)] - 0.9 * largest);
    total += excess;
    moment += excess * k;
  }
  return total > 0.0 ? wrap_angle(turn_rad + step_rad * moment / total) : turn_rad;
}

}  // namespace

NearestFeatures::NearestFeatures(const GradientFeatures& query, Part part)
    : query_(&query),
      part_(part),
      count_(count_compared(query)),
      nearest_(count_ * background, std::numeric_limits<float>::infinity()) {}

std::size_t NearestFeatures::count_compared(const GradientFeatures& features) const {
  return std::min<std::size_t>(part_ == Part::leading ? features.leading : features.corners.size(),
                               kernels::max_histograms);
}

void NearestFeatures::add(const GradientFeatures& reference) {
  compare(reference, mutual_.emplace_back());
}

void NearestFeatures::add_background(const GradientFeatures& elsewhere) {
  std::vector<Mutual> ignored;
  compare(elsewhere, ignored);
}

void NearestFeatures::compare(const GradientFeatures& reference, std::vector<Mutual>& mutual) {
  const std::size_t there = count_compared(reference);
  if (there == 0 || count_ == 0) return;
  std::vector<std::uint16_t> nearest_of_query(count_);
  std::vector<std::int32_t> distances(count_);
  std::vector<std::uint16_t> nearest_of_reference(there);
  kernels::nearest_histograms(to_bytes(std::span(query_->histograms).first(count_)),
                              to_bytes(std::span(reference.histograms).first(there)),
                              nearest_of_query, distances, nearest_of_reference,
                              kernels::chosen_instructions());
  for (std::size_t i = 0; i < count_; ++i) {
    const float distance = std::sqrt(static_cast<float>(distances[i]));
    if (nearest_of_reference[nearest_of_query[i]] == i) {
      mutual.push_back({static_cast<std::uint16_t>(i), nearest_of_query[i], distance});
    }
    const auto kept = std::span(nearest_).subspan(i * background, background);
    if (distance >= kept.back()) continue;
    kept.back() = distance;
    for (std::size_t k = background - 1; k > 0 && kept[k] < kept[k - 1]; --k) {
      std::swap(kept[k], kept[k - 1]);
    }
  }
}

std::vector<std::vector<SectorPair>> NearestFeatures::weigh_pairs() const {
  std::vector<float> limits(count_);
  for (std::size_t i = 0; i < count_; ++i) {
    const auto kept = std::span(nearest_).subspan(i * background, background);
    for (const float distance : kept) {
      if (std::isfinite(distance)) limits[i] = distance;
    }
  }
  std::vector<std::vector<SectorPair>> pairs(mutual_.size());
  for (std::size_t v = 0; v < mutual_.size(); ++v) {
    for (const auto& [query, reference, distance] : mutual_[v]) {
      const float weight = std::min((limits[query] - distance) / weight_unit, max_weight);
      if (weight > 0.0F) pairs[v].push_back({query, reference, weight});
    }
  }
  return pairs;
}

double bound_score(const GradientFeatures& query, const GradientFeatures& reference,
                   std::span<const SectorPair> pairs) {
  double total = 0.0;
  for (const SectorPair& pair : pairs) total += static_cast<double>(pair.weight);
  if (pairs.size() < 2) return total;
  const PairBearings bearings(query, reference, pairs);
  double bound = 0.0;
  for (int t = 0; t < sector_rotation_steps; ++t) {
    bound = std::max(bound, bound_at(bearings, 2.0 * std::numbers::pi * t / sector_rotation_steps));
  }
  return bound * bound_slack;
}

SectorMatch verify_sector(const GradientFeatures& query, const GradientFeatures& reference,
                          std::span<const SectorPair> pairs, bool coarse_only) {
  const PairBearings bearings(query, reference, pairs);
  const MotionAxes axes(0.0, std::numbers::pi / sector_motion_axes);
  struct Step {
    double bound, turn_rad;
  };
  std::array<Step, sector_rotation_steps> steps{};
  for (std::size_t t = 0; t < steps.size(); ++t) {
    steps[t].turn_rad = 2.0 * std::numbers::pi * static_cast<double>(t) / sector_rotation_steps;
    steps[t].bound = bound_at(bearings, steps[t].turn_rad) * bound_slack;
  }
  std::ranges::stable_sort(steps, std::greater<>(), &Step::bound);
  SectorMatch match;
  for (const auto& [bound, turn_rad] : steps) {
    if (bound <= match.score) break;
    const DirectionSums sums = sum_explained(bearings, turn_rad, axes, sector_tolerance_rad);
    const auto best = std::ranges::max_element(sums.weights);
    if (static_cast<double>(*best) <= match.score) continue;
    match.score = static_cast<double>(*best);
    match.verified = sums.counts[static_cast<std::size_t>(best - sums.weights.begin())];
    match.heading_rad = wrap_angle(turn_rad);
  }
  if (!coarse_only && match.score > 0.0) {
    match.heading_rad = refine_heading(bearings, match.heading_rad);
  }
  return match;
}

}  // namespace panonav
