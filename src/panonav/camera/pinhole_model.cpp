#include "panonav/camera/pinhole_model.hpp"

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav {

FisheyeLens::Rotation find_rotation(const PinholeModel& model) {
  FisheyeLens lens;
  lens.azimuth_rad = model.azimuth_rad;
  lens.elevation_rad = model.elevation_rad;
  lens.roll_rad = model.roll_rad;
  return FisheyeLens::Rotation(lens);
}

void validate(const PinholeModel& model) {
  require(std::isfinite(model.focal_length_px) && model.focal_length_px > 0, "focal_length_px",
          model.focal_length_px, "finite and above 0");
  require(std::isfinite(model.azimuth_rad), "azimuth_rad", model.azimuth_rad, "finite");
  require(std::abs(model.elevation_rad) <= std::numbers::pi / 2, "elevation_rad",
          model.elevation_rad, "-pi/2 .. pi/2");
  require(std::isfinite(model.roll_rad), "roll_rad", model.roll_rad, "finite");
}

std::optional<PinholeModel::Offset> project(const PinholeModel& model, const Direction3& in_lens) {
  constexpr double min_cosine = 1e-3;  // beyond, offsets exceed a thousand focal lengths
  const double square = in_lens.x * in_lens.x + in_lens.y * in_lens.y + in_lens.z * in_lens.z;
  if (!(in_lens.x > 0.0 && in_lens.x * in_lens.x > min_cosine * min_cosine * square)) return {};
  const double scale = model.focal_length_px / in_lens.x;
  return PinholeModel::Offset{-scale * in_lens.y, scale * in_lens.z};
}

Direction3 unproject(const PinholeModel& model, double right_px, double up_px) {
  const double length = std::hypot(model.focal_length_px, right_px, up_px);
  return find_rotation(model).robot_from_lens(
      {model.focal_length_px / length, -right_px / length, up_px / length});
}

double focal_length_from_field_of_view(int width_px, double field_of_view_rad) {
  require(is_field_of_view(field_of_view_rad), "field of view in radians", field_of_view_rad,
          to_text(min_field_of_view_rad) + " .. " + to_text(max_field_of_view_rad));
  return 0.5 * width_px / std::tan(0.5 * field_of_view_rad);
}

double focal_length_from_35mm(ImageSize size, double focal_length_mm) {
  require(std::isfinite(focal_length_mm) && focal_length_mm > 0, "focal length for 35 mm film",
          focal_length_mm, "finite and above 0");
  const double film_diagonal_mm = std::hypot(36.0, 24.0);
  return focal_length_mm / film_diagonal_mm * std::hypot(size.width, size.height);
}

}  // namespace panonav
