#include "bindings.hpp"
#include "panonav/camera/camera.hpp"
#include "panonav/camera/model_parameters.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/panorama/tilt.hpp"
#include "panonav/panorama/unwarper.hpp"

namespace panonav::python {

ColumnDirection parse_direction(const std::string& name) {
  if (name == "clockwise") return ColumnDirection::clockwise;
  if (name == "counter-clockwise") return ColumnDirection::counter_clockwise;
  throw ContractError("direction", "'" + name + "'", "'clockwise', 'counter-clockwise'");
}

CameraModel make_camera_model(const std::string& name, const py::dict& parameters) {
  auto model = make_default_model(name);
  if (!model) throw ContractError("model", "'" + name + "'", "a name of `camera_models`");
  if (std::holds_alternative<RigModel>(*model)) {
    throw ContractError("model", "'rig'", "another; `make_rig` makes a rig of cameras");
  }
  py::dict unused = parameters.attr("copy")();
  visit_parameters(*model, [&](const auto& parameter, auto& value) {
    const py::str key{std::string(parameter)};
    if (!unused.contains(key)) return;
    value = unused.attr("pop")(key).template cast<std::remove_cvref_t<decltype(value)>>();
  });
  if (!unused.empty()) {
    throw ContractError("parameter", std::string(py::repr(unused.begin()->first)),
                        "those of the model '" + name + "'");
  }
  return *model;
}

namespace {

PictureKind parse_kind(const std::string& name) {
  for (std::size_t i = 0; i < picture_kind_names.size(); ++i) {
    if (name == picture_kind_names[i]) return static_cast<PictureKind>(i);
  }
  throw ContractError("kind", "'" + name + "'",
                      "'panorama', 'equirectangular', 'mirror', 'pinhole'");
}

py::dict to_parameter_dict(const CameraModel& model) {
  py::dict all;
  visit_parameters(
      model, [&](const auto& name, const auto& value) { all[py::str(std::string(name))] = value; });
  return all;
}

void bind_cameras(py::module_& m) {
  py::class_<Camera>(m, "Camera",
                     "A camera that sees all azimuths: converts between pixels and directions in "
                     "the robot frame.")
      .def(py::init([](const std::string& model, std::pair<int, int> image_size,
                       const py::dict& parameters, std::pair<double, double> centre,
                       double rim_radius_px, double inner_radius_px, const std::string& direction,
                       double forward_angle_rad, double forward_column) {
             Camera camera{.model = make_camera_model(model, parameters),
                           .image_size = {image_size.first, image_size.second},
                           .centre = {centre.first, centre.second},
                           .rim_radius_px = rim_radius_px,
                           .inner_radius_px = inner_radius_px,
                           .direction = parse_direction(direction),
                           .forward_angle_rad = forward_angle_rad,
                           .forward_column = forward_column};
             validate(camera);
             return camera;
           }),
           py::arg("model"), py::arg("image_size"), py::arg("parameters") = py::dict(),
           py::kw_only(), py::arg("centre") = std::pair(0.0, 0.0), py::arg("rim_radius_px") = 0.0,
           py::arg("inner_radius_px") = 0.0, py::arg("direction") = "clockwise",
           py::arg("forward_angle_rad") = 0.0, py::arg("forward_column") = 0.5,
           "`model`: one of `camera_models`; `parameters`: a dictionary, with names as in a "
           "camera file; `image_size`: (width, height). Centre and radii in pixels are "
           "those of a mirror.")
      .def_property_readonly(
          "model", [](const Camera& c) { return model_name(c.model); }, "One of `camera_models`.")
      .def_property_readonly(
          "parameters", [](const Camera& c) { return to_parameter_dict(c.model); },
          "Parameters of the model: a dictionary, with names as in a camera file.")
      .def_property_readonly(
          "image_size",
          [](const Camera& c) { return std::pair(c.image_size.width, c.image_size.height); },
          "(width, height) of every picture of this camera.")
      .def_property_readonly(
          "centre", [](const Camera& c) { return std::pair(c.centre.u_px, c.centre.v_px); },
          "(u, v) of the mirror in pixels.")
      .def_readonly("rim_radius_px", &Camera::rim_radius_px, "Outer radius of the mirror.")
      .def_readonly("inner_radius_px", &Camera::inner_radius_px,
                    "Radius of the camera's reflection in the mirror.")
      .def_property_readonly(
          "direction", [](const Camera& c) { return to_string(c.direction); },
          "Direction of increasing azimuth in the image: 'clockwise' or 'counter-clockwise'.")
      .def_readonly("forward_angle_rad", &Camera::forward_angle_rad,
                    "Mirror: image angle of forward, counter-clockwise from the right.")
      .def_readonly("has_assumed_elevations", &Camera::has_assumed_elevations,
                    "True if the shape of the mirror was assumed: no lengths from the ground.")
      .def_readonly("forward_column", &Camera::forward_column,
                    "Equirectangular: column of the forward direction, as a fraction of the width.")
      .def_property_readonly(
          "visible_elevations", [](const Camera& c) { return visible_elevations(c); },
          "(lowest, highest) elevation in radians that is visible at every azimuth.")
      .def(
          "project",
          [](const Camera& camera, const std::tuple<double, double, double>& direction) {
            const auto pixel = project(camera, std::make_from_tuple<Direction3>(direction));
            return pixel ? std::optional(std::pair(pixel->u_px, pixel->v_px)) : std::nullopt;
          },
          py::arg("direction"),
          "Returns the pixel (u, v) of a direction (x, y, z) of the robot frame; None if the "
          "camera does not see it.")
      .def(
          "unproject",
          [](const Camera& camera, std::pair<double, double> pixel) {
            const auto d = unproject(camera, {pixel.first, pixel.second});
            return d ? std::optional(std::tuple(d->x, d->y, d->z)) : std::nullopt;
          },
          py::arg("pixel"), "Returns the unit direction (x, y, z) of a pixel (u, v), or None.")
      .def("__eq__", [](const Camera& a, const Camera& b) { return a == b; })
      .def("__repr__",
           [](const Camera& c) {
             return "Camera('" + std::string(model_name(c.model)) + "', (" +
                    std::to_string(c.image_size.width) + ", " +
                    std::to_string(c.image_size.height) + "))";
           })
      .attr("__hash__") = py::none();
  m.def(
      "make_rig", &make_rig, py::arg("cameras"),
      "Makes the camera of a rig of pinhole cameras. Its pictures are theirs side by side, in the "
      "order of the list, which `join_pictures` makes.");
  m.def(
      "join_pictures",
      [](const Camera& rig, const std::vector<py::object>& pictures) {
        const auto* const model = std::get_if<RigModel>(&rig.model);
        if (model == nullptr) throw ContractError("model", model_name(rig.model), "rig");
        std::vector<Image> images;
        std::vector<ImageView> views;
        for (const py::object& picture : pictures) {
          images.push_back(PictureArray(picture, "pictures").image());
        }
        for (const Image& image : images) views.push_back(image.view());
        return to_array(join_pictures(*model, views));
      },
      py::arg("rig"), py::arg("pictures"),
      "Joins pictures (uint8 arrays) that the cameras of a rig took at the same time.");
  m.attr("camera_models") = py::tuple(
      py::cast(std::vector<std::string>(camera_model_names.begin(), camera_model_names.end())));
  m.def(
      "read_camera", [](const std::filesystem::path& path) { return read_camera(path).camera; },
      py::arg("path"), "Reads a camera file (camera.toml). Raises FileError.");
  m.def(
      "write_camera",
      [](const std::filesystem::path& path, const Camera& camera, const py::object& mask) {
        CameraFile file{camera, std::nullopt};
        if (!mask.is_none()) file.mask = PictureArray(mask, "mask").image();
        write_camera(path, file);
      },
      py::arg("path"), py::arg("camera"), py::arg("mask") = py::none(),
      "Writes a camera file atomically; a mask (uint8, 0 where the robot itself is visible) "
      "is written next to it.");

  py::class_<Unwarper>(m, "Unwarper",
                       "Converts images of one camera to panoramas with a table that is "
                       "computed once. Several threads may use it at the same time.")
      .def(py::init([](const Camera& camera, const std::optional<ElevationBand>& elevations,
                       const py::kwargs& keywords) {
             UnwarperOptions options;
             Keywords(keywords).options(options).finish();
             options.elevations = elevations;
             const py::gil_scoped_release free;
             return std::make_unique<Unwarper>(camera, options);
           }),
           py::arg("camera"), py::arg("elevations") = py::none(),
           append_option_list(
               "`elevations`: the band (bottom, top) in radians; None: all that the camera "
               "sees at every azimuth.",
               {options_of<UnwarperOptions>()})
               .c_str())
      .def_property_readonly("rows", &Unwarper::rows, "Rows of its panoramas.")
      .def_property_readonly("columns", &Unwarper::columns, "Columns of its panoramas.")
      .def_property_readonly("elevations", &Unwarper::elevations,
                             "(bottom, top) of its panoramas in radians.")
      .def(
          "unwrap",
          [](const Unwarper& unwarper, const py::object& picture) {
            const PictureArray pixels(picture, "picture");
            const py::gil_scoped_release free;
            return unwarper.unwrap(pixels.view());
          },
          py::arg("picture"),
          "The panorama of an image: an array, a PIL image or the path of a file.");
}

}  // namespace

void bind_panoramas(py::module_& m) {
  py::class_<Panorama>(m, "Panorama",
                       "A panorama of float32: row 0 is the highest elevation, column c "
                       "has azimuth 2 pi c / columns, counter-clockwise, 0 forward.")
      .def(py::init(&panorama_from_array), py::arg("values"), py::arg("elevations") = py::none(),
           "`values`: float32, or uint8 for 0 to 1, of (rows, columns), with any strides; copied. "
           "`elevations`: (bottom, top) of the band in radians; None: unknown.")
      .def_property_readonly("rows", &Panorama::rows,
                             "Values of a column, from the highest elevation to the lowest.")
      .def_property_readonly("columns", &Panorama::columns,
                             "Values of a row: azimuths of a full turn.")
      .def_property_readonly(
          "elevations", [](const Panorama& p) { return p.elevations(); },
          "(bottom, top) in radians, or None.")
      .def_property_readonly(
          "values",
          [](const py::object& self) {
            const auto& p = self.cast<const Panorama&>();
            return make_read_only_array<float>({p.rows(), p.columns()}, p.values().data(), self);
          },
          "Read-only array of (rows, columns) that shares the panorama's memory.")
      .def(
          "__array__",
          [](const py::object& self, const py::object& dtype) -> py::object {
            py::object values = self.attr("values");
            return dtype.is_none() ? values : values.attr("astype")(dtype);
          },
          py::arg("dtype") = py::none())
      .def(
          "turned", [](const Panorama& p, int columns) { return rotate_columns(p, columns); },
          py::arg("columns"),
          "The view after a rotation of the robot by this many columns, counter-clockwise.")
      .def(
          "to_picture", [](const Panorama& p) { return to_array(to_picture(p)); },
          "Returns an image to show: uint8, clockwise, forward in the middle.")
      .def("__eq__", [](const Panorama& a, const Panorama& b) { return a == b; })
      .def("__repr__",
           [](const Panorama& p) {
             return "Panorama(" + std::to_string(p.rows()) + " rows, " +
                    std::to_string(p.columns()) + " columns" +
                    (p.elevations() ? "" : ", elevations unknown") + ")";
           })
      .attr("__hash__") = py::none();
  m.def(
      "level_panorama",
      [](const Panorama& panorama, const Tilt& tilt) { return level_panorama(panorama, tilt); },
      py::arg("panorama"), py::arg("tilt"), py::call_guard<py::gil_scoped_release>(),
      "Removes the tilt of the robot from a panorama; `tilt` is (roll, pitch) in radians.");
  m.def(
      "preprocess",
      [](const Panorama& panorama, const py::kwargs& keywords) {
        PreprocessingOptions options;
        Keywords(keywords).options(options).finish();
        const py::gil_scoped_release free;
        return preprocess(panorama, options);
      },
      py::arg("panorama"),
      append_option_list("Processes a panorama before its signature is computed.",
                         {options_of<PreprocessingOptions>()})
          .c_str());

  bind_cameras(m);
  py::class_<PictureSource>(m, "PictureSource",
                            "Image layout: how images are converted to panoramas.")
      .def(py::init([](const std::string& kind, const std::optional<ElevationBand>& elevations,
                       const std::optional<ElevationBand>& kept_elevations,
                       const std::string& direction, double forward_column,
                       const std::optional<Camera>& camera, const py::object& mask,
                       std::optional<double> field_of_view_rad) {
             PictureSource source{.kind = parse_kind(kind),
                                  .layout = {.direction = parse_direction(direction),
                                             .forward_column = forward_column,
                                             .elevations = elevations,
                                             .kept_elevations = kept_elevations},
                                  .camera = camera,
                                  .mask = std::nullopt};
             if (field_of_view_rad && source.kind != PictureKind::pinhole) {
               throw ContractError("field_of_view_rad", *field_of_view_rad,
                                   "None, except with the kind 'pinhole'");
             }
             source.field_of_view_rad = field_of_view_rad;
             if (!mask.is_none()) source.mask = PictureArray(mask, "mask").image();
             return source;
           }),
           py::arg("kind") = "panorama", py::kw_only(), py::arg("elevations") = py::none(),
           py::arg("kept_elevations") = py::none(), py::arg("direction") = "clockwise",
           py::arg("forward_column") = 0.5, py::arg("camera") = py::none(),
           py::arg("mask") = py::none(), py::arg("field_of_view_rad") = py::none(),
           "`kind`: 'panorama', 'equirectangular', 'mirror' (which needs `camera`) or 'pinhole' (a "
           "narrow picture, such as a phone's, to be localised; needs `camera`, "
           "`field_of_view_rad` from edge to edge, or EXIF data). Bands are "
           "(bottom, top) in radians: of the image's edges, and of the part to keep. `direction`: "
           "how columns run, 'clockwise' or 'counter-clockwise'. `mask`: uint8, 0 where the robot "
           "itself is seen.")
      .def_property_readonly(
          "kind", [](const PictureSource& s) { return to_string(s.kind); },
          "'panorama', 'equirectangular', 'mirror' or 'pinhole'.")
      .def_property_readonly(
          "elevations", [](const PictureSource& s) { return s.layout.elevations; },
          "(bottom, top) of the picture's edges in radians; None: unknown.")
      .def_property_readonly(
          "kept_elevations", [](const PictureSource& s) { return s.layout.kept_elevations; },
          "(bottom, top) of the part to keep in radians; None: all, but of 'equirectangular' "
          "images -30 to 40 degrees.")
      .def_property_readonly(
          "direction", [](const PictureSource& s) { return to_string(s.layout.direction); },
          "How columns run from left to right, seen from above: 'clockwise' or "
          "'counter-clockwise'.")
      .def_property_readonly(
          "forward_column", [](const PictureSource& s) { return s.layout.forward_column; },
          "Column of the forward direction, as a fraction of the width.")
      .def_readonly("camera", &PictureSource::camera, "For 'mirror' and 'pinhole', otherwise None.")
      .def_readonly("field_of_view_rad", &PictureSource::field_of_view_rad,
                    "Of 'pinhole' images without a camera; None: from their EXIF data.")
      .def("__eq__", [](const PictureSource& a, const PictureSource& b) { return a == b; })
      .def("__repr__",
           [](const PictureSource& s) {
             return "PictureSource('" + std::string(to_string(s.kind)) + "')";
           })
      .attr("__hash__") = py::none();
  py::class_<PanoramaReader>(m, "PanoramaReader",
                             "Converts images of one source to panoramas of one shape. Several "
                             "threads may use it at the same time.")
      .def(py::init([](const PictureSource& source, const PanoramaShape& shape) {
             return PanoramaReader(source, shape);
           }),
           py::arg("source"), py::arg("shape") = PanoramaShape{},
           py::call_guard<py::gil_scoped_release>(),
           "`shape`: (rows, columns); 0: that of the images, or 80 x 512 for mirror images.")
      .def(
          "convert",
          [](const PanoramaReader& reader, const py::object& picture, const Tilt& tilt) {
            const PictureArray pixels(picture, "picture");
            const py::gil_scoped_release free;
            return reader.convert(pixels.view(), tilt);
          },
          py::arg("picture"), py::arg("tilt") = Tilt{},
          "Returns the panorama of an image; with a tilt (roll, pitch) as a level robot would have "
          "taken it.")
      .def("read", &PanoramaReader::read, py::arg("path"), py::call_guard<py::gil_scoped_release>(),
           "Reads a PNG or JPEG file and converts it.");
}

}  // namespace panonav::python
