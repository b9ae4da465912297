#include "panonav/camera/fisheye_model.hpp"

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"

namespace panonav {
namespace {

double slope_at_angle(const FisheyeModel& m, double theta) {
  const double t = theta * theta;
  return m.focal_length_px * (1 + t * (3 * m.k1 + t * (5 * m.k2 + t * (7 * m.k3 + t * 9 * m.k4))));
}

bool looks_down(const FisheyeModel& model) {
  return model.axis == UnifiedModel::Axis::down;
}

}  // namespace

double radius_at_angle(const FisheyeModel& m, double theta) {
  const double t = theta * theta;
  return m.focal_length_px * theta * (1 + t * (m.k1 + t * (m.k2 + t * (m.k3 + t * m.k4))));
}

double find_last_growing_angle(const FisheyeModel& model, double limit_rad) {
  constexpr int steps = 4096;  // finer than any turn of a polynomial of ninth degree that matters
  constexpr int bisections = 60;
  for (int i = 1; i <= steps; ++i) {
    double high = limit_rad * i / steps;
    if (slope_at_angle(model, high) > 0) continue;
    double low = limit_rad * (i - 1) / steps;
    for (int k = 0; k < bisections; ++k) {
      const double middle = 0.5 * (low + high);
      (slope_at_angle(model, middle) > 0 ? low : high) = middle;
    }
    return low;
  }
  return limit_rad;
}

void validate(const FisheyeModel& model) {
  require(std::isfinite(model.focal_length_px) && model.focal_length_px > 0, "focal_length_px",
          model.focal_length_px, "finite and above 0");
  for (const double k : {model.k1, model.k2, model.k3, model.k4}) {
    require(std::isfinite(k), "k1 to k4", k, "finite");
  }
  require(model.max_angle_rad > 0 && model.max_angle_rad <= std::numbers::pi, "max_angle_rad",
          model.max_angle_rad, "above 0, at most pi");
  const double last_rad = find_last_growing_angle(model, model.max_angle_rad);
  require(last_rad >= model.max_angle_rad, "max_angle_rad", model.max_angle_rad,
          "up to which the radius grows: at most " + to_general_text(last_rad, 6));
}

std::optional<double> elevation_at(const FisheyeModel& model, double radius_px) {
  double high = model.max_angle_rad;
  if (!(radius_px >= 0) || !(radius_px <= radius_at_angle(model, high))) return std::nullopt;
  double low = 0.0;
  double theta = std::min(high, radius_px / model.focal_length_px);
  for (int i = 0; i < 100; ++i) {
    const double error = radius_at_angle(model, theta) - radius_px;
    if (error == 0) break;
    (error < 0 ? low : high) = theta;
    double next = theta - error / slope_at_angle(model, theta);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - theta) <= 1e-15) break;
    theta = next;
  }
  const double below_horizon = theta - std::numbers::pi / 2;
  return looks_down(model) ? below_horizon : -below_horizon;
}

std::optional<double> radius_at(const FisheyeModel& model, double elevation_rad) {
  const double theta = std::numbers::pi / 2 + (looks_down(model) ? elevation_rad : -elevation_rad);
  if (!(theta >= 0 && theta <= model.max_angle_rad)) return std::nullopt;
  return radius_at_angle(model, theta);
}

}  // namespace panonav
