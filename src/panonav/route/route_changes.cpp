#include "panonav/route/route_changes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

/// Number of successive images in which a change must appear; noise rarely affects half of a
/// direction in all of them.
constexpr int min_images = 5;
/// Residual in standard deviations of the noise from which on a column is unexplained: normal
/// errors exceed it once in 370 times.
constexpr double max_deviations = 3.0;

}  // namespace

bool RouteChanges::update_nearest_line(Point2 position) {
  if (lines_.empty()) return true;
  const auto distance_m = [&](const Pose2& line) { return distance(line.position(), position); };
  const auto nearest =
      static_cast<std::size_t>(std::ranges::min_element(lines_, {}, distance_m) - lines_.begin());
  return std::exchange(nearest_line_, nearest) != nearest;
}

std::vector<RouteChanges::AzimuthRange> RouteChanges::add(const RouteFix& fix) {
  const auto limit = static_cast<float>(max_deviations * fix.noise);
  std::array<int, sectors> unexplained{};
  std::array<int, sectors> all{};
  const std::size_t columns = fix.unexplained.size();
  for (std::size_t c = 0; c < columns; ++c) {
    const float value = fix.unexplained[c];
    if (!std::isfinite(value)) continue;
    const double azimuth = fix.pose.heading_rad + 2.0 * std::numbers::pi * static_cast<double>(c) /
                                                      static_cast<double>(columns);
    const double share =
        azimuth / (2.0 * std::numbers::pi) - std::floor(azimuth / (2.0 * std::numbers::pi));
    const auto sector = std::min(sectors - 1, static_cast<std::size_t>(share * sectors));
    ++all[sector];
    unexplained[sector] += value > limit ? 1 : 0;
  }
  // An object next to the route moves from sector to sector as the robot passes it.
  const auto before = unexplained_images_;
  const int increment = update_nearest_line(fix.pose.position()) ? 1 : 0;
  for (std::size_t s = 0; s < sectors; ++s) {
    const bool is_unexplained = all[s] > 0 && 2 * unexplained[s] >= all[s];
    const int so_far =
        std::max({before[(s + sectors - 1) % sectors], before[s], before[(s + 1) % sectors]});
    unexplained_images_[s] = is_unexplained ? std::max(1, so_far + increment) : 0;
  }
  const auto changed = [&](std::size_t s) {
    return unexplained_images_[s % sectors] >= min_images;
  };
  std::vector<RouteChanges::AzimuthRange> ranges;
  for (std::size_t s = 0; s < sectors; ++s) {
    if (!changed(s) || changed(s + sectors - 1)) continue;
    std::size_t end = s + 1;
    while (end < s + sectors && changed(end)) ++end;
    const double width = 2.0 * std::numbers::pi / sectors;
    ranges.push_back({wrap_angle(static_cast<double>(s) * width - fix.pose.heading_rad),
                      wrap_angle(static_cast<double>(end) * width - fix.pose.heading_rad)});
  }
  return ranges;
}

}  // namespace panonav
