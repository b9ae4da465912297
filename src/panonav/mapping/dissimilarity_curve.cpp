#include "panonav/mapping/dissimilarity_curve.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

/// Dissimilarity at which the curve becomes flat, as a share of that of far views [M04 figure 7].
constexpr double max_level_share = 0.95;

struct DistanceGroup {
  double dissimilarity = 0.0;
  double distance = 0.0;
  double square = 0.0;  // mean squared deviation from the distance
  double weight = 0.0;
};

/// Replaces the values by the nearest non-decreasing sequence in weighted least squares (pool
/// adjacent violators).
template <class Value>
void make_monotonic(std::vector<DistanceGroup>& groups, Value value) {
  struct Block {
    double sum, weight;
    std::size_t size;
  };
  std::vector<Block> blocks;
  for (DistanceGroup& group : groups) {
    blocks.push_back({value(group) * group.weight, group.weight, 1});
    while (blocks.size() > 1) {
      const Block& last = blocks.back();
      Block& before = blocks[blocks.size() - 2];
      if (before.sum * last.weight <= last.sum * before.weight) break;
      before = {before.sum + last.sum, before.weight + last.weight, before.size + last.size};
      blocks.pop_back();
    }
  }
  std::size_t next = 0;
  for (const Block& block : blocks) {
    for (std::size_t i = 0; i < block.size; ++i) value(groups[next++]) = block.sum / block.weight;
  }
}

double interpolate(double x, double x0, double y0, double x1, double y1) {
  return x1 > x0 ? y0 + (y1 - y0) * (x - x0) / (x1 - x0) : y1;
}

}  // namespace

DissimilarityCurve::DissimilarityCurve(double slope) {
  require(std::isfinite(slope) && slope > 0.0, "slope of a dissimilarity curve", slope, "> 0");
  constexpr double large = 1e12;
  knots_ = {{}, {large, large * slope, 0.0}};
  range_ = large * slope;
  max_dissimilarity_ = large;
}

DissimilarityCurve::DissimilarityCurve(std::span<const DissimilarityCurve::Sample> pairs,
                                       double level) {
  require(std::isfinite(level) && level >= 0.0, "level of far views", level, "finite and >= 0");
  require(!pairs.empty(), "pairs of a dissimilarity curve", 0.0, ">= 1");
  std::vector<DissimilarityCurve::Sample> sorted(pairs.begin(), pairs.end());
  for (const auto& pair : sorted) {
    require(std::isfinite(pair.dissimilarity) && pair.dissimilarity >= 0.0, "dissimilarity",
            pair.dissimilarity, "finite and >= 0");
    require(std::isfinite(pair.distance) && pair.distance >= 0.0, "distance", pair.distance,
            "finite and >= 0");
  }
  std::ranges::sort(sorted, [](const auto& a, const auto& b) {
    return a.dissimilarity != b.dissimilarity ? a.dissimilarity < b.dissimilarity
                                              : a.distance < b.distance;
  });
  // The number of groups is the square root of the number of pairs, so that the noise of the means
  // and the spacing of the groups shrink by the same factor.
  const std::size_t count = std::clamp<std::size_t>(
      static_cast<std::size_t>(std::sqrt(static_cast<double>(sorted.size()))), 1, 40);
  std::vector<DistanceGroup> groups(count);
  for (std::size_t g = 0; g < count; ++g) {
    const std::size_t begin = sorted.size() * g / count;
    const std::size_t end = sorted.size() * (g + 1) / count;
    DistanceGroup& group = groups[g];
    group.weight = static_cast<double>(end - begin);
    for (std::size_t i = begin; i < end; ++i) {
      group.dissimilarity += sorted[i].dissimilarity / group.weight;
      group.distance += sorted[i].distance / group.weight;
    }
    for (std::size_t i = begin; i < end; ++i) {
      const double missed = sorted[i].distance - group.distance;
      group.square += missed * missed / group.weight;
    }
  }
  make_monotonic(
      groups, [](auto& group) -> auto& { return group.distance; });
  make_monotonic(
      groups, [](auto& group) -> auto& { return group.square; });
  knots_.push_back({});
  for (const DistanceGroup& group : groups) {
    if (!(group.dissimilarity > knots_.back().dissimilarity)) {
      // Groups of equal dissimilarity add no knot; at 0 the distance is 0, as identical views are
      // most likely at one place.
      continue;
    }
    knots_.push_back({group.dissimilarity, group.distance, std::sqrt(group.square)});
  }
  if (knots_.size() == 1) knots_.push_back({1.0, 0.0, 0.0});

  max_dissimilarity_ = max_level_share * level;
  range_ = distance(max_dissimilarity_);
}

double DissimilarityCurve::distance(double dissimilarity) const {
  const auto above = std::ranges::upper_bound(knots_, dissimilarity, {}, &Knot::dissimilarity);
  if (above == knots_.end()) return knots_.back().distance;
  if (above == knots_.begin()) return 0.0;
  const Knot& low = *(above - 1);
  return interpolate(dissimilarity, low.dissimilarity, low.distance, above->dissimilarity,
                     above->distance);
}

double DissimilarityCurve::error(double distance) const {
  const auto above = std::ranges::upper_bound(knots_, distance, {}, &Knot::distance);
  if (above == knots_.end()) return knots_.back().error;
  if (above == knots_.begin()) return knots_.front().error;
  const Knot& low = *(above - 1);
  return interpolate(distance, low.distance, low.error, above->distance, above->error);
}

double DissimilarityCurve::stiffness(double distance) const {
  const double at_end = error(range_);
  if (!(at_end > 0.0)) return 1.0;
  return std::exp(std::log(0.1) * error(distance) / at_end);
}

}  // namespace panonav
