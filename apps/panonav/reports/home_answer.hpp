#pragma once

#include <optional>
#include <string>

#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/pipeline/homing_guide.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav::command {

/// The place to return to.
struct Goal {
  std::string name;
  std::optional<ReferencePose> pose;
  HomingView view;
  std::optional<Panorama> panorama;  ///< empty for views of a memory
};

/// One view and the home vector that was computed for it.
struct HomeAnswer {
  std::string file;
  std::optional<ReferencePose> pose;
  HomingResult result;
};

/// Returns a direction as text: "34 degrees to the left", "straight ahead".
[[nodiscard]] std::string describe_direction(double direction_rad);
/// Describes the robot's rotation relative to the home view.
[[nodiscard]] std::string describe_rotation(double heading_rad);
/// Returns the reason why a result has no direction, as text.
[[nodiscard]] std::string explain_no_direction(const HomingResult& result);

}  // namespace panonav::command
