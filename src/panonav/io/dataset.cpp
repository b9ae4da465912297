#include "panonav/io/dataset.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_set>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/dataset_readers.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/internal/csv_table.hpp"
#include "panonav/io/internal/toml_fields.hpp"
#include "panonav/io/media_kind.hpp"
#include "panonav/io/rig_pictures.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 10> column_names{
    "file",     "stamp_s",          "x_m",      "y_m",      "heading_deg", "odom_x_m",
    "odom_y_m", "odom_heading_deg", "roll_deg", "pitch_deg"};

ElevationBand to_elevation_band(TomlFields& fields, const std::vector<double>& values) {
  const bool fits =
      values.size() == 2 && values[0] >= -90.0 && values[1] <= 90.0 && values[0] < values[1];
  if (!fits) {
    std::string found = "[";
    for (std::size_t i = 0; i < values.size(); ++i)
      found += (i > 0 ? ", " : "") + to_text(values[i]);
    fields.fail("elevation_deg", found + "]", "[bottom, top] with -90 <= bottom < top <= 90");
  }
  return {radians(values[0]), radians(values[1])};
}

/// Reads the lens of narrow pictures: a camera file, a field of view, or neither (EXIF data).
PictureSource read_pinhole_source(TomlFields& images, const fs::path& folder) {
  PictureSource source;
  source.kind = PictureKind::pinhole;
  if (const auto file = images.text("camera")) {
    source.camera = read_camera(folder / *file).camera;
    if (!has_pinhole_lenses(*source.camera)) {
      images.fail("camera", "\"" + *file + "\"",
                  "a camera file of the model pinhole, or of several such cameras");
    }
    return source;
  }
  if (const auto degrees_wide = images.number("field_of_view_deg")) {
    const double width_rad = radians(*degrees_wide);
    if (!is_field_of_view(width_rad)) {
      images.fail("field_of_view_deg", to_text(*degrees_wide), "10 .. 150");
    }
    source.field_of_view_rad = width_rad;
  }
  return source;
}

PictureSource read_source(TomlFields& images, const fs::path& folder) {
  PictureSource source;
  const auto kind = images.choice("kind", picture_kind_names);
  if (!kind) {
    images.fail("kind", "missing", "\"panorama\", \"equirectangular\", \"mirror\", \"pinhole\"");
  }
  source.kind = static_cast<PictureKind>(*kind);
  if (source.kind == PictureKind::pinhole) return read_pinhole_source(images, folder);
  std::optional<ElevationBand> band;
  if (const auto values = images.numbers("elevation_deg"))
    band = to_elevation_band(images, *values);
  if (source.kind == PictureKind::mirror) {
    const std::string file = images.required_text("camera", "the name of a camera file");
    CameraFile camera = read_camera(folder / file);
    if (!shows_all_azimuths(camera.camera)) {
      images.fail("camera", "\"" + file + "\", which shows a part of the azimuth",
                  "a camera that shows all azimuths, or kind = \"pinhole\"");
    }
    source.camera = std::move(camera.camera);
    source.mask = std::move(camera.mask);
    source.layout.kept_elevations = band;
    return source;
  }
  if (const auto direction = images.choice("columns", column_direction_names)) {
    source.layout.direction =
        *direction == 0 ? ColumnDirection::clockwise : ColumnDirection::counter_clockwise;
  }
  if (const auto forward = images.number("forward_column")) {
    if (*forward < 0.0 || *forward > 1.0)
      images.fail("forward_column", to_text(*forward), "0 .. 1");
    source.layout.forward_column = *forward;
  }
  if (source.kind == PictureKind::panorama) {
    source.layout.elevations = band;
  } else {
    source.layout.elevations = ElevationBand{radians(-90.0), radians(90.0)};
    source.layout.kept_elevations = band;
  }
  return source;
}

// Data sets may come from strangers, so their tables may only name files in their own folder.
bool is_inside_folder(const std::string& name) {
  const fs::path path(name);
  return path.is_relative() && *path.lexically_normal().begin() != "..";
}

/// Sets name and path of an entry whose picture a table names, with escapes or by its bytes. Throws
/// FileError if there is no such file.
void set_picture(DatasetEntry& entry, const fs::path& table, const fs::path& folder,
                 const std::string& name) {
  std::error_code error;
  entry.file = is_utf8(name) ? name : escape_name(name);
  entry.path = folder / unescape_name(name);
  if (fs::is_regular_file(entry.path, error)) return;
  entry.file = escape_name(name);
  entry.path = folder / name;
  if (fs::is_regular_file(entry.path, error)) return;
  throw FileError(table.string(),
                  "file is '" + entry.file +
                      "', which does not exist; allowed: an image in the data set's folder");
}

// True if all of these columns exist, false if none do; throws FileError if only some do.
bool has_all_or_none(const CsvTable& table, const fs::path& path,
                     std::initializer_list<std::string_view> names) {
  std::size_t found = 0;
  std::string_view missing;
  for (const auto name : names) {
    if (table.has(name)) {
      ++found;
    } else {
      missing = name;
    }
  }
  if (found != 0 && found != names.size()) {
    throw FileError(path.string(),
                    "has no column '" + std::string(missing) +
                        "', which belongs to the others; allowed: all of them or none");
  }
  return found == names.size();
}

/// False if all of these fields of a row are empty: their value is not known for this image.
bool is_known(const CsvTable& table, std::size_t row,
              std::initializer_list<std::string_view> columns) {
  return !std::ranges::all_of(columns,
                              [&](auto column) { return table.text(row, column).empty(); });
}

void check_columns(const CsvTable& table, const fs::path& path) {
  for (const auto& column : table.columns()) {
    if (std::find(column_names.begin(), column_names.end(), column) == column_names.end()) {
      std::string known;
      for (const auto name : column_names) known += (known.empty() ? "" : ", ") + std::string(name);
      throw FileError(path.string(), "the column '" + column + "' is not known; known: " + known);
    }
  }
  if (!table.has("file")) throw FileError(path.string(), "has no column 'file'");
}

std::vector<DatasetEntry> read_entries(const fs::path& folder, const fs::path& path,
                                       bool needs_positions) {
  const CsvTable table = CsvTable::read(path);
  check_columns(table, path);
  const bool has_position = has_all_or_none(table, path, {"x_m", "y_m"});
  const bool has_odometry =
      has_all_or_none(table, path, {"odom_x_m", "odom_y_m", "odom_heading_deg"});
  const bool has_tilt = has_all_or_none(table, path, {"roll_deg", "pitch_deg"});
  if (table.has("heading_deg") && !has_position) {
    throw FileError(path.string(), "has a column 'heading_deg' but no 'x_m' and 'y_m'");
  }
  if (needs_positions && !has_position && !has_odometry) {
    throw FileError(path.string(),
                    "has no columns 'x_m' and 'y_m'; a table without positions is named by [list]");
  }
  if (table.rows() == 0) throw FileError(path.string(), "names no image; allowed: one or more");
  std::vector<DatasetEntry> entries;
  std::unordered_set<std::string> seen;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    DatasetEntry entry;
    const std::string& name = table.text(row, "file");
    if (name.empty()) table.fail(row, "file", "empty", "an image in the data set's folder");
    if (!is_inside_folder(unescape_name(name)) || !is_inside_folder(name)) {
      table.fail(row, "file", "'" + name + "'", "an image in the data set's folder");
    }
    set_picture(entry, path, folder, name);
    if (!seen.insert(entry.file).second) {
      table.fail(row, "file", "'" + entry.file + "' for the second time", "each image once");
    }
    if (table.has("stamp_s")) entry.stamp_s = table.number(row, "stamp_s");
    if (has_position && is_known(table, row, {"x_m", "y_m"})) {
      entry.pose =
          ReferencePose{table.position(row, "x_m"), table.position(row, "y_m"), std::nullopt};
      if (table.has("heading_deg") && is_known(table, row, {"heading_deg"})) {
        entry.pose->heading_rad = wrap_angle(radians(table.number(row, "heading_deg")));
      }
    }
    if (has_odometry && is_known(table, row, {"odom_x_m", "odom_y_m", "odom_heading_deg"})) {
      entry.odometry = Pose2{table.position(row, "odom_x_m"), table.position(row, "odom_y_m"),
                             wrap_angle(radians(table.number(row, "odom_heading_deg")))};
    }
    if (has_tilt && is_known(table, row, {"roll_deg", "pitch_deg"})) {
      const auto angle_rad = [&](std::string_view column) {
        const double angle = radians(table.number(row, column));
        if (!(std::abs(angle) <= max_tilt_rad))
          table.fail(row, column, table.text(row, column), "-30 to 30");
        return angle;
      };
      entry.tilt = Tilt{angle_rad("roll_deg"), angle_rad("pitch_deg")};
    }
    entries.push_back(std::move(entry));
  }
  set_foreign_picture_stores(entries);
  return entries;
}

Dataset find_pictures(const fs::path& folder, PictureSource source, bool is_recursive) {
  Dataset dataset{folder, std::move(source), {}, {}};
  std::error_code error;
  std::vector<std::string> names;
  const bool with_foreign = can_read_foreign_pictures();
  const auto is_readable = [&](const fs::path& path) {
    return is_folder_picture(path) || (with_foreign && !is_hidden(path) &&
                                       identify_media_file(path) == MediaKind::foreign_picture);
  };
  fs::recursive_directory_iterator file(folder, error);
  for (; !error && file != fs::recursive_directory_iterator(); file.increment(error)) {
    std::error_code unknown;
    const std::string name = file->path().lexically_relative(folder).string();
    const bool is_folder = file->is_directory(unknown) && !file->is_symlink(unknown);
    if (file->is_regular_file(unknown) && is_readable(file->path())) {
      names.push_back(name);
    } else if (!is_folder) {
      dataset.left_out.push_back(escape_name(name));
    } else if (!is_recursive || is_hidden(file->path())) {
      dataset.left_out.push_back(escape_name(name) + "/");
      file.disable_recursion_pending();
    }
  }
  if (error) throw FileError(folder.string(), "cannot be read: " + error.message());
  std::ranges::sort(dataset.left_out, is_naturally_less);
  if (names.empty())
    throw FileError(folder.string(), "contains no PNG or JPEG image; allowed: one or more");
  std::sort(names.begin(), names.end(), is_naturally_less);
  for (auto& name : names) {
    DatasetEntry entry;
    entry.path = folder / name;
    entry.file = escape_name(name);
    dataset.entries.push_back(std::move(entry));
  }
  set_foreign_picture_stores(dataset.entries);
  return dataset;
}

/// Joins the pictures that the cameras of a rig have in folders of their own.
void join_rig(Dataset& dataset, const TomlFields& images, const std::vector<std::string>& folders) {
  const auto& camera = dataset.source.camera;
  const auto* const rig = camera ? std::get_if<RigModel>(&camera->model) : nullptr;
  if (rig == nullptr) {
    images.fail("folders", "given", "only for a rig (a camera file of several cameras)");
  }
  if (folders.size() != rig->cameras.size()) {
    images.fail("folders", "a list of " + std::to_string(folders.size()),
                "a folder for each of the rig's " + std::to_string(rig->cameras.size()) +
                    " cameras, in their order");
  }
  for (const std::string& name : folders) {
    if (!is_inside_folder(name)) {
      images.fail("folders", "\"" + name + "\"", "folders in that of the data set");
    }
  }
  join_folders(dataset, *rig, folders);
}

/// A value that entries may have, and its name in warnings.
struct EntryField {
  std::string_view name;
  bool Dataset::Fields::*shared;
  bool (*has)(const DatasetEntry& entry);
};
constexpr std::array<EntryField, 5> entry_fields{{
    {"stamp", &Dataset::Fields::stamps, [](const auto& e) { return e.stamp_s.has_value(); }},
    {"position", &Dataset::Fields::positions, [](const auto& e) { return e.pose.has_value(); }},
    {"heading", &Dataset::Fields::headings,
     [](const auto& e) { return e.pose && e.pose->heading_rad.has_value(); }},
    {"odometry", &Dataset::Fields::odometry, [](const auto& e) { return e.odometry.has_value(); }},
    {"roll and pitch", &Dataset::Fields::tilts, [](const auto& e) { return e.tilt.has_value(); }},
}};

/// Warns of fields that only some of the entries have.
void add_warnings_of_partial_fields(Dataset& dataset) {
  const std::size_t all = dataset.entries.size();
  for (const EntryField& field : entry_fields) {
    const auto count = static_cast<std::size_t>(std::ranges::count_if(dataset.entries, field.has));
    if (count == 0 || count == all) continue;
    dataset.warnings.push_back(to_readable_line(dataset.folder.string()) + ": " +
                               std::to_string(all - count) + " of " + format_count(all, "image") +
                               " have no " + std::string(field.name));
  }
}

}  // namespace

Dataset read_dataset(const fs::path& folder) {
  const fs::path path = folder / "dataset.toml";
  const TomlTable table = read_toml(path);
  TomlFields top(path, "", table);
  auto images = top.section("images");
  if (!images) top.fail("[images]", "missing", "a section that says what the images are");
  auto poses = top.section("poses");
  auto list = top.section("list");
  if (poses.has_value() == list.has_value()) {
    top.fail("[poses] or [list]", poses ? "both there" : "missing",
             "one of the two, with the field file");
  }
  Dataset dataset;
  dataset.folder = folder;
  dataset.source = read_source(*images, folder);
  TomlFields& entries = poses ? *poses : *list;
  const std::string file = entries.required_text("file", "the name of a table");
  if (!is_inside_folder(file)) {
    entries.fail("file", "\"" + file + "\"", "a table in the data set's folder");
  }
  dataset.entries = read_entries(folder, folder / file, poses.has_value());
  if (const auto folders = images->texts("folders")) join_rig(dataset, *images, *folders);
  add_warnings_of_partial_fields(dataset);
  images->finish();
  entries.finish();
  top.finish();
  return dataset;
}

Dataset read_picture_folder(const fs::path& folder, PictureSource source) {
  return find_pictures(folder, std::move(source), false);
}

Dataset read_picture_tree(const fs::path& folder, PictureSource source) {
  return find_pictures(folder, std::move(source), true);
}

std::vector<std::size_t> select_picture_indices(const std::vector<double>& stamps_s,
                                                const Dataset::Selection& selection) {
  constexpr double rounding_s = 1e-4;
  std::vector<std::size_t> selected;
  std::size_t passed = 0;
  double last_s = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < stamps_s.size(); ++i) {
    const double since_first_s = stamps_s[i] - stamps_s.front();
    if (selection.from_s && since_first_s < *selection.from_s - rounding_s) continue;
    if (selection.to_s && since_first_s > *selection.to_s + rounding_s) continue;
    if (selection.every_s && stamps_s[i] - last_s < *selection.every_s - rounding_s) continue;
    last_s = stamps_s[i];
    if (passed++ % static_cast<std::size_t>(selection.every) == 0) selected.push_back(i);
  }
  return selected;
}

void select_pictures(Dataset& dataset, const Dataset::Selection& selection) {
  if (!selection.has_time_selection() && selection.every <= 1) return;
  const std::string name = dataset.folder.string();
  std::vector<double> stamps_s(dataset.entries.size(), 0.0);
  if (selection.has_time_selection()) {
    for (std::size_t i = 0; i < stamps_s.size(); ++i) {
      const DatasetEntry& entry = dataset.entries[i];
      if (!entry.stamp_s) {
        throw FileError(name,
                        "stamp_s of " + entry.file +
                            " is missing; images can be chosen by time only where all have stamps");
      }
      stamps_s[i] = *entry.stamp_s;
      if (i > 0 && stamps_s[i] < stamps_s[i - 1]) {
        throw FileError(name, "stamp_s of " + entry.file + " is " + to_text(stamps_s[i]) +
                                  "; allowed where images are chosen by time: at least " +
                                  to_text(stamps_s[i - 1]) + ", the stamp before it");
      }
    }
  }
  std::vector<DatasetEntry> kept;
  for (const std::size_t i : select_picture_indices(stamps_s, selection)) {
    kept.push_back(std::move(dataset.entries[i]));
  }
  if (kept.empty()) {
    throw FileError(name, "has no image in the requested time; it is " +
                              format_number(stamps_s.back() - stamps_s.front()) + " s long");
  }
  dataset.entries = std::move(kept);
}

Image read_picture(const DatasetEntry& entry) {
  return entry.store ? entry.store->read(entry.store_index) : read_image(entry.path);
}

Image read_grey_picture(const DatasetEntry& entry) {
  if (!entry.store) return read_grey_image(entry.path);
  Image picture = entry.store->read(entry.store_index);
  return picture.channels() == 1 ? std::move(picture) : to_grey(picture.view());
}

std::vector<std::uint8_t> read_encoded_picture(const DatasetEntry& entry) {
  if (!entry.store) return read_encoded_image(entry.path);
  if (auto encoded = entry.store->encoded(entry.store_index)) return std::move(*encoded);
  const Image picture = entry.store->read(entry.store_index);
  return encode_png(picture.view());
}

Dataset read_single_picture(const fs::path& file, PictureSource source) {
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    throw FileError(file.string(), "does not exist; allowed: a PNG or JPEG image");
  Dataset dataset{file.parent_path(), std::move(source), {}, {}};
  DatasetEntry entry;
  entry.file = escape_name(file.filename().string());
  entry.path = file;
  dataset.entries.push_back(std::move(entry));
  return dataset;
}

std::string Dataset::Unusable::describe() const {
  return FileError(path.string(), fault).what();
}

void require_usable_entries(const Dataset& dataset) {
  if (!dataset.entries.empty()) return;
  if (dataset.unusable.size() == 1) {
    throw FileError(dataset.unusable.front().path.string(), dataset.unusable.front().fault);
  }
  throw FileError(dataset.folder.string(),
                  "contains no image that can be used" +
                      (dataset.unusable.empty() ? "" : "; " + dataset.unusable.front().describe()));
}

Dataset::Fields find_shared_fields(const Dataset& dataset) {
  Dataset::Fields fields;
  for (const EntryField& field : entry_fields) {
    fields.*field.shared = std::ranges::all_of(dataset.entries, field.has);
  }
  return fields;
}

Dataset::Fields find_known_fields(const Dataset& dataset) {
  Dataset::Fields fields = find_shared_fields(dataset);
  for (const EntryField& field : entry_fields) {
    if (field.shared == &Dataset::Fields::stamps) continue;
    fields.*field.shared = std::ranges::any_of(dataset.entries, field.has);
  }
  return fields;
}

}  // namespace panonav
