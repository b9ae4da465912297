#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <functional>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/image.hpp"
#include "panonav/core/options.hpp"
#include "panonav/motion/trajectory.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/pipeline/observation.hpp"

/// Shared by the sources of the Python module: conversion of arrays, options, records and errors.
/// All functions only call the library.
namespace panonav::python {

namespace py = pybind11;

// Arrays. A wrong dtype, shape or kind throws ContractError that names the argument `what`.

/// uint8 pixels of shape (rows, columns) or (rows, columns, 3), looked at in place wherever whole
/// pixels lie side by side; else copied first. Rows may lie in any order.
class PictureArray {
 public:
  PictureArray(const py::handle& array, const char* what);
  [[nodiscard]] ImageView view() const noexcept { return view_; }
  [[nodiscard]] Image image() const;

 private:
  py::array array_;
  ImageView view_;
};
/// float32, or uint8 (0 .. 255 as 0 .. 1), of shape (rows, columns) and with any strides.
[[nodiscard]] Panorama panorama_from_array(const py::handle& array,
                                           const std::optional<ElevationBand>& elevations);
/// Returns an array of exactly this dtype and shape (-1: any size): the same if it is C-contiguous,
/// else a copy that is.
template <class Value>
[[nodiscard]] py::array_t<Value, py::array::c_style> exact_array(const py::handle& array,
                                                                 const char* what,
                                                                 std::vector<py::ssize_t> shape);
/// Numbers of any type as float64 of shape (n, columns).
[[nodiscard]] py::array_t<double, py::array::c_style> number_rows(const py::handle& array,
                                                                  const char* what,
                                                                  py::ssize_t columns);
/// Makes a trajectory of rows of stamp_s, x_m, y_m, heading_rad. Throws ContractError.
[[nodiscard]] Trajectory trajectory_of(const py::array_t<double, py::array::c_style>& rows);
/// A read-only array of what `owner` holds; it keeps the owner alive.
template <class Value>
[[nodiscard]] py::array_t<Value> read_only(std::vector<py::ssize_t> shape, const Value* data,
                                           const py::handle& owner) {
  py::array_t<Value> array(std::move(shape), data, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}
[[nodiscard]] py::array_t<std::uint8_t> array_of(const Image& image);
/// (n, 3) of x_m, y_m, heading_rad.
[[nodiscard]] py::array_t<double> pose_rows(std::span<const Pose2> poses);

/// The model of that name with these parameters, all of which must be its own.
[[nodiscard]] CameraModel camera_model_from(const std::string& name, const py::dict& parameters);
[[nodiscard]] ColumnDirection direction_of(const std::string& name);

/// An `Observation`, a `Panorama`, an array of pixels, or the path of a picture.
[[nodiscard]] Observation observation_from(const py::handle& seen);

// Options.

/// Reads the keyword arguments of a call, each once; those left over are no options.
class Keywords {
 public:
  explicit Keywords(const py::kwargs& arguments);
  /// Fills the members of an options struct and checks their ranges. With a prefix "graph" a
  /// member `iterations` is the argument `graph_iterations`.
  template <class Options>
  Keywords& options(Options& values, const std::string& prefix = "") {
    apply(prefix, [&](OptionVisitor& visitor) { visit_options(values, visitor); });
    validate(values);
    return *this;
  }
  /// True if the caller passed this argument, read or not.
  [[nodiscard]] bool has(const std::string& name) const { return all_.contains(name); }
  /// Throws OptionError on arguments that were not read, with the nearest name.
  void finish() const;

 private:
  void apply(const std::string& prefix, const std::function<void(OptionVisitor&)>& visit);
  py::kwargs all_;
  py::dict unread_;
  std::vector<std::string> known_;
};

/// The options of a struct for a docstring.
struct ListedOptions {
  std::function<void(OptionVisitor&)> visit;
  std::string prefix;
};
template <class Options>
[[nodiscard]] ListedOptions options_of(std::string prefix = "") {
  return {[](OptionVisitor& visitor) {
            Options values;
            visit_options(values, visitor);
          },
          std::move(prefix)};
}
/// `text`, and a line for each option: name, type, default, range, meaning.
[[nodiscard]] std::string with_options(const std::string& text,
                                       const std::vector<ListedOptions>& listed);

// Long work.

/// Raises what a signal handler of Python asks for, such as KeyboardInterrupt; looks at most every
/// 20 ms. Called without the GIL.
void check_signals();
/// An executor whose loops end when the user interrupts. 0 threads: one for each core.
class InterruptibleExecutor {
 public:
  explicit InterruptibleExecutor(int threads) : executor_(threads, check_signals) {}
  operator Executor&() noexcept { return executor_; }  // NOLINT(google-explicit-constructor)

 private:
  Executor executor_;
};

/// A value shared by threads of Python: any number read at a time, one changes. The GIL is released
/// meanwhile, so the result of `use` must hold nothing of Python.
template <class T>
class Shared {
 public:
  template <class... Arguments>
  explicit Shared(Arguments&&... arguments) : value_(std::forward<Arguments>(arguments)...) {}
  template <class Use>
  auto read(const Use& use) const {
    const py::gil_scoped_release free;
    const std::shared_lock lock(mutex_);
    return use(value_);
  }
  template <class Use>
  auto change(const Use& use) {
    const py::gil_scoped_release free;
    const std::unique_lock lock(mutex_);
    return use(value_);
  }

 private:
  T value_;
  mutable std::shared_mutex mutex_;
};

// Records.

[[nodiscard]] py::dict record_to_dict(const py::handle& record);
[[nodiscard]] std::string record_text(const py::handle& record);

/// Binds a struct that Python only reads: its fields, `to_dict` and `repr`.
template <class T>
class Record {
 public:
  Record(py::module_& m, const char* name, const char* doc) : class_(m, name, doc) {
    class_.def("to_dict", &record_to_dict, "All fields; records within become dictionaries, too.");
    class_.def("__repr__", &record_text);
  }
  ~Record() { class_.attr("_fields") = py::tuple(names_); }
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;

  /// `member`: of the struct, or a function of it.
  template <class Member>
  Record& field(const char* name, const Member& member, const char* doc) {
    names_.append(name);
    if constexpr (std::is_member_object_pointer_v<Member>) {
      class_.def_readonly(name, member, doc);
    } else {
      class_.def_property_readonly(name, member, doc);
    }
    return *this;
  }
  [[nodiscard]] py::class_<T>& type() noexcept { return class_; }

 private:
  py::class_<T> class_;
  py::list names_;
};

}  // namespace panonav::python

namespace pybind11::detail {

/// Ids are numbers in Python.
template <class Tag>
struct type_caster<panonav::Id<Tag>> {
  PYBIND11_TYPE_CASTER(panonav::Id<Tag>, const_name("int"));
  bool load(handle source, bool convert) {
    make_caster<std::uint32_t> number;
    if (!number.load(source, convert)) return false;
    value.value = cast_op<std::uint32_t>(number);
    return true;
  }
  static handle cast(panonav::Id<Tag> id, return_value_policy /*policy*/, handle /*parent*/) {
    return PyLong_FromUnsignedLong(id.value);
  }
};

/// Structs of two numbers are tuples in Python.
template <class T, auto first, auto second>
struct PairCaster {
  using Number = std::remove_cvref_t<decltype(std::declval<T>().*first)>;
  PYBIND11_TYPE_CASTER(T, const_name("tuple[") + make_caster<Number>::name + const_name(", ") +
                              make_caster<Number>::name + const_name("]"));
  bool load(handle source, bool convert) {
    make_caster<std::pair<Number, Number>> pair;
    if (!pair.load(source, convert)) return false;
    const auto numbers = cast_op<std::pair<Number, Number>>(pair);
    value.*first = numbers.first;
    value.*second = numbers.second;
    return true;
  }
  static handle cast(const T& pair, return_value_policy /*policy*/, handle /*parent*/) {
    return make_tuple(pair.*first, pair.*second).release();
  }
};

template <>
struct type_caster<panonav::ElevationBand>
    : PairCaster<panonav::ElevationBand, &panonav::ElevationBand::bottom_rad,
                 &panonav::ElevationBand::top_rad> {};
template <>
struct type_caster<panonav::PanoramaShape>
    : PairCaster<panonav::PanoramaShape, &panonav::PanoramaShape::rows,
                 &panonav::PanoramaShape::columns> {};
template <>
struct type_caster<panonav::SignatureShape>
    : PairCaster<panonav::SignatureShape, &panonav::SignatureShape::rows,
                 &panonav::SignatureShape::components> {};
template <>
struct type_caster<panonav::Tilt>
    : PairCaster<panonav::Tilt, &panonav::Tilt::roll_rad, &panonav::Tilt::pitch_rad> {};
template <>
struct type_caster<panonav::Point2>
    : PairCaster<panonav::Point2, &panonav::Point2::x_m, &panonav::Point2::y_m> {};

}  // namespace pybind11::detail
