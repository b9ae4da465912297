#pragma once

#include <string>
#include <vector>

#include "cli/arguments.hpp"
#include "panonav/camera/mirror_camera.hpp"
#include "panonav/core/options.hpp"

namespace panonav::command {

/// Properties of a mirror that cannot be found from images: its profile and the robot's forward
/// direction.
struct MirrorOptions {
  int profile = 0;
  double inner_elevation_deg = -60.0;
  double rim_elevation_deg = 20.0;
  double mirror_a_mm = HyperboloidalModel{}.a_mm;
  double mirror_b_mm = HyperboloidalModel{}.b_mm;
  double xi = UnifiedModel{}.xi;
  int direction = 0;
  double forward_angle_deg = 0.0;
};

void visit_options(MirrorOptions& options, OptionVisitor& visitor);

/// Makes the model of a mirror whose rim has this radius in the image.
[[nodiscard]] CameraModel make_mirror_model(const MirrorOptions& options, double rim_radius_px);

/// A property of a mirror that images do not show.
struct MirrorAssumption {
  std::string option;  ///< name of the option that sets it
  std::string text;    ///< the flag and the assumed value
};

/// Lists the properties of the mirror that no option sets, so that defaults are assumed.
[[nodiscard]] std::vector<MirrorAssumption> list_assumptions(const Arguments& declared,
                                                             const MirrorOptions& options);

}  // namespace panonav::command
