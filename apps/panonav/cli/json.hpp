#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "panonav/core/text.hpp"
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

/// Replaces texts of a document that are not valid UTF-8, such as paths, by their escapes.
inline void escape_texts(ordered_json& document) {
  if (const auto* text = document.get_ptr<const std::string*>(); text != nullptr) {
    if (!is_utf8(*text)) document = escape_name(*text);
  } else if (document.is_structured()) {
    for (auto& part : document) escape_texts(part);
  }
}

/// Returns the document as one line of text. In values that are not valid UTF-8, escapes stand for
/// the bytes (`escape_name`).
[[nodiscard]] inline std::string json_line(ordered_json document) {
  escape_texts(document);
  return document.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace panonav::command
