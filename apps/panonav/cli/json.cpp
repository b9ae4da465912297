#include "cli/json.hpp"

#include <array>

namespace panonav::command {

namespace {

struct FormerKey {
  std::string_view now;
  std::string_view former;
};

/// Keys of JSON output that have another name since the last version; the only list of them.
constexpr std::array<FormerKey, 26> former_keys{{
    {"ate_m", "position_m"},                      // evaluate
    {"rpe_m", "relative_position_m"},             // evaluate
    {"rpe_heading_rad", "relative_heading_rad"},  // evaluate
    {"rmse", "rms"},                              // evaluate
    {"max", "largest"},                           // evaluate
    {"procrustes_disparity", "shape_difference"},
    {"procrustes_disparity_with_reflection", "shape_difference_with_reflection"},
    {"odometry_procrustes_disparity", "odometry_shape_difference"},
    {"arranged_procrustes_disparity", "arranged_shape_difference"},  // demo
    {"drive_procrustes_disparity", "drive_shape_difference"},        // demo
    {"wheels_procrustes_disparity", "wheels_shape_difference"},      // demo
    {"column_difference", "difference"},  // localise: column by column, after turning
    {"image_difference", "difference"},   // navigate: of whole views
    {"connected_component", "part"},
    {"connected_components", "parts"},
    {"edges", "passages"},
    {"edges_from", "passages_from"},
    {"closed_edges", "closed_passages"},
    {"ground_truth", "truth"},
    {"injected", "redrawn"},  // track
    {"step", "look"},
    {"steps", "looks"},
    {"kidnapped_after_step", "carried_after_look"},
    {"mission_kidnapped", "mission_carried"},  // demo
    {"mission_steps", "mission_looks"},        // demo
    {"springs_rejected", "springs_given_up"},  // arrange
}};

ordered_json with_former_keys(const ordered_json& value) {
  if (!value.is_structured()) return value;
  ordered_json renamed = value.is_array() ? ordered_json::array() : ordered_json::object();
  for (const auto& [key, member] : value.items()) {
    if (value.is_array()) {
      renamed.push_back(with_former_keys(member));
      continue;
    }
    std::string_view name = key;
    for (const FormerKey& entry : former_keys) {
      if (name == entry.now) name = entry.former;
    }
    renamed[std::string(name)] = with_former_keys(member);
  }
  return renamed;
}

}  // namespace

std::string with_former_keys(std::string_view line) {
  const auto value = ordered_json::parse(line);
  const auto renamed = with_former_keys(value);
  return renamed == value ? std::string(line) : json_line(renamed);
}

}  // namespace panonav::command
