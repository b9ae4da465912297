#include "lab/m04/learn_weights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <string>

#include "lab/m04/support.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/voronoi.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav::lab {

namespace {

constexpr double max_near_spacings = 1.25;  // reaches 4 neighbours in a square grid, 2 on a path
constexpr double min_far_spacings = 1.75;   // beyond the diagonal of a square grid
constexpr std::size_t max_near = 4;
constexpr std::size_t max_far = 12;
constexpr std::size_t min_anchors = 16;
constexpr std::size_t fold_count = 4;
// Candidate penalties, in units of the mean diagonal of the second moments; infinity gives equal
// weights.
constexpr std::array<double, 7> penalty_candidates = {
    1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, std::numeric_limits<double>::infinity()};

// Sums of margins per component and of their products, over any number of triplets (view, near,
// far).
struct MarginMoments {
  explicit MarginMoments(std::size_t components)
      : first(components), second(components * components) {}

  void add(std::span<const double> margin) {
    ++count;
    for (std::size_t i = 0; i < margin.size(); ++i) {
      first[i] += margin[i];
      for (std::size_t j = 0; j < margin.size(); ++j) {
        second[i * margin.size() + j] += margin[i] * margin[j];
      }
    }
  }
  void add(const MarginMoments& other) {
    count += other.count;
    for (std::size_t i = 0; i < first.size(); ++i) first[i] += other.first[i];
    for (std::size_t i = 0; i < second.size(); ++i) second[i] += other.second[i];
  }

  std::size_t count = 0;
  std::vector<double> first;
  std::vector<double> second;
};

// Returns the mean of the weighted margin over its standard deviation; 0 without variance.
double signal_to_noise(const MarginMoments& moments, std::span<const double> weights) {
  const std::size_t size = weights.size();
  const auto n = static_cast<double>(moments.count);
  double mean = 0.0;
  double square = 0.0;
  for (std::size_t i = 0; i < size; ++i) {
    mean += weights[i] * moments.first[i] / n;
    for (std::size_t j = 0; j < size; ++j) {
      square += weights[i] * weights[j] * moments.second[i * size + j] / n;
    }
  }
  const double variance = square - mean * mean;
  return variance > 0.0 ? mean / std::sqrt(variance) : 0.0;
}

// Minimises the mean of (1 - w . margin)^2 + penalty * sum of (w_k - mean w)^2 over w >= 0 by
// coordinate descent, which converges because the objective is convex. The weights are scaled to
// mean 1.
std::vector<double> solve_weights(const MarginMoments& moments, double penalty) {
  const std::size_t size = moments.first.size();
  std::vector<double> weights(size, 1.0);
  if (!std::isfinite(penalty)) return weights;
  const auto n = static_cast<double>(moments.count);
  double diagonal = 0.0;
  for (std::size_t i = 0; i < size; ++i) diagonal += moments.second[i * size + i] / n;
  const double strength = penalty * diagonal / static_cast<double>(size);
  const double inverse_size = 1.0 / static_cast<double>(size);
  const auto curvature = [&](std::size_t i, std::size_t j) {
    return moments.second[i * size + j] / n + strength * ((i == j ? 1.0 : 0.0) - inverse_size);
  };
  constexpr int max_rounds = 2000;
  for (int round = 0; round < max_rounds; ++round) {
    double change = 0.0;
    for (std::size_t i = 0; i < size; ++i) {
      double rest = moments.first[i] / n;
      for (std::size_t j = 0; j < size; ++j) {
        if (j != i) rest -= curvature(i, j) * weights[j];
      }
      const double own = curvature(i, i);
      const double optimum = own > 0.0 ? std::max(0.0, rest / own) : 0.0;
      change = std::max(change, std::abs(optimum - weights[i]));
      weights[i] = optimum;
    }
    if (change < 1e-9) break;
  }
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  // If all weights are 0, no weighting ranks near views first on average; equal weights are as
  // good.
  if (!(sum > 0.0)) return std::vector<double>(size, 1.0);
  for (double& weight : weights) weight *= static_cast<double>(size) / sum;
  return weights;
}

struct PosedView {
  ViewId view;
  Point2 position;
};

// Adds the margins of the view `anchor`; returns false if it has no near or no far views.
bool add_margins(const VisualMemory& memory, std::span<const PosedView> posed, double spacing_m,
                 ViewId anchor, MarginMoments& moments) {
  const Point2 here = memory.info(anchor).pose->position();
  std::vector<PosedView> near;
  for (const PosedView& other : posed) {
    if (other.view != anchor && distance(other.position, here) <= max_near_spacings * spacing_m) {
      near.push_back(other);
    }
  }
  std::ranges::stable_sort(near, {},
                           [&](const PosedView& v) { return distance(v.position, here); });
  if (near.size() > max_near) near.resize(max_near);

  const std::array<ViewId, 1> excluded{anchor};
  const auto found = memory.search(memory.packed(anchor), {.top = 4 * static_cast<int>(max_far)},
                                   {.excluded_views = excluded, .allowed_rows = {}});
  std::vector<ViewId> far;
  for (const Match& match : found.matches) {
    const auto& pose = memory.info(match.view).pose;
    if (far.size() < max_far && pose &&
        distance(pose->position(), here) > min_far_spacings * spacing_m) {
      far.push_back(match.view);
    }
  }
  if (near.empty() || far.empty()) return false;

  const FourierSignature signature = memory.signature(anchor);
  std::vector<std::vector<double>> to_near;
  double mean_near = 0.0;
  for (const PosedView& other : near) {
    to_near.push_back(dissimilarity_by_component(signature, memory.signature(other.view)));
    mean_near += std::accumulate(to_near.back().begin(), to_near.back().end(), 0.0) /
                 static_cast<double>(near.size());
  }
  if (!(mean_near > 0.0)) return false;  // all near views equal the anchor, so there is no scale
  std::vector<double> margin(to_near.front().size());
  for (const ViewId other : far) {
    const auto to_far = dissimilarity_by_component(signature, memory.signature(other));
    for (const auto& nearby : to_near) {
      for (std::size_t k = 0; k < margin.size(); ++k)
        margin[k] = (to_far[k] - nearby[k]) / mean_near;
      moments.add(margin);
    }
  }
  return true;
}

}  // namespace

std::optional<ComponentWeights> learn_component_weights(const VisualMemory& memory,
                                                        int sampled_views, std::uint64_t seed) {
  require(sampled_views >= static_cast<int>(min_anchors), "sampled views", sampled_views,
          ">= " + std::to_string(min_anchors));
  std::vector<PosedView> posed;
  std::vector<ViewId> ids;
  std::vector<Point2> positions;
  for (const ViewId view : memory.views()) {
    if (!memory.info(view).pose) continue;
    posed.push_back({view, memory.info(view).pose->position()});
    ids.push_back(view);
    positions.push_back(posed.back().position);
  }
  if (posed.size() < min_anchors) return std::nullopt;
  const double spacing_m = VoronoiCells(positions).spacing_m();
  if (!(spacing_m > 0.0)) return std::nullopt;

  const auto components = static_cast<std::size_t>(memory.shape().components);
  const auto anchors = sample_views(ids, sampled_views, seed);
  // Consecutive views are neighbours. Each fold is a contiguous run, so that folds share few
  // neighbours.
  std::vector<MarginMoments> folds(fold_count, MarginMoments(components));
  std::size_t used = 0;
  for (std::size_t i = 0; i < anchors.size(); ++i) {
    used +=
        add_margins(memory, posed, spacing_m, anchors[i], folds[i * fold_count / anchors.size()]);
  }
  const bool every_fold =
      std::ranges::all_of(folds, [](const MarginMoments& m) { return m.count > 0; });
  if (used < min_anchors || !every_fold) return std::nullopt;

  const auto cross_validated_margin = [&](double penalty) {
    double sum = 0.0;
    for (std::size_t left_out_fold = 0; left_out_fold < fold_count; ++left_out_fold) {
      MarginMoments others(components);
      for (std::size_t f = 0; f < fold_count; ++f) {
        if (f != left_out_fold) others.add(folds[f]);
      }
      sum += signal_to_noise(folds[left_out_fold], solve_weights(others, penalty)) / fold_count;
    }
    return sum;
  };
  MarginMoments all(components);
  for (const MarginMoments& m : folds) all.add(m);
  ComponentWeights result;
  double best_penalty = penalty_candidates.back();
  result.margin = result.margin_of_equal_weights = cross_validated_margin(best_penalty);
  for (const double penalty : penalty_candidates) {
    const double margin = cross_validated_margin(penalty);
    if (margin > result.margin) {
      result.margin = margin;
      best_penalty = penalty;
    }
  }
  result.weights = solve_weights(all, best_penalty);
  return result;
}

}  // namespace panonav::lab
