#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

struct VisualStep;

/// Measures the metric lengths of successive steps from images of the ground. Where the ground
/// shows nothing, the scale of the latest steps gives the length.
class GroundLengths {
 public:
  /// Throws ContractError unless the height is above 0.
  explicit GroundLengths(double camera_height_m);

  /// Replaces the displacement of `step`, the visual step between both views, by the one that the
  /// ground shows, in metres, or else only its length, by the scale of the latest steps. Returns
  /// false and leaves the step unchanged if neither is known.
  bool correct_step(const HomingView& before, const HomingView& after, VisualStep& step);

  /// Metric scale of visual displacements in metres per unit of length, estimated from the latest
  /// steps; nullopt before the third.
  [[nodiscard]] std::optional<double> scale_m() const;
  /// Number of steps whose own images gave their length.
  [[nodiscard]] std::size_t measured_steps() const noexcept { return measured_steps_; }

 private:
  double camera_height_m_;
  std::size_t measured_steps_ = 0;
  std::vector<double> latest_scales_m_;  // metres for each unit of length of the views
};

}  // namespace panonav
