#include "panonav/io/camera_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "panonav/camera/model_parameters.hpp"
#include "panonav/camera/rig_model.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/internal/toml_fields.hpp"
#include "panonav/io/option_file.hpp"

namespace panonav {

namespace {

constexpr std::array<std::string_view, 2> elevation_origins{"known", "assumed"};

int read_whole_number(TomlFields& fields, std::string_view field) {
  const double value = fields.required_number(field);
  if (value != std::round(value) || value < 1.0 || value > 100000.0) {
    fields.fail(field, to_text(value), "a whole number, 1 .. 100000");
  }
  return static_cast<int>(value);
}

/// Reads a list of exactly as many numbers, if the field is present.
template <std::size_t count>
void read_fixed_numbers(TomlFields& fields, std::string_view field,
                        std::array<double, count>& numbers) {
  const auto found = fields.numbers(field);
  if (!found) return;
  if (found->size() != count) {
    fields.fail(field, std::to_string(found->size()) + " numbers",
                std::to_string(count) + " numbers");
  }
  std::ranges::copy(*found, numbers.begin());
}

Image read_mask(const std::filesystem::path& path, ImageSize size) {
  const Image image = read_image(path);
  if (image.size() != size) {
    throw FileError(path.string(), "the mask is " + std::to_string(image.width()) + " x " +
                                       std::to_string(image.height()) + "; allowed: the camera's " +
                                       std::to_string(size.width) + " x " +
                                       std::to_string(size.height));
  }
  return to_grey(image.view());
}

/// Index of the rig, the last model; its file has no `model` but several `[[camera]]`.
constexpr std::size_t rig_model_index = std::variant_size_v<CameraModel> - 1;

CameraModel read_model(TomlFields& fields) {
  std::string known;
  for (const auto name : std::span(camera_model_names).first(rig_model_index))
    known += (known.empty() ? "" : ", ") + std::string(name);
  const std::string name = fields.required_text("model", known + ", or several [[camera]]");
  auto model = make_default_model(name);
  if (!model || model->index() == rig_model_index) fields.fail("model", "\"" + name + "\"", known);
  visit_parameters(*model, [&](std::string_view parameter, auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>) {
      value = fields.required_number(parameter);
    } else {
      const auto numbers = fields.numbers(parameter);
      if (!numbers) fields.fail(parameter, "missing", "a list of numbers");
      value = *numbers;
    }
  });
  if (auto* axis = find_view_axis(*model)) {
    *axis = static_cast<UnifiedModel::Axis>(fields.choice("axis", view_axis_names).value_or(0));
  }
  return *model;
}

/// Reads the fields of one camera, except its mask; does not validate it.
Camera read_one_camera(TomlFields& fields) {
  Camera camera;
  camera.model = read_model(fields);
  camera.image_size = {read_whole_number(fields, "width_px"),
                       read_whole_number(fields, "height_px")};
  if (std::holds_alternative<EquirectangularModel>(camera.model)) {
    camera.forward_column = fields.number("forward_column").value_or(0.5);
  } else if (std::holds_alternative<PinholeModel>(camera.model)) {
    camera.centre = {fields.required_number("centre_u_px"), fields.required_number("centre_v_px")};
    camera.rim_radius_px = fields.number("rim_radius_px").value_or(0.0);
    read_fixed_numbers(fields, "affine", camera.affine);
    read_fixed_numbers(fields, "distortion", camera.distortion);
  } else if (has_vertical_axis(camera)) {
    camera.centre = {fields.required_number("centre_u_px"), fields.required_number("centre_v_px")};
    camera.rim_radius_px = fields.required_number("rim_radius_px");
    camera.inner_radius_px = fields.required_number("inner_radius_px");
    camera.forward_angle_rad = radians(fields.number("forward_angle_deg").value_or(0.0));
    read_fixed_numbers(fields, "affine", camera.affine);
    read_fixed_numbers(fields, "distortion", camera.distortion);
  }
  if (const auto direction = fields.choice("columns", column_direction_names)) {
    camera.direction =
        *direction == 0 ? ColumnDirection::clockwise : ColumnDirection::counter_clockwise;
  }
  camera.has_assumed_elevations = fields.choice("elevations", elevation_origins).value_or(0) == 1;
  return camera;
}

}  // namespace

CameraFile read_camera(const std::filesystem::path& path, CameraMount mount) {
  constexpr std::size_t max_bytes = 1U << 20U;
  const auto bytes = read_file(path, max_bytes);
  const std::string_view content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (const auto format = identify_calibration(content)) {
    auto calibrated = parse_calibration(path, content, *format, mount);
    return {calibrated.camera, std::nullopt, calibrated.format};
  }
  const TomlTable table = read_toml(path);
  TomlFields fields(path, "", table);
  CameraFile result;
  try {
    std::vector<Camera> cameras;
    for (TomlFields& camera : fields.sections("camera")) {
      cameras.push_back(read_one_camera(camera));
      camera.finish();
    }
    result.camera = cameras.empty() ? read_one_camera(fields) : make_rig(std::move(cameras));
    const auto mask = fields.text("mask");
    fields.finish();
    validate(result.camera);
    if (mask) result.mask = read_mask(path.parent_path() / *mask, result.camera.image_size);
  } catch (const ContractError& error) {
    throw FileError(path.string(), error.what());
  }
  return result;
}

namespace {

/// Appends the fields of one camera, except its mask.
void append_camera(const Camera& camera, std::string& text) {
  const auto number = [&text](std::string_view field, double value) {
    text += std::string(field) + " = " + to_text(value) + "\n";
  };
  const auto numbers = [&text](std::string_view field, std::span<const double> values) {
    text += std::string(field) + " = [";
    for (std::size_t i = 0; i < values.size(); ++i)
      text += (i > 0 ? ", " : "") + to_text(values[i]);
    text += "]\n";
  };
  const auto write_map = [&] {
    if (camera.affine != Camera{}.affine) numbers("affine", camera.affine);
    if (camera.distortion != Camera{}.distortion) numbers("distortion", camera.distortion);
  };
  text += "model = \"" + std::string(model_name(camera.model)) + "\"\n";
  visit_parameters(camera.model, [&](std::string_view parameter, const auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>) {
      number(parameter, value);
    } else {
      numbers(parameter, value);
    }
  });
  if (const auto* axis = find_view_axis(camera.model);
      axis != nullptr && *axis != UnifiedModel::Axis::down) {
    text += "axis = \"" + std::string(view_axis_names[static_cast<std::size_t>(*axis)]) + "\"\n";
  }
  number("width_px", camera.image_size.width);
  number("height_px", camera.image_size.height);
  if (std::holds_alternative<EquirectangularModel>(camera.model)) {
    number("forward_column", camera.forward_column);
  } else if (std::holds_alternative<PinholeModel>(camera.model)) {
    number("centre_u_px", camera.centre.u_px);
    number("centre_v_px", camera.centre.v_px);
    if (camera.rim_radius_px != 0.0) number("rim_radius_px", camera.rim_radius_px);
    write_map();
  } else if (has_vertical_axis(camera)) {
    number("centre_u_px", camera.centre.u_px);
    number("centre_v_px", camera.centre.v_px);
    number("rim_radius_px", camera.rim_radius_px);
    number("inner_radius_px", camera.inner_radius_px);
    number("forward_angle_deg", to_exact_degrees(camera.forward_angle_rad));
    write_map();
  }
  text += "columns = \"" + std::string(to_string(camera.direction)) + "\"\n";
  if (camera.has_assumed_elevations) {
    text +=
        "# The shape of the mirror was assumed, so lengths must not be computed from the ground.\n"
        "elevations = \"assumed\"\n";
  }
}

}  // namespace

void write_camera(const std::filesystem::path& path, const CameraFile& file) {
  validate(file.camera);
  std::string text =
      "# How the pixels of a camera and the directions around the robot belong together.\n";
  if (file.mask) {
    const std::string name = path.stem().string() + "_mask.png";
    write_png(path.parent_path() / name, file.mask->view());
    text += "mask = " + quote_for_toml(name) + "\n";
  }
  if (const auto* rig = std::get_if<RigModel>(&file.camera.model)) {
    text += "# The pictures of these cameras stand side by side, from left to right.\n";
    for (const Camera& camera : rig->cameras) {
      text += "\n[[camera]]\n";
      append_camera(camera, text);
    }
  } else {
    append_camera(file.camera, text);
  }
  write_file(path, text);
}

}  // namespace panonav
