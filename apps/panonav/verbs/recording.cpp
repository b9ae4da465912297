#include "verbs/recording.hpp"

#include <filesystem>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/positions.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/motion/headed_path.hpp"

namespace panonav::command {

void declare_pictures(Arguments& arguments, PictureArguments& pictures) {
  arguments.choice("--kind", pictures.kind, {"panorama", "equirectangular", "mirror"},
                   "What the pictures show, where no dataset.toml says it");
  arguments.option("--camera", pictures.camera,
                   "Calibration of a mirror camera (panonav calibrate)");
  arguments.choice("--columns-run", pictures.columns, {"clockwise", "counter-clockwise"},
                   "How columns run, seen from above; default clockwise");
  arguments.option("--forward-column", pictures.forward_column,
                   "Fraction of the width that looks along the heading; default 0.5");
  arguments.option("--elevation-deg", pictures.elevation_deg,
                   "Lower and upper edge of a panorama, or the band to keep of other pictures");
}

std::optional<PictureSource> picture_source(const PictureArguments& pictures) {
  const bool nothing = !pictures.kind && !pictures.camera && !pictures.columns &&
                       !pictures.forward_column && !pictures.elevation_deg;
  if (nothing) return std::nullopt;
  const std::string kind = pictures.kind.value_or(pictures.camera ? "mirror" : "");
  if (kind.empty()) throw UsageError("--kind is missing: panorama, equirectangular or mirror");

  PictureSource source;
  std::optional<ElevationBand> band;
  if (pictures.elevation_deg) {
    const auto [low, high] = *pictures.elevation_deg;
    if (low < -90.0 || high > 90.0 || low >= high) {
      throw UsageError("--elevation-deg is " + to_text(low) + " " + to_text(high) +
                       "; allowed: -90 <= LOW < HIGH <= 90");
    }
    band = ElevationBand{radians(low), radians(high)};
  }
  if (kind == "mirror") {
    if (!pictures.camera) {
      throw UsageError(
          "--camera is missing: pictures of a mirror need the file that panonav "
          "calibrate writes");
    }
    if (pictures.columns || pictures.forward_column) {
      throw UsageError(
          "--columns-run and --forward-column do not go with a mirror; the camera "
          "file says where forward is");
    }
    source.kind = PictureKind::mirror;
    auto camera = read_camera(*pictures.camera);
    source.camera = std::move(camera.camera);
    source.mask = std::move(camera.mask);
    source.layout.kept_elevations = band;
    return source;
  }
  if (pictures.camera) throw UsageError("--camera goes only with --kind mirror");
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

Dataset open_recording(const std::string& input, const PictureArguments& pictures,
                       const std::optional<PictureSource>& remembered) {
  namespace fs = std::filesystem;
  const auto stated = picture_source(pictures);
  std::error_code ignored;
  if (!fs::exists(input, ignored)) throw FileError(input, "there is no such file or folder");
  if (fs::is_directory(input, ignored) && fs::exists(fs::path(input) / "dataset.toml", ignored)) {
    if (stated) {
      throw UsageError(input +
                       " has a dataset.toml, which says how its pictures lie; leave out "
                       "--kind and its companions");
    }
    return read_dataset(input);
  }
  const auto& source = stated ? stated : remembered;
  if (!source) {
    throw UsageError(input + " has no dataset.toml; say what the pictures show with --kind");
  }
  if (fs::is_directory(input, ignored)) return read_picture_folder(input, *source);
  return single_picture(input, *source);
}

std::vector<Pose2> dataset_poses(const Dataset& dataset) {
  std::vector<Pose2> poses;
  bool headings = true;
  for (const auto& entry : dataset.entries) {
    if (!entry.pose) return {};
    headings = headings && entry.pose->heading_rad;
    poses.push_back({entry.pose->x_m, entry.pose->y_m, entry.pose->heading_rad.value_or(0.0)});
  }
  if (headings || poses.size() < 2) return headings ? poses : std::vector<Pose2>{};
  return headed_along_way(positions_of(poses));
}

std::vector<Pose2> odometry_poses(const Dataset& dataset) {
  std::vector<Pose2> poses;
  for (const auto& entry : dataset.entries) {
    if (!entry.odometry) return {};
    poses.push_back(*entry.odometry);
  }
  return poses;
}

}  // namespace panonav::command
