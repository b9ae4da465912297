#include "bindings.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::python {

namespace {

template <class Signature, class Value>
py::array_t<Value> make_array_view(const py::object& self, const Value* data) {
  const SignatureShape shape = [&] {
    if constexpr (std::is_same_v<Signature, PackedSignature>) {
      return self.cast<const PackedSignature&>().shape;
    } else {
      return self.cast<const FourierSignature&>().shape();
    }
  }();
  return make_read_only_array<Value>({shape.components, shape.rows}, data, self);
}

template <class Value>
std::vector<Value> to_vector(const py::array_t<Value, py::array::c_style>& array) {
  return {array.data(), array.data() + array.size()};
}

template <class Signature>
void bind_compass(py::module_& m, const char* doc) {
  m.def(
      "compass",
      [](const Signature& query, const Signature& reference, int components) {
        return compass(query, reference, components);
      },
      py::arg("query"), py::arg("reference"), py::arg("components") = 0,
      py::call_guard<py::gil_scoped_release>(), doc);
}

}  // namespace

void bind_signatures(py::module_& m) {
  // Declared first, as functions of FourierSignature return it.
  py::class_<PackedSignature> packed(
      m, "PackedSignature",
      "A signature with 8 + 8 bits per component and row. Arrays have "
      "the shape (components, rows).");
  py::class_<FourierSignature>(m, "FourierSignature",
                               "The first Fourier components of every row of a panorama. Arrays "
                               "have the shape (components, rows).")
      .def(py::init([](const py::object& magnitudes, const py::object& phases,
                       const std::optional<ElevationBand>& elevations) {
             const auto sizes = require_exact_array<float>(magnitudes, "magnitudes", {-1, -1});
             const auto angles =
                 require_exact_array<float>(phases, "phases_rad", {sizes.shape(0), sizes.shape(1)});
             return FourierSignature(
                 {static_cast<int>(sizes.shape(1)), static_cast<int>(sizes.shape(0))},
                 to_vector(sizes), to_vector(angles), elevations);
           }),
           py::arg("magnitudes"), py::arg("phases_rad"), py::arg("elevations") = py::none(),
           "float32 arrays of (components, rows): magnitudes >= 0, phases in [-pi, pi), 0 where "
           "the magnitude is 0.")
      .def_property_readonly("rows", &FourierSignature::rows,
                             "Number of rows, from the highest elevation to the lowest.")
      .def_property_readonly("components", &FourierSignature::components,
                             "Number of frequencies, from 0 on.")
      .def_property_readonly(
          "elevations", [](const FourierSignature& s) { return s.elevations(); },
          "(bottom, top) of the panorama's rows in radians; None: unknown.")
      .def_property_readonly(
          "magnitudes",
          [](const py::object& self) {
            return make_array_view<FourierSignature>(
                self, self.cast<const FourierSignature&>().magnitudes().data());
          },
          "Read-only float32 of (components, rows).")
      .def_property_readonly(
          "phases_rad",
          [](const py::object& self) {
            return make_array_view<FourierSignature>(
                self, self.cast<const FourierSignature&>().phases_rad().data());
          },
          "Read-only float32 of (components, rows), in [-pi, pi).")
      .def(
          "turned", [](const FourierSignature& s, double turn_rad) { return turn(s, turn_rad); },
          py::arg("turn_rad"), "Returns the signature after a counter-clockwise turn of the robot.")
      .def(
          "packed", [](const FourierSignature& s, float full_scale) { return pack(s, full_scale); },
          py::arg("full_scale"), "Packs it to bytes; `full_scale` is the magnitude packed as 255.")
      .def("__eq__", [](const FourierSignature& a, const FourierSignature& b) { return a == b; })
      .def("__repr__",
           [](const FourierSignature& s) {
             return "FourierSignature(" + std::to_string(s.components()) + " components, " +
                    std::to_string(s.rows()) + " rows)";
           })
      .attr("__hash__") = py::none();

  packed
      .def(py::init([](const py::object& magnitudes, const py::object& phases) {
             const auto sizes =
                 require_exact_array<std::uint8_t>(magnitudes, "magnitudes", {-1, -1});
             const auto angles = require_exact_array<std::uint8_t>(
                 phases, "phases", {sizes.shape(0), sizes.shape(1)});
             require(sizes.size() > 0, "components times rows", 0.0, ">= 1");
             return PackedSignature{
                 {static_cast<int>(sizes.shape(1)), static_cast<int>(sizes.shape(0))},
                 to_vector(sizes),
                 to_vector(angles)};
           }),
           py::arg("magnitudes"), py::arg("phases"), "uint8 arrays of (components, rows).")
      .def_property_readonly(
          "rows", [](const PackedSignature& s) { return s.shape.rows; },
          "Number of rows, from the highest elevation to the lowest.")
      .def_property_readonly(
          "components", [](const PackedSignature& s) { return s.shape.components; },
          "Number of frequencies, from 0 on.")
      .def_property_readonly(
          "magnitudes",
          [](const py::object& self) {
            return make_array_view<PackedSignature>(
                self, self.cast<const PackedSignature&>().magnitudes.data());
          },
          "Read-only uint8 of (components, rows).")
      .def_property_readonly(
          "phases",
          [](const py::object& self) {
            return make_array_view<PackedSignature>(
                self, self.cast<const PackedSignature&>().phases.data());
          },
          "Read-only uint8 of (components, rows), in steps of 2 pi / 256.")
      .def(
          "unpacked",
          [](const PackedSignature& s, float full_scale,
             const std::optional<ElevationBand>& elevations) {
            return unpack(s, full_scale, elevations);
          },
          py::arg("full_scale"), py::arg("elevations") = py::none(),
          "Converts it to real numbers; `full_scale` is the magnitude of the byte 255, > 0.")
      .def("__eq__", [](const PackedSignature& a, const PackedSignature& b) { return a == b; })
      .def("__repr__",
           [](const PackedSignature& s) {
             return "PackedSignature(" + std::to_string(s.shape.components) + " components, " +
                    std::to_string(s.shape.rows) + " rows)";
           })
      .attr("__hash__") = py::none();

  m.def(
      "compute_signature",
      [](const Panorama& panorama, int components) {
        return compute_signature(panorama, components);
      },
      py::arg("panorama"), py::arg("components") = 15, py::call_guard<py::gil_scoped_release>(),
      "Computes the first Fourier components of each row; 1 <= components <= columns / 2.");
  m.def("dissimilarity_l1", &dissimilarity_l1, py::arg("a"), py::arg("b"),
        py::arg("components") = 0, "Sum of |A^a - A^b| over rows and components; 0: all.");
  m.def("dissimilarity_l2", &dissimilarity_l2, py::arg("a"), py::arg("b"),
        py::arg("components") = 0, "Euclidean distance of the magnitudes.");
  m.def(
      "dissimilarity_weighted",
      [](const FourierSignature& a, const FourierSignature& b, const std::vector<double>& weights) {
        return dissimilarity_weighted(a, b, weights);
      },
      py::arg("a"), py::arg("b"), py::arg("weights"),
      "Sum of weight |A^a - A^b|; one weight >= 0 for each component.");
  m.def("dissimilarity_packed", &dissimilarity_packed, py::arg("a"), py::arg("b"),
        py::arg("components") = 0,
        "L1 distance of packed magnitudes, an integer, by which memories search.");
  m.def(
      "similarities",
      [](const std::vector<double>& dissimilarities) { return similarities(dissimilarities); },
      py::arg("dissimilarities"), "Rescales to 0 (largest dissimilarity) .. 1000 (smallest).");

  Record<CompassReading>(m, "CompassReading", "The relative heading of two views.")
      .field("heading_rad", &CompassReading::heading_rad,
             "Heading of the query minus that of the reference, in [-pi, pi).")
      .field("correlation", &CompassReading::correlation, "Normalised, at this heading, -1 to 1.")
      .field("distinctness", &CompassReading::distinctness,
             "0 to 1: how much the correlation exceeds its next maximum.");
  bind_compass<FourierSignature>(
      m, "Heading of `query` relative to `reference`; None when a view has no structure.");
  bind_compass<PackedSignature>(m, "Does the same with packed signatures.");
}

}  // namespace panonav::python
