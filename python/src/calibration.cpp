#include "bindings.hpp"
#include "panonav/camera/calibrate_dual_fisheye.hpp"
#include "panonav/camera/find_mirror.hpp"
#include "panonav/camera/mirror_camera.hpp"
#include "panonav/core/error.hpp"
#include "panonav/pipeline/orientation_check.hpp"
#include "recordings.hpp"

namespace panonav::python {

namespace {

/// Pixels of a list of images, and their views; keeps the arrays alive.
class Pictures {
 public:
  explicit Pictures(const py::iterable& pictures) {
    if (is_path(pictures)) throw ContractError("pictures", "one path", "a list of images");
    for (const py::handle& picture : pictures) arrays_.emplace_back(picture, "picture");
    for (const PictureArray& array : arrays_) views_.push_back(array.view());
  }
  [[nodiscard]] std::span<const ImageView> views() const noexcept { return views_; }

 private:
  std::vector<PictureArray> arrays_;
  std::vector<ImageView> views_;
};

std::pair<double, double> to_pair(const PixelPoint& point) {
  return {point.u_px, point.v_px};
}

CameraModel make_mirror_model(const std::string& name, const py::dict& parameters,
                              std::optional<double> rim_elevation_rad, double rim_radius_px) {
  CameraModel model = make_camera_model(name, parameters);
  if (!rim_elevation_rad) return model;
  if (const auto* hyperboloid = std::get_if<HyperboloidalModel>(&model)) {
    return fit_focal_length(*hyperboloid, rim_radius_px, *rim_elevation_rad);
  }
  if (const auto* unified = std::get_if<UnifiedModel>(&model)) {
    return fit_focal_length(*unified, rim_radius_px, *rim_elevation_rad);
  }
  throw ContractError("rim_elevation_rad", *rim_elevation_rad,
                      "None for the model '" + name + "', whose parameters say it");
}

void bind_mirrors(py::module_& m) {
  Record<MirrorCircle::Circle>(m, "FoundCircle", "A circle found in an image.")
      .field(
          "centre", [](const MirrorCircle::Circle& c) { return to_pair(c.centre); }, "(u, v)")
      .field("radius_px", &MirrorCircle::Circle::radius_px, "Radius of the circle, > 0.")
      .field("quality", &MirrorCircle::Circle::quality,
             "Part of the circumference with an edge, 0 to 1.")
      .field("residual_px", &MirrorCircle::Circle::residual_px,
             "Deviation of edge points from the circle.");
  Record<MirrorCircle>(m, "MirrorCircle", "Position of a mirror in the images of its camera.")
      .field(
          "image_size",
          [](const MirrorCircle& c) { return std::pair(c.image_size.width, c.image_size.height); },
          "(width, height)")
      .field(
          "centre", [](const MirrorCircle& c) { return to_pair(c.centre); }, "(u, v) of the rim.")
      .field("rim_radius_px", &MirrorCircle::rim_radius_px, "Radius of the mirror's rim.")
      .field("inner_radius_px", &MirrorCircle::inner_radius_px,
             "Radius of the camera's own reflection, or None.")
      .field("quality", &MirrorCircle::quality, "Part of the rim with an edge, 0 to 1.")
      .field("residual_px", &MirrorCircle::residual_px, "Deviation of edge points from the rim.")
      .field("rim_per_image", &MirrorCircle::rim_per_image,
             "Rim found in each image alone; None if it shows no rim.");
  m.def(
      "find_mirror",
      [](const py::iterable& pictures, const py::kwargs& keywords) {
        MirrorCircle::SearchOptions options;
        Keywords(keywords).options(options).finish();
        const Pictures all(pictures);
        const py::gil_scoped_release free;
        return find_mirror(all.views(), options);
      },
      py::arg("pictures"),
      append_option_list(
          "Finds the mirror in raw images of one camera, a list of arrays, PIL images or "
          "paths; more images are better. None if no rim is visible.",
          {options_of<MirrorCircle::SearchOptions>()})
          .c_str());
  m.def(
      "camera_from_mirror",
      [](const MirrorCircle& mirror, const std::string& model, const py::dict& parameters,
         std::optional<double> rim_elevation_rad, std::optional<double> inner_radius_px,
         const std::string& direction, double forward_angle_rad) {
        return camera_from_mirror(
            mirror,
            {.model = make_mirror_model(model, parameters, rim_elevation_rad, mirror.rim_radius_px),
             .inner_radius_px = inner_radius_px,
             .direction = parse_direction(direction),
             .forward_angle_rad = forward_angle_rad,
             .is_model_assumed = parameters.empty()});
      },
      py::arg("mirror"), py::arg("model") = "equiangular", py::arg("parameters") = py::dict(),
      py::kw_only(), py::arg("rim_elevation_rad") = py::none(),
      py::arg("inner_radius_px") = py::none(), py::arg("direction") = "clockwise",
      py::arg("forward_angle_rad") = 0.0,
      "Makes the camera of a mirror that `find_mirror` found. Images do not show the mirror's "
      "shape and the forward direction. `rim_elevation_rad` sets the focal length of hyperboloidal "
      "and unified mirrors. `direction`: how the image moves in a turn to the left, 'clockwise' if "
      "the camera looks up into the mirror.");
  m.def(
      "draw_mirror",
      [](const py::object& picture, const MirrorCircle& mirror,
         std::optional<double> forward_angle_rad) {
        const PictureArray pixels(picture, "picture");
        return to_array(draw_mirror(pixels.view(), mirror, forward_angle_rad));
      },
      py::arg("picture"), py::arg("mirror"), py::arg("forward_angle_rad") = py::none(),
      "Returns a colour copy with rim, inner radius, centre and forward direction drawn, to "
      "check.");
}

void bind_orientation(py::module_& m) {
  Record<OrientationCheck>(m, "OrientationCheck",
                           "What poses or odometry show of the stated orientation of images.")
      .field("columns_right", &OrientationCheck::columns_right,
             "True if columns run in the stated direction; None: nothing can be said.")
      .field("forward_right", &OrientationCheck::forward_right,
             "True if forward is where it is stated; None: nothing can be said.")
      .field(
          "forward_turn_rad",
          [](const OrientationCheck& c) { return c.fault ? c.fault->turn_rad : 0.0; },
          "Azimuth of the stated forward direction, counter-clockwise; 0 unless it is wrong.")
      .field(
          "turns", [](const OrientationCheck& c) { return c.evidence.turns(); },
          "Number of compared pairs that turn.")
      .field(
          "opposite_turns", [](const OrientationCheck& c) { return c.evidence.opposite_turns(); },
          "Number of them whose images turn in the opposite direction.")
      .field(
          "moves", [](const OrientationCheck& c) { return c.evidence.moves(); },
          "Number of compared pairs with a direction of motion.")
      .field("corrected", &OrientationCheck::corrected,
             "Corrected `PictureSource`; None without a fault, and for two lenses.")
      .field("explanation", &OrientationCheck::explanation,
             "The finding in one line; empty if nothing can be said.");
  m.def(
      "check_orientation",
      [](const py::object& recording, const std::optional<PictureSource>& source, int threads) {
        const Dataset dataset = to_dataset(recording, source);
        const py::gil_scoped_release free;
        InterruptibleExecutor executor(threads);
        return check_orientation(dataset, executor);
      },
      py::arg("recording"), py::arg("source") = py::none(), py::kw_only(), py::arg("threads") = 0,
      "Checks by poses or odometry whether the columns of the images of a recording run in the "
      "stated direction and forward is where it is stated, as `panonav calibrate --orientation`. "
      "Reads at most 240 images.");
}

}  // namespace

void bind_calibration(py::module_& m) {
  bind_mirrors(m);
  bind_orientation(m);
  Record<DualFisheyeCalibration>(m, "DualFisheyeCalibration", "Calibration of two lenses.")
      .field("camera", &DualFisheyeCalibration::camera,
             "Has the model 'dual-fisheye'; the camera was turned about its vertical.")
      .field("matches", &DualFisheyeCalibration::matches,
             "Number of matched points, without outliers.")
      .field("inlier_share", &DualFisheyeCalibration::inlier_share,
             "Share of textured points that match; about 0.1 by chance.")
      .field("residual_rad", &DualFisheyeCalibration::residual_rad,
             "Standard deviation of a match.")
      .field("azimuth_deviation_rad", &DualFisheyeCalibration::azimuth_deviation_rad,
             "Largest standard deviation of an azimuth on the horizon.")
      .field("turns_rad", &DualFisheyeCalibration::turns_rad,
             "Turn of each image since the first.");
  m.def(
      "calibrate_dual_fisheye",
      [](const py::iterable& pictures, double left_roll_rad, double right_roll_rad,
         double left_azimuth_rad, std::optional<double> field_of_view_rad,
         std::optional<double> turn_rad, const std::string& direction, int threads) {
        const DualFisheyeCalibration::Knowledge known{left_roll_rad,    right_roll_rad,
                                                      left_azimuth_rad, field_of_view_rad,
                                                      turn_rad,         parse_direction(direction)};
        const Pictures all(pictures);
        const py::gil_scoped_release free;
        InterruptibleExecutor executor(threads);
        auto answer = calibrate_dual_fisheye(all.views(), known, executor);
        if (const auto* refusal = std::get_if<std::string>(&answer)) {
          throw Error("the pictures do not determine the lenses: " + *refusal);
        }
        return std::get<DualFisheyeCalibration>(std::move(answer));
      },
      py::arg("pictures"), py::kw_only(), py::arg("left_roll_rad") = 0.0,
      py::arg("right_roll_rad") = 0.0, py::arg("left_azimuth_rad") = 0.0,
      py::arg("field_of_view_rad") = py::none(), py::arg("turn_rad") = py::none(),
      py::arg("direction") = "clockwise", py::arg("threads") = 0,
      "Finds the two lenses of a 360 degree camera in images of one place, between which it was "
      "turned about its vertical axis. Rolls: direction of the sky in each circle, within about 3 "
      "degrees. None: estimated. Raises Error with the reason if the images are not sufficient.");
}

}  // namespace panonav::python
