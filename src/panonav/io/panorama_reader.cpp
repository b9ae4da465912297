#include "panonav/io/panorama_reader.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/panorama/hidden_values.hpp"

namespace panonav {

namespace {

/// Fills in the bands of an equirectangular source that are not set.
PictureLayout complete_sphere_layout(PictureLayout layout) {
  constexpr double pole_rad = std::numbers::pi / 2.0;
  if (!layout.elevations) layout.elevations = ElevationBand{-pole_rad, pole_rad};
  if (!layout.kept_elevations) layout.kept_elevations = default_equirectangular_band;
  return layout;
}

/// A band extended at both ends by rows of the same height, up to `limit` and at most by
/// `margin_rad`.
struct WiderBand {
  int rows = 0;
  ElevationBand band;
};
WiderBand widen_band(const ElevationBand& band, int rows, const ElevationBand& limit,
                     double margin_rad) {
  const double row_rad = (band.top_rad - band.bottom_rad) / rows;
  const auto rows_in = [&](double room_rad) {
    return static_cast<int>(std::floor(std::clamp(room_rad, 0.0, margin_rad) / row_rad + 1e-6));
  };
  const int above = rows_in(limit.top_rad - band.top_rad);
  const int below = rows_in(band.bottom_rad - limit.bottom_rad);
  return {rows + above + below,
          {band.bottom_rad - below * row_rad, band.top_rad + above * row_rad}};
}

Panorama level_equirectangular(ImageView picture, PictureLayout layout, PanoramaShape shape,
                               const Tilt& tilt) {
  const ElevationBand sphere = layout.elevations.value();
  const ElevationBand band = layout.kept_elevations.value();
  if (shape.rows == 0) {
    const double share = (band.top_rad - band.bottom_rad) / (sphere.top_rad - sphere.bottom_rad);
    shape.rows = std::max(1, static_cast<int>(std::lround(share * picture.height)));
  }
  const double row_rad = (band.top_rad - band.bottom_rad) / shape.rows;
  const double tilt_rad = std::hypot(tilt.roll_rad, tilt.pitch_rad);
  const WiderBand wide =
      tilt_rad > max_tilt_rad && is_whole_sphere(sphere)
          ? WiderBand{static_cast<int>(std::lround(std::numbers::pi / row_rad)), sphere}
          : widen_band(band, shape.rows, sphere, tilt_rad + 2.0 * row_rad);
  layout.kept_elevations = wide.band;
  return level_panorama(panorama_from_picture(picture, layout, {wide.rows, shape.columns}), tilt,
                        shape.rows, band);
}

}  // namespace

struct PanoramaReader::Wide {
  std::once_flag is_made;
  std::optional<Unwarper> unwarper;  // nullopt: the camera shows nothing beyond the band
  std::vector<std::uint8_t> hidden;
};

void require_picture_size(const PictureSource& source, ImageSize size) {
  const std::string own = std::to_string(size.width) + " x " + std::to_string(size.height) + " px";
  if (source.camera && size != source.camera->image_size) {
    const ImageSize& camera = source.camera->image_size;
    throw ContractError("image size", own,
                        std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                            " px, as the camera's images");
  }
  if (source.kind != PictureKind::equirectangular) return;
  constexpr double tolerance = 0.02;  // for cropped borders and rounding
  const ElevationBand shown = *complete_sphere_layout(source.layout).elevations;
  const double ratio = 2.0 * std::numbers::pi / (shown.top_rad - shown.bottom_rad);
  if (std::abs(size.width - ratio * size.height) <= tolerance * size.width) return;
  if (is_whole_sphere(shown)) {
    throw ContractError("equirectangular image", own,
                        "twice as wide as high, with the whole sphere; for a part of the sphere "
                        "use the kind panorama with an elevation band");
  }
  throw ContractError("equirectangular image", own,
                      format_number(ratio, {}, 4) +
                          " times as wide as high, with elevations from " +
                          format_number(degrees(shown.bottom_rad), "deg") + " to " +
                          format_number(degrees(shown.top_rad), "deg") + " degrees");
}

PanoramaReader::PanoramaReader(PictureSource source, PanoramaShape shape)
    : source_(std::move(source)), shape_(shape) {
  if (source_.kind == PictureKind::equirectangular) {
    source_.layout = complete_sphere_layout(source_.layout);
  }
  if (source_.kind == PictureKind::pinhole) {
    throw ContractError("kind of the images", "pinhole",
                        "panorama, equirectangular or mirror, as all azimuths are needed; narrow "
                        "pictures can only be localised and tracked");
  }
  if (source_.kind != PictureKind::mirror) return;
  require(source_.camera.has_value(), "camera of mirror images", 0.0, "one camera");
  UnwarperOptions options;
  if (shape.rows != 0) options.rows = shape.rows;
  if (shape.columns != 0) options.columns = shape.columns;
  options.elevations = source_.layout.kept_elevations;
  unwarper_.emplace(*source_.camera, options);
  if (source_.mask) hidden_ = find_hidden_values(source_.mask->view(), *unwarper_);
  wide_ = std::make_shared<Wide>();
}

const PanoramaReader::Wide* PanoramaReader::get_or_create_wide() const {
  std::call_once(wide_->is_made, [&] {
    constexpr double margin_rad = 0.175;  // 10 degrees, more than robots lean
    const WiderBand band = widen_band(unwarper_->elevations(), unwarper_->rows(),
                                      visible_elevations(*source_.camera), margin_rad);
    if (band.rows == unwarper_->rows()) return;
    wide_->unwarper.emplace(*source_.camera,
                            UnwarperOptions{band.rows, unwarper_->columns(), band.band});
    if (source_.mask) wide_->hidden = find_hidden_values(source_.mask->view(), *wide_->unwarper);
  });
  return wide_->unwarper ? wide_.get() : nullptr;
}

Panorama PanoramaReader::convert(ImageView picture, const Tilt& tilt) const {
  const bool is_level = tilt == Tilt{};
  if (source_.kind == PictureKind::equirectangular) {
    require_picture_size(source_, picture.size());
    if (!is_level) return level_equirectangular(picture, source_.layout, shape_, tilt);
  }
  if (!unwarper_)
    return level_panorama(panorama_from_picture(picture, source_.layout, shape_), tilt);
  validate(tilt);
  const Wide* const more = is_level ? nullptr : get_or_create_wide();
  Panorama panorama = (more == nullptr ? *unwarper_ : *more->unwarper).unwrap(picture);
  const auto& hidden = more == nullptr ? hidden_ : more->hidden;
  if (!hidden.empty()) fill_hidden_values(panorama, hidden);
  return is_level ? panorama
                  : level_panorama(panorama, tilt, unwarper_->rows(), unwarper_->elevations());
}

Panorama PanoramaReader::read(const std::filesystem::path& file) const {
  const Image picture = read_image(file);
  try {
    return convert(picture.view());
  } catch (const ContractError& error) {
    throw FileError(file.string(), error.what());
  }
}

}  // namespace panonav
