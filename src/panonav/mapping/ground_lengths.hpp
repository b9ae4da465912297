#pragma once

#include <optional>
#include <vector>

#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

struct VisualStep;

/// Lengths of steps from the ground, one step after the other. The latest steps predict the next
/// one and replace it where the ground shows nothing.
class GroundLengths {
 public:
  /// Throws ContractError unless the height is above 0.
  explicit GroundLengths(double camera_height_m);

  /// Writes the displacement that the ground shows, in metres, into `step`, which must be that of
  /// these views; else the length that the latest steps suggest. False where neither is known; the
  /// step then stays as it is.
  bool correct(const HomingView& before, const HomingView& after, VisualStep& step);

  /// Metres for each unit of length of the views, by the latest steps; empty before the first.
  [[nodiscard]] std::optional<double> scale_m() const;

 private:
  double camera_height_m_;
  std::vector<double> latest_scales_m_;  // metres for each unit of length of the views
};

}  // namespace panonav
