#include "panonav/route/route_panorama.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/route/internal/line_sampling.hpp"

namespace panonav {

RoutePanorama::RoutePanorama(int columns) : columns_(columns) {
  if (columns < 16 || columns > 16384) throw ContractError("columns", columns, "16 to 16384");
}

bool RoutePanorama::append(const Pose2& pose, std::span<const float> line) {
  std::vector<std::uint8_t> bytes(line.size());
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (!std::isfinite(line[i])) {
      throw ContractError("line[" + std::to_string(i) + "]", static_cast<double>(line[i]),
                          "a finite number");
    }
    bytes[i] = static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(line[i], 0.0F, 1.0F)));
  }
  return append(pose, bytes);
}

bool RoutePanorama::append(const Pose2& pose, std::span<const std::uint8_t> line) {
  if (line.size() != static_cast<std::size_t>(columns_)) {
    throw ContractError("values of the line", static_cast<double>(line.size()),
                        std::to_string(columns_));
  }
  if (!is_finite(pose)) {
    throw ContractError("pose", "not finite", "finite numbers");
  }
  if (!poses_.empty() && distance(poses_.back().position(), pose.position()) < min_step_m) {
    return false;
  }
  poses_.push_back({pose.x_m, pose.y_m, wrap_angle(pose.heading_rad)});
  bytes_.insert(bytes_.end(), line.begin(), line.end());
  return true;
}

std::vector<float> line_values(const RoutePanorama& route, std::size_t i) {
  const auto bytes = route.line(i);
  std::vector<float> line(bytes.size());
  for (std::size_t c = 0; c < line.size(); ++c) line[c] = static_cast<float>(bytes[c]) / 255.0F;
  return line;
}

std::vector<float> world_line(const RoutePanorama& route, std::size_t i) {
  const auto line = line_values(route, i);
  const double turn = route.poses()[i].heading_rad * route.columns() / (2.0 * std::numbers::pi);
  std::vector<float> turned(line.size());
  for (std::size_t c = 0; c < line.size(); ++c) {
    turned[c] = sample_line(line, static_cast<double>(c) - turn).value;
  }
  return turned;
}

double RoutePanorama::length_m() const {
  return path_length_m(std::span<const Pose2>(poses_));
}

}  // namespace panonav
