#include "panonav/pipeline/internal/sector_recogniser.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/io/exif.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/panorama/sector_view.hpp"
#include "panonav/pipeline/narrow_features.hpp"

namespace panonav {

namespace {

Camera make_pinhole_camera(ImageSize size, double focal_length_px) {
  Camera camera;
  camera.model = PinholeModel{.focal_length_px = focal_length_px};
  camera.image_size = size;
  camera.centre = {0.5 * size.width, 0.5 * size.height};
  return camera;
}

/// Returns the camera of a picture with this layout. Throws ContractError if the size of the
/// picture is not that of the camera, or if its field of view is unknown.
Camera choose_camera(const Observation& observation, const PictureSource& source, ImageSize size) {
  if (source.camera) {
    require_picture_size(source, size);
    return *source.camera;
  }
  if (source.field_of_view_rad) {
    return make_pinhole_camera(
        size, focal_length_from_field_of_view(size.width, *source.field_of_view_rad));
  }
  std::optional<double> focal_length_mm;
  if (!observation.encoded.empty()) {
    focal_length_mm = find_focal_length_35mm(observation.encoded);
  } else if (!observation.file.empty()) {
    focal_length_mm = read_focal_length_35mm(observation.file);
  }
  if (!focal_length_mm) {
    throw ContractError("field of view", "unknown",
                        "stated (the angle between the left and the right edge), a camera file, or "
                        "EXIF data with FocalLengthIn35mmFilm");
  }
  return make_pinhole_camera(size, focal_length_from_35mm(size, *focal_length_mm));
}

}  // namespace

SectorRecogniser::SectorRecogniser(const MemoryFile& file, const VisualMemory& memory,
                                   PictureSource source, const std::optional<SectorModel>& model)
    : header_(refine_header(file.header())),
      source_(std::move(source)),
      localiser_(memory, make_gradient_source(file), model) {}

Place SectorRecogniser::localise(const Observation& observation, int top,
                                 std::span<const ViewId> excluded) const {
  return rethrow_with_file_name(observation, [&] {
    const auto* const image = std::get_if<Image>(&observation.picture);
    if (image == nullptr) throw ContractError("picture", "a panorama", "an image");
    const Camera camera =
        choose_camera(observation, observation.narrow_source.value_or(source_), image->size());
    const SectorView sector =
        unwarp_sector(image->view(), camera, {header_.shape.rows, header_.panorama_columns},
                      *header_.elevations, observation.tilt.value_or(Tilt{}));
    SectorQuery query{.features = extract_gradient_features(sector, header_.preprocessing),
                      .azimuth_rad = std::get<PinholeModel>(camera.model).azimuth_rad,
                      .width_rad = std::max(sector.width_rad(), min_field_of_view_rad),
                      .has_known_tilt = observation.tilt.has_value()};
    for (auto& corner : query.features.corners) {
      corner.azimuth_rad -= static_cast<float>(query.azimuth_rad);
    }
    return localiser_.localise(query, top, excluded);
  });
}

}  // namespace panonav
