#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "panonav/camera/model_parameters.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/camera_calibration.hpp"

namespace panonav {

namespace {

/// Parameters of a model of other programs, and how well it represents the camera.
struct ExportedModel {
  bool is_fisheye = false;       ///< else the omnidirectional model of Mei
  double xi = 0.0;               ///< of the model of Mei
  double focal_length_px = 0.0;  ///< along u
  std::array<double, 4> coefficients{};
  double residual_rad = 0.0;
};

/// Samples the angles from the axis and the radii of the ideal image that the picture shows.
std::pair<std::vector<double>, std::vector<double>> sample_angles(const Camera& camera) {
  constexpr int samples = 400;
  const double corner_px =
      std::hypot(std::max(camera.centre.u_px, camera.image_size.width - camera.centre.u_px),
                 std::max(camera.centre.v_px, camera.image_size.height - camera.centre.v_px));
  const double rim_px = std::min(camera.rim_radius_px, corner_px);
  Camera ideal = camera;
  ideal.affine = Camera{}.affine;
  ideal.distortion = Camera{}.distortion;
  const int side = static_cast<int>(std::ceil(2.0 * camera.rim_radius_px)) + 2;
  ideal.image_size = {side, side};
  ideal.centre = {0.5 * side, 0.5 * side};
  std::pair<std::vector<double>, std::vector<double>> sampled;
  const double inner_px = camera.inner_radius_px;
  double sign = 0.0;
  for (int i = 1; i <= samples; ++i) {
    const double radius_px = inner_px + (rim_px - inner_px) * i / samples;
    const auto seen = unproject(ideal, {ideal.centre.u_px + radius_px, ideal.centre.v_px});
    if (!seen) continue;
    if (sign == 0.0) sign = seen->elevation_rad() < 0.0 ? 1.0 : -1.0;  // what the middle shows
    sampled.first.push_back(std::numbers::pi / 2 + sign * seen->elevation_rad());
    sampled.second.push_back(radius_px);
  }
  return sampled;
}

ExportedModel to_exported_model(const Camera& camera) {
  const auto& [k1, k2, p1, p2, k3] = camera.distortion;
  if (const auto* fisheye = std::get_if<FisheyeModel>(&camera.model)) {
    return {true,
            0.0,
            fisheye->focal_length_px,
            {fisheye->k1, fisheye->k2, fisheye->k3, fisheye->k4},
            0.0};
  }
  const auto* unified = std::get_if<UnifiedModel>(&camera.model);
  if (unified != nullptr) {
    require(k3 == 0.0, "distortion k3", k3, "0, as the model omni has two radial coefficients");
    return {false, unified->xi, unified->focal_length_px, {k1, k2, p1, p2}, 0.0};
  }
  const auto [angles_rad, radii_px] = sample_angles(camera);
  const UnifiedFit fit = fit_unified(angles_rad, radii_px);
  return {false,
          fit.model.xi,
          fit.model.focal_length_px,
          {fit.k[0], fit.k[1], 0.0, 0.0},
          fit.residual_rad};
}

std::string join(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "" : ", ") + to_text(number);
  return text;
}

std::string format_matrix(const std::string& name, int rows, int columns,
                          std::span<const double> numbers) {
  return name + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
         "\n   cols: " + std::to_string(columns) + "\n   dt: d\n   data: [ " + join(numbers) +
         " ]\n";
}

std::string format_opencv(const Camera& camera, const ExportedModel& model,
                          const std::string& comment) {
  const double f = model.focal_length_px;
  const std::array<double, 9> matrix{f,
                                     f * camera.affine[2],
                                     camera.centre.u_px - 0.5,
                                     0.0,
                                     f * camera.affine[0],
                                     camera.centre.v_px - 0.5,
                                     0.0,
                                     0.0,
                                     1.0};
  std::string text = "%YAML:1.0\n---\n" + comment;
  text += "image_width: " + std::to_string(camera.image_size.width) +
          "\nimage_height: " + std::to_string(camera.image_size.height) + "\n";
  text += "camera_model: " + std::string(model.is_fisheye ? "fisheye" : "omnidir") + "\n";
  text += format_matrix("K", 3, 3, matrix) + format_matrix("D", 4, 1, model.coefficients);
  if (!model.is_fisheye) text += format_matrix("xi", 1, 1, std::array{model.xi});
  return text;
}

std::string format_kalibr(const Camera& camera, const ExportedModel& model,
                          const std::string& comment) {
  const double f = model.focal_length_px;
  require(camera.affine[2] == 0.0, "affine e", camera.affine[2],
          "0, as Kalibr has no skew; OpenCV has");
  const std::array<double, 4> intrinsics{f, f * camera.affine[0], camera.centre.u_px - 0.5,
                                         camera.centre.v_px - 0.5};
  std::string text = comment + "cam0:\n";
  text += std::string("  camera_model: ") + (model.is_fisheye ? "pinhole" : "omni") + "\n";
  text += "  intrinsics: [" + (model.is_fisheye ? "" : to_text(model.xi) + ", ") +
          join(intrinsics) + "]\n";
  text += std::string("  distortion_model: ") + (model.is_fisheye ? "equidistant" : "radtan") +
          "\n  distortion_coeffs: [" + join(model.coefficients) + "]\n";
  text += "  resolution: [" + std::to_string(camera.image_size.width) + ", " +
          std::to_string(camera.image_size.height) + "]\n";
  return text;
}

}  // namespace

double write_calibration(const std::filesystem::path& path, const Camera& camera,
                         ExportFormat format) {
  validate(camera);
  if (!has_vertical_axis(camera)) {
    throw ContractError("model", model_name(camera.model),
                        "a mirror or a lens with one centre that sees all azimuths");
  }
  const double max_shear = 1e-4;  // radians by which azimuths change, 0.006 degrees
  require(std::abs(camera.affine[1]) <= max_shear, "affine d", camera.affine[1],
          "-1e-4 .. 1e-4, as camera matrices have no such parameter");
  const double max_residual_deg = 0.05;
  const ExportedModel model = to_exported_model(camera);
  if (!(degrees(model.residual_rad) <= max_residual_deg)) {
    throw ContractError("difference of elevations between the camera and the model omni",
                        degrees(model.residual_rad), "at most 0.05 degrees");
  }
  const std::string comment =
      "# Written by panonav; elevations differ from its camera file by at most " +
      to_text(degrees(model.residual_rad)) + " degrees.\n";
  write_file(path, format == ExportFormat::kalibr ? format_kalibr(camera, model, comment)
                                                  : format_opencv(camera, model, comment));
  return model.residual_rad;
}

}  // namespace panonav
