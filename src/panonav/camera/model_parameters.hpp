#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "panonav/camera/camera.hpp"

namespace panonav {

/// Names of the models in files, in the order of the alternatives of CameraModel.
inline constexpr std::array<std::string_view, std::variant_size_v<CameraModel>> camera_model_names{
    "hyperboloidal", "polynomial", "unified", "equiangular", "equirectangular",
    "dual-fisheye",  "fisheye",    "pinhole", "rig"};

/// Returns the axis of a unified or fisheye model; null for others. `Model` is CameraModel, const
/// or not.
template <class Model>
[[nodiscard]] auto* find_view_axis(Model& model) {
  if (auto* fisheye = std::get_if<FisheyeModel>(&model)) return &fisheye->axis;
  auto* unified = std::get_if<UnifiedModel>(&model);
  return unified != nullptr ? &unified->axis : nullptr;
}

/// Names of the values of UnifiedModel::Axis in files, in its order. Files omit the default,
/// `down`.
inline constexpr std::array<std::string_view, 2> view_axis_names{"down", "up"};

/// Returns the model's name in files: one of `camera_model_names`.
[[nodiscard]] inline std::string_view model_name(const CameraModel& model) {
  return camera_model_names[model.index()];
}

/// Makes the model of that name with default parameters; nullopt when there is none.
[[nodiscard]] inline std::optional<CameraModel> make_default_model(std::string_view name) {
  std::optional<CameraModel> found;
  [&]<std::size_t... i>(std::index_sequence<i...>) {
    ((camera_model_names[i] == name ? void(found.emplace(std::in_place_index<i>)) : void()), ...);
  }
  (std::make_index_sequence<camera_model_names.size()>());
  return found;
}

/// Calls `visit(name, value)` for each parameter of the model; `value` is a double or, for the
/// coefficients of the polynomial, a vector of doubles; not for a rig, whose cameras have models of
/// their own. All readers and writers of files use this list. `Model` is CameraModel, const or not.
template <class Model, class Visit>
void visit_parameters(Model& model, Visit&& visit) {
  std::visit(
      [&](auto& m) {
        using Kind = std::remove_cvref_t<decltype(m)>;
        if constexpr (std::is_same_v<Kind, HyperboloidalModel>) {
          visit("a_mm", m.a_mm);
          visit("b_mm", m.b_mm);
          visit("focal_length_px", m.focal_length_px);
        } else if constexpr (std::is_same_v<Kind, PolynomialModel>) {
          visit("coefficients", m.coefficients);
        } else if constexpr (std::is_same_v<Kind, UnifiedModel>) {
          visit("xi", m.xi);
          visit("focal_length_px", m.focal_length_px);
        } else if constexpr (std::is_same_v<Kind, FisheyeModel>) {
          visit("focal_length_px", m.focal_length_px);
          visit("k1", m.k1);
          visit("k2", m.k2);
          visit("k3", m.k3);
          visit("k4", m.k4);
          visit("max_angle_rad", m.max_angle_rad);
        } else if constexpr (std::is_same_v<Kind, PinholeModel>) {
          visit("focal_length_px", m.focal_length_px);
          visit("azimuth_rad", m.azimuth_rad);
          visit("elevation_rad", m.elevation_rad);
          visit("roll_rad", m.roll_rad);
        } else if constexpr (std::is_same_v<Kind, EquiangularModel>) {
          visit("elevation_at_inner_rad", m.elevation_at_inner_rad);
          visit("elevation_at_rim_rad", m.elevation_at_rim_rad);
        } else if constexpr (std::is_same_v<Kind, EquirectangularModel>) {
          visit("elevation_bottom_rad", m.elevation_bottom_rad);
          visit("elevation_top_rad", m.elevation_top_rad);
        } else if constexpr (std::is_same_v<Kind, DualFisheyeModel>) {
          for (std::size_t i = 0; i < m.lenses.size(); ++i) {
            auto& lens = m.lenses[i];
            const std::string name = "lens" + std::to_string(i) + "_";
            visit(name + "centre_u_px", lens.centre_u_px);
            visit(name + "centre_v_px", lens.centre_v_px);
            visit(name + "focal_length_px", lens.focal_length_px);
            visit(name + "k3", lens.k3);
            visit(name + "k5", lens.k5);
            visit(name + "max_angle_rad", lens.max_angle_rad);
            visit(name + "azimuth_rad", lens.azimuth_rad);
            visit(name + "elevation_rad", lens.elevation_rad);
            visit(name + "roll_rad", lens.roll_rad);
            visit(name + "gain", lens.gain);
          }
          visit("baseline_m", m.baseline_m);
        } else {
          static_assert(std::is_same_v<Kind, RigModel>);
        }
      },
      model);
}

}  // namespace panonav
