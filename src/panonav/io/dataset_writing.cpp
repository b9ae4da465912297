#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/internal/csv_table.hpp"

namespace panonav {

namespace {

std::string format_table(const std::vector<DatasetEntry>& entries, const Dataset::Fields& columns) {
  std::string table = "file";
  if (columns.stamps) table += ",stamp_s";
  if (columns.positions) table += ",x_m,y_m";
  if (columns.headings) table += ",heading_deg";
  if (columns.odometry) table += ",odom_x_m,odom_y_m,odom_heading_deg";
  if (columns.tilts) table += ",roll_deg,pitch_deg";
  table += "\n";
  for (const auto& entry : entries) {
    if (entry.file.empty() || entry.file.find_first_of("\r\n") != std::string::npos) {
      throw ContractError("file", "a name that is empty or has a line break", "other names");
    }
    table += to_csv_field(entry.file);
    const auto add = [&table](double value) { table += "," + to_text(value); };
    const auto& pose = entry.pose;
    const auto& odometry = entry.odometry;
    const auto& tilt = entry.tilt;
    if (columns.stamps) add(*entry.stamp_s);
    if (columns.positions && pose) {
      add(pose->x_m);
      add(pose->y_m);
    } else if (columns.positions) {
      table += ",,";
    }
    if (columns.headings && pose && pose->heading_rad) {
      add(to_exact_degrees(*pose->heading_rad));
    } else if (columns.headings) {
      table += ",";
    }
    if (columns.odometry && odometry) {
      add(odometry->x_m);
      add(odometry->y_m);
      add(to_exact_degrees(odometry->heading_rad));
    } else if (columns.odometry) {
      table += ",,,";
    }
    if (columns.tilts && tilt) {
      add(to_exact_degrees(tilt->roll_rad));
      add(to_exact_degrees(tilt->pitch_rad));
    } else if (columns.tilts) {
      table += ",,";
    }
    table += "\n";
  }
  return table;
}

/// Returns the section [images]; writes the camera of mirror pictures to camera.toml.
std::string format_images_section(const Dataset& dataset) {
  const PictureSource& source = dataset.source;
  std::string text = "[images]\nkind = \"" + std::string(to_string(source.kind)) + "\"\n";
  std::optional<ElevationBand> band = source.layout.kept_elevations;
  if (source.kind == PictureKind::panorama) band = source.layout.elevations;
  if (source.kind == PictureKind::pinhole) {
    if (source.camera) {
      write_camera(dataset.folder / "camera.toml", {*source.camera, {}});
      text += "camera = \"camera.toml\"\n";
    } else if (source.field_of_view_rad) {
      text += "field_of_view_deg = " + to_text(to_exact_degrees(*source.field_of_view_rad)) + "\n";
    }
    return text;
  }
  if (source.kind != PictureKind::mirror) {
    text += "columns = \"" + std::string(to_string(source.layout.direction)) +
            "\"\nforward_column = " + to_text(source.layout.forward_column) + "\n";
  }
  if (band) {
    text += "elevation_deg = [" + to_text(to_exact_degrees(band->bottom_rad)) + ", " +
            to_text(to_exact_degrees(band->top_rad)) + "]\n";
  }
  if (source.kind == PictureKind::mirror) {
    require(source.camera.has_value(), "camera of mirror images", 0.0, "one camera");
    write_camera(dataset.folder / "camera.toml", {*source.camera, source.mask});
    text += "camera = \"camera.toml\"\n";
  }
  return text;
}

}  // namespace

void write_dataset(const Dataset& dataset) {
  require(!dataset.entries.empty(), "number of images", 0.0, ">= 1");
  const Dataset::Fields columns = find_known_fields(dataset);
  std::string text = format_images_section(dataset);
  const bool with_poses = columns.positions || columns.odometry;
  const std::string name = with_poses ? "poses.csv" : "images.csv";
  text += std::string("\n[") + (with_poses ? "poses" : "list") + "]\nfile = \"" + name + "\"\n";
  write_file(dataset.folder / name, format_table(dataset.entries, columns));
  write_file(dataset.folder / "dataset.toml", text);
}

}  // namespace panonav
