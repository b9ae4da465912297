#include "panonav/storage/memory_header.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <set>
#include <span>
#include <utility>

#include "panonav/camera/model_parameters.hpp"
#include "panonav/core/error.hpp"

namespace panonav {

namespace {

constexpr std::array<std::string_view, 3> kind_names{"panorama", "equirectangular", "mirror"};
constexpr std::array<std::string_view, 2> direction_names{"clockwise", "counter-clockwise"};
constexpr std::string_view preprocessing_prefix = "preprocessing.";
constexpr std::string_view camera_prefix = "source.camera.";

std::string joined(std::string_view a, std::string_view b) {
  std::string text(a);
  text += b;
  return text;
}

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

// What a picture file may have: more than any picture of the memory could be made from.
void require_picture(int rows, int columns, std::string_view rows_name,
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

// Doubles as little-endian bytes.
std::vector<std::uint8_t> bytes_of(const std::vector<double>& values) {
  std::vector<std::uint8_t> bytes;
  for (const double value : values) {
    const auto word = std::bit_cast<std::uint64_t>(value);
    for (unsigned shift = 0; shift < 64; shift += 8) {
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
    }
  }
  return bytes;
}

std::vector<double> doubles_of(const std::vector<std::uint8_t>& bytes) {
  std::vector<double> values;
  for (std::size_t i = 0; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word = 0;
    for (unsigned j = 0; j < 8; ++j) word |= std::uint64_t{bytes[i + j]} << (8 * j);
    values.push_back(std::bit_cast<double>(word));
  }
  return values;
}

// One bit a pixel, rows one after the other, the first pixel in the lowest bit.
std::vector<std::uint8_t> bits_of(const Image& mask) {
  std::vector<std::uint8_t> bits((mask.pixels().size() + 7) / 8);
  for (std::size_t i = 0; i < mask.pixels().size(); ++i) {
    if (mask.pixels()[i] != 0) bits[i / 8] |= static_cast<std::uint8_t>(1U << (i % 8));
  }
  return bits;
}

Image mask_of(const std::vector<std::uint8_t>& bits, ImageSize size) {
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

class OptionWriter final : public OptionVisitor {
 public:
  explicit OptionWriter(Settings& settings) : settings_(settings) {}
  void visit(const OptionInfo& info, int& value) override { put(info, std::int64_t{value}); }
  void visit(const OptionInfo& info, double& value) override { put(info, value); }
  void visit(const OptionInfo& info, bool& value) override { put(info, std::int64_t{value}); }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    put(info, std::string(choices[static_cast<std::size_t>(value)]));
  }

 private:
  void put(const OptionInfo& info, SettingValue value) {
    settings_.emplace(joined(preprocessing_prefix, info.name), std::move(value));
  }
  Settings& settings_;
};

// Hands out settings by key and type, and knows which were never asked for.
class SettingsReader {
 public:
  explicit SettingsReader(const Settings& settings) : settings_(settings) {}

  template <class Value>
  const Value* find(const std::string& key) {
    used_.insert(key);
    const auto found = settings_.find(key);
    if (found == settings_.end()) return nullptr;
    const Value* value = std::get_if<Value>(&found->second);
    if (value == nullptr)
      throw ContractError(key, "of a wrong type", "the type in docs/formats.md");
    return value;
  }
  template <class Value>
  const Value& get(const std::string& key) {
    const Value* value = find<Value>(key);
    if (value == nullptr) throw ContractError(key, "missing", "one value");
    return *value;
  }
  int integer(const std::string& key) {
    const auto value = get<std::int64_t>(key);
    require(value >= 0 && value <= std::numeric_limits<int>::max(), key, static_cast<double>(value),
            "0 .. 2^31 - 1");
    return static_cast<int>(value);
  }
  std::size_t choice(const std::string& key, std::span<const std::string_view> names) {
    const auto& name = get<std::string>(key);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names[i] == name) return i;
    }
    throw ContractError(key, name, "a name in docs/formats.md");
  }
  std::optional<ElevationBand> band(const std::string& prefix) {
    const auto* bottom = find<double>(prefix + "bottom_rad");
    const auto* top = find<double>(prefix + "top_rad");
    if (bottom == nullptr && top == nullptr) return std::nullopt;
    if (bottom == nullptr || top == nullptr) throw ContractError(prefix, "half", "both or neither");
    return ElevationBand{*bottom, *top};
  }
  bool has(const std::string& key) const { return settings_.contains(key); }
  void require_all_used() const {
    for (const auto& [key, value] : settings_) {
      if (!key.starts_with("parameter.") && !key.starts_with("synchronised.") &&
          !used_.contains(key)) {
        throw ContractError("setting " + key, "unknown", "the settings in docs/formats.md");
      }
    }
  }

 private:
  const Settings& settings_;
  std::set<std::string> used_;
};

// Every option must be there: a default that changes must not change what a file means.
class OptionReader final : public OptionVisitor {
 public:
  explicit OptionReader(SettingsReader& reader) : reader_(reader) {}
  void visit(const OptionInfo& info, int& value) override { value = reader_.integer(key(info)); }
  void visit(const OptionInfo& info, double& value) override {
    value = reader_.get<double>(key(info));
  }
  void visit(const OptionInfo& info, bool& value) override {
    value = reader_.integer(key(info)) != 0;
  }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    value = static_cast<int>(reader_.choice(key(info), choices));
  }

 private:
  std::string key(const OptionInfo& info) const {
    const std::string former = joined(preprocessing_prefix, info.former);
    return reader_.has(former) ? former : joined(preprocessing_prefix, info.name);
  }
  SettingsReader& reader_;
};

void put_band(Settings& settings, const std::string& prefix,
              const std::optional<ElevationBand>& band) {
  if (!band) return;
  settings.emplace(prefix + "bottom_rad", band->bottom_rad);
  settings.emplace(prefix + "top_rad", band->top_rad);
}

void put_camera(Settings& settings, const Camera& camera) {
  const auto put = [&](std::string_view key, SettingValue value) {
    settings.emplace(joined(camera_prefix, key), std::move(value));
  };
  put("model", std::string(model_name(camera.model)));
  visit_parameters(camera.model, [&](std::string_view name, const auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>) {
      put(name, value);
    } else {
      put(name, bytes_of(value));
    }
  });
  // A key that programs before it do not know: only where they would misread the camera.
  if (const auto* unified = std::get_if<UnifiedModel>(&camera.model);
      unified != nullptr && unified->axis != ViewAxis::down) {
    put("axis", std::string(view_axis_names[static_cast<std::size_t>(unified->axis)]));
  }
  put("width_px", std::int64_t{camera.image_size.width});
  put("height_px", std::int64_t{camera.image_size.height});
  put("centre_u_px", camera.centre.u_px);
  put("centre_v_px", camera.centre.v_px);
  put("rim_radius_px", camera.rim_radius_px);
  put("inner_radius_px", camera.inner_radius_px);
  put("direction", std::string(direction_names[static_cast<std::size_t>(camera.direction)]));
  put("forward_angle_rad", camera.forward_angle_rad);
  put("forward_column", camera.forward_column);
}

Camera camera_from(SettingsReader& reader) {
  const auto key = [](std::string_view name) { return joined(camera_prefix, name); };
  Camera camera;
  const auto& name = reader.get<std::string>(key("model"));
  const auto model = model_of_name(name);
  if (!model) throw ContractError(key("model"), name, "a model in docs/formats.md");
  camera.model = *model;
  visit_parameters(camera.model, [&](std::string_view parameter, auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>) {
      value = reader.get<double>(key(parameter));
    } else {
      value = doubles_of(reader.get<std::vector<std::uint8_t>>(key(parameter)));
    }
  });
  if (auto* unified = std::get_if<UnifiedModel>(&camera.model);
      unified != nullptr && reader.has(key("axis"))) {
    unified->axis = static_cast<ViewAxis>(reader.choice(key("axis"), view_axis_names));
  }
  camera.image_size = {reader.integer(key("width_px")), reader.integer(key("height_px"))};
  camera.centre = {reader.get<double>(key("centre_u_px")), reader.get<double>(key("centre_v_px"))};
  camera.rim_radius_px = reader.get<double>(key("rim_radius_px"));
  camera.inner_radius_px = reader.get<double>(key("inner_radius_px"));
  camera.direction = static_cast<ColumnDirection>(reader.choice(key("direction"), direction_names));
  camera.forward_angle_rad = reader.get<double>(key("forward_angle_rad"));
  camera.forward_column = reader.get<double>(key("forward_column"));
  return camera;
}

}  // namespace

void validate(const MemoryHeader& header) {
  require_picture(header.shape.rows, header.panorama_columns, "rows", "panorama_columns");
  // The memory itself knows what shapes and scales it takes.
  static_cast<void>(VisualMemory(header.shape, header.full_scale, header.elevations));
  require(header.panorama_columns / 2 >= header.shape.components, "panorama_columns",
          header.panorama_columns, ">= 2 x components");
  require_band(header.elevations, "elevations");
  validate(header.preprocessing);
  const PictureSource& source = header.source;
  require_band(source.layout.elevations, "source elevations");
  require_band(source.layout.kept_elevations, "source kept elevations");
  require(source.layout.forward_column >= 0.0 && source.layout.forward_column <= 1.0,
          "forward_column", source.layout.forward_column, "0 .. 1");
  if (source.camera.has_value() != (source.kind == PictureKind::mirror)) {
    throw ContractError("camera", source.camera ? "there" : "missing",
                        "there for mirror pictures and only for them");
  }
  if (header.picture_shape) {
    if (source.kind != PictureKind::panorama) {
      throw ContractError("picture_shape", "there", "there for panoramas only");
    }
    require_picture(header.picture_shape->rows, header.picture_shape->columns, "picture rows",
                    "picture columns");
    require(header.picture_shape->columns >= 4, "picture columns", header.picture_shape->columns,
            ">= 4");
  }
  if (source.camera) {
    require_picture(source.camera->image_size.height, source.camera->image_size.width, "height_px",
                    "width_px");
    validate(*source.camera);
  }
  if (source.mask && (!source.camera || source.mask->channels() != 1 ||
                      source.mask->size() != source.camera->image_size)) {
    throw ContractError(
        "mask",
        std::to_string(source.mask->width()) + " x " + std::to_string(source.mask->height()),
        "one channel, the size of the camera's pictures");
  }
  if (header.created_s) {
    require(std::isfinite(*header.created_s), "created_s", *header.created_s, "finite");
  }
}

Settings settings_of(const MemoryHeader& header) {
  Settings settings;
  settings.emplace("rows", std::int64_t{header.shape.rows});
  settings.emplace("components", std::int64_t{header.shape.components});
  settings.emplace("full_scale", static_cast<double>(header.full_scale));
  settings.emplace("panorama_columns", std::int64_t{header.panorama_columns});
  put_band(settings, "elevation_", header.elevations);
  if (header.created_s) settings.emplace("created_s", *header.created_s);
  OptionWriter writer(settings);
  PreprocessingOptions preprocessing = header.preprocessing;
  visit_options(preprocessing, writer);

  const PictureSource& source = header.source;
  settings.emplace("source.kind", std::string(kind_names[static_cast<std::size_t>(source.kind)]));
  settings.emplace("source.direction",
                   std::string(direction_names[static_cast<std::size_t>(source.layout.direction)]));
  settings.emplace("source.forward_column", source.layout.forward_column);
  put_band(settings, "source.elevation_", source.layout.elevations);
  put_band(settings, "source.kept_elevation_", source.layout.kept_elevations);
  if (header.picture_shape) {
    settings.emplace("source.picture_rows", std::int64_t{header.picture_shape->rows});
    settings.emplace("source.picture_columns", std::int64_t{header.picture_shape->columns});
  }
  if (source.camera) put_camera(settings, *source.camera);
  if (source.mask) settings.emplace("source.mask", bits_of(*source.mask));
  return settings;
}

MemoryHeader header_from(const Settings& settings) {
  SettingsReader reader(settings);
  MemoryHeader header;
  header.shape = {reader.integer("rows"), reader.integer("components")};
  header.full_scale = static_cast<float>(reader.get<double>("full_scale"));
  header.panorama_columns = reader.integer("panorama_columns");
  header.elevations = reader.band("elevation_");
  if (const auto* created = reader.find<double>("created_s")) header.created_s = *created;
  OptionReader options(reader);
  visit_options(header.preprocessing, options);

  PictureSource& source = header.source;
  source.kind = static_cast<PictureKind>(reader.choice("source.kind", kind_names));
  source.layout.direction =
      static_cast<ColumnDirection>(reader.choice("source.direction", direction_names));
  source.layout.forward_column = reader.get<double>("source.forward_column");
  source.layout.elevations = reader.band("source.elevation_");
  source.layout.kept_elevations = reader.band("source.kept_elevation_");
  if (reader.find<std::int64_t>("source.picture_rows") != nullptr ||
      reader.find<std::int64_t>("source.picture_columns") != nullptr) {
    header.picture_shape = PanoramaShape{reader.integer("source.picture_rows"),
                                         reader.integer("source.picture_columns")};
  }
  if (source.kind == PictureKind::mirror) {
    source.camera = camera_from(reader);
    require_picture(source.camera->image_size.height, source.camera->image_size.width, "height_px",
                    "width_px");
    validate(*source.camera);
    if (const auto* mask = reader.find<std::vector<std::uint8_t>>("source.mask")) {
      source.mask = mask_of(*mask, source.camera->image_size);
    }
  }
  reader.require_all_used();
  validate(header);
  return header;
}

}  // namespace panonav
