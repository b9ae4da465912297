#include "panonav/storage/memory_header.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <span>
#include <utility>

#include "panonav/camera/model_parameters.hpp"
#include "panonav/core/error.hpp"
#include "panonav/storage/internal/little_endian.hpp"

namespace panonav {

namespace {

/// Narrow pictures are in no memory.
constexpr std::span memory_kind_names = std::span(picture_kind_names).first<3>();
static_assert(memory_kind_names.size() == static_cast<std::size_t>(PictureKind::pinhole));
constexpr std::array<std::string_view, 2> elevation_origins{"known", "assumed"};

void require_band(const std::optional<ElevationBand>& band, std::string_view field) {
  if (!band) return;
  constexpr double right_angle = std::numbers::pi / 2 + 1e-9;
  const bool holds = band->bottom_rad >= -right_angle && band->bottom_rad < band->top_rad &&
                     band->top_rad <= right_angle;
  if (!holds) {
    throw ContractError(field, to_text(band->bottom_rad) + " .. " + to_text(band->top_rad),
                        "bottom < top, both within +-pi/2");
  }
}

// Checks the limits of picture files, which no picture of a memory can exceed.
void require_picture_size(int rows, int columns, std::string_view rows_name,
                          std::string_view columns_name) {
  constexpr int max_side = 32768;
  constexpr std::int64_t max_pixels = 134'217'728;
  require(rows >= 1 && rows <= max_side, rows_name, rows, "1 .. 32768");
  require(columns >= 1 && columns <= max_side, columns_name, columns, "1 .. 32768");
  const std::int64_t pixels = std::int64_t{rows} * columns;
  if (pixels > max_pixels) {
    throw ContractError(std::string(rows_name) + " x " + std::string(columns_name),
                        static_cast<double>(pixels), "up to 134217728 pixels");
  }
}

// Converts doubles to little-endian bytes.
std::vector<std::uint8_t> to_bytes(const std::vector<double>& values) {
  std::vector<std::uint8_t> bytes;
  for (const double value : values) {
    append_little_endian(bytes, std::bit_cast<std::uint64_t>(value));
  }
  return bytes;
}

std::vector<double> to_doubles(const std::vector<std::uint8_t>& bytes) {
  std::vector<double> values;
  for (std::size_t i = 0; i + 8 <= bytes.size(); i += 8) {
    values.push_back(std::bit_cast<double>(read_little_endian<std::uint64_t>(&bytes[i])));
  }
  return values;
}

// Packs a mask with one bit for each pixel, row by row, the first pixel in the lowest bit.
std::vector<std::uint8_t> to_bits(const Image& mask) {
  std::vector<std::uint8_t> bits((mask.pixels().size() + 7) / 8);
  for (std::size_t i = 0; i < mask.pixels().size(); ++i) {
    if (mask.pixels()[i] != 0) bits[i / 8] |= static_cast<std::uint8_t>(1U << (i % 8));
  }
  return bits;
}

Image to_mask(const std::vector<std::uint8_t>& bits, ImageSize size) {
  const auto pixels =
      static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height);
  require(bits.size() == (pixels + 7) / 8, "bytes of the mask", static_cast<double>(bits.size()),
          "one bit a pixel of the camera");
  Image mask(size.width, size.height);
  for (std::size_t i = 0; i < mask.pixels().size(); ++i) {
    mask.pixels()[i] = (bits[i / 8] >> (i % 8)) & 1U ? 255 : 0;
  }
  return mask;
}

// Passes each option to the member function `field` or `choice` of `Fields`.
template <class Fields>
class OptionFields : public OptionVisitor {
 public:
  void visit(const OptionInfo& info, int& value) override { fields().field(key(info), value); }
  void visit(const OptionInfo& info, double& value) override { fields().field(key(info), value); }
  void visit(const OptionInfo& info, bool& value) override { fields().field(key(info), value); }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    fields().choice(key(info), choices, value);
  }

 private:
  Fields& fields() { return static_cast<Fields&>(*this); }
  static std::string key(const OptionInfo& info) {
    return "preprocessing." + std::string(info.name);
  }
};

// Writes the fields of a header as settings.
class SettingsWriter final : public OptionFields<SettingsWriter> {
 public:
  void field(const std::string& key, bool value) { put(key, std::int64_t{value}); }
  void field(const std::string& key, int value) { put(key, std::int64_t{value}); }
  void field(const std::string& key, double value) { put(key, value); }
  void field(const std::string& key, float value) { put(key, static_cast<double>(value)); }
  void field(const std::string& key, const std::vector<double>& value) {
    put(key, to_bytes(value));
  }
  void field(const std::string& key, const std::optional<double>& value) {
    if (value) put(key, *value);
  }
  template <class Enum>
  void choice(const std::string& key, std::span<const std::string_view> names, Enum value) {
    put(key, std::string(names[static_cast<std::size_t>(value)]));
  }
  template <class Enum>
  void visit_choice_with_default(const std::string& key, std::span<const std::string_view> names,
                                 Enum value, Enum default_value) {
    if (value != default_value) choice(key, names, value);
  }
  template <std::size_t count>
  void visit_numbers_with_default(const std::string& key, const std::array<double, count>& value,
                                  const std::array<double, count>& default_value) {
    if (value != default_value) put(key, to_bytes({value.begin(), value.end()}));
  }
  void band(const std::string& prefix, const std::optional<ElevationBand>& band) {
    if (!band) return;
    put(prefix + "bottom_rad", band->bottom_rad);
    put(prefix + "top_rad", band->top_rad);
  }
  void shape(const std::string& prefix, const std::optional<PanoramaShape>& shape) {
    if (!shape) return;
    field(prefix + "rows", shape->rows);
    field(prefix + "columns", shape->columns);
  }
  void model(const std::string& key, const CameraModel& model) {
    put(key, std::string(model_name(model)));
  }
  void options(PreprocessingOptions options) { visit_options(options, *this); }

  void put(const std::string& key, SettingValue value) { settings.emplace(key, std::move(value)); }
  Settings settings;
};

// Reads settings that SettingsWriter wrote, and records which were read. Every option must be
// present, so that a changed default cannot change the meaning of a file.
class SettingsReader final : public OptionFields<SettingsReader> {
 public:
  explicit SettingsReader(const Settings& settings) : settings_(settings) {}

  void field(const std::string& key, int& value) {
    const auto number = get<std::int64_t>(key);
    require(number >= 0 && number <= std::numeric_limits<int>::max(), key,
            static_cast<double>(number), "0 .. 2^31 - 1");
    value = static_cast<int>(number);
  }
  void field(const std::string& key, bool& value) {
    int number = 0;
    field(key, number);
    value = number != 0;
  }
  void field(const std::string& key, double& value) { value = get<double>(key); }
  void field(const std::string& key, float& value) { value = static_cast<float>(get<double>(key)); }
  void field(const std::string& key, std::vector<double>& value) {
    value = to_doubles(get<std::vector<std::uint8_t>>(key));
  }
  void field(const std::string& key, std::optional<double>& value) {
    if (const auto* found = find<double>(key)) value = *found;
  }
  template <class Enum>
  void choice(const std::string& key, std::span<const std::string_view> names, Enum& value) {
    const auto& name = get<std::string>(key);
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) throw ContractError(key, name, "a name in docs/formats.md");
    value = static_cast<Enum>(found - names.begin());
  }
  template <class Enum>
  void visit_choice_with_default(const std::string& key, std::span<const std::string_view> names,
                                 Enum& value, Enum default_value) {
    value = default_value;
    if (settings_.contains(key)) choice(key, names, value);
  }
  template <std::size_t count>
  void visit_numbers_with_default(const std::string& key, std::array<double, count>& value,
                                  const std::array<double, count>& default_value) {
    value = default_value;
    if (!settings_.contains(key)) return;
    const auto numbers = to_doubles(get<std::vector<std::uint8_t>>(key));
    require(numbers.size() == count, key, static_cast<double>(numbers.size()),
            std::to_string(count) + " numbers");
    std::ranges::copy(numbers, value.begin());
  }
  void band(const std::string& prefix, std::optional<ElevationBand>& band) {
    const auto* bottom = find<double>(prefix + "bottom_rad");
    const auto* top = find<double>(prefix + "top_rad");
    if (bottom == nullptr && top == nullptr) return;
    if (bottom == nullptr || top == nullptr) throw ContractError(prefix, "half", "both or neither");
    band = ElevationBand{*bottom, *top};
  }
  void shape(const std::string& prefix, std::optional<PanoramaShape>& shape) {
    if (!settings_.contains(prefix + "rows") && !settings_.contains(prefix + "columns")) return;
    shape.emplace();
    field(prefix + "rows", shape->rows);
    field(prefix + "columns", shape->columns);
  }
  void model(const std::string& key, CameraModel& model) {
    const auto& name = get<std::string>(key);
    const auto found = make_default_model(name);
    if (!found) throw ContractError(key, name, "a model in docs/formats.md");
    model = *found;
  }
  void options(PreprocessingOptions& options) { visit_options(options, *this); }

  template <class Value>
  const Value* find(const std::string& key) {
    used_.insert(key);
    const auto found = settings_.find(key);
    if (found == settings_.end()) return nullptr;
    const Value* value = std::get_if<Value>(&found->second);
    if (value == nullptr) {
      throw ContractError(key, "of a wrong type", "the type in docs/formats.md");
    }
    return value;
  }
  void require_all_used() const {
    for (const auto& [key, value] : settings_) {
      if (!key.starts_with("parameter.") && !key.starts_with("synchronised.") &&
          !used_.contains(key)) {
        throw ContractError("setting " + key, "unknown", "the settings in docs/formats.md");
      }
    }
  }

 private:
  template <class Value>
  const Value& get(const std::string& key) {
    const Value* value = find<Value>(key);
    if (value == nullptr) throw ContractError(key, "missing", "one value");
    return *value;
  }
  const Settings& settings_;
  std::set<std::string> used_;
};

const std::string camera_prefix = "source.camera.";

// Lists the settings of a camera once for writing and reading: `Fields` is a SettingsWriter with a
// const camera, or a SettingsReader.
template <class Fields, class AnyCamera>
void visit_camera(Fields& fields, AnyCamera& camera, const std::string& prefix) {
  fields.model(prefix + "model", camera.model);
  visit_parameters(camera.model, [&](const std::string& name, auto& value) {
    fields.field(prefix + name, value);
  });
  if (auto* rig = std::get_if<RigModel>(&camera.model)) {
    auto count = static_cast<int>(rig->cameras.size());
    fields.field(prefix + "cameras", count);
    require(count >= 0 && count <= static_cast<int>(RigModel::max_cameras), prefix + "cameras",
            count, "2 .. " + std::to_string(RigModel::max_cameras));
    if constexpr (!std::is_const_v<AnyCamera>) rig->cameras.resize(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      visit_camera(fields, rig->cameras[static_cast<std::size_t>(i)],
                   prefix + "camera" + std::to_string(i) + ".");
    }
  }
  if (auto* axis = find_view_axis(camera.model)) {
    fields.visit_choice_with_default(prefix + "axis", view_axis_names, *axis,
                                     UnifiedModel::Axis::down);
  }
  fields.visit_numbers_with_default(prefix + "affine", camera.affine, Camera{}.affine);
  fields.visit_numbers_with_default(prefix + "distortion", camera.distortion, Camera{}.distortion);
  fields.field(prefix + "width_px", camera.image_size.width);
  fields.field(prefix + "height_px", camera.image_size.height);
  fields.field(prefix + "centre_u_px", camera.centre.u_px);
  fields.field(prefix + "centre_v_px", camera.centre.v_px);
  fields.field(prefix + "rim_radius_px", camera.rim_radius_px);
  fields.field(prefix + "inner_radius_px", camera.inner_radius_px);
  fields.choice(prefix + "direction", column_direction_names, camera.direction);
  fields.field(prefix + "forward_angle_rad", camera.forward_angle_rad);
  fields.field(prefix + "forward_column", camera.forward_column);
  fields.visit_choice_with_default(prefix + "elevations", elevation_origins,
                                   camera.has_assumed_elevations, false);
}

// Reads or writes all fields of the header except the camera and its mask.
template <class Fields, class Header>
void visit_header(Fields& fields, Header& header) {
  fields.field("rows", header.shape.rows);
  fields.field("components", header.shape.components);
  fields.field("full_scale", header.full_scale);
  fields.field("panorama_columns", header.panorama_columns);
  fields.band("elevation_", header.elevations);
  fields.field("created_s", header.created_s);
  fields.options(header.preprocessing);
  auto& source = header.source;
  fields.choice("source.kind", memory_kind_names, source.kind);
  fields.choice("source.direction", column_direction_names, source.layout.direction);
  fields.field("source.forward_column", source.layout.forward_column);
  fields.band("source.elevation_", source.layout.elevations);
  fields.band("source.kept_elevation_", source.layout.kept_elevations);
  fields.shape("source.picture_", header.picture_shape);
}

void require_camera(const Camera& camera) {
  require_picture_size(camera.image_size.height, camera.image_size.width, "height_px", "width_px");
  validate(camera);
}

}  // namespace

void validate(const MemoryHeader& header) {
  require_picture_size(header.shape.rows, header.panorama_columns, "rows", "panorama_columns");
  // The constructor of the memory checks shape and scale.
  static_cast<void>(VisualMemory(header.shape, header.full_scale, header.elevations));
  require(header.panorama_columns / 2 >= header.shape.components, "panorama_columns",
          header.panorama_columns, ">= 2 x components");
  require_band(header.elevations, "elevations");
  validate(header.preprocessing);
  const PictureSource& source = header.source;
  if (source.kind == PictureKind::pinhole) {
    throw ContractError("kind of the images", "pinhole",
                        "panorama, equirectangular or mirror: a memory has views of all azimuths");
  }
  require_band(source.layout.elevations, "source elevations");
  require_band(source.layout.kept_elevations, "source kept elevations");
  require(source.layout.forward_column >= 0.0 && source.layout.forward_column <= 1.0,
          "forward_column", source.layout.forward_column, "0 .. 1");
  if (source.camera.has_value() != (source.kind == PictureKind::mirror)) {
    throw ContractError("camera", source.camera ? "there" : "missing",
                        "there for mirror images and only for them");
  }
  if (header.picture_shape) {
    if (source.kind != PictureKind::panorama) {
      throw ContractError("picture_shape", "there", "there for panoramas only");
    }
    require_picture_size(header.picture_shape->rows, header.picture_shape->columns, "image rows",
                         "image columns");
    require(header.picture_shape->columns >= 4, "image columns", header.picture_shape->columns,
            ">= 4");
  }
  if (source.camera) require_camera(*source.camera);
  if (source.mask && (!source.camera || source.mask->channels() != 1 ||
                      source.mask->size() != source.camera->image_size)) {
    throw ContractError(
        "mask",
        std::to_string(source.mask->width()) + " x " + std::to_string(source.mask->height()),
        "one channel, the size of the camera's images");
  }
  if (header.created_s) {
    require(std::isfinite(*header.created_s), "created_s", *header.created_s, "finite");
  }
}

Settings to_settings(const MemoryHeader& header) {
  SettingsWriter writer;
  visit_header(writer, header);
  const PictureSource& source = header.source;
  if (source.camera) visit_camera(writer, *source.camera, camera_prefix);
  if (source.mask) writer.put("source.mask", to_bits(*source.mask));
  return std::move(writer.settings);
}

MemoryHeader to_header(const Settings& settings) {
  SettingsReader reader(settings);
  MemoryHeader header;
  visit_header(reader, header);
  PictureSource& source = header.source;
  if (source.kind == PictureKind::mirror) {
    visit_camera(reader, source.camera.emplace(), camera_prefix);
    require_camera(*source.camera);
    if (const auto* mask = reader.find<std::vector<std::uint8_t>>("source.mask")) {
      source.mask = to_mask(*mask, source.camera->image_size);
    }
  }
  reader.require_all_used();
  validate(header);
  return header;
}

}  // namespace panonav
