#include "panonav/route/route_changes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

constexpr int min_pictures = 5;         // in which a change shows, one after the other
constexpr double max_deviations = 3.0;  // of noise; more are unexplained

}  // namespace

bool RouteChanges::counts(Point2 position) {
  if (lines_.empty()) return true;
  const auto off_m = [&](const Pose2& line) { return distance(line.position(), position); };
  const auto nearest =
      static_cast<std::size_t>(std::ranges::min_element(lines_, {}, off_m) - lines_.begin());
  return std::exchange(line_, nearest) != nearest;
}

std::vector<RouteChanges::AzimuthRange> RouteChanges::add(const RouteFix& fix) {
  const auto limit = static_cast<float>(max_deviations * fix.noise);
  std::array<int, sectors> above{};
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
    above[sector] += value > limit ? 1 : 0;
  }
  // A thing beside the route goes from sector to sector as the robot passes it.
  const auto before = pictures_;
  const int more = counts(fix.pose.position()) ? 1 : 0;
  for (std::size_t s = 0; s < sectors; ++s) {
    const bool high = all[s] > 0 && 2 * above[s] >= all[s];
    const int so_far =
        std::max({before[(s + sectors - 1) % sectors], before[s], before[(s + 1) % sectors]});
    pictures_[s] = high ? std::max(1, so_far + more) : 0;
  }
  const auto changed = [&](std::size_t s) { return pictures_[s % sectors] >= min_pictures; };
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
