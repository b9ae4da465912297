#include <algorithm>
#include <cstring>

#include "bindings.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav::python {

namespace {

std::string shape_text(const std::vector<py::ssize_t>& shape) {
  std::string text;
  for (const py::ssize_t size : shape) {
    text += (text.empty() ? "" : ", ") + (size < 0 ? std::string("n") : std::to_string(size));
  }
  return "(" + text + (shape.size() == 1 ? ",)" : ")");
}

std::string shape_text(const py::array& array) {
  return shape_text(std::vector<py::ssize_t>(array.shape(), array.shape() + array.ndim()));
}

std::string type_name(const py::handle& value) {
  return std::string(py::str(py::type::of(value).attr("__name__")));
}

py::array require_array(const py::handle& value, const char* what) {
  if (!py::isinstance<py::array>(value)) {
    throw ContractError(what, type_name(value), "a numpy array");
  }
  return py::reinterpret_borrow<py::array>(value);
}

/// True if the array has this type, in the byte order of this machine.
template <class Value>
bool has_dtype(const py::array& array) {
  return py::isinstance<py::array_t<Value>>(array);
}

std::string dtype_text(const py::array& array) {
  return std::string(py::str(array.dtype()));
}

}  // namespace

namespace {

/// Converts a PIL image to an array of grey or colour pixels, upright and without alpha channel.
py::object to_array_of_pil_image(const py::handle& value) {
  const py::object image = py::module_::import("PIL.ImageOps")
                               .attr("exif_transpose")(py::reinterpret_borrow<py::object>(value));
  const auto mode = image.attr("mode").cast<std::string>();
  const auto pixels = [](const py::object& one) {
    return py::module_::import("numpy").attr("asarray")(one);
  };
  if (mode == "L" || mode == "RGB" || mode == "F") return pixels(image);
  if (mode.starts_with("I")) {  // PIL opens 16-bit PNG files as 32 bit
    const py::object whole = pixels(image);
    if (py::cast<double>(whole.attr("min")()) < 0 ||
        py::cast<double>(whole.attr("max")()) > 65535) {
      throw ContractError("pixels of the image", "beyond 16 bit", "0 to 65535");
    }
    return whole.attr("astype")("uint16");
  }
  return pixels(image.attr("convert")(mode == "1" || mode.starts_with("L") ? "L" : "RGB"));
}

/// Scales 16-bit pixels to 8 bit, as `read_image` does.
py::array scale_to_8_bit(const py::array& array) {
  const py::object wide = array.attr("astype")("uint32");
  return (wide * py::int_(255) + py::int_(32895)).attr("__rshift__")(16).attr("astype")("uint8");
}

/// Returns uint8 pixels of (rows, columns) or (rows, columns, 3).
py::array to_pixels(const py::handle& value, const char* what) {
  if (is_path(value)) return to_array(read_image(to_path(value, what)));
  if (py::isinstance<Observation>(value)) {
    const auto* const image = std::get_if<Image>(&value.cast<const Observation&>().picture);
    if (image == nullptr) throw ContractError(what, "a Panorama", "an image of the camera");
    return to_array(*image);
  }
  const bool is_pil_image = py::hasattr(value, "getbands") && py::hasattr(value, "mode");
  const py::object pixels =
      is_pil_image ? to_array_of_pil_image(value) : py::reinterpret_borrow<py::object>(value);
  if (!py::isinstance<py::array>(pixels)) {
    throw ContractError(what, type_name(value),
                        "a numpy array, a PIL image or the path of an image");
  }
  py::array array(pixels);
  const bool is_16_bit = has_dtype<std::uint16_t>(array);
  if (!has_dtype<std::uint8_t>(array) && !is_16_bit) {
    throw ContractError(std::string("dtype of ") + what, dtype_text(array),
                        "uint8, or uint16, which is scaled to 8 bit");
  }
  const auto dimensions = array.ndim();
  const bool fits =
      (dimensions == 2 ||
       (dimensions == 3 && (array.shape(2) == 1 || array.shape(2) == 3 || array.shape(2) == 4))) &&
      std::all_of(array.shape(), array.shape() + dimensions,
                  [](auto size) { return size >= 1 && size <= 1 << 24; });
  if (!fits) {
    throw ContractError(std::string("shape of ") + what, shape_text(array),
                        "(rows, columns), (rows, columns, 3), or (rows, columns, 4) with alpha, "
                        "which is ignored; no size 0");
  }
  if (dimensions == 3 && array.shape(2) != 3) {
    const py::object channels =
        array.shape(2) == 1 ? py::object(py::int_(0)) : py::object(py::slice(0, 3, 1));
    array = py::array(array[py::make_tuple(py::ellipsis(), channels)]);
  }
  return is_16_bit ? scale_to_8_bit(array) : array;
}

}  // namespace

PictureArray::PictureArray(const py::handle& value, const char* what)
    : array_(to_pixels(value, what)) {
  const auto dimensions = array_.ndim();
  const int channels = dimensions == 3 ? 3 : 1;
  const bool whole_pixels =
      array_.strides(1) == channels && (channels == 1 || array_.strides(2) == 1);
  if (!whole_pixels) array_ = py::array_t<std::uint8_t, py::array::c_style>::ensure(array_);
  view_ = {.data = static_cast<const std::uint8_t*>(array_.data()),
           .width = static_cast<int>(array_.shape(1)),
           .height = static_cast<int>(array_.shape(0)),
           .channels = channels,
           .stride = array_.strides(0)};
}

Image PictureArray::image() const {
  Image image(view_.width, view_.height, view_.channels);
  const auto bytes = static_cast<std::size_t>(view_.width) * view_.channels;
  for (int v = 0; v < view_.height; ++v) {
    std::memcpy(image.pixels().data() + v * bytes, view_.data + v * view_.stride, bytes);
  }
  return image;
}

Panorama panorama_from_array(const py::handle& value,
                             const std::optional<ElevationBand>& elevations) {
  const py::array array = require_array(value, "values");
  if (array.ndim() != 2 || array.shape(0) > 1 << 24 || array.shape(1) > 1 << 24) {
    throw ContractError("shape of values", shape_text(array), "(rows, columns)");
  }
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(array.size()));
  const auto append_values = [&](const auto& numbers, float unit) {
    for (py::ssize_t y = 0; y < numbers.shape(0); ++y) {
      for (py::ssize_t c = 0; c < numbers.shape(1); ++c) {
        values.push_back(static_cast<float>(numbers(y, c)) / unit);
      }
    }
  };
  if (has_dtype<float>(array)) {
    append_values(py::array_t<float>(array).unchecked<2>(), 1.0F);
  } else if (has_dtype<std::uint8_t>(array)) {
    append_values(py::array_t<std::uint8_t>(array).unchecked<2>(), 255.0F);
  } else {
    throw ContractError("dtype of values", dtype_text(array), "float32, or uint8 for 0 to 1");
  }
  return {static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)), elevations,
          std::move(values)};
}

template <class Value>
py::array_t<Value, py::array::c_style> require_exact_array(const py::handle& value,
                                                           const char* what,
                                                           std::vector<py::ssize_t> shape) {
  const py::array array = require_array(value, what);
  if (!has_dtype<Value>(array)) {
    throw ContractError(std::string("dtype of ") + what, dtype_text(array),
                        std::string(py::str(py::dtype::of<Value>())));
  }
  bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
  for (std::size_t i = 0; fits && i < shape.size(); ++i) {
    fits = shape[i] < 0 || array.shape(static_cast<py::ssize_t>(i)) == shape[i];
  }
  if (!fits) {
    throw ContractError(std::string("shape of ") + what, shape_text(array), shape_text(shape));
  }
  return py::array_t<Value, py::array::c_style>::ensure(array);
}
template py::array_t<std::uint8_t, py::array::c_style> require_exact_array(
    const py::handle&, const char*, std::vector<py::ssize_t>);
template py::array_t<float, py::array::c_style> require_exact_array(const py::handle&, const char*,
                                                                    std::vector<py::ssize_t>);

namespace {

/// Returns the field names of structured poses: x_m, y_m, heading_rad; stamp_s first of four.
py::list field_names(py::ssize_t columns) {
  py::list names;
  if (columns == 4) names.append("stamp_s");
  names.append("x_m");
  names.append("y_m");
  if (columns > 2) names.append("heading_rad");
  return names;
}

/// Converts structured poses to an array of columns; returns other arrays unchanged.
py::object to_unstructured_array(const py::handle& value, const char* what, py::ssize_t columns) {
  auto array = py::reinterpret_borrow<py::object>(value);
  if (!py::isinstance<py::array>(value) || array.attr("dtype").attr("names").is_none())
    return array;
  const py::list expected = field_names(columns);
  if (!py::list(array.attr("dtype").attr("names")).equal(expected)) {
    throw ContractError(std::string("fields of ") + what,
                        std::string(py::str(array.attr("dtype").attr("names"))),
                        std::string(py::str(py::tuple(expected))));
  }
  py::list fields;
  for (const auto& name : expected) fields.append(array[name]);
  return py::module_::import("numpy").attr("stack")(fields, py::arg("axis") = -1);
}

}  // namespace

py::array_t<double, py::array::c_style> to_number_rows(const py::handle& value, const char* what,
                                                       py::ssize_t columns) {
  const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(
      to_unstructured_array(value, what, columns));
  if (!numbers) {
    PyErr_Clear();
    throw ContractError(what, type_name(value), "an array of numbers");
  }
  if (numbers.ndim() != 2 || numbers.shape(1) != columns) {
    throw ContractError(std::string("shape of ") + what, shape_text(numbers),
                        shape_text({-1, columns}));
  }
  return numbers;
}

py::array_t<std::uint8_t> to_array(const Image& image) {
  std::vector<py::ssize_t> shape{image.height(), image.width()};
  if (image.channels() == 3) shape.push_back(3);
  return py::array_t<std::uint8_t>(shape, image.pixels().data());
}

py::array_t<double> to_pose_rows(std::span<const Pose2> poses) {
  py::array_t<double> rows({static_cast<py::ssize_t>(poses.size()), py::ssize_t{3}});
  auto row = rows.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    const Pose2& pose = poses[static_cast<std::size_t>(i)];
    row(i, 0) = pose.x_m;
    row(i, 1) = pose.y_m;
    row(i, 2) = pose.heading_rad;
  }
  return rows;
}

bool is_path(const py::handle& value) {
  return py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__");
}

std::filesystem::path to_path(const py::handle& value, const char* what) {
  if (!is_path(value)) throw ContractError(what, type_name(value), "a path");
  return value.cast<std::filesystem::path>();
}

Observation to_observation(const py::handle& value) {
  if (py::isinstance<Observation>(value)) return value.cast<const Observation&>();
  if (py::isinstance<Panorama>(value)) return Observation(value.cast<const Panorama&>());
  if (!is_path(value)) return Observation(PictureArray(value, "picture").image());
  const auto file = to_path(value, "picture");
  const py::gil_scoped_release free;
  Observation observation(read_image(file));
  observation.name = file.filename().string();
  observation.file = file;
  return observation;
}

void bind_arrays(py::module_& m) {
  m.def(
      "structured_poses",
      [](const py::array_t<double, py::array::c_style | py::array::forcecast>& rows) {
        if (rows.ndim() != 2 || rows.shape(1) < 2 || rows.shape(1) > 4) {
          throw ContractError("shape of rows", shape_text(rows), "(n, 2), (n, 3) or (n, 4)");
        }
        py::list fields;
        for (const auto& name : field_names(rows.shape(1))) {
          fields.append(py::make_tuple(name, "f8"));
        }
        return py::array(rows.attr("view")(fields).attr("reshape")(-1));
      },
      py::arg("rows"),
      "Converts an array of (n, 2), (n, 3) or (n, 4) to a structured array of n poses, fields x_m, "
      "y_m, heading_rad and, for 4 columns, stamp_s first; shares the memory of C-contiguous "
      "float64 arrays. Functions that take rows of poses also take such arrays.");
}

}  // namespace panonav::python
