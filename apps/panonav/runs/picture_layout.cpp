#include "runs/picture_layout.hpp"

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "panonav/camera/model_parameters.hpp"
#include "panonav/camera/pinhole_model.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/camera_file.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

std::optional<ElevationBand> parse_elevation_band(const PictureArguments& pictures) {
  constexpr double min_band_deg = 5.0;  // images cover more; values in radians cover less
  if (!pictures.elevation_deg) return std::nullopt;
  const auto [low, high] = *pictures.elevation_deg;
  if (low < -90.0 || high > 90.0 || high - low < min_band_deg) {
    throw UsageError("--elevation-deg is " + to_text(low) + " " + to_text(high) +
                     "; allowed: LOW HIGH in degrees, -90 <= LOW < HIGH <= 90, 5 degrees apart "
                     "or more");
  }
  return ElevationBand{radians(low), radians(high)};
}

PictureSource make_mirror_source(const PictureArguments& pictures,
                                 const std::optional<ElevationBand>& band, Session& session) {
  if (!pictures.camera) {
    throw UsageError(
        "--camera is missing: images of a mirror need a camera file (panonav calibrate)");
  }
  if (pictures.columns || pictures.forward_column) {
    throw UsageError(
        "--columns-run and --forward-column cannot be used with a mirror; the camera file contains "
        "the forward direction");
  }
  PictureSource source{.kind = PictureKind::mirror};
  auto camera = read_camera(*pictures.camera);
  if (!shows_all_azimuths(camera.camera)) {
    throw UsageError("--camera is " + *pictures.camera + ", of the model " +
                     std::string(model_name(camera.camera.model)) +
                     ", which shows a part of the azimuth; allowed: one that shows all azimuths, "
                     "or localise with --kind pinhole");
  }
  if (!camera.format.empty()) {
    session.note(*pictures.camera + ": " + camera.format +
                 " calibration; the camera is taken for a lens that looks up, with its right side "
                 "in front (otherwise: panonav calibrate " +
                 quote_for_shell(*pictures.camera) + " -o camera.toml --mount down, or mirror)");
  }
  source.camera = std::move(camera.camera);
  source.mask = std::move(camera.mask);
  source.layout.kept_elevations = band;
  return source;
}

PictureSource make_pinhole_source(const PictureArguments& pictures) {
  if (pictures.columns || pictures.forward_column || pictures.elevation_deg) {
    throw UsageError(
        "--columns-run, --forward-column and --elevation-deg cannot be used with --kind pinhole");
  }
  PictureSource source;
  source.kind = PictureKind::pinhole;
  if (pictures.camera) {
    if (pictures.field_of_view_deg) {
      throw UsageError("--field-of-view cannot be used with --camera, which contains it");
    }
    source.camera = read_camera(*pictures.camera).camera;
    if (!has_pinhole_lenses(*source.camera)) {
      throw UsageError("--camera is " + *pictures.camera + ", a camera file of the model " +
                       std::string(model_name(source.camera->model)) +
                       "; allowed with --kind pinhole: pinhole, or several cameras");
    }
  }
  if (const auto width_deg = pictures.field_of_view_deg) {
    const double width_rad = radians(*width_deg);
    if (!is_field_of_view(width_rad)) {
      throw UsageError("--field-of-view is " + to_text(*width_deg) +
                       "; allowed: 10 to 150 degrees");
    }
    source.field_of_view_rad = width_rad;
  }
  return source;
}

}  // namespace

bool states_layout(const PictureArguments& pictures) {
  return pictures.kind || pictures.camera || pictures.columns || pictures.forward_column ||
         pictures.elevation_deg || pictures.field_of_view_deg;
}

void declare_gpano(Arguments& arguments, bool& ignore_gpano) {
  arguments.flag("--ignore-gpano", ignore_gpano,
                 "Do not level 360 degree images by the pitch and roll in their GPano data, and "
                 "ignore which part of the sphere these say that they show");
  arguments.hide_from_help({"--ignore-gpano"});
}

void declare_picture_layout(Arguments& arguments, PictureArguments& pictures) {
  std::vector<std::string> kinds{"panorama", "equirectangular", "mirror"};
  std::string help = "Type of the images; not needed if a dataset.toml gives it";
  if (pictures.takes_narrow) {
    kinds.emplace_back("pinhole");
    help += "; pinhole: a phone's or forward camera's";
  }
  arguments.choice("--kind", pictures.kind, kinds, help);
  if (pictures.takes_narrow) {
    arguments.option("--field-of-view DEG", pictures.field_of_view_deg,
                     "Angle between the left and the right edge of pinhole images; by default from "
                     "--camera, or from the focal length in their EXIF data");
  }
  arguments.option("--camera FILE", pictures.camera,
                   "Calibration file of the camera: made by panonav calibrate, or of a lens that "
                   "looks up by OCamCalib, Kalibr, OpenCV, ROS or stella_vslam");
  arguments.choice("--columns-run", pictures.columns, {"clockwise", "counter-clockwise"},
                   "Direction in which the view turns from the left to the right edge of the "
                   "image, seen from above; default clockwise");
  arguments.option(
      "--forward-column", pictures.forward_column,
      "Column that shows the forward direction, as a fraction of the image width; default 0.5");
  arguments.option("--elevation-deg", pictures.elevation_deg,
                   "Elevations of the lower and upper edge of a panorama; for other images: of the "
                   "part of the image that is used; default for equirectangular: -30 40");
  arguments.hide_from_help({"--columns-run", "--forward-column"});
  declare_gpano(arguments, pictures.ignore_gpano);
}

std::optional<PictureSource> make_picture_source(const PictureArguments& pictures,
                                                 Session& session) {
  if (!states_layout(pictures)) return std::nullopt;
  const std::string kind = pictures.kind.value_or(pictures.camera              ? "mirror"
                                                  : pictures.field_of_view_deg ? "pinhole"
                                                                               : "");
  if (kind.empty()) throw UsageError("--kind is missing: panorama, equirectangular or mirror");

  if (kind == "pinhole") return make_pinhole_source(pictures);
  if (pictures.field_of_view_deg) {
    throw UsageError("--field-of-view can only be used with --kind pinhole");
  }
  const std::optional<ElevationBand> band = parse_elevation_band(pictures);
  if (kind == "mirror") return make_mirror_source(pictures, band, session);
  if (pictures.camera) throw UsageError("--camera can only be used with --kind mirror");
  PictureSource source;
  if (pictures.columns == "counter-clockwise") {
    source.layout.direction = ColumnDirection::counter_clockwise;
  }
  if (pictures.forward_column) {
    if (*pictures.forward_column < 0.0 || *pictures.forward_column > 1.0) {
      throw UsageError("--forward-column is " + to_text(*pictures.forward_column) +
                       "; allowed: 0 to 1");
    }
    source.layout.forward_column = *pictures.forward_column;
  }
  if (kind == "equirectangular") {
    source.kind = PictureKind::equirectangular;
    source.layout.elevations = ElevationBand{radians(-90.0), radians(90.0)};
    source.layout.kept_elevations = band;
  } else {
    source.layout.elevations = band;
  }
  return source;
}

}  // namespace panonav::command
