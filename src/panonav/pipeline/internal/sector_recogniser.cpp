#include "panonav/pipeline/internal/sector_recogniser.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

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

/// A picture of one pinhole camera.
struct LensPicture {
  ImageView picture;
  const Camera* camera;
};

/// Returns the pictures of the cameras of a rig, which are parts of one, or that of a single
/// camera.
std::vector<LensPicture> split_picture(ImageView picture, const Camera& camera) {
  const auto* const rig = std::get_if<RigModel>(&camera.model);
  if (rig == nullptr) return {{picture, &camera}};
  std::vector<LensPicture> parts;
  for (const auto& [index, left_px, size] : list_tiles(*rig)) {
    parts.push_back({{picture.data + static_cast<std::ptrdiff_t>(left_px) * picture.channels,
                      size.width, size.height, picture.channels, picture.stride},
                     &rig->cameras[index]});
  }
  return parts;
}

/// Appends the features of a sector whose corners `keep` accepts: leading ones to `leading`, the
/// others to `others`.
template <class Keep>
void append_features(const GradientFeatures& from, const Keep& keep, GradientFeatures& leading,
                     GradientFeatures& others) {
  for (std::size_t i = 0; i < from.corners.size(); ++i) {
    if (!keep(from.corners[i])) continue;
    GradientFeatures& to = i < from.leading ? leading : others;
    to.corners.push_back(from.corners[i]);
    to.histograms.push_back(from.histograms[i]);
  }
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
    SectorQuery query = make_query(image->view(), camera, observation.tilt.value_or(Tilt{}));
    query.has_known_tilt = observation.tilt.has_value();
    return localiser_.localise(query, top, excluded);
  });
}

SectorQuery SectorRecogniser::make_query(ImageView image, const Camera& camera,
                                         const Tilt& tilt) const {
  const auto* const rig = std::get_if<RigModel>(&camera.model);
  const std::vector<LensPicture> parts = split_picture(image, camera);
  const PanoramaShape shape{header_.shape.rows, header_.panorama_columns};
  GradientFeatures leading;
  GradientFeatures others;
  std::vector<SectorView> sectors;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    auto sector =
        unwarp_sector(parts[i].picture, *parts[i].camera, shape, *header_.elevations, tilt);
    if (!sector) continue;
    const double share = 1.0 / static_cast<double>(parts.size());
    // Where several cameras see a corner, it counts once, in the picture of the nearest axis.
    append_features(
        extract_gradient_features(*sector, header_.preprocessing, share),
        [&](const GradientFeatures::Corner& corner) {
          if (rig == nullptr) return true;
          const auto pixel = project(
              *rig, tilt_direction(
                        Direction3::from_angles(corner.azimuth_rad, corner.elevation_rad), tilt));
          return pixel && tile_at(*rig, pixel->u_px).camera == i;
        },
        leading, others);
    sectors.push_back(*std::move(sector));
  }
  require(!sectors.empty(), "elevations of the picture", 0.0, "some of those of the memory");
  SectorQuery query;
  query.features = std::move(leading);
  query.features.leading = query.features.corners.size();
  append_features(
      others, [](const auto&) { return true; }, query.features, query.features);
  if (rig == nullptr) query.azimuth_rad = std::get<PinholeModel>(camera.model).azimuth_rad;
  query.width_rad = std::max(shown_width(sectors), min_field_of_view_rad);
  for (auto& corner : query.features.corners) {
    corner.azimuth_rad -= static_cast<float>(query.azimuth_rad);
  }
  return query;
}

}  // namespace panonav
