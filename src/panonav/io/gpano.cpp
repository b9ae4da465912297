#include "panonav/io/gpano.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/internal/xmp_packet.hpp"

namespace panonav {

namespace {

constexpr double whole_circle_rad = 2.0 * std::numbers::pi;
constexpr ElevationBand whole_band{-0.5 * std::numbers::pi, 0.5 * std::numbers::pi};
constexpr std::string_view xml_blanks = " \t\r\n";

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-' || c == '.' || c == ':';
}

void skip_blanks(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(xml_blanks), text.size()));
}

/// Returns the prefix that the text declares for the namespace of GPano; empty: none.
std::string find_gpano_prefix(std::string_view xmp) {
  constexpr std::string_view uri = "http://ns.google.com/photos/1.0/panorama/";
  constexpr std::string_view declaration = "xmlns:";
  for (std::size_t at = xmp.find(uri); at != xmp.npos; at = xmp.find(uri, at + 1)) {
    // Goes back over xmlns:PREFIX = "
    std::string_view before = xmp.substr(0, at);
    if (before.empty() || (before.back() != '"' && before.back() != '\'')) continue;
    before.remove_suffix(1);
    const auto drop_blanks = [&] {
      before = before.substr(0, before.find_last_not_of(xml_blanks) + 1);
    };
    drop_blanks();
    if (!before.ends_with('=')) continue;
    before.remove_suffix(1);
    drop_blanks();
    std::size_t begin = before.size();
    while (begin > 0 && is_name_character(before[begin - 1])) --begin;
    const std::string_view name = before.substr(begin);
    if (name.starts_with(declaration)) return std::string(name.substr(declaration.size()));
  }
  return {};
}

/// Returns the value of an attribute or of an element of this name; nullopt without one.
std::optional<std::string_view> find_xml_value(std::string_view xmp, const std::string& name) {
  for (std::size_t at = xmp.find(name); at != xmp.npos; at = xmp.find(name, at + 1)) {
    std::string_view rest = xmp.substr(at + name.size());
    const char before = at > 0 ? xmp[at - 1] : '\0';
    if (is_name_character(before) || before == '/' || rest.empty() ||
        is_name_character(rest.front())) {
      continue;
    }
    char end = '<';
    if (before == '<') {
      const std::size_t close = rest.find('>');
      if (close == rest.npos || (close > 0 && rest[close - 1] == '/')) continue;
      rest.remove_prefix(close + 1);
    } else {
      skip_blanks(rest);
      if (!rest.starts_with('=')) continue;
      rest.remove_prefix(1);
      skip_blanks(rest);
      if (!rest.starts_with('"') && !rest.starts_with('\'')) continue;
      end = rest.front();
      rest.remove_prefix(1);
    }
    const std::size_t length = rest.find(end);
    if (length == rest.npos) continue;
    std::string_view value = rest.substr(0, length);
    skip_blanks(value);
    return value.substr(0, value.find_last_not_of(xml_blanks) + 1);
  }
  return std::nullopt;
}

class GpanoValues {
 public:
  explicit GpanoValues(std::string_view xmp) : xmp_(xmp), prefix_(find_gpano_prefix(xmp) + ":") {}
  [[nodiscard]] bool has_namespace() const { return prefix_.size() > 1; }
  [[nodiscard]] std::optional<std::string_view> text(const std::string& name) const {
    return find_xml_value(xmp_, prefix_ + name);
  }
  /// Returns a number from `low` to `high`; nullopt if it is missing, no number or out of range.
  [[nodiscard]] std::optional<double> number(const std::string& name, double low,
                                             double high) const {
    auto value = text(name);
    if (value && value->starts_with('+')) value->remove_prefix(1);
    double result = 0.0;
    if (!value || !read_number(*value, result) || !(result >= low && result <= high)) return {};
    return result;
  }

 private:
  std::string_view xmp_;
  std::string prefix_;
};

/// A part of the width or height of the whole sphere, as fractions.
struct GpanoPart {
  double first = 0.0;
  double size = 1.0;
};

/// Returns the stated part of one side; the whole if it is not stated or lies outside of the whole.
/// A part without a place is in the middle.
GpanoPart find_part(const GpanoValues& values, const std::string& side, const std::string& place) {
  constexpr double max_px = 1e9;
  const auto whole = values.number("FullPano" + side + "Pixels", 1.0, max_px);
  const auto size = values.number("CroppedAreaImage" + side + "Pixels", 1.0, max_px);
  if (!whole || !size || *size > *whole) return {};
  const double first = values.number("CroppedArea" + place + "Pixels", -max_px, max_px)
                           .value_or(0.5 * (*whole - *size));
  constexpr double rounding_px = 1.0;
  if (first < -rounding_px || first + *size > *whole + rounding_px) return {};
  return {std::clamp(first / *whole, 0.0, 1.0 - *size / *whole), *size / *whole};
}

std::string format_degrees(const ElevationBand& band) {
  return format_number(degrees(band.bottom_rad), "deg") + " to " +
         format_number(degrees(band.top_rad), "deg") + " degrees";
}

constexpr std::string_view ignore_hint =
    "; to read the images as if they had no such data, set the option ignore_gpano";

std::string explain_sector(const GpanoData& data) {
  const double left_deg = degrees(data.azimuth_left_rad);
  std::string why = "shows only a sector, azimuths from " + format_number(left_deg, "deg") +
                    " to " + format_number(left_deg + degrees(data.azimuth_width_rad), "deg") +
                    " degrees clockwise";
  if (data.elevations) why += " and elevations from " + format_degrees(*data.elevations);
  return why + " (GPano data); allowed: images of all azimuths" + std::string(ignore_hint);
}

/// Returns the pictures' own elevations if the data of the first picture with all azimuths state a
/// part of the sphere.
std::optional<ElevationBand> find_common_band(const std::vector<std::optional<GpanoData>>& data) {
  for (const auto& one : data) {
    if (one && !one->has_all_azimuths()) continue;
    if (!one || !one->elevations || is_whole_sphere(*one->elevations)) return std::nullopt;
    return one->elevations;
  }
  return std::nullopt;
}

/// Sets the elevations of the layout to those that the pictures show. The part of them that is kept
/// must be stated within them; by default it is what they show of the default part.
void set_shown_elevations(Dataset& dataset, const ElevationBand& shown) {
  PictureLayout& layout = dataset.source.layout;
  if (dataset.source.kind == PictureKind::panorama) {
    if (!layout.elevations) layout.elevations = shown;
    return;
  }
  layout.elevations = shown;
  const auto& [low, high] = default_equirectangular_band;
  if (!layout.kept_elevations) {
    ElevationBand kept{std::max(low, shown.bottom_rad), std::min(high, shown.top_rad)};
    layout.kept_elevations = kept.bottom_rad < kept.top_rad ? kept : shown;
  }
  constexpr double tolerance_rad = 1e-6;
  ElevationBand& kept = *layout.kept_elevations;
  if (kept.bottom_rad < shown.bottom_rad - tolerance_rad ||
      kept.top_rad > shown.top_rad + tolerance_rad) {
    throw FileError(dataset.entries.front().path.string(),
                    "shows elevations from " + format_degrees(shown) +
                        " (GPano data), but the elevations to use are " + format_degrees(kept) +
                        "; allowed: a part of those that it shows" + std::string(ignore_hint));
  }
}

/// Sets the elevations of a layout that is remembered from pictures of a part of the sphere, if the
/// pictures now show the whole.
void restore_whole_sphere(Dataset& dataset) {
  auto& elevations = dataset.source.layout.elevations;
  const DatasetEntry& first = dataset.entries.front();
  if (dataset.source.kind != PictureKind::equirectangular || first.store) return;
  if (!elevations || is_whole_sphere(*elevations)) return;
  try {
    const ImageSize size = read_image_size(first.path);
    if (size.width == 2 * size.height) elevations = whole_band;
  } catch (const FileError&) {
    return;  // reported when the image is read
  }
}

/// Returns why a picture with these data cannot be used; empty: it can.
std::string find_fault(const GpanoData& data, const std::optional<ElevationBand>& common,
                       const Tilt& tilt, const PictureSource& source) {
  if (!data.has_all_azimuths()) return explain_sector(data);
  constexpr double tolerance_rad = radians(0.5);
  const ElevationBand shown = data.elevations.value_or(whole_band);
  const ElevationBand allowed = common.value_or(whole_band);
  if (std::abs(shown.bottom_rad - allowed.bottom_rad) > tolerance_rad ||
      std::abs(shown.top_rad - allowed.top_rad) > tolerance_rad) {
    return "shows elevations from " + format_degrees(shown) +
           " (GPano data); allowed: " + format_degrees(allowed) + ", as the first image";
  }
  const bool sees_all = source.kind == PictureKind::equirectangular && is_whole_sphere(allowed);
  const double max_rad = std::max(std::abs(tilt.roll_rad), std::abs(tilt.pitch_rad));
  if (!sees_all && max_rad > max_tilt_rad) {
    return "is tilted by " + format_number(degrees(max_rad), "deg") +
           " degrees (GPano data); allowed for images of a part of the sphere: up to 30" +
           std::string(ignore_hint);
  }
  return {};
}

void add_warning(Dataset& dataset, std::size_t tilted, double max_tilt,
                 const std::optional<ElevationBand>& shown) {
  std::string used;
  if (tilted > 0) {
    used = std::to_string(tilted) + " of " + std::to_string(dataset.entries.size()) +
           " images are levelled by their pitch and roll, up to " +
           format_number(degrees(max_tilt), "deg", 3) + " degrees";
  }
  if (shown) {
    used += (used.empty() ? "" : "; ") + std::string("they show elevations from ") +
            format_degrees(*shown);
  }
  if (used.empty()) return;
  dataset.warnings.push_back("GPano data of the images: " + used + std::string(ignore_hint));
}

}  // namespace

bool GpanoData::has_all_azimuths() const noexcept {
  constexpr double tolerance = 0.02;  // as for the shape of equirectangular images
  return azimuth_width_rad >= (1.0 - tolerance) * whole_circle_rad;
}

std::optional<GpanoData> parse_gpano(std::string_view xmp) {
  const GpanoValues values(xmp);
  if (!values.has_namespace()) return std::nullopt;
  const auto projection = values.text("ProjectionType");
  if (projection && to_lower_case(*projection) != "equirectangular") return std::nullopt;
  GpanoData data;
  data.pitch_rad = radians(values.number("PosePitchDegrees", -90.0, 90.0).value_or(0.0));
  data.roll_rad = radians(values.number("PoseRollDegrees", -180.0, 180.0).value_or(0.0));
  if (const auto heading = values.number("PoseHeadingDegrees", 0.0, 360.0)) {
    data.heading_rad = radians(*heading);
  }
  const GpanoPart columns = find_part(values, "Width", "Left");
  data.azimuth_width_rad = columns.size * whole_circle_rad;
  data.azimuth_left_rad = (columns.first - 0.5) * whole_circle_rad;
  if (values.number("FullPanoHeightPixels", 1.0, 1e9)) {
    const GpanoPart rows = find_part(values, "Height", "Top");
    const double top_rad = (0.5 - rows.first) * std::numbers::pi;
    data.elevations = ElevationBand{top_rad - rows.size * std::numbers::pi, top_rad};
  }
  return data;
}

std::optional<GpanoData> read_gpano(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return std::nullopt;
  std::ifstream stream(file, std::ios::binary);
  const auto xmp = detail::read_xmp_packet(stream);
  return xmp ? parse_gpano(*xmp) : std::nullopt;
}

Tilt to_tilt(const GpanoData& data, const PictureLayout& layout) {
  if (data.pitch_rad == 0.0 && data.roll_rad == 0.0) return {};
  // The direction upwards, with x towards the centre of the picture and y to its left. The picture
  // is rolled first and then pitched, as a `Tilt`, whose pitch lowers the front.
  const double x = std::sin(data.pitch_rad);
  double y = std::sin(data.roll_rad) * std::cos(data.pitch_rad);
  const double z = std::cos(data.roll_rad) * std::cos(data.pitch_rad);
  const bool is_clockwise = layout.direction == ColumnDirection::clockwise;
  if (!is_clockwise) y = -y;
  const double centre_rad =
      (is_clockwise ? 1.0 : -1.0) * (layout.forward_column - 0.5) * whole_circle_rad;
  const double forward = std::cos(centre_rad) * x - std::sin(centre_rad) * y;
  const double left = std::sin(centre_rad) * x + std::cos(centre_rad) * y;
  return {std::atan2(left, z), -std::asin(std::clamp(forward, -1.0, 1.0))};
}

void apply_gpano(Dataset& dataset) {
  if (dataset.source.kind == PictureKind::mirror || dataset.source.kind == PictureKind::pinhole) {
    return;
  }
  std::vector<std::optional<GpanoData>> data;
  for (const DatasetEntry& entry : dataset.entries) {
    data.push_back(entry.store ? std::nullopt : read_gpano(entry.path));
  }
  const auto shown = find_common_band(data);
  if (!shown) restore_whole_sphere(dataset);
  if (std::ranges::none_of(data, [](const auto& one) { return one.has_value(); })) return;
  PictureSource& source = dataset.source;
  std::vector<DatasetEntry> kept;
  std::size_t tilted = 0;
  double max_tilt = 0.0;
  // Panoramas can be levelled only if their elevations are known.
  const bool can_level =
      source.kind == PictureKind::equirectangular || source.layout.elevations || shown;
  for (std::size_t i = 0; i < data.size(); ++i) {
    DatasetEntry& entry = dataset.entries[i];
    if (data[i]) {
      const Tilt tilt = to_tilt(*data[i], source.layout);
      const std::string why = find_fault(*data[i], shown, entry.tilt.value_or(tilt), source);
      if (!why.empty()) {
        dataset.unusable.push_back({entry.file, entry.path, why});
        continue;
      }
      if (!entry.tilt && tilt != Tilt{} && can_level) {
        entry.tilt = tilt;
        ++tilted;
        max_tilt = std::max({max_tilt, std::abs(tilt.roll_rad), std::abs(tilt.pitch_rad)});
      }
    }
    kept.push_back(std::move(entry));
  }
  dataset.entries = std::move(kept);
  require_usable_entries(dataset);
  if (shown) set_shown_elevations(dataset, *shown);
  add_warning(dataset, tilted, max_tilt, shown);
}

}  // namespace panonav
