#include "panonav/camera/equiangular_model.hpp"

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav {

void validate(const EquiangularModel& model) {
  const auto in_range = [](double value) { return std::abs(value) <= std::numbers::pi / 2; };
  require(in_range(model.elevation_at_inner_rad), "elevation_at_inner_rad",
          model.elevation_at_inner_rad, "-pi/2 .. pi/2");
  require(in_range(model.elevation_at_rim_rad), "elevation_at_rim_rad", model.elevation_at_rim_rad,
          "-pi/2 .. pi/2");
  require(model.elevation_at_inner_rad != model.elevation_at_rim_rad, "elevation_at_rim_rad",
          model.elevation_at_rim_rad, "other than elevation_at_inner_rad");
}

double elevation_at(const EquiangularModel& model, double radius_px, double inner_radius_px,
                    double rim_radius_px) {
  const double t = (radius_px - inner_radius_px) / (rim_radius_px - inner_radius_px);
  return model.elevation_at_inner_rad * (1 - t) + model.elevation_at_rim_rad * t;
}

double radius_at(const EquiangularModel& model, double elevation_rad, double inner_radius_px,
                 double rim_radius_px) {
  const double t = (elevation_rad - model.elevation_at_inner_rad) /
                   (model.elevation_at_rim_rad - model.elevation_at_inner_rad);
  return inner_radius_px * (1 - t) + rim_radius_px * t;
}

}  // namespace panonav
