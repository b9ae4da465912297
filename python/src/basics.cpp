#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>

#include "bindings.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/memory/visual_memory.hpp"

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

py::array as_array(const py::handle& value, const char* what) {
  if (!py::isinstance<py::array>(value)) {
    throw ContractError(what, std::string(py::str(py::type::of(value).attr("__name__"))),
                        "a numpy array");
  }
  return py::reinterpret_borrow<py::array>(value);
}

/// In the byte order of this machine.
template <class Value>
bool has_type(const py::array& array) {
  return py::isinstance<py::array_t<Value>>(array);
}

std::string dtype_text(const py::array& array) {
  return std::string(py::str(array.dtype()));
}

}  // namespace

PictureArray::PictureArray(const py::handle& given, const char* what)
    : array_(as_array(given, what)) {
  if (!has_type<std::uint8_t>(array_)) {
    throw ContractError(std::string("dtype of ") + what, dtype_text(array_), "uint8");
  }
  const auto dimensions = array_.ndim();
  const bool fits = (dimensions == 2 || (dimensions == 3 && array_.shape(2) == 3)) &&
                    std::all_of(array_.shape(), array_.shape() + dimensions,
                                [](auto size) { return size >= 1 && size <= 1 << 24; });
  if (!fits) {
    throw ContractError(std::string("shape of ") + what, shape_text(array_),
                        "(rows, columns) or (rows, columns, 3), no size 0");
  }
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

Panorama panorama_from_array(const py::handle& given,
                             const std::optional<ElevationBand>& elevations) {
  const py::array array = as_array(given, "values");
  if (array.ndim() != 2 || array.shape(0) > 1 << 24 || array.shape(1) > 1 << 24) {
    throw ContractError("shape of values", shape_text(array), "(rows, columns)");
  }
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(array.size()));
  const auto take = [&](const auto& numbers, float unit) {
    for (py::ssize_t y = 0; y < numbers.shape(0); ++y) {
      for (py::ssize_t c = 0; c < numbers.shape(1); ++c) {
        values.push_back(static_cast<float>(numbers(y, c)) / unit);
      }
    }
  };
  if (has_type<float>(array)) {
    take(py::array_t<float>(array).unchecked<2>(), 1.0F);
  } else if (has_type<std::uint8_t>(array)) {
    take(py::array_t<std::uint8_t>(array).unchecked<2>(), 255.0F);
  } else {
    throw ContractError("dtype of values", dtype_text(array), "float32, or uint8 for 0 to 1");
  }
  return {static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)), elevations,
          std::move(values)};
}

template <class Value>
py::array_t<Value, py::array::c_style> exact_array(const py::handle& given, const char* what,
                                                   std::vector<py::ssize_t> shape) {
  const py::array array = as_array(given, what);
  if (!has_type<Value>(array)) {
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
template py::array_t<std::uint8_t, py::array::c_style> exact_array(const py::handle&, const char*,
                                                                   std::vector<py::ssize_t>);
template py::array_t<float, py::array::c_style> exact_array(const py::handle&, const char*,
                                                            std::vector<py::ssize_t>);

namespace {

/// Of structured poses, as many as columns: x_m, y_m, heading_rad, or stamp_s first.
py::list field_names(py::ssize_t columns) {
  py::list names;
  if (columns == 4) names.append("stamp_s");
  names.append("x_m");
  names.append("y_m");
  if (columns > 2) names.append("heading_rad");
  return names;
}

/// The fields of structured poses side by side; another array is handed through.
py::object without_structure(const py::handle& given, const char* what, py::ssize_t columns) {
  auto array = py::reinterpret_borrow<py::object>(given);
  if (!py::isinstance<py::array>(given) || array.attr("dtype").attr("names").is_none())
    return array;
  const py::list wanted = field_names(columns);
  if (!py::list(array.attr("dtype").attr("names")).equal(wanted)) {
    throw ContractError(std::string("fields of ") + what,
                        std::string(py::str(array.attr("dtype").attr("names"))),
                        std::string(py::str(py::tuple(wanted))));
  }
  py::list fields;
  for (const auto& name : wanted) fields.append(array[name]);
  return py::module_::import("numpy").attr("stack")(fields, py::arg("axis") = -1);
}

}  // namespace

py::array_t<double, py::array::c_style> number_rows(const py::handle& given, const char* what,
                                                    py::ssize_t columns) {
  const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(
      without_structure(given, what, columns));
  if (!numbers) {
    PyErr_Clear();
    throw ContractError(what, std::string(py::str(py::type::of(given).attr("__name__"))),
                        "an array of numbers");
  }
  if (numbers.ndim() != 2 || numbers.shape(1) != columns) {
    throw ContractError(std::string("shape of ") + what, shape_text(numbers),
                        shape_text({-1, columns}));
  }
  return numbers;
}

py::array_t<std::uint8_t> array_of(const Image& image) {
  std::vector<py::ssize_t> shape{image.height(), image.width()};
  if (image.channels() == 3) shape.push_back(3);
  return py::array_t<std::uint8_t>(shape, image.pixels().data());
}

py::array_t<double> pose_rows(std::span<const Pose2> poses) {
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

Observation observation_from(const py::handle& seen) {
  if (py::isinstance<Observation>(seen)) return seen.cast<const Observation&>();
  if (py::isinstance<Panorama>(seen)) return Observation(seen.cast<const Panorama&>());
  const bool is_path = py::isinstance<py::str>(seen) || py::hasattr(seen, "__fspath__");
  if (!is_path) return Observation(PictureArray(seen, "picture").image());
  const auto file = seen.cast<std::filesystem::path>();
  const py::gil_scoped_release free;
  Observation observation(read_image(file));
  observation.name = file.filename().string();
  observation.file = file;
  return observation;
}

namespace {

/// Takes the given values of the options that it visits.
class Taker final : public OptionVisitor {
 public:
  Taker(py::dict& given, std::vector<std::string>& known, std::string prefix)
      : given_(given), known_(known), prefix_(std::move(prefix)) {}

  void visit(const OptionInfo& info, int& value) override {
    take(info, value, "whole numbers " + describe_range(info));
  }
  void visit(const OptionInfo& info, double& value) override {
    take(info, value, "numbers " + describe_range(info));
  }
  void visit(const OptionInfo& info, bool& value) override {
    const auto [name, given] = find(info);
    if (!given) return;
    if (!py::isinstance<py::bool_>(given)) refuse(name, given, "True, False");
    value = given.cast<bool>();
  }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    const auto [name, given] = find(info);
    if (!given) return;
    std::string all;
    for (std::size_t i = 0; i < choices.size(); ++i) {
      if (py::isinstance<py::str>(given) && given.cast<std::string>() == choices[i]) {
        value = static_cast<int>(i);
        return;
      }
      all += (all.empty() ? "'" : ", '") + std::string(choices[i]) + "'";
    }
    refuse(name, given, all);
  }

 private:
  std::pair<std::string, py::object> find(const OptionInfo& info) {
    const std::string name = prefix_ + std::string(info.name);
    known_.push_back(name);
    return {name, given_.contains(name) ? given_.attr("pop")(name) : py::object()};
  }
  [[noreturn]] static void refuse(const std::string& name, const py::handle& given,
                                  const std::string& allowed) {
    throw ContractError(name, std::string(py::repr(given)), allowed);
  }
  template <class Number>
  void take(const OptionInfo& info, Number& value, const std::string& allowed) {
    const auto [name, given] = find(info);
    if (!given) return;
    py::detail::make_caster<Number> number;
    if (py::isinstance<py::bool_>(given) || !number.load(given, true)) refuse(name, given, allowed);
    value = number;
  }

  py::dict& given_;
  std::vector<std::string>& known_;
  std::string prefix_;
};

std::string joined(const std::string& prefix) {
  return prefix.empty() ? "" : prefix + "_";
}

/// A line of a docstring for each option.
class Lister final : public OptionVisitor {
 public:
  Lister(std::string& text, std::string prefix) : text_(text), prefix_(std::move(prefix)) {}
  void visit(const OptionInfo& info, int& value) override {
    list(info, "int", std::to_string(value), describe_range(info));
  }
  void visit(const OptionInfo& info, double& value) override {
    list(info, "float", to_text(value), describe_range(info));
  }
  void visit(const OptionInfo& info, bool& value) override {
    list(info, "bool", value ? "True" : "False", "");
  }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    std::string all;
    for (const auto choice : choices)
      all += (all.empty() ? "'" : ", '") + std::string(choice) + "'";
    list(info, "str", "'" + std::string(choices[static_cast<std::size_t>(value)]) + "'", all);
  }

 private:
  void list(const OptionInfo& info, const char* type, const std::string& value,
            const std::string& allowed) {
    text_ += "\n    " + prefix_ + std::string(info.name) + ": " + type + " = " + value +
             "\n        " + std::string(info.help) +
             (allowed.empty() ? "" : "; allowed: " + allowed);
  }
  std::string& text_;
  std::string prefix_;
};

}  // namespace

Keywords::Keywords(const py::kwargs& given) : all_(given), given_(given.attr("copy")()) {}

void Keywords::apply(const std::string& prefix, const std::function<void(OptionVisitor&)>& visit) {
  Taker taker(given_, known_, joined(prefix));
  visit(taker);
}

void Keywords::finish() const {
  if (given_.empty()) return;
  const auto name = py::str(given_.begin()->first);
  const auto near = py::module_::import("difflib").attr("get_close_matches")(name, known_, 1);
  std::string line = "there is no option '" + std::string(name) + "'";
  if (py::len(near) > 0) {
    line += "; did you mean '" + near.cast<py::list>()[0].cast<std::string>() + "'?";
  } else {
    std::string all;
    for (const auto& one : known_) all += (all.empty() ? "" : ", ") + one;
    line += "; allowed: " + (all.empty() ? "none" : all);
  }
  throw OptionError(line);
}

std::string with_options(const std::string& text, const std::vector<ListedOptions>& listed) {
  std::string all = text + "\n\nOptions:";
  for (const ListedOptions& options : listed) {
    Lister lister(all, joined(options.prefix));
    options.visit(lister);
  }
  return all;
}

void check_signals() {
  using Clock = std::chrono::steady_clock;
  static std::atomic<Clock::rep> last{0};
  const auto now = Clock::now().time_since_epoch();
  if (now - Clock::duration(last.load()) < std::chrono::milliseconds(20)) return;
  last = now.count();
  const py::gil_scoped_acquire held;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

namespace {

py::object plain(const py::handle& value) {
  if (py::hasattr(value, "_fields")) return record_to_dict(value);
  if (!py::isinstance<py::list>(value)) return py::reinterpret_borrow<py::object>(value);
  py::list all;
  for (const auto& one : value) all.append(plain(one));
  return all;
}

std::string short_text(const py::handle& value) {
  if (py::isinstance<py::float_>(value)) {
    return py::str("{:.6g}").format(value).cast<std::string>();
  }
  if (py::isinstance<py::list>(value) && py::len(value) > 0) {
    return "[" + std::to_string(py::len(value)) + " of them]";
  }
  if (py::isinstance<py::array>(value)) {
    return "array" + shape_text(py::reinterpret_borrow<py::array>(value));
  }
  if (py::isinstance<py::tuple>(value)) {
    std::string all;
    for (const auto& one : value) all += (all.empty() ? "" : ", ") + short_text(one);
    return "(" + all + ")";
  }
  return py::repr(value).cast<std::string>();
}

}  // namespace

py::dict record_to_dict(const py::handle& record) {
  py::dict all;
  for (const auto& name : record.attr("_fields")) all[name] = plain(record.attr(name));
  return all;
}

std::string record_text(const py::handle& record) {
  std::string text;
  for (const auto& name : record.attr("_fields")) {
    text +=
        (text.empty() ? "" : ", ") + name.cast<std::string>() + "=" + short_text(record.attr(name));
  }
  return py::type::of(record).attr("__name__").cast<std::string>() + "(" + text + ")";
}

namespace {

/// The exception class `name` of the package with these bases.
py::object make_error(py::module_& m, const char* name, const py::tuple& bases, const char* doc) {
  const std::string full = std::string("panonav.") + name;
  auto type = py::reinterpret_steal<py::object>(
      PyErr_NewExceptionWithDoc(full.c_str(), doc, bases.ptr(), nullptr));
  if (!type) throw py::error_already_set();
  m.attr(name) = type;
  return type;
}

PyObject* error_type = nullptr;
PyObject* contract_error_type = nullptr;
PyObject* option_error_type = nullptr;
PyObject* file_error_type = nullptr;

}  // namespace

void bind_basics(py::module_& m) {
  const auto builtin = [](PyObject* type) { return py::reinterpret_borrow<py::object>(type); };
  const auto error = make_error(m, "Error", py::make_tuple(builtin(PyExc_Exception)),
                                "Base of everything that panonav raises; one line says what is "
                                "wrong, where, which value was found and which are allowed.");
  // Held for ever: translators may run until the interpreter ends.
  error_type = error.inc_ref().ptr();
  contract_error_type =
      make_error(m, "ContractError", py::make_tuple(error, builtin(PyExc_ValueError)),
                 "A value that a function does not take.")
          .release()
          .ptr();
  option_error_type = make_error(m, "OptionError", py::make_tuple(error, builtin(PyExc_ValueError)),
                                 "An option that does not exist or is out of its range.")
                          .release()
                          .ptr();
  file_error_type = make_error(m, "FileError", py::make_tuple(error, builtin(PyExc_OSError)),
                               "A file is missing, unreadable, damaged, of another kind, of "
                               "another version, or cannot be written.")
                        .release()
                        .ptr();
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const FileError& e) {
      PyErr_SetString(file_error_type, e.what());
    } catch (const OptionError& e) {
      PyErr_SetString(option_error_type, e.what());
    } catch (const ContractError& e) {
      PyErr_SetString(contract_error_type, e.what());
    } catch (const Error& e) {
      PyErr_SetString(error_type, e.what());
    }
  });

  py::class_<Pose2> pose(m, "Pose2",
                         "Position and heading in the plane: x forward, y left, heading "
                         "counter-clockwise; a tuple of three numbers counts as one.");
  pose.def(py::init<double, double, double>(), py::arg("x_m") = 0.0, py::arg("y_m") = 0.0,
           py::arg("heading_rad") = 0.0, "Lengths in metres, heading in radians.")
      .def(py::init([](const std::tuple<double, double, double>& numbers) {
             return std::make_from_tuple<Pose2>(numbers);
           }),
           "Of (x_m, y_m, heading_rad).")
      .def_readonly("x_m", &Pose2::x_m, "Position along the frame's x axis.")
      .def_readonly("y_m", &Pose2::y_m, "Position along its y axis.")
      .def_readonly("heading_rad", &Pose2::heading_rad,
                    "In [-pi, pi) for every pose that panonav makes.")
      .def(
          "inverse", [](const Pose2& p) { return inverse(p); },
          "Of the pose of b in the frame of a: the pose of a in the frame of b.")
      .def("__mul__", [](const Pose2& a, const Pose2& b) { return a * b; })
      .def("__eq__", [](const Pose2& a, const Pose2& b) { return a == b; })
      .def("__iter__",
           [](const Pose2& p) { return py::iter(py::make_tuple(p.x_m, p.y_m, p.heading_rad)); })
      .def("__len__", [](const Pose2&) { return 3; })
      .def("to_dict", &record_to_dict, "All fields.")
      .def("__repr__", &record_text);
  pose.attr("_fields") = py::make_tuple("x_m", "y_m", "heading_rad");
  pose.attr("__hash__") = py::none();
  py::implicitly_convertible<py::tuple, Pose2>();
  py::implicitly_convertible<py::list, Pose2>();

  py::class_<ReferencePose> reference(m, "ReferencePose",
                                      "Where a view was taken; the heading may be unknown (None). "
                                      "A tuple of two or three values counts as one.");
  reference
      .def(py::init<double, double, std::optional<double>>(), py::arg("x_m"), py::arg("y_m"),
           py::arg("heading_rad") = py::none(), "Lengths in metres, heading in radians.")
      .def(py::init([](const std::pair<double, double>& p) {
             return ReferencePose{p.first, p.second, std::nullopt};
           }),
           "Of (x_m, y_m); the heading is unknown.")
      .def(py::init([](const std::tuple<double, double, std::optional<double>>& numbers) {
             return std::make_from_tuple<ReferencePose>(numbers);
           }),
           "Of (x_m, y_m, heading_rad).")
      .def(py::init([](const Pose2& p) {
             return ReferencePose{p.x_m, p.y_m, p.heading_rad};
           }),
           "Of a Pose2.")
      .def_readonly("x_m", &ReferencePose::x_m, "In the frame of the memory's positions.")
      .def_readonly("y_m", &ReferencePose::y_m, "In the frame of the memory's positions.")
      .def_readonly("heading_rad", &ReferencePose::heading_rad,
                    "In the same frame, in [-pi, pi); None: unknown.")
      .def("__eq__", [](const ReferencePose& a, const ReferencePose& b) { return a == b; })
      .def("to_dict", &record_to_dict, "All fields.")
      .def("__repr__", &record_text);
  reference.attr("_fields") = py::make_tuple("x_m", "y_m", "heading_rad");
  reference.attr("__hash__") = py::none();
  py::implicitly_convertible<py::tuple, ReferencePose>();
  py::implicitly_convertible<py::list, ReferencePose>();
  py::implicitly_convertible<Pose2, ReferencePose>();

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
      "An array of (n, 2), (n, 3) or (n, 4) as a structured one of n poses with the fields x_m, "
      "y_m, heading_rad and, of four, stamp_s first; it looks at the same numbers where they are "
      "float64 side by side. Functions that take rows of poses take such arrays, too.");
}

}  // namespace panonav::python
