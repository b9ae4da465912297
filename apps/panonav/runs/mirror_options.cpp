#include "runs/mirror_options.hpp"

#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::command {

void visit_options(MirrorOptions& options, OptionVisitor& visitor) {
  using T = MirrorOptions;
  constexpr OptionTable table{
      choice<&T::profile>("Shape of the mirror; dual-fisheye: no mirror, but two fisheye lenses "
                          "side by side in one image",
                          "equiangular", "hyperboloidal", "unified", "dual-fisheye"),
      option<&T::inner_elevation_deg>(
          "Elevation at the inner radius of the mirror (only for equiangular)", -90, 90),
      option<&T::rim_elevation_deg>("Elevation at the mirror's rim", -90, 90),
      option<&T::mirror_a_mm>("Parameter a of the hyperboloid [Y03 eq. 1]", 0.01, 1e5),
      option<&T::mirror_b_mm>("Parameter b of the hyperboloid [Y03 eq. 1]", 0.01, 1e5),
      option<&T::xi>("Mirror parameter of the unified model", 0, 10),
      choice<&T::direction>(
          "Direction in which the image rotates when the robot rotates to the left: clockwise if "
          "the camera points up into the mirror, counter-clockwise if the camera points down. For "
          "dual-fisheye: clockwise, or counter-clockwise if the image is mirrored",
          "clockwise", "counter-clockwise"),
      option<&T::forward_angle_deg>(
          "Direction in the image that is the robot's forward direction: 0 is right, 90 is up",
          -360, 360),
  };
  table.visit(options, visitor);
}

CameraModel make_mirror_model(const MirrorOptions& options, double rim_radius_px) {
  const double rim_rad = radians(options.rim_elevation_deg);
  switch (options.profile) {
    case 1:
      return fit_focal_length(
          HyperboloidalModel{.a_mm = options.mirror_a_mm, .b_mm = options.mirror_b_mm},
          rim_radius_px, rim_rad);
    case 2:
      return fit_focal_length(UnifiedModel{.xi = options.xi}, rim_radius_px, rim_rad);
    default:
      return EquiangularModel{radians(options.inner_elevation_deg), rim_rad};
  }
}

std::vector<MirrorAssumption> list_assumptions(const Arguments& declared,
                                               const MirrorOptions& options) {
  const auto number = [](double value) { return format_number(value); };
  std::vector<MirrorAssumption> needed;
  if (options.profile == 0) {
    needed = {
        {"profile", "--profile equiangular (elevations increase evenly along the radius)"},
        {"inner_elevation_deg", "--inner-elevation-deg " + number(options.inner_elevation_deg)}};
  } else if (options.profile == 1) {
    needed = {{"mirror_a_mm", "--mirror-a-mm " + number(options.mirror_a_mm)},
              {"mirror_b_mm", "--mirror-b-mm " + number(options.mirror_b_mm)}};
  } else {
    needed = {{"xi", "--xi " + number(options.xi)}};
  }
  needed.push_back(
      {"rim_elevation_deg", "--rim-elevation-deg " + number(options.rim_elevation_deg)});
  std::erase_if(
      needed, [&](const MirrorAssumption& each) { return declared.is_set("mirror", each.option); });
  return needed;
}

}  // namespace panonav::command
