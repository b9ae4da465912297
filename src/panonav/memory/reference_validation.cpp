#include "panonav/memory/reference_validation.hpp"

#include <cmath>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/geometry/position_bound.hpp"

namespace panonav {

void validate(const ReferencePose& pose) {
  require(is_position(pose.x_m), "pose x_m", pose.x_m, position_range);
  require(is_position(pose.y_m), "pose y_m", pose.y_m, position_range);
  if (pose.heading_rad) {
    require(std::isfinite(*pose.heading_rad), "pose heading_rad", *pose.heading_rad, "finite");
  }
}

void validate(const ReferenceInfo& info) {
  if (info.name.empty()) throw ContractError("view name", "empty", "at least one character");
  if (info.name.size() > max_name_bytes) {
    throw ContractError("view name", std::to_string(info.name.size()) + " bytes long",
                        "1 to " + std::to_string(max_name_bytes) + " bytes");
  }
  if (info.pose) validate(*info.pose);
  if (info.stamp_s) {
    require(std::abs(*info.stamp_s) <= max_stamp_s, "stamp_s", *info.stamp_s, stamp_range);
  }
}

}  // namespace panonav
