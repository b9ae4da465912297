#include <atomic>
#include <chrono>
#include <filesystem>

#include "bindings.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav::python {

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

py::object to_plain_value(const py::handle& value) {
  if (py::hasattr(value, "_fields")) return record_to_dict(value);
  if (!py::isinstance<py::list>(value)) return py::reinterpret_borrow<py::object>(value);
  py::list all;
  for (const auto& one : value) all.append(to_plain_value(one));
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
    return "array" + py::str(value.attr("shape")).cast<std::string>();
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
  for (const auto& name : record.attr("_fields")) all[name] = to_plain_value(record.attr(name));
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

/// Creates the exception class `name` with these bases and adds it to the module.
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
                                "Base class of all exceptions of panonav; one line says what is "
                                "wrong, where, which value was found and which are allowed.");
  // Never released, as translators may run until the interpreter ends.
  error_type = error.inc_ref().ptr();
  contract_error_type =
      make_error(m, "ContractError", py::make_tuple(error, builtin(PyExc_ValueError)),
                 "A value that a function does not accept.")
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
    } catch (const std::filesystem::filesystem_error& e) {  // such as a name of 300 characters
      const std::string line = e.path1().string() + ": cannot be used: " + e.code().message();
      PyErr_SetString(file_error_type, line.c_str());
    }
  });

  py::class_<Pose2> pose(m, "Pose2",
                         "Position and heading in the plane: x forward, y left, heading "
                         "counter-clockwise. A tuple of three numbers is accepted, too.");
  pose.def(py::init<double, double, double>(), py::arg("x_m") = 0.0, py::arg("y_m") = 0.0,
           py::arg("heading_rad") = 0.0, "Lengths in metres, heading in radians.")
      .def(py::init([](const std::tuple<double, double, double>& numbers) {
             return std::make_from_tuple<Pose2>(numbers);
           }),
           "Of (x_m, y_m, heading_rad).")
      .def_readonly("x_m", &Pose2::x_m, "Position along the frame's x axis.")
      .def_readonly("y_m", &Pose2::y_m, "Position along the frame's y axis.")
      .def_readonly("heading_rad", &Pose2::heading_rad,
                    "In [-pi, pi) for every pose that panonav makes.")
      .def(
          "inverse", [](const Pose2& p) { return inverse(p); },
          "For the pose of b in the frame of a, returns the pose of a in the frame of b.")
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
                                      "Pose of a view; the heading may be unknown (None). "
                                      "A tuple of two or three values is accepted, too.");
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
}

}  // namespace panonav::python
