#include "bindings.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::python {

namespace {

template <class Signature, class Value>
py::array_t<Value> looked_at(const py::object& self, const Value* data) {
  const SignatureShape shape = [&] {
    if constexpr (std::is_same_v<Signature, PackedSignature>) {
      return self.cast<const PackedSignature&>().shape;
    } else {
      return self.cast<const FourierSignature&>().shape();
    }
  }();
  return read_only<Value>({shape.components, shape.rows}, data, self);
}

template <class Value>
std::vector<Value> values_of(const py::array_t<Value, py::array::c_style>& array) {
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
  // Named by what the other class gives.
  py::class_<PackedSignature> packed(
      m, "PackedSignature",
      "A signature in 8 + 8 bit for each component and row. Arrays have "
      "the shape (components, rows).");
  py::class_<FourierSignature>(m, "FourierSignature",
                               "The first Fourier components of every row of a panorama. Arrays "
                               "have the shape (components, rows).")
      .def(py::init([](const py::object& magnitudes, const py::object& phases,
                       const std::optional<ElevationBand>& elevations) {
             const auto sizes = exact_array<float>(magnitudes, "magnitudes", {-1, -1});
             const auto angles =
                 exact_array<float>(phases, "phases_rad", {sizes.shape(0), sizes.shape(1)});
             return FourierSignature(
                 {static_cast<int>(sizes.shape(1)), static_cast<int>(sizes.shape(0))},
                 values_of(sizes), values_of(angles), elevations);
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
            return looked_at<FourierSignature>(
                self, self.cast<const FourierSignature&>().magnitudes().data());
          },
          "Read-only float32 of (components, rows).")
      .def_property_readonly(
          "phases_rad",
          [](const py::object& self) {
            return looked_at<FourierSignature>(
                self, self.cast<const FourierSignature&>().phases_rad().data());
          },
          "Read-only float32 of (components, rows), in [-pi, pi).")
      .def(
          "turned", [](const FourierSignature& s, double turn_rad) { return turn(s, turn_rad); },
          py::arg("turn_rad"), "Of the same view after the robot turned counter-clockwise.")
      .def(
          "packed", [](const FourierSignature& s, float full_scale) { return pack(s, full_scale); },
          py::arg("full_scale"), "In 8 + 8 bit; `full_scale` is the magnitude that becomes 255.")
      .def("__eq__", [](const FourierSignature& a, const FourierSignature& b) { return a == b; })
      .def("__repr__",
           [](const FourierSignature& s) {
             return "FourierSignature(" + std::to_string(s.components()) + " components, " +
                    std::to_string(s.rows()) + " rows)";
           })
      .attr("__hash__") = py::none();

  packed
      .def(py::init([](const py::object& magnitudes, const py::object& phases) {
             const auto sizes = exact_array<std::uint8_t>(magnitudes, "magnitudes", {-1, -1});
             const auto angles =
                 exact_array<std::uint8_t>(phases, "phases", {sizes.shape(0), sizes.shape(1)});
             require(sizes.size() > 0, "components times rows", 0.0, ">= 1");
             return PackedSignature{
                 {static_cast<int>(sizes.shape(1)), static_cast<int>(sizes.shape(0))},
                 values_of(sizes),
                 values_of(angles)};
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
            return looked_at<PackedSignature>(
                self, self.cast<const PackedSignature&>().magnitudes.data());
          },
          "Read-only uint8 of (components, rows).")
      .def_property_readonly(
          "phases",
          [](const py::object& self) {
            return looked_at<PackedSignature>(self,
                                              self.cast<const PackedSignature&>().phases.data());
          },
          "Read-only uint8 of (components, rows), in steps of 2 pi / 256.")
      .def(
          "unpacked",
          [](const PackedSignature& s, float full_scale,
             const std::optional<ElevationBand>& elevations) {
            return unpack(s, full_scale, elevations);
          },
          py::arg("full_scale"), py::arg("elevations") = py::none(),
          "With magnitudes and phases as real numbers; `full_scale` is what 255 stands for, > 0.")
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
      "The first Fourier components of every row; 1 <= components <= columns / 2.");
  m.def("dissimilarity_l1", &dissimilarity_l1, py::arg("a"), py::arg("b"),
        py::arg("components") = 0, "Sum of |A^a - A^b| over rows and components; 0: all.");
  m.def("dissimilarity_l2", &dissimilarity_l2, py::arg("a"), py::arg("b"),
        py::arg("components") = 0, "Square root of the sum of squares.");
  m.def(
      "dissimilarity_weighted",
      [](const FourierSignature& a, const FourierSignature& b, const std::vector<double>& weights) {
        return dissimilarity_weighted(a, b, weights);
      },
      py::arg("a"), py::arg("b"), py::arg("weights"),
      "Sum of weight |A^a - A^b|; one weight >= 0 for each component.");
  m.def("dissimilarity_packed", &dissimilarity_packed, py::arg("a"), py::arg("b"),
        py::arg("components") = 0,
        "The exact integer L1 of packed magnitudes; the measure of a memory.");
  m.def(
      "similarities",
      [](const std::vector<double>& dissimilarities) { return similarities(dissimilarities); },
      py::arg("dissimilarities"), "Rescaled to 0 (the largest) .. 1000 (the smallest).");

  Record<CompassReading>(m, "CompassReading", "The relative heading of two views.")
      .field("heading_rad", &CompassReading::heading_rad,
             "Heading of the query minus that of the reference, in [-pi, pi).")
      .field("correlation", &CompassReading::correlation, "Normalised, at this heading; -1 to 1.")
      .field("distinctness", &CompassReading::distinctness,
             "0 to 1: how far the correlation stands above its next maximum.");
  bind_compass<FourierSignature>(
      m, "Heading of `query` relative to `reference`; None when a view has no structure.");
  bind_compass<PackedSignature>(m, "The same from packed signatures.");
}

}  // namespace panonav::python
