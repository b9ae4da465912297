#pragma once

#include <array>
#include <optional>
#include <span>

namespace panonav {

/// Unified central model (Geyer, Daniilidis 2000; Mei, Rives 2007): a direction is projected onto
/// the unit sphere, and then in perspective from a point at distance xi behind its centre: r = f
/// sin(psi) / (xi + cos(psi)), where psi is the angle to the axis. xi = 0 is a pinhole, 0 < xi < 1
/// a hyperboloidal mirror or a fisheye lens, xi = 1 a paraboloidal mirror. Valid: xi <= 1: cos(psi)
/// > -xi, every r; xi > 1: cos(psi) > -1 / xi, and r < f / sqrt(xi^2 - 1).
struct UnifiedModel {
  /// Direction that the middle of the picture shows.
  enum class Axis {
    down,  ///< a mirror above the camera: the middle shows the camera itself
    up,    ///< a fisheye lens towards the ceiling
  };

  double xi = 1.0;                 ///< >= 0
  double focal_length_px = 300.0;  ///< above 0
  Axis axis = Axis::down;          ///< direction that the middle of the picture shows
  friend bool operator==(const UnifiedModel&, const UnifiedModel&) = default;
};

/// Throws ContractError that names the field, its value and its range.
void validate(const UnifiedModel& model);

/// Returns the elevation (up is positive) visible at distance `radius_px` from the image centre;
/// nullopt outside the valid domain.
[[nodiscard]] std::optional<double> elevation_at(const UnifiedModel& model, double radius_px);

/// Returns the distance from the image centre at which an elevation is visible; nullopt outside the
/// valid domain.
[[nodiscard]] std::optional<double> radius_at(const UnifiedModel& model, double elevation_rad);

/// A unified model with radial distortion that was fitted to another camera.
struct UnifiedFit {
  UnifiedModel model;         ///< its axis is not set
  std::array<double, 2> k{};  ///< k1 and k2 of `Camera::distortion`
  double residual_rad = 0.0;  ///< largest difference of angles
};

/// Fits a unified model with distortion to angles from the axis and the distances from the centre
/// at which they are imaged, both ascending, by least squares of angles over a grid of xi. Throws
/// ContractError unless there are at least 8 of each.
[[nodiscard]] UnifiedFit fit_unified(std::span<const double> angles_rad,
                                     std::span<const double> radii_px);

}  // namespace panonav
