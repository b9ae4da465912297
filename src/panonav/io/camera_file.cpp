#include "panonav/io/camera_file.hpp"

#include <array>
#include <cmath>
#include <string>
#include <type_traits>

#include "panonav/camera/model_parameters.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/internal/toml_fields.hpp"
#include "panonav/io/option_file.hpp"

namespace panonav {

namespace {

constexpr std::array<std::string_view, 2> direction_names{"clockwise", "counter-clockwise"};

int read_whole_number(TomlFields& fields, std::string_view field) {
  const double value = fields.required_number(field);
  if (value != std::round(value) || value < 1.0 || value > 100000.0) {
    fields.fail(field, to_text(value), "a whole number, 1 .. 100000");
  }
  return static_cast<int>(value);
}

}  // namespace

CameraFile read_camera(const std::filesystem::path& path) {
  const TomlTable table = read_toml(path);
  TomlFields fields(path, "", table);
  CameraFile result;
  Camera& camera = result.camera;
  std::string known;
  for (const auto name : camera_model_names)
    known += (known.empty() ? "" : ", ") + std::string(name);
  const std::string name = fields.required_text("model", known);
  const auto model = make_default_model(name);
  if (!model) fields.fail("model", "\"" + name + "\"", known);
  camera.model = *model;
  visit_parameters(camera.model, [&](std::string_view parameter, auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>) {
      value = fields.required_number(parameter);
    } else {
      const auto numbers = fields.numbers(parameter);
      if (!numbers) fields.fail(parameter, "missing", "a list of numbers");
      value = *numbers;
    }
  });
  if (auto* unified = std::get_if<UnifiedModel>(&camera.model)) {
    unified->axis =
        static_cast<UnifiedModel::Axis>(fields.choice("axis", view_axis_names).value_or(0));
  }
  camera.image_size = {read_whole_number(fields, "width_px"),
                       read_whole_number(fields, "height_px")};
  if (std::holds_alternative<EquirectangularModel>(camera.model)) {
    camera.forward_column = fields.number("forward_column").value_or(0.5);
  } else if (lens_count(camera) == 1) {
    camera.centre = {fields.required_number("centre_u_px"), fields.required_number("centre_v_px")};
    camera.rim_radius_px = fields.required_number("rim_radius_px");
    camera.inner_radius_px = fields.required_number("inner_radius_px");
    camera.forward_angle_rad = radians(fields.number("forward_angle_deg").value_or(0.0));
  }
  if (const auto direction = fields.choice("columns", direction_names)) {
    camera.direction =
        *direction == 0 ? ColumnDirection::clockwise : ColumnDirection::counter_clockwise;
  }
  const auto mask = fields.text("mask");
  fields.finish();
  try {
    validate(camera);
  } catch (const ContractError& error) {
    throw FileError(path.string(), error.what());
  }
  if (mask) {
    const auto mask_path = path.parent_path() / *mask;
    const Image image = read_image(mask_path);
    if (image.size() != camera.image_size) {
      throw FileError(mask_path.string(), "the mask is " + std::to_string(image.width()) + " x " +
                                              std::to_string(image.height()) +
                                              "; allowed: the camera's " +
                                              std::to_string(camera.image_size.width) + " x " +
                                              std::to_string(camera.image_size.height));
    }
    result.mask = to_grey(image.view());
  }
  return result;
}

void write_camera(const std::filesystem::path& path, const CameraFile& file) {
  const Camera& camera = file.camera;
  validate(camera);
  std::string text =
      "# How the pixels of a camera and the directions around the robot belong together.\n";
  const auto number = [&text](std::string_view field, double value) {
    text += std::string(field) + " = " + to_text(value) + "\n";
  };
  text += "model = \"" + std::string(model_name(camera.model)) + "\"\n";
  visit_parameters(camera.model, [&](std::string_view parameter, const auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>) {
      number(parameter, value);
    } else {
      text += std::string(parameter) + " = [";
      for (std::size_t i = 0; i < value.size(); ++i)
        text += (i > 0 ? ", " : "") + to_text(value[i]);
      text += "]\n";
    }
  });
  if (const auto* unified = std::get_if<UnifiedModel>(&camera.model);
      unified != nullptr && unified->axis != UnifiedModel::Axis::down) {
    text += "axis = \"" + std::string(view_axis_names[static_cast<std::size_t>(unified->axis)]) +
            "\"\n";
  }
  number("width_px", camera.image_size.width);
  number("height_px", camera.image_size.height);
  if (std::holds_alternative<EquirectangularModel>(camera.model)) {
    number("forward_column", camera.forward_column);
  } else if (lens_count(camera) == 1) {
    number("centre_u_px", camera.centre.u_px);
    number("centre_v_px", camera.centre.v_px);
    number("rim_radius_px", camera.rim_radius_px);
    number("inner_radius_px", camera.inner_radius_px);
    number("forward_angle_deg", to_exact_degrees(camera.forward_angle_rad));
  }
  text += "columns = \"" +
          std::string(direction_names[camera.direction == ColumnDirection::clockwise ? 0 : 1]) +
          "\"\n";
  if (file.mask) {
    const std::string name = path.stem().string() + "_mask.png";
    write_png(path.parent_path() / name, file.mask->view());
    text += "mask = " + quote_for_toml(name) + "\n";
  }
  write_file(path, text);
}

}  // namespace panonav
