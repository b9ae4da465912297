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

/// Conversions of arrays, options, records and errors for all sources of the Python module. The
/// bindings only call the library.
namespace panonav::python {

namespace py = pybind11;

// Arrays. A wrong dtype, shape or kind throws ContractError that names the argument `what`.

/// Pixels of an array, a PIL image, an Observation or the path of an image. Arrays are uint8 of
/// (rows, columns) or (rows, columns, 3) with any strides, and are not copied if the pixels of each
/// row are contiguous. 16-bit pixels are scaled to 8 bit, and a fourth channel is ignored, as by
/// `read_image`. Throws FileError on a file that cannot be read.
class PictureArray {
 public:
  PictureArray(const py::handle& array, const char* what);
  [[nodiscard]] ImageView view() const noexcept { return view_; }
  [[nodiscard]] Image image() const;

 private:
  py::array array_;
  ImageView view_;
};
/// Makes a panorama of an array of float32, or uint8 scaled to 0 .. 1, of shape (rows, columns)
/// with any strides.
[[nodiscard]] Panorama panorama_from_array(const py::handle& array,
                                           const std::optional<ElevationBand>& elevations);
/// Requires an array of exactly this dtype and shape (-1: any size). Returns the array if it is
/// C-contiguous, otherwise a C-contiguous copy.
template <class Value>
[[nodiscard]] py::array_t<Value, py::array::c_style> require_exact_array(
    const py::handle& array, const char* what, std::vector<py::ssize_t> shape);
/// Converts numbers of any type to float64 of shape (n, columns).
[[nodiscard]] py::array_t<double, py::array::c_style> to_number_rows(const py::handle& array,
                                                                     const char* what,
                                                                     py::ssize_t columns);
/// Makes a trajectory from rows of stamp_s, x_m, y_m, heading_rad. Throws ContractError.
[[nodiscard]] Trajectory to_trajectory(const py::array_t<double, py::array::c_style>& rows);
/// Returns a read-only array of data that `owner` holds; the array keeps the owner alive.
template <class Value>
[[nodiscard]] py::array_t<Value> make_read_only_array(std::vector<py::ssize_t> shape,
                                                      const Value* data, const py::handle& owner) {
  py::array_t<Value> array(std::move(shape), data, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}
[[nodiscard]] py::array_t<std::uint8_t> to_array(const Image& image);
/// Returns an array of (n, 3) with columns x_m, y_m, heading_rad.
[[nodiscard]] py::array_t<double> to_pose_rows(std::span<const Pose2> poses);

/// Makes the camera model of this name. Throws if it does not have one of the parameters.
[[nodiscard]] CameraModel make_camera_model(const std::string& name, const py::dict& parameters);
[[nodiscard]] ColumnDirection parse_direction(const std::string& name);

/// True for str and objects such as pathlib.Path.
[[nodiscard]] bool is_path(const py::handle& value);
/// Converts a str or an object such as pathlib.Path. Throws ContractError.
[[nodiscard]] std::filesystem::path to_path(const py::handle& value, const char* what);
/// Converts an `Observation`, a `Panorama`, or what `PictureArray` accepts.
[[nodiscard]] Observation to_observation(const py::handle& value);

// Options.

/// Reads options from the keyword arguments of a call. Arguments that nothing has read are reported
/// by `finish`.
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
  /// True if an argument was not read yet.
  [[nodiscard]] bool has_unread() const { return !unread_.empty(); }
  /// Throws OptionError, which proposes the most similar name, if an argument was not read.
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
/// Returns `text` followed by a line for each option: name, type, default, range, meaning.
[[nodiscard]] std::string append_option_list(const std::string& text,
                                             const std::vector<ListedOptions>& listed);

// Long work.

/// Throws the exception of a pending Python signal handler, such as KeyboardInterrupt. Checks at
/// most every 20 ms. Called without the GIL.
void check_signals();
/// An executor whose loops end when the user interrupts. `threads` 0: one thread per core.
class InterruptibleExecutor {
 public:
  explicit InterruptibleExecutor(int threads) : executor_(threads, check_signals) {}
  operator Executor&() noexcept { return executor_; }  // NOLINT(google-explicit-constructor)

 private:
  Executor executor_;
};

/// A value that Python threads share: several may read at the same time, or one may change it. The
/// GIL is released during the access, so `use` must not touch Python objects or return them.
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
    class_.def("to_dict", &record_to_dict,
               "Returns all fields; nested records also become dictionaries.");
    class_.def("__repr__", &record_text);
  }
  ~Record() { class_.attr("_fields") = py::tuple(names_); }
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;

  /// Adds a read-only field. `member` is a member of the struct or a function that takes it.
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

/// Converts ids to and from int in Python.
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

/// Converts structs of two numbers to and from tuples in Python.
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
