#include "panonav/mapping/internal/lattice_curve.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"

namespace panonav {

namespace {

/// Smallest relative error of lengths from phases, as phases are packed in steps of 0.025 rad.
constexpr double min_phase_length_error = 0.02;
/// Number of random pairs from which the dissimilarity of far views is estimated. It is the mean
/// over the quarter of the pairs that are farthest apart; the standard error of this mean is 1/20
/// of their standard deviation.
constexpr std::size_t far_pairs = 2000;

double layout_distance(std::span<const Pose2> poses, std::size_t a, std::size_t b) {
  return distance(poses[a].position(), poses[b].position());
}

/// Returns for each view the slope at which its most similar view would be at distance 1.
std::vector<double> slopes_to_nearest(std::span<const Lattice::Spring> measured,
                                      std::size_t nodes) {
  std::vector<double> nearest(nodes, INFINITY);
  for (const auto& spring : measured) {
    nearest[spring.a] = std::min(nearest[spring.a], spring.dissimilarity);
    nearest[spring.b] = std::min(nearest[spring.b], spring.dissimilarity);
  }
  std::vector<double> slopes;
  for (const double value : nearest) {
    if (std::isfinite(value) && value > 0.0) slopes.push_back(1.0 / value);
  }
  return slopes;
}

/// Returns the mean dissimilarity of far views, the farther quarter of random pairs; nullopt if
/// their mean distance is at most twice `near`.
std::optional<double> estimate_far_dissimilarity(const SpringViews& views,
                                                 const LatticeLayout& layout, double near) {
  const std::size_t nodes = layout.poses.size();
  Random random(1);
  std::vector<DissimilarityCurve::Sample> drawn;
  for (std::size_t i = 0; i < far_pairs; ++i) {
    const auto a = static_cast<std::size_t>(random.index(nodes));
    const auto b = static_cast<std::size_t>(random.index(nodes));
    if (a == b || layout.components[a] != layout.components[b]) continue;
    drawn.push_back({views.dissimilarity(std::minmax(a, b)), layout_distance(layout.poses, a, b)});
  }
  if (drawn.empty()) return std::nullopt;
  std::ranges::sort(drawn, [](const auto& a, const auto& b) {
    return a.distance != b.distance ? a.distance > b.distance : a.dissimilarity < b.dissimilarity;
  });
  drawn.resize(drawn.size() / 4 + 1);
  double dissimilarity = 0.0;
  double distance = 0.0;
  for (const auto& pair : drawn) {
    dissimilarity += pair.dissimilarity / static_cast<double>(drawn.size());
    distance += pair.distance / static_cast<double>(drawn.size());
  }
  if (distance <= 2.0 * near) return std::nullopt;
  return dissimilarity;
}

}  // namespace

DissimilarityCurve make_first_curve(std::span<const Lattice::Spring> measured,
                                    const NodeMotions& motions, const SpringViews& views,
                                    Lattice::Errors& errors) {
  std::vector<double> slopes;
  std::vector<double> units;
  for (const auto& spring : measured) {
    if (!spring.phases || !spring.phases->has_direction || !has_agreeing_views(spring)) continue;
    if (const NodeMotion* moved = motions.find({spring.a, spring.b})) {
      units.push_back(step_length(*moved) / spring.phases->length);
    }
    if (spring.dissimilarity > 0.0) slopes.push_back(spring.phases->length / spring.dissimilarity);
  }
  if (!units.empty()) errors.phase_unit = upper_median(units);
  for (double& slope : slopes) slope *= errors.phase_unit;
  if (!motions.empty()) slopes.clear();
  for (const NodeMotion& motion : motions.all()) {
    const double dissimilarity = views.dissimilarity(std::minmax(motion.a, motion.b));
    if (dissimilarity > 0.0 && step_length(motion) > 0.0)
      slopes.push_back(step_length(motion) / dissimilarity);
  }
  if (slopes.empty()) slopes = slopes_to_nearest(measured, views.size());
  return DissimilarityCurve(slopes.empty() ? 1.0 : upper_median(slopes));
}

std::optional<DissimilarityCurve> fit_curve(std::span<const Lattice::Spring> measured,
                                            std::span<const Lattice::Spring> springs,
                                            const SpringViews& views, const LatticeLayout& layout) {
  std::vector<DissimilarityCurve::Sample> pairs;
  for (const auto& spring : springs.empty() ? measured : springs) {
    if (!springs.empty() && spring.weight < min_curve_weight) continue;
    pairs.push_back({spring.dissimilarity, layout_distance(layout.poses, spring.a, spring.b)});
  }
  if (pairs.empty()) return std::nullopt;
  std::vector<double> lengths;
  double max_dissimilarity = 0.0;
  for (const auto& pair : pairs) {
    lengths.push_back(pair.distance);
    max_dissimilarity = std::max(max_dissimilarity, pair.dissimilarity);
  }
  // If all views are near each other, the curve has no flat part.
  const auto far = estimate_far_dissimilarity(views, layout, upper_median(lengths));
  return DissimilarityCurve(pairs, far.value_or(2.0 * max_dissimilarity));
}

void fit_phase_unit(std::span<const Lattice::Spring> springs, std::span<const Pose2> poses,
                    Lattice::Errors& errors) {
  std::vector<double> ratios;
  for (const auto& spring : springs) {
    if (spring.weight < min_curve_weight || !spring.phases || !spring.phases->has_direction)
      continue;
    ratios.push_back(layout_distance(poses, spring.a, spring.b) / spring.phases->length);
  }
  if (ratios.empty()) return;
  const double unit = upper_median(ratios);
  if (!(unit > 0.0)) return;
  for (double& ratio : ratios) ratio = std::abs(ratio / unit - 1.0);
  errors.phase_unit = unit;
  errors.phase_length = std::max(min_phase_length_error, sigma_over_mad * upper_median(ratios));
}

}  // namespace panonav
