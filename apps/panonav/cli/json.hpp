#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav::command {

using nlohmann::ordered_json;

/// Returns the value as JSON; null if there is none.
template <class Value>
[[nodiscard]] ordered_json to_json_or_null(const std::optional<Value>& value) {
  return value ? ordered_json(*value) : ordered_json();
}
/// Returns the number as JSON; null if it is not finite.
[[nodiscard]] inline ordered_json to_json_or_null(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json();
}

[[nodiscard]] inline ordered_json pose_json(const Pose2& pose) {
  return {{"x_m", pose.x_m}, {"y_m", pose.y_m}, {"heading_rad", pose.heading_rad}};
}

/// The heading is null if it is unknown.
[[nodiscard]] inline ordered_json pose_json(const ReferencePose& pose) {
  return {{"x_m", pose.x_m}, {"y_m", pose.y_m}, {"heading_rad", to_json_or_null(pose.heading_rad)}};
}

/// Returns null if there is no pose.
template <class Pose>
[[nodiscard]] ordered_json pose_json(const std::optional<Pose>& pose) {
  return pose ? pose_json(*pose) : ordered_json();
}

/// Returns the document as one line of text. Bytes that are not valid UTF-8 become the replacement
/// character U+FFFD.
[[nodiscard]] inline std::string json_line(const ordered_json& document) {
  return document.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace panonav::command
