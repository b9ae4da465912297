#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "panonav/panorama/tilt.hpp"
#include "panonav/signature/gradient_features.hpp"

namespace panonav {

/// Scores of the places that a cut view resembles, and the right one.
struct ShareCase {
  std::vector<double> scores;
  std::optional<std::size_t> right;  ///< index of `scores`
};
/// Returns the `SectorModel::share_exponent` of a grid under which the right places are most
/// probable.
[[nodiscard]] double fit_share_exponent(std::span<const ShareCase> cases);

/// Returns the share of a place, before all are divided by their sum: a power of its score,
/// relative to the largest one.
[[nodiscard]] double share_of_score(double score, double largest, double exponent) noexcept;

/// Rotates the corners of a tilted picture to those of a level one; histograms stay as they are.
[[nodiscard]] GradientFeatures level_corners(GradientFeatures features, const Tilt& tilt);
/// Searches the tilt of largest score, by coordinates, in steps up to three from 0; no tilt if its
/// score is below `min_gain` times that of none.
[[nodiscard]] Tilt search_tilt(const std::function<double(const Tilt&)>& score, double step_rad,
                               double min_gain);

}  // namespace panonav
