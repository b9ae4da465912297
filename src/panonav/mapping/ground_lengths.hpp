#pragma once

#include <optional>
#include <vector>

#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

struct VisualStep;

/// Reads lengths of successive steps from the ground. The latest steps predict the next one and
/// replace it where the ground shows nothing.
class GroundLengths {
 public:
  /// Throws ContractError unless the height is above 0.
  explicit GroundLengths(double camera_height_m);

  /// Replaces the displacement of `step`, which must be that of these views, by the one that the
  /// ground shows, in metres, else its length by that of the latest steps. False where neither is
  /// known; the step then stays as it is.
  bool correct_step(const HomingView& before, const HomingView& after, VisualStep& step);

  /// Metric scale of visual displacements in metres per unit of length, estimated from the latest
  /// steps; nullopt before the first.
  [[nodiscard]] std::optional<double> scale_m() const;

 private:
  double camera_height_m_;
  std::vector<double> latest_scales_m_;  // metres for each unit of length of the views
};

}  // namespace panonav
