#include "panonav/localisation/internal/sector_learning.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/sector_localiser.hpp"

namespace panonav {

double fit_share_exponent(std::span<const ShareCase> cases) {
  double best = SectorModel{}.share_exponent;
  double largest = -std::numeric_limits<double>::infinity();
  constexpr int steps = 16;
  constexpr double smallest_exponent = 0.4;
  constexpr double factor = 1.25;
  for (int i = 0; i <= steps; ++i) {
    const double exponent = smallest_exponent * std::pow(factor, i);
    double likelihood = 0.0;
    for (const ShareCase& learnt : cases) {
      const double top = std::ranges::max(learnt.scores);
      double total = 0.0;
      for (const double score : learnt.scores) total += share_of_score(score, top, exponent);
      likelihood += std::log(share_of_score(learnt.scores[*learnt.right], top, exponent) / total);
    }
    if (likelihood <= largest) continue;
    largest = likelihood;
    best = exponent;
  }
  return best;
}

double share_of_score(double score, double largest, double exponent) noexcept {
  constexpr double min_ratio = 1e-3;
  return std::pow(largest > 0.0 ? std::max(score / largest, min_ratio) : 1.0, exponent);
}

GradientFeatures level_corners(GradientFeatures features, const Tilt& tilt) {
  for (auto& corner : features.corners) {
    const auto seen = Direction3::from_angles(corner.azimuth_rad, corner.elevation_rad);
    const Direction3 level = level_direction(seen, tilt);
    corner.azimuth_rad = static_cast<float>(level.azimuth_rad());
    corner.elevation_rad = static_cast<float>(level.elevation_rad());
  }
  return features;
}

Tilt search_tilt(const std::function<double(const Tilt&)>& score, double step_rad,
                 double min_gain) {
  const double level = score({});
  Tilt best;
  double largest = level;
  constexpr int steps = 3;
  const auto search = [&](double Tilt::*angle) {
    const Tilt from = best;
    for (int i = -steps; i <= steps; ++i) {
      Tilt tried = from;
      tried.*angle = i * step_rad;
      const double found = score(tried);
      if (found <= largest) continue;
      largest = found;
      best = tried;
    }
  };
  search(&Tilt::pitch_rad);
  search(&Tilt::roll_rad);
  return largest >= min_gain * level && level > 0.0 ? best : Tilt{};
}

}  // namespace panonav
