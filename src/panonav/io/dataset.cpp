#include "panonav/io/dataset.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_set>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/internal/csv_table.hpp"
#include "panonav/io/internal/toml_fields.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 3> kind_names{"panorama", "equirectangular", "mirror"};
constexpr std::array<std::string_view, 2> column_directions{"clockwise", "counter-clockwise"};
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

PictureSource read_source(TomlFields& images, const fs::path& folder) {
  PictureSource source;
  const auto kind = images.choice("kind", kind_names);
  if (!kind) images.fail("kind", "missing", "\"panorama\", \"equirectangular\", \"mirror\"");
  source.kind = static_cast<PictureKind>(*kind);
  std::optional<ElevationBand> band;
  if (const auto values = images.numbers("elevation_deg"))
    band = to_elevation_band(images, *values);
  if (source.kind == PictureKind::mirror) {
    const std::string file = images.required_text("camera", "the name of a camera file");
    CameraFile camera = read_camera(folder / file);
    source.camera = std::move(camera.camera);
    source.mask = std::move(camera.mask);
    source.layout.kept_elevations = band;
    return source;
  }
  if (const auto direction = images.choice("columns", column_directions)) {
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

void require_picture(const fs::path& table, const DatasetEntry& entry) {
  std::error_code error;
  if (!fs::is_regular_file(entry.path, error)) {
    throw FileError(table.string(),
                    "file is '" + entry.file +
                        "', which does not exist; allowed: an image in the data set's folder");
  }
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
    entry.file = table.text(row, "file");
    if (entry.file.empty()) table.fail(row, "file", "empty", "an image in the data set's folder");
    if (!is_inside_folder(entry.file)) {
      table.fail(row, "file", "'" + entry.file + "'", "an image in the data set's folder");
    }
    if (!seen.insert(entry.file).second) {
      table.fail(row, "file", "'" + entry.file + "' for the second time", "each image once");
    }
    entry.path = folder / entry.file;
    require_picture(path, entry);
    if (table.has("stamp_s")) entry.stamp_s = table.number(row, "stamp_s");
    if (has_position) {
      entry.pose =
          ReferencePose{table.position(row, "x_m"), table.position(row, "y_m"), std::nullopt};
      if (table.has("heading_deg")) {
        entry.pose->heading_rad = wrap_angle(radians(table.number(row, "heading_deg")));
      }
    }
    if (has_odometry) {
      entry.odometry = Pose2{table.position(row, "odom_x_m"), table.position(row, "odom_y_m"),
                             wrap_angle(radians(table.number(row, "odom_heading_deg")))};
    }
    if (has_tilt) {
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
  return entries;
}

bool is_picture(const fs::path& path) {
  const std::string extension = to_lower_case(path.extension().string());
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

// Compares digits as numbers, and all other text character by character.
bool is_naturally_less(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      std::size_t i_end = i;
      std::size_t j_end = j;
      while (i_end < a.size() && digit(a[i_end])) ++i_end;
      while (j_end < b.size() && digit(b[j_end])) ++j_end;
      std::size_t i_first = i;
      std::size_t j_first = j;
      while (i_first + 1 < i_end && a[i_first] == '0') ++i_first;
      while (j_first + 1 < j_end && b[j_first] == '0') ++j_first;
      if (i_end - i_first != j_end - j_first) return i_end - i_first < j_end - j_first;
      const int order = a.compare(i_first, i_end - i_first, b, j_first, j_end - j_first);
      if (order != 0) return order < 0;
      i = i_end;
      j = j_end;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (i == a.size() && j == b.size()) return a < b;  // equal but for leading zeros
  return i == a.size();
}

Dataset find_pictures(const fs::path& folder, PictureSource source, bool is_recursive) {
  Dataset dataset{folder, std::move(source), {}, {}};
  std::error_code error;
  std::vector<std::string> names;
  fs::recursive_directory_iterator file(folder, error);
  for (; !error && file != fs::recursive_directory_iterator(); file.increment(error)) {
    std::error_code unknown;
    const std::string name = file->path().lexically_relative(folder).string();
    const bool is_folder = file->is_directory(unknown) && !file->is_symlink(unknown);
    if (is_picture(file->path()) && file->is_regular_file(unknown)) {
      names.push_back(name);
    } else if (!is_folder) {
      dataset.left_out.push_back(name);
    } else if (!is_recursive) {
      dataset.left_out.push_back(name + "/");
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
    entry.file = std::move(name);
    dataset.entries.push_back(std::move(entry));
  }
  return dataset;
}

/// A value that entries may have, and its first column in the table.
struct EntryField {
  std::string_view column;
  bool Dataset::Fields::*shared;
  bool (*has)(const DatasetEntry& entry);
};
constexpr std::array<EntryField, 5> entry_fields{{
    {"stamp_s", &Dataset::Fields::stamps, [](const auto& e) { return e.stamp_s.has_value(); }},
    {"x_m", &Dataset::Fields::positions, [](const auto& e) { return e.pose.has_value(); }},
    {"heading_deg", &Dataset::Fields::headings,
     [](const auto& e) { return e.pose && e.pose->heading_rad.has_value(); }},
    {"odom_x_m", &Dataset::Fields::odometry, [](const auto& e) { return e.odometry.has_value(); }},
    {"roll_deg", &Dataset::Fields::tilts, [](const auto& e) { return e.tilt.has_value(); }},
}};

/// Throws ContractError if only some of the entries have a field.
void require_whole_fields(const std::vector<DatasetEntry>& entries) {
  require(!entries.empty(), "number of images", 0.0, ">= 1");
  const auto all = static_cast<std::ptrdiff_t>(entries.size());
  for (const EntryField& field : entry_fields) {
    const auto count = std::ranges::count_if(entries, field.has);
    require(count == 0 || count == all, "number of images with " + std::string(field.column),
            static_cast<double>(count), "0 or all " + std::to_string(all));
  }
}

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
    if (columns.stamps) add(*entry.stamp_s);
    if (columns.positions) {
      add(entry.pose->x_m);
      add(entry.pose->y_m);
    }
    if (columns.headings) add(to_exact_degrees(*entry.pose->heading_rad));
    if (columns.odometry) {
      add(entry.odometry->x_m);
      add(entry.odometry->y_m);
      add(to_exact_degrees(entry.odometry->heading_rad));
    }
    if (columns.tilts) {
      add(to_exact_degrees(entry.tilt->roll_rad));
      add(to_exact_degrees(entry.tilt->pitch_rad));
    }
    table += "\n";
  }
  return table;
}

/// Returns the section [images]; writes the camera of mirror pictures to camera.toml.
std::string format_images_section(const Dataset& dataset) {
  const PictureSource& source = dataset.source;
  std::string text = "[images]\nkind = \"" +
                     std::string(kind_names[static_cast<std::size_t>(source.kind)]) + "\"\n";
  std::optional<ElevationBand> band = source.layout.kept_elevations;
  if (source.kind == PictureKind::panorama) band = source.layout.elevations;
  if (source.kind != PictureKind::mirror) {
    text += "columns = \"" +
            std::string(
                column_directions[source.layout.direction == ColumnDirection::clockwise ? 0 : 1]) +
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
  entry.file = file.filename().string();
  entry.path = file;
  dataset.entries.push_back(std::move(entry));
  return dataset;
}

Dataset::Fields find_shared_fields(const Dataset& dataset) {
  Dataset::Fields fields;
  for (const EntryField& field : entry_fields) {
    fields.*field.shared = std::ranges::all_of(dataset.entries, field.has);
  }
  return fields;
}

Dataset::Fields drop_partial_fields(Dataset& dataset) {
  const Dataset::Fields fields = find_shared_fields(dataset);
  for (DatasetEntry& entry : dataset.entries) {
    if (!fields.stamps) entry.stamp_s.reset();
    if (!fields.positions) entry.pose.reset();
    if (entry.pose && !fields.headings) entry.pose->heading_rad.reset();
    if (!fields.odometry) entry.odometry.reset();
    if (!fields.tilts) entry.tilt.reset();
  }
  return fields;
}

void write_dataset(const Dataset& dataset) {
  require_whole_fields(dataset.entries);
  const Dataset::Fields columns = find_shared_fields(dataset);
  std::string text = format_images_section(dataset);
  const bool with_poses = columns.positions || columns.odometry;
  const std::string name = with_poses ? "poses.csv" : "images.csv";
  text += std::string("\n[") + (with_poses ? "poses" : "list") + "]\nfile = \"" + name + "\"\n";
  write_file(dataset.folder / name, format_table(dataset.entries, columns));
  write_file(dataset.folder / "dataset.toml", text);
}

}  // namespace panonav
